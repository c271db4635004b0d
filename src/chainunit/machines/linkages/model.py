"""A machine from the description of its linkage: the model of a file, without a line of code of its own.

The description is data as JSON has them, which a checked file gives (`chainunit.machines.linkages.file`). It is the
whole definition: by it another process builds the same model.

x points right, y up, angles count counter-clockwise from the x axis. The coordinate q is that of the driver.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial, reduce
from types import MappingProxyType
from typing import Any, cast

import numpy as np

from ...core.engines import MATH, numpy_
from ...core.errors import InputError
from ...core.messages import unit_behind
from ...core.model import About, FmuData, Part, Requirement
from ...core.planar import ZERO
from ...core.ports import ShaftMotion
from ...core.quantities import Fields, Value, declared_class, fields_of, group, quantity, variable_of
from ...groups.followed import MOST_MISFIT
from ...groups.loads import GuideLosses, PinLosses, Weight
from ...mechanism.assur import GROUND, ON_LEGS, PRISMATIC
from ...mechanism.curves import TableCurve
from ...mechanism.driven import StateOfDrivers
from ...mechanism.driver_ports import ROTATING, SLIDING, SWINGING
from ...mechanism.end_stops import EndStops, SwingStops, usual_stops
from ...mechanism.expressions import expression, splines, value_of
from ...mechanism.extremes import MotionExtreme
from ...mechanism.machine import MachineState, Mechanism, derived_numbers
from ...mechanism.models import DirectMachine, InverseMachine, names_of, slopes, words_on_motion
from .closing import LEAST_MARGIN
from .declarations import LinkageMotion, LinkBody, common_parameters, with_differing
from .following import FollowedLinkage, lesser, misfits, signed, trackings
from .further import BACK, FurtherDrivers
from .geometry import LinkGeometry, start_sides
from .joint_kind import CAM
from .joint_kinds import KINDS
from .loads import (
    ForceLaw,
    SpringDamper,
    TorqueLaw,
    checked_widths,
    extremes_of,
    name_of_load,
    parts_of_extreme,
    requirement_of_width,
)
from .outputs import DescribedLinkage, LinkageOutputs
from .parts import LinkageParts
from .structure import Structure, check_groups
from .way import DriverWay

STANDARD_GRAVITY = 9.81
_FIXED_RATIO = (
    "gear ratio, motor turns per driver turn; phi has its bounds at this one, so that the file alone sets it"
)


def machine_of(data: Mapping[str, Any]) -> InverseMachine:
    """The model of a description; equal descriptions have one model.

    Raises
    ------
    InputError
        if the linkage is not determined, has a group that is not covered, or does not close.
    """
    return _machine_of(json.dumps(data, sort_keys=True))


@cache
def _machine_of(text: str) -> InverseMachine:
    # of the text: the entries have one order, whatever that of the file is
    return LinkageDescription(json.loads(text)).model()


def _field_of(entry: Mapping[str, Any]) -> tuple[str, Any, Any]:
    """A parameter or an input of the file as a field of a declaration."""
    bounds = {key: entry[key] for key in ("min", "max") if entry.get(key) is not None}
    name, start, tunable = entry["name"], entry["value"], entry.get("tunable", False)
    described = entry.get("description") or name
    return name, Value, quantity(entry["unit"], described, default=start, tunable=tunable, **bounds)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class FileMachine(InverseMachine):
    """The model of a linkage file."""

    described_by: LinkageDescription

    @property
    def at_start(self) -> DescribedLinkage:
        """The linkage with the start values."""
        return self.described_by.at_start

    def __post_init__(self) -> None:
        further = self.described_by.further
        if further.free:
            declared = declared_class("Slopes", (self.driver_port.slopes,), further.slopes())
            feed = fields_of(self.Inputs, without=(*names_of(ShaftMotion), *further.names.values()))
            feed_type = declared_class("Feed", (), [*feed, *further.feed()])
            feed_type.__module__, feed_type.__qualname__ = self.Parameters.__module__, f"{self.name}.Feed"
            self.follow(
                Feed=feed_type,
                parts=(Part(self.Outputs, self._outputs), Part(declared, self._slopes)),
                input_rates=MappingProxyType({"phi": "w", "w": "a", **further.input_rates()}),
                terminals=(*self.driver_port.terminals, *further.terminals()),
            )
        super().__post_init__()

    def _derived(self, xp: Any, p: Any) -> list[Any]:
        """See `LinkageModel`; the numbers of the start values are known."""
        described = self.described_by
        return [*described.start_derived] if described.is_start(xp, p) else super()._derived(xp, p)

    def state(self, xp: Any, p: Any, u: Any, q: Any, w: Any) -> MachineState:
        """See `LinkageModel`."""
        state, further = super().state(xp, p, u, q, w), self.described_by.further
        if not (further.free or further.are_motored):
            return state
        return StateOfDrivers(xp, state.m, w, further.geared, further.motions(u))

    def _direct_of(self, base: type[DirectMachine], parameters: Fields = (), **more: Any) -> DirectMachine:
        """See `InverseMachine`.

        Raises
        ------
        InputError
            for a machine with two drivers that are inputs.
        """
        if free := self.described_by.further.free:
            name = next(iter(free.values())).name
            raise InputError(
                "is an input of its own, and a direct model has one driver: export without --direct, or give it a "
                f'law in [drivers.{name}], such as phi = "0 deg"',
                key=f"drivers.{name}",
            )
        return super()._direct_of(base, parameters, **more)

    def _slopes(self, xp: Any, p: Any, u: Any, x: Any, s: StateOfDrivers) -> Any:
        """The slopes of the load ports of a machine with several inputs."""
        loads = self.described_by.further.slopes_at(s, u.a / p.ratio)
        return self.parts[1].layout.cls(**vars(slopes(xp, p, u, x, s)), **loads)


class LinkageDescription(LinkageOutputs):
    """The description of a linkage with its structure: what all values of its parameters share."""

    def __init__(self, data: Mapping[str, Any]) -> None:
        self.data = data
        self.structure = Structure.of(data)
        self.way = DriverWay.of(data, self.structure.rate)
        check_groups(self.structure, data.get("groups", ()))
        tables = data.get("tables", {})
        self.curves = {
            name: TableCurve(table["places"], table["values"], table["over"] == "phi" and self.way.turns)
            for name, table in tables.items()
        }
        self.tables = {name: self.curves[name] for name, table in tables.items() if table["over"] == "phi"}
        further = self.structure.further
        variables = [self.variable("driver", driver.name) for driver in further]
        self.further = FurtherDrivers(further, variables, splines(tables, self.way.turns))
        self.extremes = extremes_of(data["loads"])
        self.link_turns: dict[str, tuple[float, float]] = {}
        self.Parameters = self._parameters()
        inputs = [_field_of(entry) for entry in data.get("inputs", ())]
        self.port, motion = ROTATING, cast("type", LinkageMotion)
        if self.way.linear:
            self.port, motion = SLIDING, SLIDING.motion
        if not self.way.turns:
            port = self.port if self.way.linear else SWINGING
            start = declared_class(
                port.start.__name__, (port.start,), [self._in_range(port.start, "phi_start")]
            )
            self.port, inputs = port._replace(start=start), [self._in_range(motion, "phi"), *inputs]
        self.Inputs = declared_class("Inputs", (motion,), [*inputs, *self.further.inputs()])
        p, u = self.Parameters(), self.Inputs()
        geometry = LinkGeometry(MATH, self.structure, self.values(MATH, p, u))
        self.sides: dict[str, Any] = dict(start_sides(geometry))
        self.at_start = self._loaded(self._parts(geometry, u), p)
        self.sides |= trackings(self.at_start)
        self.followed = self._followed(self.at_start)
        self.link_turns = self._turns()
        self.start_derived = self.followed.derived
        values = geometry.values
        if self.extremes:
            self.start_derived = derived_numbers(MATH, self.at_start)
            # the loads know the extremes from here on
            values |= zip(self.extremes, self.start_derived[-len(self.extremes) :], strict=True)
        self.widths = checked_widths(data["loads"], values)
        p = self.Parameters()
        object.__setattr__(p, "derived", self.start_derived)
        self.check_loads(p, 1.0)

    # declarations

    def _parameters(self) -> Any:
        """The declaration of the parameters: the ones of the file, bodies of links with quantities of their own, and
        the common ones of all machines. A driver that swings has one allowed ratio, see `_FIXED_RATIO`."""
        fields = [_field_of(entry) for entry in self.data.get("parameters", ())]
        for link in self.data["links"]:
            if quantities := link.get("own", {}):
                name, title = self.variable("link", link["name"]), f"link {link['name']}"
                fields.append((name, LinkBody, group(LinkBody, title, default=LinkBody(**quantities))))
        kinds = {j.kind for j in self.structure.joints.values()}
        common = common_parameters(self.way.linear, kinds, self.data["common"])
        fields += [with_differing(common, table, laws) for table, laws in self.data.get("losses", {}).items()]
        if self.way.swings:
            ratio = self._ratio
            fields.append(("ratio", Value, quantity("1", _FIXED_RATIO, default=ratio, min=ratio, max=ratio)))
        return declared_class("Parameters", (common,), fields)

    @property
    def _ratio(self) -> float:
        """The gear ratio of the file."""
        return float(self.data["common"].get("ratio", 1.0))

    def _in_range(self, declared: type, name: str) -> tuple[str, Any, Any]:
        """The field of a declaration with the bounds of the driver's range, at the ratio of the file."""
        q = variable_of(declared, name).quantity
        low, high = (self._ratio * end for end in self.span)
        ends = " to ".join(f"{math.degrees(end):g} deg" for end in self.span)
        description = q.template if self.way.linear else f"{q.template}; range of the driver: {ends}"
        return name, Value, quantity(q.unit, description, default=0.5 * (low + high), min=low, max=high)

    def values(self, xp: Any, p: Any, u: Any) -> dict[str, Any]:
        """By name, the values of all that expressions may name: parameters and inputs of the file, quantities of
        links, extremes, tables as curves, and the parameters that are expressions of others."""
        values = {entry["name"]: getattr(p, entry["name"]) for entry in self.data.get("parameters", ())}
        values |= {entry["name"]: getattr(u, entry["name"]) for entry in self.data.get("inputs", ())}
        for link in self.data["links"]:
            for quantity_name in link.get("own", {}):
                body = getattr(p, self.variable("link", link["name"]))
                values[f"{quantity_name}_of_{link['name']}"] = getattr(body, quantity_name)
        # before the extremes are derived, nothing needs them
        derived = getattr(p, "derived", ())
        values |= zip(self.extremes, derived[-len(self.extremes) :], strict=False) if self.extremes else ()
        values |= {f"table {name}": curve for name, curve in self.curves.items()}
        values["splines"] = self.further.tables
        values |= {"g": p.g, "ratio": p.ratio}
        for name, text in self.data.get("derived", ()):
            values[name] = value_of(xp, text, values)
        return values

    # the linkage

    def linkage(self, xp: Any, p: Any, u: Any, places: Mapping[str, Any] | None = None) -> DescribedLinkage:
        """The linkage with the values of parameters and inputs; `places` as of `_parts`."""
        geometry = LinkGeometry(xp, self.structure, self.values(xp, p, u))
        return self._loaded(self._parts(geometry, u, places), p)

    def _parts(self, geometry: LinkGeometry, u: Any, places: Mapping[str, Any] | None = None) -> LinkageParts:
        """The parts with the drivers that are inputs at the places that `u` gives, or at `places` by name."""
        courses = self.further.courses(geometry.values, u, places) if self.further.entries else {}
        return LinkageParts(geometry, self.sides, courses)

    def _loaded(self, parts: LinkageParts, p: Any) -> DescribedLinkage:
        """The linkage of these parts, with the loads on it."""
        loads: dict[str, Any] = {"weight": Weight(p.g)}
        for load in self.data["loads"]:
            loads[name_of_load(load)] = self._load(load, parts)
        laws = {
            table: {parts.receivers[name][0]: getattr(getattr(p, table), name) for name in named}
            for table, named in self.data.get("losses", {}).items()
        }
        loads["pins"] = PinLosses(p.pins, p.pins.damping, laws.get("pins", {}))
        cams = [parts.receivers[name][0] for name, j in self.structure.joints.items() if j.kind == CAM]
        if cams or any(j.kind == PRISMATIC for j in self.structure.joints.values()):
            lengths = {
                parts.receivers[joint["name"]][0]: parts.geometry.number(joint["length"])
                for joint in self.data["joints"]
                if "length" in joint
            }
            usual = getattr(p, "guides", None) or p.cams
            of_cams = dict.fromkeys(cams, getattr(p, "cams", None))
            differing = of_cams | laws.get("cams", {}) | laws.get("guides", {})
            loads["guides"] = GuideLosses(usual, usual.damping, lengths, differing)
        extremes = tuple(self._extreme(name, parts) for name in self.extremes)
        return DescribedLinkage(
            parts.ground, parts.driver, tuple(parts.groups), loads, parts, extremes=extremes
        )

    def _extreme(self, name: str, parts: LinkageParts) -> MotionExtreme:
        """An extreme of the motion, by its name in expressions."""
        kind, link, point, axis = parts_of_extreme(name)
        frame, ends = parts.frames[link], not self.way.turns
        place = frame.coordinates(parts.geometry.point(link, point) if point else ZERO)

        def coordinate(xp: Any, m: Any) -> tuple[Any, Any, Any]:
            moving = m.links[link]
            if axis == "angle":
                return self.angle(xp, link, frame.x_axis(moving.u), m.q), moving.t1, moving.t2
            k = moving.beside(place.x, place.y)
            return getattr(k.p, axis), getattr(k.p1, axis), getattr(k.p2, axis)

        return MotionExtreme(coordinate, self.way.places(), 1.0 if kind == "max" else -1.0, ends)

    def _load(self, load: Mapping[str, Any], parts: LinkageParts) -> Any:
        """A load of the file on the links: a spring, a torque, or a force along the frame or along its link
        (follower)."""
        kind, (link, *point), geometry = load["type"], load["on"], parts.geometry
        if kind == "spring":
            one, other = (
                (None if link == GROUND else link, parts.pin_on(link, point))
                for link, point in (load["on"], load["by"])
            )
            return SpringDamper(
                (one, other), *(geometry.number(load[key]) for key in ("stiffness", "length", "damping"))
            )
        frame = parts.frames[link]

        def angle(xp: Any, m: Any) -> Any:
            return self.angle(xp, link, frame.x_axis(m.links[link].u), m.q)

        law = geometry.values, self.tables, angle
        if kind == "torque":
            return TorqueLaw(link, load["torque"], *law)
        axis = frame.axis if kind == "follower" else None
        fx, fy = load["force"]
        return ForceLaw(link, parts.pin_on(link, *point), (fx, fy), axis, *law)

    def check_loads(self, p: Any, speed: float) -> None:
        """Refuse a force or a torque that has no value, or an infinite one, at a place of the way.

        Parameters
        ----------
        p : the parameters, with the numbers that are derived from them
        speed : of the driver [rad/s, m/s]

        Raises
        ------
        InputError
            in one line, for the first such load.
        """
        xp, q = numpy_(), np.array(self.way.places())
        laws = {load["name"]: load for load in self.data["loads"] if load["type"] != "spring"}
        if not laws:
            return
        linkage = self.linkage(xp, p, self.Inputs())
        first_wrong: dict[str, int] = {}
        with np.errstate(all="ignore"):
            m = Mechanism(xp, linkage, q, getattr(p, "derived", ()))
            for name, load in laws.items():
                wrenches = linkage.loads[name_of_load(load)].effect(xp, m, speed, {}).wrenches
                total = sum(abs(x) for w in wrenches for x in (w.force.x, w.force.y, w.moment))
                wrong = ~np.isfinite(np.broadcast_to(total, q.shape))
                if np.any(wrong):
                    first_wrong[name] = int(np.argmax(wrong))
        if first_wrong:
            name = min(first_wrong, key=first_wrong.__getitem__)
            unit = "m/s" if self.way.linear else "rad/s"
            place = self.way.words(float(q[first_wrong[name]]))
            raise InputError(
                f"has no value, or an infinite one, at {place} and a speed of {speed:.6g} {unit}",
                key=f"loads.{name}.{'torque' if laws[name]['type'] == 'torque' else 'force'}",
            )

    # the way of the driver

    @property
    def span(self) -> tuple[float, float]:
        """The least and the largest place of the driver: a turn from the start on [rad], or its range [rad, m]."""
        return self.way.span

    @property
    def angle_counts(self) -> str:
        """How the angle of the driver counts, in words."""
        driver = self.structure.driver
        degrees = round(math.degrees(self.at_start.parts.geometry.number(driver.zero)), 6)
        named = {0.0: "from the x axis", 90.0: "from the upward vertical"}
        way = "counter-clockwise" if driver.sense > 0.0 else "clockwise"
        if (on := self.structure.joints[driver.joint].other_link(driver.link)) != GROUND:
            return f"from {degrees:g} deg to the x axis of {on}, {way}"
        return f"{named.get(degrees, f'from {degrees:g} deg to the x axis')}, {way}"

    def _followed(self, linkage: DescribedLinkage) -> FollowedLinkage:
        """The linkage over the way of its driver."""
        # extremes depend on the rotation of the links
        return FollowedLinkage(self.structure, self.way, replace(linkage, extremes=()))

    def _turns(self) -> dict[str, tuple[float, float]]:
        """See `FollowedLinkage.turns`; a refusal names the range of the driver in which the linkage closes. Refuse
        extremes of the angle of a link that turns round, too."""
        try:
            courses = self._courses(self.followed, self.Parameters())
        except InputError as error:
            words = "" if self.further.free else self.followed.range_words()
            raise InputError(f"{error}{words}", key=error.key) from None
        turns = self.followed.turns(courses)
        if self.extremes and self.further.free:
            raise InputError(
                f"{self.extremes[0]}: depends on two inputs, and has no value; give a number, or give "
                f'the other driver a law, phi = "..."',
                key="loads",
            )
        for name in self.extremes:
            _, link, _, axis = parts_of_extreme(name)
            if axis == "angle" and self.way.turns and turns[link][0]:
                raise InputError(
                    f"{name}: {link} turns all the way round, and its angle has no extremes; take those of a "
                    "point, or of a link that swings",
                    key=f"links.{link}",
                )
        return turns

    def _courses(self, followed: FollowedLinkage, p: Any) -> list[dict[str, list[float]]]:
        """The courses of the links over the way of the first driver, at all places of the drivers that are inputs;
        `followed` gets all margins."""
        grid = self.further.grid()
        visited = [(grid[0], followed.courses())]
        for places in grid[1:]:

            def way(other: Mapping[str, float], places: Mapping[str, float] = places) -> float:
                return sum(abs(place - other[name]) for name, place in places.items())

            _, near = min(visited, key=lambda visit: way(visit[0]))
            other = self._followed(self.linkage(MATH, p, self.Inputs(), places))
            other.signs, other.derived = followed.signs, followed.derived
            try:
                visited.append((places, other.courses({name: course[0] for name, course in near.items()})))
            except InputError as error:
                others = " and ".join(self.further.words(name, place) for name, place in places.items())
                raise InputError(
                    f"{error}; this is with {others}, in its range in [drivers], which may be narrower",
                    key=error.key,
                ) from None
            followed.margins += other.margins
        return [courses for _, courses in visited]

    def is_start(self, xp: Any, p: Any) -> bool:
        """Whether the parameters are numbers with the start values, whose linkage is known."""
        return xp is MATH and p == self.Parameters()

    def obstacle(self, p: Any) -> str:
        """The sentence on the place at which the linkage with these parameters does not close or jams, with the
        parameters; empty if there is none."""
        try:
            self._courses(self._followed(self.linkage(MATH, p, self.Inputs())), p)
        except InputError as error:
            values = ", ".join(
                f"{entry['name']} = {getattr(p, entry['name']):g}{unit_behind(entry['unit'])}"
                for entry in self.data.get("parameters", ())
            )
            return f"{error}{f' ({values})' * bool(values)}"
        return ""

    # the model

    def end_stops(self) -> EndStops | None:
        """The usual end stops of a driver with a range, for its start values; None for one that turns round."""
        if self.way.turns:
            return None
        states = [
            MachineState(MATH, Mechanism(MATH, self.at_start, q, self.start_derived), 0.0)
            for q in self.way.places()
        ]
        mass = max(state.J for state in states)
        low, high = self.span
        bodies = sum(body.m for body in states[0].m.bodies.values())
        # a driver that nothing loads still stops its own weight, one that swings at its radius of gyration
        arm = math.sqrt(mass / bodies) if mass and bodies and not self.way.linear else 1.0
        force = max(mass * STANDARD_GRAVITY / arm, *(abs(state.bias) for state in states))
        # without masses and loads no effort is known: one of 1 N or 1 N m
        force = force or 1.0
        return usual_stops(force, mass, high - low, EndStops if self.way.linear else SwingStops)

    def model(self) -> InverseMachine:
        """The model of the machine."""
        data = self.data
        receivers = self.at_start.parts.receivers
        variables = {name: self.variable("joint", name) for name in self.structure.joints}
        title = data["title"] or data["name"]
        return FileMachine(
            name=data["name"],
            text=f"{title}.",
            noun=title,
            driver_noun=data["driver"]["link"],
            description=data["title"] or f"linkage {data['name']}",
            direct_description=words_on_motion(f"{title}, moving by itself", self.port),
            made=(machine_of, (data,)),
            fmu_data=FmuData(self.notes, About(**data.get("about", {}))),
            repeated=self.repeated,
            constant=self.constant,
            driver_port=self.port,
            span=self.span,
            turns=self.way.turns,
            slides=self.way.linear,
            end_stops=self.end_stops(),
            angle_counts=self.angle_counts,
            Parameters=self.Parameters,
            Inputs=self.Inputs,
            Outputs=self.outputs,
            joints={variable: receivers[name][0] for name, variable in variables.items()},
            pins=variables,
            contacts=tuple(
                f"{variables[j.name]}.normal" for j in self.structure.joints.values() if j.kind == CAM
            ),
            usual_speed=(0.05, 200.0),
            described_by=self,
            linkage=self.linkage,
            probes=self.probes,
            required=self.required,
            requirements=self.limits,
            obstacle=self.obstacle,
        )

    @property
    def required(self) -> tuple[Requirement, ...]:
        """The requirements whose values and limits `limits` gives."""
        names = tuple(parameter["name"] for parameter in self.data.get("parameters", ()))
        groups = {", ".join(assur.links): assur.kind for assur in self.structure.groups}
        margins = (
            Requirement(
                f"least margin of the group of {links} over the way of the driver",
                "1",
                "the linkage does not close all the way, or comes to a dead position",
                names,
            )
            for links in groups
        )
        fits = (
            Requirement(
                f"largest misfit of a leg of the group of {links} over the turn of the driver, in parts of its "
                "length",
                "1",
                "the group does not close all the way round from the start pose, or moves too sharply to be followed",
                names,
            )
            for links, kind in groups.items()
            if kind in ON_LEGS
        )
        laws = (
            Requirement(
                f"sine of half the angle, or the way, by which {entry.name} is not back after a turn of the driver",
                "1",
                "the law must come back; let the driver swing by a range for another one",
                tuple(name for name in names if name in expression(str(entry.law)).names),
            )
            for entry in self.further.varying(self.way.turns)
        )
        belts = (
            Requirement(f"distance of the centres of the belt {belt}", "m", "the pulleys overlap", names)
            for belt in self.structure.belts
        )
        widths = (requirement_of_width(*width, names) for width in self.widths)
        return (*margins, *fits, *laws, *belts, *widths)

    def limits(self, xp: Any, p: Any) -> Iterator[tuple[Any, Any, Any]]:
        """The least margin of each group over the way of the driver, and the largest misfit of each triad or
        tetrad, and the distance of the pulleys of each belt, with their limits."""
        if self.is_start(xp, p):
            linkage, derived, course = self.at_start, self.start_derived, self.followed.margins
        else:
            linkage, derived = self.linkage(xp, p, self.Inputs()), getattr(p, "derived", ())
            course = []
            for k, q in enumerate(self.way.places()):
                if self.further.free:
                    linkage = self.linkage(xp, p, self.Inputs(), self.further.lattice(k))
                course.append(signed(self._margins(xp, linkage, derived, q), self.followed.signs))
        for margins_of_group in zip(*course, strict=True):
            yield reduce(partial(lesser, xp), margins_of_group), LEAST_MARGIN, math.inf
        for _, misfit in misfits(linkage, derived):
            yield misfit, -math.inf, MOST_MISFIT
        geometry = linkage.parts.geometry
        values = geometry.values
        for entry in self.further.varying(self.way.turns):
            yield self.further.misfit(xp, entry, values, self.way.start), -BACK, BACK
        for belt in self.structure.belts.values():
            distance = geometry.span(belt.third, *belt.table["held"])[1]
            yield distance, 0.5 * sum(belt.table["diameters"]), math.inf
        for _, width, sign in self.widths:
            yield sign * width.of.value(xp, values), 0.0, math.inf

    def _margins(self, xp: Any, linkage: DescribedLinkage, derived: Sequence[Any], q: float) -> list[Any]:
        """The margins of the groups at a place; NaN if the linkage does not close."""
        try:
            return Mechanism(xp, linkage, q, derived).margins()
        except (ArithmeticError, ValueError):
            return [math.nan] * len(self.structure.groups)

    @property
    def notes(self) -> str:
        """Paragraphs for the description of the FMU on frame, signs and limits, each after an empty line."""
        driver, span = self.structure.driver, self.way.limits
        if driver.linear:
            effort, unit, counts = "force", "m", f"phi is the way of {driver.joint}"
        else:
            effort, unit = "torque", "deg"
            counts = f"The angle of {driver.link} is phi/ratio and counts {self.angle_counts}"
        if span:
            low, high = span if driver.linear else map(math.degrees, span)
            ends = f"from {low:g} {unit} to {high:g} {unit}"
            counts += f", {ends}: beyond, the linkage was not checked and may not close"
        for entry in self.further.entries:
            name, driver_effort = self.further.names[entry.name], "force" if entry.linear else "torque"
            drive = "a gear drives it" if entry.geared else "a motor of its own drives it"
            moves = "is an input of its own" if entry.is_free else f"follows by {entry.law}; {drive}"
            counts += f". The driver {entry.name} {moves}; {name}.tau is its {driver_effort} along {name}.phi"
        kinds = dict.fromkeys(joint.kind for joint in self.structure.joints.values())
        limits = "".join(f" {KINDS[kind].limits}" for kind in kinds if KINDS[kind].limits)
        return (
            "\n\nFrame and signs: x points right, y up; the angle of a link counts counter-clockwise from the x "
            f"axis. {counts}. The {effort} tau is the one that the machine needs. The reaction of a joint is the "
            "force on the link that its description names first."
            "\n\nLimits: links are rigid, and joints have no play; a joint pushes and pulls. Static friction is not "
            "modelled. Lengths are fixed before the initialization, where lengths for which the linkage does not "
            f"close are refused.{limits}"
        )
