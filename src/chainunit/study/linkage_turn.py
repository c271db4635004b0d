"""A linkage over the way of its driver at constant speed, by inverse dynamics: motion, torque, inertia, reactions;
and these findings as data, the content of linkage.json. A driver that swings goes there and back.

Extremes and means are taken over the whole way, not at the `PLACES` of the curves alone."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, NamedTuple

import numpy as np

from .. import __version__
from ..core.brief import briefly_shown
from ..core.engines import numpy_
from ..core.quantities import Value, declaration, quantity
from ..machines.equilibria import Equilibria, Equilibrium, Holding
from ..machines.linkages.loads import loads_by_speed
from ..machines.linkages.model import LinkageDescription
from ..machines.machine import Machine
from ..mechanism.assur import DYADS, PRISMATIC
from ..mechanism.sampled_quantities import largest, means, roots
from ..reading.results import InUnit, part, result
from ..reading.tables import UnusualValue, option_value, slips_of
from .arrays import above_noise

PLACES = 361
USUAL_SPEEDS = {"rad/s": "60 rpm", "m/s": "0.1 m/s"}
"""Speed of the driver of a linkage where nobody gives one, by its unit."""
FASTEST = {"rad/s": 1e5, "m/s": 1e4}
"""Largest speed of the driver, by its unit: no machine comes near."""
_LOSSLESS = 1e-9
"""Part of the mean size of a torque below which its mean is that of a machine without losses."""
STANDS = 1e-9
"""A way [m] or an angle [rad] over which a part moves, below which it stands."""
_SOUGHT = 1e-7
"""Accuracy [rad, m] to which the place of a smooth extreme is found: nearer to 0 it is 0."""
_ROUNDING = 1e-12
"""Size of a place [m] or an angle [rad] below which it is what rounding leaves of 0."""


@declaration
class LinkageTurn:
    """A linkage over the way of its driver at constant speed."""

    AT_DRIVER: ClassVar = ("torque_peak", "torque_rms", "torque_mean", "inertia_least", "inertia_largest")

    torque_peak: Value = quantity("N.m", "largest in size")
    torque_rms: Value = quantity("N.m", "RMS")
    torque_mean: Value = quantity("N.m", "mean")
    power_mean: Value = quantity("W", "mean power")
    inertia_least: Value = quantity("kg.m2", "reflected inertia, least")
    inertia_largest: Value = quantity("kg.m2", "reflected inertia, largest")
    energy_gap: Value = quantity("1", "gap between reactions and virtual work, share of the peak")


@declaration
class GroupTurn:
    """A group over the way of the driver."""

    AT_DRIVER: ClassVar = ("margin_at",)

    margin: Value = quantity("1", "least margin; 0 is a dead position")
    margin_at: Value = quantity("rad", "angle of the driver where it is least")


@declaration
class JointTurn:
    """A joint over the way of the driver."""

    AT_DRIVER: ClassVar = ("peak_at",)

    peak: Value = quantity("N", "largest force")
    peak_at: Value = quantity("rad", "angle of the driver where it is largest")
    rms: Value = quantity("N", "force, RMS")
    moment: Value = quantity("N.m", "largest moment of a guide, about the point of its block")
    least: Value = quantity("N", "least force of a cam on its follower, which lifts off below 0")


@declaration
class Stroke:
    """The motion of a sliding joint between its two ends."""

    AT_DRIVER: ClassVar = ("least_at", "largest_at", "forth")

    least: Value = quantity("m", "least way of the block along its line")
    least_at: Value = quantity("rad", "place of the driver there")
    largest: Value = quantity("m", "largest way of the block along its line")
    largest_at: Value = quantity("rad", "place of the driver there")
    range: Value = quantity("m", "stroke")
    forth: Value = quantity("rad", "angle of the driver from the least to the largest way")
    time_ratio: Value = quantity("1", "time ratio: slow stroke over quick return")


@declaration
class Swing:
    """The motion of a link that swings between two ends."""

    AT_DRIVER: ClassVar = ("least_at", "largest_at", "forth")

    least: Value = quantity("rad", "least angle")
    least_at: Value = quantity("rad", "place of the driver there")
    largest: Value = quantity("rad", "largest angle")
    largest_at: Value = quantity("rad", "place of the driver there")
    range: Value = quantity("rad", "swing")
    forth: Value = quantity("rad", "angle of the driver from the least to the largest angle")
    time_ratio: Value = quantity("1", "time ratio: slow stroke over quick return")


class DriverTurn(NamedTuple):
    """A driver besides the first one, over the way of that: its largest effort [N m, N], and its mean power [W]."""

    linear: bool
    peak: float
    power_mean: float


@briefly_shown
@dataclass(frozen=True)
class LinkageFindings:
    """The findings on a linkage: `q` are the places of the driver [rad], shape (n,), `outputs` the outputs there by
    name, and the summaries by the names of groups, joints and links."""

    machine: Machine
    speed: float
    """of the driver [rad/s, m/s]"""
    q: Any
    outputs: dict[str, Any]
    turn: LinkageTurn
    groups: dict[str, GroupTurn]
    joints: dict[str, JointTurn]
    strokes: dict[str, Stroke]
    """of each sliding joint that is not the driver"""
    swings: dict[str, Swing]
    """of each link that swings"""
    dead_centres: dict[str, list[float]]
    """places of the driver at which each of these joints and links turns back, by the name of its variables"""
    drivers: dict[str, DriverTurn]
    """of each driver besides the first one"""
    limits: dict[str, tuple[float, float]]
    """least and largest value of the angle of each link and of each place of a point, by output"""
    rest: Equilibria
    """the machine at rest"""
    back: LinkageFindings | None = None
    """the findings on the way back, at the same places, of a driver that swings"""

    @property
    def description(self) -> LinkageDescription:
        """The description of the machine's linkage."""
        described: LinkageDescription = self.machine.model.described_by  # type: ignore[attr-defined]
        return described

    @property
    def sentence(self) -> str:
        """The groups in one line: ``crank + RRR dyad (coupler, rocker) + RRP dyad (rod, ram)``."""
        groups = self.description.structure.groups
        pinned = len(groups) > len(self.description.at_start.groups)
        parts = [] if pinned else [self.machine.model.driver_noun]
        for group in groups:
            kind = f"{group.kind} dyad" if group.kind in DYADS else group.kind
            parts.append(f"{kind} ({', '.join(group.links)})")
        return " + ".join(parts)


