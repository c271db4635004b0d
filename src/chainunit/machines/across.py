"""The chain unit across its width: two rockers on one axle, joined by the bar on which the webs hang.

Paper 000 draws two rockers that coincide in the plane, and one coupler, in the plane of symmetry between them. So the
coupler, the weights and the inertia of drive and empty organs load both rockers alike. Material and processing force
may lie beside the middle, at the place s: 0 in the middle, 1 at the front rocker, -1 at the back one. The webs are
made of many chains, and the walls are flexible: a load stays in its strip, and comes at its place s to the bar, which
is rigid. The lever rule then gives the front rocker the share (1 + s)/2 of the load's force in A2, and the reaction
in C the same share, as the coupler cannot take a moment about an axis in the plane. The moments of both rockers about
C differ: the bar has to pass half the difference as torsion, and the axle helps it in fact. The bar bends as a beam
on two supports. Material lies evenly on the widest strip whose middle is s, a processing force acts at its point s.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from ..core.errors import InputError
from ..core.model import Requirement
from ..core.planar import Vec2
from ..core.quantities import Value, declaration, declared_class, group, quantity
from ..groups.loads import Weight
from ..mechanism.machine import MachineState
from ..mechanism.models import InverseMachine
from .bar_organs import NAMES, SIDES, SideLoads, SideName, organ_masses, resistances, two_bars
from .differing import with_pins
from .parts import Force, force

ROWS = ("front", "back")
"""The rockers; the place 1 is at the first one."""
PLACES: Mapping[str, str] = {"material_mass": "across", "processing_force": "force_across"}
"""By load of an organ, the name of its place across the width."""
_PLACE = "place across: 0 middle, 1 front rocker, -1 back rocker"


def place(what: str) -> Any:
    """The declaration of the place of a load across the width."""
    return quantity("1", f"{what}, {_PLACE}", default=0.0, min=-1.0, max=1.0)


def middle_of(*loads: tuple[float, float]) -> float:
    """The place of several loads together, each by its size and its place; 0 without a load."""
    whole = math.fsum(size for size, _ in loads)
    return math.fsum(size * place for size, place in loads) / whole if whole else 0.0


@declaration
class PlacedLoads(SideLoads):
    """The material on one organ, and its place."""

    across: Value = place("material")
    force_across: Value = place("processing force")


@declaration
class BarSection:
    """The section of the bar that joins the rockers, a tube or a solid one, and its permitted stress."""

    diameter: Value = quantity("m", "outer diameter", default=0.08, above=0.0, max=10.0)
    bore: Value = quantity("m", "inner diameter; 0 for a solid bar", default=0.0, min=0.0, max=10.0)
    limit: Value = quantity(
        "N/m2", "permitted equivalent stress", default=1e8, above=0.0, max=1e11, kind="stress", tunable=True
    )


@declaration
class RockerShare:
    """The share of one rocker."""

    pivot: Force = group(Force, "on this rocker at C, from the frame")
    left_pin: Force = group(Force, "on the left web at A2, from this rocker")
    right_pin: Force = group(Force, "on the right web at A2, from this rocker")
    tau: Value = quantity("N.m", "torque along psi that carries its share of both organs", nominal=100.0)


@declaration
class BarLoad:
    """The load of the bar that joins the rockers."""

    torsion: Value = quantity("N.m", "torque in the bar, if the axle in C takes none", nominal=100.0)
    bending: Value = quantity("N.m", "largest bending moment in the bar", nominal=100.0)


@declaration
class LoadedBar(BarLoad):
    """The load of the bar and of its section."""

    stress: Value = quantity("N/m2", "largest equivalent stress (von Mises)", nominal=1e7, kind="stress")


def extended(machine: InverseMachine, names: frozenset[str]) -> InverseMachine:
    """The chain unit with those of its further parameters that are among `names`, see `InverseMachine.having`: with
    its width the shares of both rockers, with the section of the bar its stress, and pins that differ.

    Raises
    ------
    InputError
        for a bar without a width, for chains with a width, and for a pin that the machine does not have.
    """
    bar = any(name.startswith("bar.") for name in names)
    if bar and "width" not in names:
        raise InputError("bar: joins rockers that stand a width apart; give width, too", "bar")
    if "width" not in names:
        return with_pins(machine, names)
    if machine.States is not None:
        raise InputError("width: is of organs with two bars, and these are chains; leave it out", "width")
    return with_pins(_of_width(machine, bar), names)


@functools.cache
def _of_width(machine: InverseMachine, bar: bool) -> InverseMachine:
    """`ChamberForces` with the shares of both rockers, and the stress of the bar."""
    load: type = LoadedBar if bar else BarLoad
    sides = [
        (side, PlacedLoads, group(PlacedLoads, f"{side} organ", default=PlacedLoads())) for side in SIDES
    ]
    width = quantity("m", "distance of the rockers", default=1.0, above=0.0, max=1e3)
    parameters: list[tuple[str, Any, Any]] = [("width", Value, width)]
    section: dict[str, Any] = {}
    if bar:
        parameters.append(("bar", BarSection, group(BarSection, "bar", default=BarSection())))
        wall = Requirement("bar.bore", "m", "the bar has no wall", depends=("bar.diameter",))
        section = {
            "required": (*machine.required, wall),
            "requirements": functools.partial(_limits, machine),
        }
    outputs = [(row, RockerShare, group(RockerShare, f"{row} rocker")) for row in ROWS]
    outputs.append(("bar", load, group(load, "bar that joins the rockers")))
    return machine.altered(
        root=machine,
        made=(_of_width, (machine, bar)),
        Parameters=declared_class("WideParameters", (machine.Parameters,), parameters),
        Inputs=declared_class("PlacedInputs", (machine.Inputs,), sides),
        Feed=declared_class("PlacedFeed", (machine.Feed,), sides),
        Outputs=declared_class("WideOutputs", (machine.Outputs,), outputs),
        probes=functools.partial(_probes, machine),
        joints={**machine.joints, **{output: joint for _, output, joint in _BEARINGS}},
        pins={**machine.pins, **{title: output for title, output, _ in _BEARINGS}},
        layers={"rocker": (1.0, -1.0), "crank": (0.0,), "coupler": (0.0,)},
        **section,
    )


_BEARINGS = tuple(
    (title.format(row), f"{row}.{name}", joint)
    for row in ROWS
    for title, name, joint in (
        ("C {} rocker pivot", "pivot", ("C", "rocker")),
        ("A2 left web at {} rocker", "left_pin", ("A2", NAMES["left"].web)),
        ("A2 right web at {} rocker", "right_pin", ("A2", NAMES["right"].web)),
    )
)
"""Title, output and joint of the bearings of both rockers."""
SHARES = tuple(output for _, output, _ in _BEARINGS)
"""The outputs of these bearings."""


def _limits(machine: InverseMachine, xp: Any, p: Any) -> Iterator[tuple[Any, Any, Any]]:
    """The limits of the machine, and those of the wall of the bar."""
    yield from machine.requirements(xp, p)
    yield p.bar.bore, -math.inf, p.bar.diameter


class _PlacedForce(NamedTuple):
    """A part of the force of the rockers on a web in A2 [N], its place across the width, and half of the width of the
    strip over which it is spread, both in halves of the width; None for a force at one point."""

    force: Vec2
    place: Any
    half: Any = None


def _probes(machine: InverseMachine, xp: Any, p: Any, u: Any, s: MachineState, a: Any) -> dict[str, Any]:
    """The outputs of the machine, and the shares of both rockers."""
    reactions = s.reactions(a)
    material = {side: _material(p, side, getattr(u, side)) for side in SIDES}
    by_mass = _at_a2(xp, p, s, a, material, Weight(p.g))
    by_force = _at_a2(xp, p, s, a, dict.fromkeys(SIDES, (0.0, 0.0)), *resistances(p, u).values())
    parts: dict[SideName, list[_PlacedForce]] = {}
    for side in SIDES:
        loads, whole = getattr(u, side), reactions["A2", NAMES[side].web]
        parts[side] = [
            _PlacedForce(whole - by_mass[side] - by_force[side], 0.0, 1.0),
            _PlacedForce(by_mass[side], loads.across, 1.0 - xp.abs(loads.across)),
            _PlacedForce(by_force[side], loads.force_across),
        ]
    both = [*parts["left"], *parts["right"]]
    half, along = reactions["C", "rocker"] * 0.5, s.m.links["rocker"].u.turned()
    rows = {}
    for row, sign in zip(ROWS, (0.5, -0.5), strict=True):
        pins = {side: _sum(part.force * (0.5 + sign * part.place) for part in parts[side]) for side in SIDES}
        rows[row] = RockerShare(
            pivot=force(half + _sum(part.force * (sign * part.place) for part in both)),
            left_pin=force(pins["left"]),
            right_pin=force(pins["right"]),
            tau=p.e * along.dot(pins["left"] + pins["right"]),
        )
    bar = _bar(xp, p, both, 0.5 * (rows["front"].tau - rows["back"].tau))
    return machine.probes(xp, p, u, s, a) | rows | {"bar": bar}


def _sum(vectors: Iterable[Vec2]) -> Vec2:
    return functools.reduce(Vec2.__add__, vectors)


def _material(p: Any, side: SideName, loads: Any) -> tuple[Any, Any]:
    """The masses of the material on wall and web [kg]."""
    (on_wall, on_web), masses = organ_masses(p, side, loads), getattr(p, side)
    return on_wall - masses.wall_mass, on_web - masses.web_mass


def _at_a2(
    xp: Any, p: Any, s: MachineState, a: Any, masses: Mapping[SideName, tuple[Any, Any]], *loads: Any
) -> dict[SideName, Vec2]:
    """The forces of the rockers on the webs in A2 [N] if the organs have these `masses` of wall and web and carry
    these `loads` alone, in the motion of the machine."""
    organs = (two_bars(p, side, *masses[side]) for side in SIDES)
    linkage = dataclasses.replace(
        s.m.linkage,
        groups=(s.m.linkage.groups[0], *organs),
        loads={f"load {k}": load for k, load in enumerate(loads)},
    )
    reactions = MachineState(xp, s.m.with_bodies(linkage), s.w).reactions(a)
    return {side: reactions["A2", NAMES[side].web] for side in SIDES}


def _bar(xp: Any, p: Any, parts: Sequence[_PlacedForce], torsion: Any) -> BarLoad:
    """The load of the bar. The bending moment is the largest of those in the middle, at the forces, and where each
    strip of material by itself bends the bar most."""
    places = (_worst(xp, part) for part in parts)
    squares = (_sum(part.force * _arm(xp, part, x) for part in parts).squared() for x in places)
    bending = 0.25 * p.width * xp.sqrt(functools.reduce(xp.maximum, squares) + _NO_FORCE)
    if not hasattr(p, "bar"):
        return BarLoad(torsion=torsion, bending=bending)
    d2, bore2 = p.bar.diameter * p.bar.diameter, p.bar.bore * p.bar.bore
    modulus = (math.pi / 32.0) * (d2 * d2 - bore2 * bore2) / p.bar.diameter
    stress = xp.sqrt(bending * bending + 0.75 * (torsion * torsion)) / modulus
    return LoadedBar(torsion=torsion, bending=bending, stress=stress)


def _worst(xp: Any, part: _PlacedForce) -> Any:
    """The place at which a force bends the bar most."""
    return part.place if part.half is None else part.place * xp.abs(part.place)


def _arm(xp: Any, part: _PlacedForce, x: Any) -> Any:
    """The bending moment of a unit of a force at the place `x` of the bar, in quarters of the width: 1 - s x less the
    mean distance of the strip from x."""
    away = xp.abs(x - part.place)
    if part.half is not None:
        inside = xp.minimum(away, part.half)
        away = away - inside + 0.5 * (part.half + inside * inside / (part.half + _NO_STRIP))
    return 1.0 - part.place * x - away


_NO_FORCE = 1e-30
"""Square of a force that does not count [N2]: with it the root has a slope at zero, too."""
_NO_STRIP = 1e-30
"""Width of a strip that does not count."""
