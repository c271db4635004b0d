"""A machine from the description of its linkage: the model of a file, without a line of code of its own.

The description is a text in JSON, which a checked file gives (`chainunit.machines.linkages.file`). It is the
whole definition: by it another process, or an FMU, builds the same model. Standard library only.

x points right, y up, angles count counter-clockwise from the x axis. The coordinate q is that of the driver.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any, cast

from ...engines import MATH
from ...errors import GeometryError, InputError
from ...groups.loads import GuideLosses, PinLosses, Weight
from ...groups.triad import MOST_MISFIT
from ...mechanism.assur import GROUND, PRISMATIC
from ...mechanism.driver_ports import ROTATING, SLIDING
from ...mechanism.expressions import value_of
from ...mechanism.linkage import Linkage
from ...mechanism.machine import MachineState, Mechanism, derived_numbers
from ...mechanism.models import InverseMachine
from ...model import Requirement, keep
from ...planar import Vec2
from ...quantities import Value, declared_class, group, quantity
from ...refusals import unit_behind
from ..parts import Force, force
from .declarations import (
    RESERVED,
    CommonParameters,
    GuideReaction,
    LinkageMotion,
    LinkBody,
    LinkTurning,
    PointMotion,
    Running,
    WayRunning,
    field_of,
    with_starts,
)
from .loads import CoordinateTable, ForceLaw, SpringDamper, TorqueLaw, name_of_load
from .narrow import check_triads, lesser, lows, turns_of_triads
from .parts import LinkageParts
from .probes import guide_reaction, own_axis, point_motion
from .structure import check_groups, structure_of

ANGLES = 48
"""Places of the driver at which a linkage is checked to close."""
LEAST_MARGIN = 1e-3
"""Least margin of a group: closer to a dead position its forces have no limit."""


@dataclass
class DescribedLinkage(Linkage):
    """A linkage with the parts that it was made from."""

    parts: LinkageParts


def machine_of(text: str) -> type[InverseMachine]:
    """The model of a description.

    Raises
    ------
    InputError
        where the linkage is not determined, has a group that is not covered, or does not close.
    """
    return _machine_of(text)


@cache
def _machine_of(text: str) -> type[InverseMachine]:
    return LinkageDescription(json.loads(text), text).model()


class LinkageDescription:
    """The description of a linkage with its structure: what all values of its parameters share."""

    def __init__(self, data: Mapping[str, Any], text: str) -> None:
        self.data, self.text = data, text
        self.structure = structure_of(data)
        driver = self.structure.driver
        check_groups(self.structure, data.get("groups", ()))
        self.tables = {
            name: CoordinateTable(each["places"], each["values"], not driver.linear)
            for name, each in data.get("tables", {}).items()
        }
        self.Parameters = self._parameters()
        inputs = [field_of(each) for each in data.get("inputs", ())]
        self.port, motion = ROTATING, cast("type", LinkageMotion)
        if driver.linear:
            low, high = data["range"]
            middle = 0.5 * (low + high)
            way = quantity("m", "way of the driver", default=middle, min=low, max=high)
            start = quantity("m", "way of the driver at the start", default=middle, min=low, max=high)
            inputs = [("phi", Value, way), *inputs]
            motion = SLIDING.motion
            self.port = SLIDING._replace(
                start=declared_class("WayStart", (SLIDING.start,), [("phi_start", Value, start)])
            )
        self.Inputs = declared_class("Inputs", (motion,), inputs)
        p, u = self.Parameters(), self.Inputs()
        self.sides = dict(LinkageParts(MATH, self.structure, self.values(p, u)).sides)
        self.sides |= turns_of_triads(self.linkage(MATH, p, u))
        self.turning = self._followed(p, u)

    # declarations

    def _parameters(self) -> Any:
        fields = [field_of(each) for each in self.data.get("parameters", ())]
        for link in self.data["links"]:
            own = link.get("own", {})
            if own:
                name, words = self.variable("link", link["name"]), f"link {link['name']}"
                fields.append((name, LinkBody, group(LinkBody, words, default=LinkBody(**own))))
        return declared_class("Parameters", (with_starts(CommonParameters, self.data["common"]),), fields)

    def variable(self, kind: str, name: str) -> str:
        """The name under which the variables of a link or a joint stand: with its kind where the name has another
        meaning already."""
        shared = kind == "joint" and name in self.structure.links
        return f"{name}_{kind}" if shared or name in RESERVED else name

    def values(self, p: Any, u: Any) -> dict[str, Any]:
        """The quantities that expressions may name."""
        values = {each["name"]: getattr(p, each["name"]) for each in self.data.get("parameters", ())}
        values |= {each["name"]: getattr(u, each["name"]) for each in self.data.get("inputs", ())}
        for link in self.data["links"]:
            for quantity_name in link.get("own", {}):
                own = getattr(p, self.variable("link", link["name"]))
                values[f"{quantity_name}_of_{link['name']}"] = getattr(own, quantity_name)
        return values | {"g": p.g, "ratio": p.ratio}

    # the linkage

    def parts(self, xp: Any, p: Any, u: Any) -> LinkageParts:
        """The groups with the values of parameters and inputs."""
        return LinkageParts(xp, self.structure, self.values(p, u), self.sides)

    def linkage(self, xp: Any, p: Any, u: Any) -> DescribedLinkage:
        """The linkage with the values of parameters and inputs."""
        parts = self.parts(xp, p, u)
        loads: dict[str, Any] = {"weight": Weight(p.g)}
        for load in self.data["loads"]:
            loads[name_of_load(load)] = self._load(load, parts)
        loads["pins"] = PinLosses(p.pins, p.pins.damping)
        if any(j.kind == PRISMATIC for j in self.structure.joints.values()):
            lengths = {
                parts.receivers[each["name"]][0]: parts.number(each["length"])
                for each in self.data["joints"]
                if "length" in each
            }
            loads["guides"] = GuideLosses(p.guides, p.guides.damping, lengths)
        return DescribedLinkage(parts.ground, parts.driver, parts.groups, loads, parts)

    def _load(self, load: Mapping[str, Any], parts: LinkageParts) -> Any:
        kind = load["type"]
        if kind == "torque":
            return TorqueLaw(load["on"][0], load["torque"], parts.values, self.tables)
        if kind == "spring":
            ends = [
                (None if link == GROUND else link, parts.pin_on(link, point))
                for link, point in (load["on"], load["by"])
            ]
            stiffness, length, damping = (
                parts.number(load[key]) for key in ("stiffness", "length", "damping")
            )
            return SpringDamper((ends[0], ends[1]), stiffness, length, damping)
        link, point = load["on"]
        axis = parts.frames[link].axis if kind == "follower" else None
        fx, fy = load["force"]
        return ForceLaw(link, parts.pin_on(link, point), (fx, fy), axis, parts.values, self.tables)

    # the rotation of links over the turn

    @property
    def span(self) -> tuple[float, float]:
        """The least and the largest place of the driver: a turn from the start on [rad], or its range [m]."""
        if self.data["driver"]["linear"]:
            low, high = self.data["range"]
            return float(low), float(high)
        return self.structure.start, self.structure.start + 2.0 * math.pi

    @property
    def angle_counts(self) -> str:
        """How the angle of the driver counts, in words."""
        driver = self.structure.driver
        zero = value_of(MATH, driver.zero, self.values(self.Parameters(), self.Inputs()))
        return driver.angle_counts(zero)

    def places(self) -> list[float]:
        """Places of the driver from the start on, around or over its range."""
        driver = self.data["driver"]
        start = self.structure.start
        if driver["linear"]:
            low, high = self.data["range"]
            return [low + (high - low) * k / ANGLES for k in range(ANGLES + 1)]
        return [start + 2.0 * math.pi * k / ANGLES for k in range(ANGLES)]

    def _followed(self, p: Any, u: Any) -> dict[str, tuple[float, float]]:
        """For each link its turns per turn of the driver, and the middle of the rest of its angle [rad].

        Raises
        ------
        InputError
            where the linkage does not close, or passes a dead position, with the place of the driver.
        """
        linkage = self.linkage(MATH, p, u)
        parts = linkage.parts
        try:
            derived = derived_numbers(MATH, linkage)
        except (ArithmeticError, ValueError):
            raise self._closing(linkage, ()) from None
        check_triads(linkage, derived)
        places = self.places()
        around = [*places, places[0] + 2.0 * math.pi] if not self.data["driver"]["linear"] else places
        angles: dict[str, list[float]] = {}
        signs: list[float] = []
        courses: list[list[float]] = []
        for q in around:
            try:
                m = Mechanism(MATH, linkage, q, derived)
            except (ArithmeticError, ValueError):
                raise self._closing(linkage, derived) from None
            margins = m.margins()
            signs = signs or [math.copysign(1.0, margin) for margin in margins]
            courses.append([margin * sign for margin, sign in zip(margins, signs, strict=True)])
            for each, margin in zip(self.structure.groups, courses[-1], strict=True):
                if not margin > LEAST_MARGIN:
                    raise self._dead(each.links, q)
            for name in self.structure.links:
                axis = own_axis(m.links[name].u, parts.frames[name])
                angle = math.atan2(axis.y, axis.x)
                before = angles.setdefault(name, [self.structure.poses[name][2]])
                before.append(before[-1] + math.remainder(angle - before[-1], 2.0 * math.pi))

        def margins_at(q: float) -> list[float]:
            margins = Mechanism(MATH, linkage, q, derived).margins()
            return [margin * sign for margin, sign in zip(margins, signs, strict=True)]

        for k, q, least in lows(margins_at, courses, around):
            links = self.structure.groups[k].links
            if not least > LEAST_MARGIN:
                raise self._open(links, q) if math.isnan(least) else self._dead(links, q)
        turning = {}
        for name, course in angles.items():
            course = course[1:]
            rate = 0.0 if self.data["driver"]["linear"] else round((course[-1] - course[0]) / (2.0 * math.pi))
            rest = [angle - rate * (q - around[0]) for angle, q in zip(course, around, strict=True)]
            turning[name] = rate, 0.5 * (min(rest) + max(rest)) - rate * around[0]
        return turning

    def obstacle(self, p: Any) -> str:
        """The sentence on the place at which the linkage with these parameters does not close or jams, with the
        parameters; empty where there is none."""
        try:
            self._followed(p, self.Inputs())
        except InputError as error:
            given = ", ".join(
                f"{each['name']} = {getattr(p, each['name']):g}{unit_behind(each['unit'])}"
                for each in self.data.get("parameters", ())
            )
            return f"{error}{f' ({given})' * bool(given)}"
        return ""

    def _open(self, links: Sequence[str], q: float) -> InputError:
        text = f"the group of {', '.join(links)} cannot close at {self._at(q)}: change its lengths"
        return InputError(text, key=f"links.{links[0]}")

    def _dead(self, links: Sequence[str], q: float) -> InputError:
        return InputError(
            f"the group of {', '.join(links)} comes to a dead position at {self._at(q)}: there its forces have no "
            "limit; change its lengths",
            key=f"links.{links[0]}",
        )

    def _at(self, q: float) -> str:
        if self.data["driver"]["linear"]:
            return f"{self.data['driver']['joint']} = {q:.6g} m"
        return f"{math.degrees(q) % 360.0:.4g} deg of {self.data['driver']['link']}"

    def _closing(self, linkage: Linkage, derived: Sequence[Any]) -> InputError:
        """The refusal with the first place at which the linkage does not close, and the group that does not."""
        groups = self.structure.groups
        behind_driver = len(groups) - len(linkage.groups)
        for q in self.places():
            for k, each in enumerate(groups):
                number = k + 1 - behind_driver
                part = linkage.before(number) if number < len(linkage.groups) else linkage
                try:
                    Mechanism(MATH, part, q, derived[: part.derived])
                except (ArithmeticError, ValueError, IndexError):
                    return self._open(each.links, q)
        return InputError("the linkage does not close: change its lengths", key="links")

    # the model

    def model(self) -> type[InverseMachine]:
        """The model."""
        data, described = self.data, self
        parts = self.parts(MATH, self.Parameters(), self.Inputs())
        bearings = {
            self.variable("joint", name): parts.receivers[name][0]
            for name, j in self.structure.joints.items()
            if j.kind != PRISMATIC
        }
        given = tuple(each["name"] for each in data.get("parameters", ()))
        words = {
            "least margin of the group of {} over the way of the driver": (
                "the linkage does not close all the way, or comes to a dead position"
            ),
            "largest misfit of a leg of the group of {} over the turn of the driver, in parts of its length": (
                "the group does not close all the way round from the start pose, or moves too sharply to be followed"
            ),
        }
        required = tuple(
            Requirement(subject.format(", ".join(each.links)), "1", why, given)
            for subject, why in words.items()
            for each in self.structure.groups
            if subject.startswith("least") or each.kind == "triad"
        )

        class FileMachine(InverseMachine):
            """A machine whose linkage a file describes."""

            name = data["name"]
            noun = data["title"] or data["name"]
            turning = data["driver"]["link"]
            description = data["title"] or f"linkage {data['name']}"
            built_by = f"machine_of({described.text!r})"
            maker = (machine_of, (described.text,))
            driver_port = described.port
            span = described.span
            turns = not described.structure.driver.linear
            angle_counts = described.angle_counts
            Parameters = described.Parameters
            Inputs = described.Inputs
            Outputs = described.outputs
            joints = bearings
            usual_speed = (0.05, 200.0)
            described_by = described

            @staticmethod
            def linkage(xp: Any, p: Any, u: Any) -> Linkage:
                """See `LinkageDescription.linkage`."""
                return described.linkage(xp, p, u)

            @classmethod
            def check(cls, p: Any, derived: list[Any] | None = None) -> Any:
                """See `Model.check`; a refusal says where the linkage does not close."""
                try:
                    return super().check(p, derived)
                except GeometryError as error:
                    where = described.obstacle(p)
                    raise (GeometryError(where) if where else error) from None

            @staticmethod
            def requirements(xp: Any, p: Any) -> Iterator[tuple[Any, Any, Any]]:
                """Each group closes, clear of its dead positions."""
                yield from described.limits(xp, p)

            @staticmethod
            def probes(xp: Any, p: Any, u: Any, s: MachineState, a: Any) -> dict[str, Any]:
                """See `LinkageDescription.probes`."""
                return described.probes(xp, p, u, s, a)

        FileMachine.required = required
        FileMachine.__name__ = FileMachine.__qualname__ = data["name"]
        keep(FileMachine, "Parameters", "Inputs", "Feed")
        return FileMachine

    def limits(self, xp: Any, p: Any) -> Iterator[tuple[Any, Any, Any]]:
        """The least margin of each group over the way of the driver, and the largest misfit of each triad, with
        their limits."""
        u = self.Inputs()
        linkage = self.linkage(xp, p, u)
        derived = getattr(p, "derived", ())
        least: list[Any] = []
        for q in self.places():
            try:
                margins = Mechanism(xp, linkage, q, derived).margins()
            except (ArithmeticError, ValueError):
                margins = [math.nan] * len(self.structure.groups)
            signed = [margin * sign for margin, sign in zip(margins, self._signs, strict=True)]
            least = signed if not least else [lesser(xp, *pair) for pair in zip(least, signed, strict=True)]
        for margin in least:
            yield margin, LEAST_MARGIN, math.inf
        last = 0
        for each in linkage.groups:
            last += each.derived
            if each.derived:
                yield derived[last - 2], -math.inf, MOST_MISFIT

    @cached_property
    def _signs(self) -> list[float]:
        """The signs of the margins with the start values."""
        linkage = self.linkage(MATH, self.Parameters(), self.Inputs())
        m = Mechanism(MATH, linkage, self.places()[0], derived_numbers(MATH, linkage))
        return [math.copysign(1.0, margin) for margin in m.margins()]

    @cached_property
    def outputs(self) -> type:
        """The declaration of the outputs."""
        fields: list[tuple[str, Any, Any]] = []
        for name, joint in self.structure.joints.items():
            of: type = GuideReaction if joint.kind == PRISMATIC else Force
            words = f"joint {name}: on {joint.on[0]} from {joint.by[0]}"
            fields.append((self.variable("joint", name), of, group(of, words)))
        for name, of in self.link_outputs.items():
            fields.append((self.variable("link", name), of, group(of, f"link {name}")))
        running = WayRunning if self.structure.driver.linear else Running
        return declared_class("Outputs", (self.port.values, running), fields)

    @cached_property
    def link_outputs(self) -> Mapping[str, Any]:
        """The declaration of the outputs of each link."""
        declared = {}
        for name, link in self.structure.links.items():
            points = [(point, PointMotion, group(PointMotion, f"point {point}")) for point in link.points]
            if link.heavy:
                points.append(("centroid", PointMotion, group(PointMotion, "centroid")))
            declared[name] = declared_class(f"Link_{name}", (LinkTurning,), points)
        return declared

    def probes(self, xp: Any, p: Any, u: Any, s: MachineState, a: Any) -> dict[str, Any]:
        """Reactions, rotation of links and motion of points at acceleration `a` of the driver."""
        reactions, m, w = s.reactions(a), s.m, s.w
        assert isinstance(m.linkage, DescribedLinkage)
        parts = m.linkage.parts
        given = sum(
            s.effects[name_of_load(each)].dissipative
            for each in self.data["loads"]
            if each["type"] != "spring"
        )
        values: dict[str, Any] = {"load_power": -(given * w)}
        for name, joint in self.structure.joints.items():
            key, sign = parts.receivers[name]
            if joint.kind == PRISMATIC:
                value: Any = guide_reaction(m, joint, key, sign, reactions[key], parts, w, a)
            else:
                f = reactions[key]
                value = force(f if sign > 0.0 else -f)
            values[self.variable("joint", name)] = value
        for name, link in self.structure.links.items():
            moving, frame = m.links[name], parts.frames[name]
            fields = {
                "angle": self._angle(xp, name, own_axis(moving.u, frame), m.q),
                "w": moving.t1 * w,
                "a": moving.t2 * (w * w) + moving.t1 * a,
            }
            for point in link.points:
                at = frame.of(parts.point(name, point))
                fields[point] = point_motion(moving.beside(at.x, at.y), w, a)
            if link.heavy:
                at = frame.of(parts.vector(link.centroid))
                fields["centroid"] = point_motion(moving.beside(at.x, at.y), w, a)
            values[self.variable("link", name)] = self.link_outputs[name](**fields)
        return values

    def _angle(self, xp: Any, name: str, axis: Vec2, q: Any) -> Any:
        """The angle of a link without jumps: the middle of its course, which may turn with the driver, and the
        rest."""
        rate, middle = self.turning[name]
        about = middle + rate * q if rate else middle
        c, s = (xp.cos(about), xp.sin(about)) if rate else (math.cos(about), math.sin(about))
        return about + xp.atan2(c * axis.y - s * axis.x, c * axis.x + s * axis.y)