class _Way:
    """A linkage at any places of its driver, at constant speed with the loads of normal running."""

    def __init__(self, machine: Machine, speed: float) -> None:
        self.machine, self.speed = machine, speed
        self.feed = machine.model.feed_layout.by_name(machine.model.Feed())

    def state(self, q: Any) -> tuple[Any, dict[str, Any]]:
        """The machine at the places `q` [rad, m], and its outputs by name, each of the shape of `q`."""
        machine = self.machine
        u = machine.inputs({"phi": q * machine.ratio, "w": self.speed * machine.ratio, **self.feed})
        state, part = machine.state(u), machine.model.parts[0]
        outputs = part.layout.by_name(part.equations(numpy_(), machine.p, u, None, state))
        return state, {name: np.broadcast_to(x, q.shape) for name, x in outputs.items()}

    def outputs(self, names: Iterable[str]) -> Callable[[Any], Any]:
        """The function that gives outputs at places, shape (names, n)."""
        variables = tuple(names)

        def values(q: Any) -> Any:
            outputs = self.state(q)[1]
            return np.array([outputs[name] for name in variables]).reshape(-1, len(q))

        return values


def speed_of_driver(machine: Machine, text: str | None, name: str = "--speed") -> float:
    """The speed of the driver of a linkage [rad/s, m/s] from an option or argument of that name, or the usual one.

    Raises
    ------
    InputError
        for a text that is no speed.
    """
    unit = "m/s" if machine.model.slides else "rad/s"
    most = FASTEST[unit]
    return option_value(name, text or USUAL_SPEEDS[unit], unit, "speed of the driver", most)


def linkage_findings(machine: Machine, speed: float) -> LinkageFindings:
    """The linkage over its way at a constant `speed` of the driver [rad/s, m/s], with the loads of normal running; of
    a driver with a range there and, as `back`, at the opposite speed.

    Raises
    ------
    InputError
        for a load that has no finite value.
    """
    description: LinkageDescription = machine.model.described_by  # type: ignore[attr-defined]
    for driver_speed in {speed} if machine.model.turns else {abs(speed), -abs(speed)}:
        description.check_loads(machine.p, driver_speed)
    equilibria = machine.equilibria()
    if machine.model.turns:
        return _findings(machine, speed, equilibria)
    forth, back = (_findings(machine, sign * abs(speed), equilibria) for sign in (1.0, -1.0))
    return replace(forth, back=back)


def _findings(machine: Machine, speed: float, rest: Equilibria) -> LinkageFindings:
    """The linkage over its way in one direction: extremes between the `PLACES`, means over the way."""
    description: LinkageDescription = machine.model.described_by  # type: ignore[attr-defined]
    q = np.linspace(*description.span, PLACES)
    way = _Way(machine, speed)
    state, outputs = way.state(q)
    joints = {name: description.variable("joint", name) for name in description.structure.joints}
    moving = [name for name in outputs if name.endswith((".angle", ".x", ".y"))]
    moments = [f"{joint}.moment" for joint in joints.values() if f"{joint}.moment" in outputs]
    drivers = [(entry, description.further.names[entry.name]) for entry in description.structure.further]
    sought = [*moments, *(f"{name}.tau" for _, name in drivers)]
    groups = [", ".join(group.links) for group in description.structure.groups]

    def columns(q: Any) -> dict[str, Any]:
        """By name, all quantities of which the largest value counts; with a minus those of which the least counts."""
        state, x = way.state(q)
        named = {"torque": np.abs(state.bias), "inertia": state.J, "-inertia": -state.J}
        margins = zip(groups, state.m.margins(), strict=True)
        named |= {f"-margin {name}": -np.abs(margin) for name, margin in margins}
        named |= {
            f"force {name}": np.hypot(x[f"{joint}.fx"], x[f"{joint}.fy"]) for name, joint in joints.items()
        }
        named |= {name: np.abs(x[name]) for name in sought} | {
            name: -x[name] for name in machine.model.contacts
        }
        named |= {name: x[name] for name in moving} | {f"-{name}": -x[name] for name in moving}
        return {name: np.broadcast_to(column, q.shape) for name, column in named.items()}

    turns, names = machine.model.turns, [*columns(q[:1])]
    places, values = largest(lambda q: np.array([*columns(q).values()]), q, around=turns)
    peak_places = {name: _folded(float(place), turns) for name, place in zip(names, places, strict=True)}
    top = dict(zip(names, map(float, values), strict=True))

    (mean, torque_rms), forces_rms = _means(way, joints.values(), description.span)
    torque = np.broadcast_to(state.bias, q.shape)
    gap = np.abs(state.torque_by_reactions(0.0) + state.friction - torque)
    sign = np.sign(np.broadcast_to(way.state(places[:1])[0].bias, 1)[0])
    turn = LinkageTurn(
        torque_peak=float(sign * top["torque"]),
        torque_rms=torque_rms,
        torque_mean=mean,
        power_mean=mean * speed,
        inertia_least=above_noise(-top["-inertia"], top["inertia"]),
        inertia_largest=top["inertia"],
        energy_gap=float(np.max(gap) / max(np.max(np.abs(torque)), 1e-300)),
    )
    motions = list(_motions(description, way, q))
    joint_turns = {}
    for (name, variable), force_rms in zip(joints.items(), forces_rms, strict=True):
        normal = f"{variable}.normal"
        joint_turns[name] = JointTurn(
            peak=top[f"force {name}"],
            peak_at=peak_places[f"force {name}"],
            rms=force_rms,
            moment=top.get(f"{variable}.moment"),
            least=-top[normal] if normal in machine.model.contacts else None,
        )
    return LinkageFindings(
        machine,
        speed,
        q,
        outputs,
        turn,
        groups={
            name: GroupTurn(margin=-top[f"-margin {name}"], margin_at=peak_places[f"-margin {name}"])
            for name in groups
        },
        joints=joint_turns,
        strokes={name: motion for name, motion, _ in motions if isinstance(motion, Stroke)},
        swings={name: motion for name, motion, _ in motions if isinstance(motion, Swing)},
        dead_centres={
            description.variable("joint" if isinstance(motion, Stroke) else "link", name): places_of_turning
            for name, motion, places_of_turning in motions
        },
        drivers={
            entry.name: DriverTurn(
                entry.linear,
                top[f"{name}.tau"],
                float(means(way.outputs([f"{name}.power"]), *description.span)[0][0]),
            )
            for entry, name in drivers
        },
        limits={name: (_plain(-top[f"-{name}"]), _plain(top[name])) for name in moving},
        rest=rest,
    )


def _means(
    way: _Way, joints: Collection[str], span: tuple[float, float]
) -> tuple[tuple[float, float], list[float]]:
    """Mean and RMS of the torque [N m], and the RMS of the force in each of the `joints` [N], by the names of their
    variables, over the way of the driver from the begin to the end of its `span`."""

    def squares(q: Any) -> Any:
        """Effort, its square, and the square of the force of each joint, shape (rows, places)."""
        state, outputs = way.state(q)
        bias = np.broadcast_to(state.bias, q.shape)
        forces = (outputs[f"{joint}.fx"] ** 2 + outputs[f"{joint}.fy"] ** 2 for joint in joints)
        return np.array([bias, bias**2, *forces])

    (mean, *mean_squares), (size, *_) = means(squares, *span)
    torque_rms, *forces_rms = map(math.sqrt, mean_squares)
    # the mean of a torque without losses is rounding
    return (0.0 if abs(mean) <= _LOSSLESS * size else float(mean), torque_rms), forces_rms


class _MovingPart(NamedTuple):
    """A joint or link that moves, the class of its motion, and the outputs of its place and its rate."""

    name: str
    motion: type[Stroke | Swing]
    place: str
    rate: str


def _motions(
    description: LinkageDescription, way: _Way, q: Any
) -> Iterator[tuple[str, Stroke | Swing, list[float]]]:
    """The motion of each sliding joint besides the driver and of each link that swings, each with its name and with
    the places of the driver at which it turns back."""
    structure, turns = description.structure, way.machine.model.turns
    parts: list[_MovingPart] = []
    for name, joint in structure.joints.items():
        if joint.kind == PRISMATIC and name != structure.driver.joint:
            variable = description.variable("joint", name)
            parts.append(_MovingPart(name, Stroke, f"{variable}.s", f"{variable}.v"))
    for name in structure.links:
        if description.link_turns[name][0] == 0.0 or not turns:
            variable = description.variable("link", name)
            parts.append(_MovingPart(name, Swing, f"{variable}.angle", f"{variable}.w"))
    _, outputs = way.state(q)
    parts = [moving for moving in parts if np.ptp(outputs[moving.place]) > STANDS]
    dead_centres = roots(way.outputs(moving.rate for moving in parts), q, around=turns) if parts else []
    for moving, back in zip(parts, dead_centres, strict=True):
        # a driver with a range has ends of its own
        places = back if turns and len(back) else np.array([q[0], *back, q[-1]])
        course = way.outputs([moving.place])(places)[0]
        low, high = int(np.argmin(course)), int(np.argmax(course))
        whole = 2.0 * math.pi
        forth = float(places[high] - places[low]) % whole if turns else None
        motion = moving.motion(
            least=_plain(course[low]),
            least_at=_folded(float(places[low]), turns),
            largest=_plain(course[high]),
            largest_at=_folded(float(places[high]), turns),
            range=float(course[high] - course[low]),
            forth=forth,
            time_ratio=max(forth, whole - forth) / min(forth, whole - forth) if forth else None,
        )
        yield moving.name, motion, sorted(_folded(float(x), turns) for x in back)


def _folded(q: float, turns: bool) -> float:
    """A place of the driver, 0 where it is rounding; the angle of one that turns from 0 to a whole turn."""
    folded = q % (2.0 * math.pi) if turns else q
    from_zero = min(folded, 2.0 * math.pi - folded) if turns else abs(folded)
    return 0.0 if from_zero < _SOUGHT else folded


def _plain(place: float) -> float:
    """A place [m] or an angle [rad]; 0 where it is rounding."""
    return 0.0 if abs(place) < _ROUNDING else float(place)


@result
class WayForces:
    """Effort at the driver and reactions, in one direction of the driver."""

    turn: LinkageTurn = part("effort and inertia at the driver")
    joints: Mapping[str, JointTurn] = part("reactions, by joint")


@result
class WayBack:
    """The way back of a driver that swings."""

    forces: WayForces = part(inline=True)
    over_the_way: Mapping[str, InUnit] = part("effort and inertia at each place of the driver")


@result
class LinkageAtRest:
    """A linkage at rest."""

    equilibria: tuple[Equilibrium, ...] = part("the equilibria in rising order")
    summary: Holding = part("the effort that holds the driver")
    indifferent: bool = part(
        "whether the machine stays wherever it is, as no load has an effort at the driver"
    )
    repeats: bool = part("whether the loads of a driver that turns are the same again after a turn")
    without_potential: Sequence[str] = part("loads without a potential of their own")
    by_speed: Sequence[str] = part("loads that depend on the speed")
    over_the_way: Mapping[str, InUnit] = part(
        "holding effort, friction and potential at each place of the driver"
    )


@result
class LinkageData:
    """A linkage over the way of its driver, and at rest."""

    chainunit: str = part("version of chainunit")
    source: str = part("the linkage file")
    title: str = part("title of the linkage")
    sentence: str = part("its groups in one line", name="groups_in_words")
    degrees_of_freedom: int = part("its degrees of freedom")
    speed: InUnit = part("speed of the driver")
    forces: WayForces = part(inline=True)
    groups: Mapping[str, GroupTurn] = part("margins, by group")
    strokes: Mapping[str, Stroke] = part("motion of each sliding joint")
    swings: Mapping[str, Swing] = part("motion of each link that swings")
    dead_centres: Mapping[str, InUnit] = part("places of the driver at which a joint or link turns back")
    angles: Mapping[str, InUnit] = part("least and largest angle of each link")
    points: Mapping[str, Mapping[str, InUnit]] = part("least and largest x and y of each point")
    over_the_way: Mapping[str, InUnit] = part("effort and inertia at each place of the driver")
    rest: LinkageAtRest = part("the linkage at rest")
    back: WayBack | None = part("the way back of a driver that swings", optional=True)
    drivers: Mapping[str, Mapping[str, InUnit]] | None = part(
        "largest effort and mean power of each driver besides the first one", optional=True
    )
    drawn: list[str] = part("sentences on a linkage from a drawing of another program")
    slips: list[str] = part("values of the file without a unit that are of an unusual size, in words")
    notes: list[str] = part("values of the file of an unusual size, in words")


def linkage_data(
    f: LinkageFindings, source: str, unusual: Iterable[UnusualValue], remarks: Iterable[str] = ()
) -> LinkageData:
    """The findings on a linkage of the file `source`, which has these values of an unusual size, as data; with
    `remarks` on a drawing."""
    description, unit = f.description, f.machine.model.driver_port.unit

    angles, points = {}, {}
    for name, entry in description.structure.links.items():
        link = description.variable("link", name)
        angles[name] = InUnit(f.limits[f"{link}.angle"], "rad")
        for point in entry.points:
            x, y = f.limits[f"{link}.{point}.x"], f.limits[f"{link}.{point}.y"]
            points[f"{name}.{point}"] = {"x": InUnit(x, "m"), "y": InUnit(y, "m")}
    return LinkageData(
        chainunit=__version__,
        source=source,
        title=f.machine.model.description,
        sentence=f.sentence,
        degrees_of_freedom=1 + len(description.further.free),
        speed=InUnit(f.speed, unit("rad/s")),
        forces=WayForces(f.turn, f.joints),
        groups=f.groups,
        strokes=f.strokes,
        swings=f.swings,
        dead_centres={name: InUnit(places, unit("rad")) for name, places in f.dead_centres.items()},
        angles=angles,
        points=points,
        over_the_way={"driver": InUnit(f.q, unit("rad")), **_over_the_way(f)},
        rest=_at_rest(f),
        back=WayBack(WayForces(f.back.turn, f.back.joints), _over_the_way(f.back)) if f.back else None,
        drivers={
            name: {
                "peak": InUnit(turn.peak, "N" if turn.linear else "N.m"),
                "power_mean": InUnit(turn.power_mean, "W"),
            }
            for name, turn in f.drivers.items()
        }
        or None,
        drawn=[*remarks],
        slips=[str(value) for value in slips_of(tuple(unusual))],
        notes=[value.sentence for value in unusual if value.with_unit],
    )


def _over_the_way(f: LinkageFindings) -> dict[str, InUnit]:
    unit = f.machine.model.driver_port.unit
    return {name: InUnit(f.outputs[name], unit(rotary)) for name, rotary in (("tau", "N.m"), ("J", "kg.m2"))}


def _at_rest(f: LinkageFindings) -> LinkageAtRest:
    """The equilibria, and the holding force, its friction and the potential over the way of the driver."""
    equilibria, unit = f.rest, f.machine.model.driver_port.unit
    rest = equilibria.rest
    columns: dict[str, Any] = {
        "driver": InUnit(rest.q, unit("rad")),
        "holding": InUnit(rest.holding, unit("N.m")),
        "friction": InUnit(rest.friction, unit("N.m")),
    }
    return LinkageAtRest(
        equilibria.places,
        equilibria.summary,
        equilibria.indifferent,
        equilibria.repeats,
        [name.removeprefix("loads.") for name in equilibria.driven],
        loads_by_speed(f.description.data["loads"]),
        columns if rest.potential is None else columns | {"potential": InUnit(rest.potential, "J")},
    )
