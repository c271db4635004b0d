"""Gears: two wheels that are pinned to one link, the arm, and roll on each other at their pitch point.

Relative to the arm a wheel turns z'/z times as fast as the other one, the other way round, or the same way in a ring
with internal teeth. Its place follows in closed form from the places of the other wheel and of the arm. The force of
the teeth acts at the pitch point, along the common tangent of the pitch circles: the part of it that gives a torque.
The force by which slanting flanks press the wheels apart along the line of their centres is in no pin.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, ClassVar, NamedTuple

import numpy as np

from ...core.errors import InputError, shown
from ...core.planar import ZERO, Link, Motion, Vec2, mirrored, rotated
from ...groups.block import Row
from ...groups.body import Bar, Load
from ...groups.group import Group, Outline, SolvedGroup
from ...groups.joints import (
    Guide,
    GuideData,
    Hinge,
    HingeData,
    JointData,
    LinkageInMotion,
    Placed,
    Rail,
    Rates,
    Third,
)  # fmt: skip
from ...mechanism.assur import GROUND, PRISMATIC, REVOLUTE, AssurGroup
from .entries import EntryReader, is_given
from .joint_kind import JointEntry, JointParts, JointTable, SingleLinkKind
from .names import connected, owners_of

_AT_REST = Link(Motion(ZERO), Vec2(1.0, 0.0), 0.0, 0.0)
_MOST = 20
"""Largest number of turns of a wheel in a turn of the links before it: a linkage is checked at so many places."""
_LEAST_RADIUS = 1e-9
"""Least pitch radius of the pinion of a rack [m]; a smaller one is zero but for rounding."""
_LEAST_COSINE = -0.98
"""Cosine of the angle, of about 168 deg, by which a wheel may turn whose ratio is no whole number: half a turn on
either side of its start has one angle, and the places at which a linkage is checked lie some degrees apart."""


class Rolling(NamedTuple):
    """How a wheel turns: `ratio` times as fast as the link `source`, both seen from the `arm`; None is the ground."""

    arm: str | None
    source: str | None
    ratio: Fraction

    def turn(self, turn_of: Callable[[str], Any]) -> Any:
        """The derivative of its angle, from the derivatives of the same order of links by name."""
        arm, source = (0.0 if name is None else turn_of(name) for name in (self.arm, self.source))
        return arm + (source - arm) * float(self.ratio)

    def sight(self, linkage: LinkageInMotion) -> tuple[Vec2, Vec2]:
        """The direction of the arm, and that of the source as the arm sees it, unit vectors."""
        arm, source = (_AT_REST if name is None else linkage.links[name] for name in (self.arm, self.source))
        return arm.u, rotated(source.u, mirrored(arm.u))


@dataclass(frozen=True)
class MeshData:
    """The mesh of two wheels as data: the pitch point `pin`, a point of the arm, the wheel `link` on which its force
    acts, on the pin `centre`, the wheel `by` from which it acts, None for the ground, and how the first one turns."""

    pin: str
    link: str
    centre: str
    by: str | None
    rolling: Rolling

    @property
    def form(self) -> str:
        """Its links neither turn about it nor slide in it."""
        return "rolls"

    def carrier(self, carries: Mapping[str, str]) -> str | None:
        """The other wheel; the arm carries the pitch point, but no force of the teeth."""
        return self.by

    def third_before(
        self, m: LinkageInMotion, links: Mapping[str, Third], pins: Mapping[str, Vec2]
    ) -> Third | None:
        """The third derivatives of the centre and of the angle of the wheel."""
        return pins.get(self.centre, ZERO), self.rolling.turn(lambda name: links[name][1])

    def at_centre(self, m: LinkageInMotion, reaction: Vec2) -> Vec2:
        """The force on the link; it has the moment of one through the pitch point."""
        return reaction

    def opposite(self, m: LinkageInMotion, carrier: str, reaction: Vec2) -> Load:
        """What the opposite force does to the other wheel."""
        return -reaction, -(m.pins[self.pin].p - m.links[carrier].pin.p).cross(reaction)

    def turning(self, m: LinkageInMotion, carrier: str | None, reaction: Vec2) -> Iterator[tuple[str, Load]]:
        """The changes by q of the load of the mesh on both of its links, at a constant size of the force: it turns
        with the arm. On `link`, which starts from its centre, its lever turns as the force does, so that the moment
        stays; on the `carrier` the moment changes, too."""
        turn = 0.0 if self.rolling.arm is None else m.links[self.rolling.arm].t1
        force = self.at_centre(m, reaction)
        more = force.turned() * turn
        yield self.link, (more, 0.0)
        if carrier is not None:
            point, start = m.pins[self.pin], m.links[carrier].pin
            yield carrier, (-more, -((point.p1 - start.p1).cross(force) + (point.p - start.p).cross(more)))


class Mesh(Placed):
    """The mesh at one position, whose reaction has the direction `along`. It gives n . v + lever t the same value on
    both sides, with the velocity v of a point and the speed t of an angle: of the link these are unknowns, with the
    coefficients of its `row`, and of the other side known `rates`, by order of the derivative by q."""

    __slots__ = ("_along", "_lever", "_n", "_rates", "_row")

    def __init__(
        self, n: Vec2, lever: Any, rates: Sequence[Third], along: Vec2, row: Row | None = None
    ) -> None:
        self._n, self._lever, self._rates, self._along = n, lever, rates, along
        self._row = {0: n.x, 1: n.y, 2: lever} if row is None else row

    def rows(self) -> list[Row]:
        """Its row."""
        return [{**self._row}]

    def right(self, rates: Rates, before: Third | None) -> list[Any]:
        """Its right side, from the other side."""
        point, turn = self._rates[len(rates)] if before is None else before
        return [self._n.dot(point) + self._lever * turn]

    def force(self, multipliers: Iterator[Any]) -> tuple[Vec2 | None, Any]:
        """The tangential force of the teeth, or the pull of a belt [N]."""
        return self._along * next(multipliers), None


@dataclass
class GearedLink(Group):
    """A wheel on a pin that moves in a known way, in mesh with another wheel: its bar, the pitch point, the wheel
    `by`, the pin at its centre, and how the wheel turns. It has the angle `angle` [rad] at the place `start` of the
    driver. Its margin is 1 or, if its ratio is no whole number, 0 if its source has turned by nearly half a turn."""

    bar: Bar
    mesh: str
    by: str | None
    by_centre: str
    rolling: Rolling
    angle: float
    start: float

    derived_count: ClassVar[int] = 4
    """The number of values that `derive` gives: at the start the directions of the source and of the wheel, as the
    arm sees them."""

    @property
    def joints(self) -> tuple[JointData, ...]:
        """Its pin and its mesh."""
        bar = self.bar
        return HingeData(bar.pin, bar.name), self.mesh_data

    @property
    def mesh_data(self) -> MeshData:
        """Its mesh as data."""
        return MeshData(self.mesh, self.bar.name, self.bar.pin, self.by, self.rolling)

    def mesh_at(self, arm: Vec2, rates: Sequence[Third]) -> Mesh:
        """Its mesh in a place `arm` from its centre; `rates` are those of its centre and its angle, see `Mesh`."""
        n = arm.turned()
        return Mesh(n, arm.squared(), rates, n)

    @property
    def circles(self) -> tuple[tuple[str, str], ...]:
        """The pitch circles of both wheels."""
        return (self.bar.pin, self.mesh), (self.by_centre, self.mesh)

    def derive(self, xp: Any, before: Callable[[float], LinkageInMotion]) -> list[Any]:
        """See `derived_count`."""
        arm, source = self.rolling.sight(before(self.start))
        wheel = rotated(Vec2(math.cos(self.angle), math.sin(self.angle)), mirrored(arm))
        return [source.x, source.y, wheel.x, wheel.y]

    def solve(self, xp: Any, q: Any, linkage: LinkageInMotion, derived: Sequence[Any]) -> SolvedGroup:
        """The wheel, turned from its start as the source was."""
        rolling, centre, ratio = self.rolling, linkage.pins[self.bar.pin], self.rolling.ratio
        arm, source = rolling.sight(linkage)
        turned = rotated(source, mirrored(Vec2(derived[0], derived[1])))
        if ratio.denominator == 1:
            margin = 1.0
            step = wheel = turned if ratio > 0 else mirrored(turned)
            for _ in range(abs(int(ratio)) - 1):
                wheel = rotated(wheel, step)
        else:
            margin = (turned.x - _LEAST_COSINE) * (1.0 / (1.0 - _LEAST_COSINE))
            angle = xp.atan2(turned.y, turned.x) * float(ratio)
            wheel = Vec2(xp.cos(angle), xp.sin(angle))
        u = rotated(rotated(wheel, Vec2(derived[2], derived[3])), arm)
        links = linkage.links
        turns = rolling.turn(lambda name: links[name].t1), rolling.turn(lambda name: links[name].t2)
        rates = [*zip((centre.p1, centre.p2), turns, strict=True)]
        mesh = self.mesh_at(linkage.pins[self.mesh].p - centre.p, rates)
        return SolvedGroup([(centre, u)], (Hinge(0, base=centre), mesh), margin)


class GearKind(SingleLinkKind):
    """A gear: the links `on` and `by` are wheels about their points, which are pinned to one link."""

    name = noun = "gear"
    keys = ("teeth", "internal")
    use = "for a gear give it `teeth`, the numbers of teeth of both wheels"
    limits = (
        "The reaction of a gear is its tangential force; what presses the wheels apart is in no reaction."
    )
    equations = 1
    alone = "geared link"

    def read(self, reader: EntryReader, key: str, table: Mapping[str, Any], joint: JointTable) -> None:
        """Add to the `joint` the teeth of both wheels, and whether one is a ring (internal)."""
        teeth: Any = table.get("teeth")
        whole = isinstance(teeth, list) and len(teeth) == 2 and all(type(z) is int and z > 0 for z in teeth)
        if not whole:
            reader.fault(
                f"{key}.teeth",
                f"{is_given(teeth)}; must be two whole numbers > 0, the teeth of {joint['on'][0]} and of "
                f"{joint['by'][0]}, such as [20, 40]",
            )
        internal = reader.flag(f"{key}.internal", table)
        if whole and internal is True and teeth[0] == teeth[1]:
            reader.fault(
                f"{key}.teeth",
                f"is {shown(teeth)}; a wheel in a ring has fewer teeth than the ring; give both numbers",
            )
        joint |= {"teeth": teeth, "internal": internal}

    def ratio(self, joint: JointEntry, link: str) -> Fraction:
        """How often a wheel turns per turn of the other one, seen from the arm."""
        on, by = joint.table["teeth"]
        ratio = Fraction(by, on) if link == joint.on[0] else Fraction(on, by)
        return ratio if joint.table["internal"] else -ratio

    def complete(self, reader: EntryReader, joint: JointTable, joints: Sequence[JointTable]) -> None:
        """Add the arm with its points at the centres, and the pitch point, which it carries by the name of the
        joint."""
        if self.held(reader, joint, joints):
            (z, other), sign = joint["teeth"], -1 if joint["internal"] else 1
            share, arm = z / (z + sign * other), joint["third"]
            a, b = (reader.points[arm][point] for point in joint["held"])
            place = [f"({x}) + {share!r} * (({y}) - ({x}))" for x, y in zip(a, b, strict=True)]
            joint |= {"points": {arm: {joint["name"]: place}}}

    def held(self, reader: EntryReader, joint: JointTable, joints: Sequence[JointTable]) -> bool:
        """Add the arm with its points at the centres; returns whether the file has no fault so far."""
        key, wheels = f"joints.{joint['name']}", (joint["on"][0], joint["by"][0])
        centres = [_pinned(reader, joint[end], joints) for end in ("on", "by")]
        arm = next(
            (link for link in reader.points if link not in wheels and all(link in c for c in centres)), ""
        )
        if not arm:
            on, by = (".".join(joint[end]) for end in ("on", "by"))
            reader.fault(
                key,
                f"no link holds its two wheels at their distance: {on} and {by} must be pinned to one link, or to "
                "the ground; name the centres of the wheels in `on` and `by`",
            )
        elif not reader.errors:
            joint |= {"third": arm, "held": [centre[arm] for centre in centres]}
            return True
        return False

    def start_faults(
        self, joint: Mapping[str, Any], points: Mapping[str, Mapping[str, tuple[float, float]]]
    ) -> Iterator[tuple[str, str]]:
        """The fault of wheels on one centre."""
        arm, (a, b) = joint["third"], joint["held"]
        if math.dist(points[arm][a], points[arm][b]) == 0.0:
            yield (
                f"joints.{joint['name']}",
                f"its wheels have one centre, {a} and {b} of {arm} in one place, and cannot be in mesh; place them "
                "apart",
            )

    def rate(self, joint: JointEntry, link: str) -> float:
        """See `SingleLinkKind`; seen from an arm that turns, too, the ground turns."""
        ratio, other = self.ratio(joint, link), joint.other_link(link)
        rate = abs(1 - ratio) * (joint.third != GROUND) + abs(ratio) * (other != GROUND)
        if rate > _MOST:
            raise InputError(
                f"{link} may turn {float(rate):.3g} times in a turn of the links before it by the {self.noun} "
                f"{joint.name}, and must turn {_MOST} times at most; leave the fast wheel out: a gear to the motor "
                "is the `ratio` at the top of the file",
                key=f"links.{link}",
            )
        return float(rate)

    def group(self, parts: JointParts, link: str, first: JointEntry, joint: JointEntry) -> Group:
        """The wheel `link`, which turns on the arm in its pin `first` and meshes with another one in the `joint`. If
        the other wheel is itself driven by a gear on the same arm, it is an idler: the turn then follows from the
        wheel that drives it, by the product of both ratios."""
        other, arm = joint.other_link(link), joint.third
        idler = next((g for g in parts.groups if isinstance(g, GearedLink) and g.bar.name == other), None)
        rolling = Rolling(_moving(arm), _moving(other), self.ratio(joint, link))
        if idler is not None and idler.rolling.arm == rolling.arm:
            rolling = idler.rolling._replace(ratio=rolling.ratio * idler.rolling.ratio)
        bar, centre = parts.hung(link, first), parts.pin(other, joint.at(other))
        mesh, angle = self.mesh_pin(parts, joint, centre), parts.structure.poses[link][2]
        parts.receive(joint, mesh, link)
        wheel = GearedLink(bar, mesh, _moving(other), centre, rolling, angle, parts.structure.start)
        return self.wheel(parts, joint, wheel)

    def mesh_pin(self, parts: JointParts, joint: JointEntry, centre: str) -> str:
        """The pin of the mesh: the pitch point; `centre` is the pin at the centre of the other wheel."""
        return parts.pin(joint.third, joint.name)

    def wheel(self, parts: JointParts, joint: JointEntry, wheel: GearedLink) -> GearedLink:
        """The group of the kind, from a wheel with teeth."""
        return wheel

    def dead(self, group: AssurGroup, where: str) -> str:
        """See `SingleLinkKind`: the ratio is no whole number."""
        (link,), joint = group.links, group.joints[1]
        other = joint.other_link(link)
        return (
            f"{other} has turned by nearly half a turn from its start at {where}, and {link} does not turn a whole "
            f"number of times as fast by the {self.noun} {joint.name}, so that it would not be back after a turn; "
            "drive the slower of the two wheels with a whole ratio, or let it swing by less than 168 deg about its "
            "start"
        )


class RackData(MeshData):
    """The mesh of a rack and its pinion as data: `pin` is a point of the rack on its pitch line."""

    def third_before(
        self, m: LinkageInMotion, links: Mapping[str, Third], pins: Mapping[str, Vec2]
    ) -> Third | None:
        """The third derivatives of the pin, if it is known, and of the clockwise angle of the other link."""
        return pins.get(self.pin, ZERO), -links[self.by or ""][1]

    def turning(self, m: LinkageInMotion, carrier: str | None, reaction: Vec2) -> Iterator[tuple[str, Load]]:
        """None: the force keeps its line."""
        return iter(())


@dataclass
class RackedLink(Group):
    """A rack on a `rail` of the ground that a pinion moves, or without one a pinion on a pin of the ground that a
    rack turns: its bar, the `name` of the joint, the point `mesh` of the rack on its pitch line, the other link `by`.
    The rack has the direction `d`; the pitch line lies by the `radius` to the left of the `centre`, and at the start
    values on this `side` of it, +1 or -1. At the place `start` of the driver the rack is at `place`, the pinion at
    that angle. The margin is as that of `GearedLink`, and below 0 on the other side."""

    bar: Bar
    name: str
    mesh: str
    by: str
    centre: str
    d: Vec2
    radius: Any
    side: float
    rail: Rail | None
    guide: str
    place: float
    start: float

    derived_count: ClassVar[int] = 2
    """The number of values that `derive` gives: at the start the direction of the pinion, or the place of the
    rack."""

    @property
    def outlines(self) -> Mapping[str, Outline]:
        """The pitch circle of the pinion."""
        angles = np.linspace(0.0, 2.0 * math.pi, 91)
        circle = Vec2(np.cos(angles), np.sin(angles))
        return {self.name: Outline(self.centre, Rail(None, ZERO, self.d), lambda: circle * abs(self.radius))}

    @property
    def joints(self) -> tuple[JointData, ...]:
        """Its guide or its pin, and its mesh."""
        link = self.bar.name
        first = HingeData(self.bar.pin, link) if self.rail is None else GuideData(self.guide, link, self.rail)
        return first, RackData(self.mesh, link, self.centre, self.by, Rolling(None, None, Fraction(1)))

    def derive(self, xp: Any, before: Callable[[float], LinkageInMotion]) -> list[Any]:
        """See `derived_count`."""
        m = before(self.start)
        there = m.pins[self.mesh].p if self.rail is None else m.links[self.by].u
        return [there.x, there.y]

    def solve(self, xp: Any, q: Any, linkage: LinkageInMotion, derived: Sequence[Any]) -> SolvedGroup:
        """The rack as far along as the pinion has turned, or the pinion turned as the rack has moved."""
        d, r, there = self.d, self.radius, Vec2(derived[0], derived[1])
        if self.rail is None:
            centre, rack = linkage.pins[self.bar.pin], linkage.pins[self.mesh]
            turned = d.dot(there - rack.p) / r
            cosine, rates, row = xp.cos(turned), [(rack.p1, 0.0), (rack.p2, 0.0)], {0: d.x, 1: d.y, 2: -r}
            u = Vec2(xp.cos(turned + self.place), xp.sin(turned + self.place))
            pose, first = (centre, u), Hinge(0, base=centre)
        else:
            pinion, rail = linkage.links[self.by], self.rail.at_position(linkage.links)
            turned = rotated(pinion.u, mirrored(there))
            way = self.place - d.dot(rail.pin.p) - r * xp.atan2(turned.y, turned.x)
            cosine, rates, row = turned.x, [(ZERO, -pinion.t1), (ZERO, -pinion.t2)], {3: 1}
            pose, first = (rail.pin.p + d * way, rail.u), Guide(0, d, way, d * way, rail)
        margin = (
            (cosine - _LEAST_COSINE)
            * (self.side / (1.0 - _LEAST_COSINE))
            * r
            / xp.sqrt(r * r + _LEAST_RADIUS**2)
        )
        return SolvedGroup([pose], (first, Mesh(d, r, rates, d, row)), margin)


class RackKind(SingleLinkKind):
    """A rack, the link `on` with a point of its pitch line, and its pinion about a point of the link `by`."""

    name = noun = "rack"
    limits = (
        "The reaction of a rack is its tangential force; what presses it from its pinion is in no reaction."
    )
    equations = 1
    alone = "rack and pinion"
    seats = (REVOLUTE, PRISMATIC)

    def complete(self, reader: EntryReader, joint: JointTable, joints: Sequence[JointTable]) -> None:
        """Add the guide of the rack, and the point of the ground at the centre of the pinion."""
        rack = {joint["on"][0], GROUND}
        guides = [j["name"] for j in joints if j["type"] == PRISMATIC and {j["on"][0], j["by"][0]} == rack]
        pinned = _pinned(reader, joint["by"], joints)
        if not guides or GROUND not in pinned:
            reader.fault(
                f"joints.{joint['name']}",
                f"{joint['on'][0]} must slide in a guide of the ground, and {'.'.join(joint['by'])} be pinned to the "
                "ground: give the rack in `on` with a point of its pitch line, the pinion in `by` with its centre",
            )
        joint |= {"guide": next(iter(guides), ""), "centre": pinned.get(GROUND, "")}

    def start(self, first: JointEntry, joint: JointEntry, geometry: Any) -> dict[str, float]:
        """The side of the pinion on which the rack lies, and its place along its guide."""
        radius = _pitch(joint, geometry)[1]
        if abs(radius) < _LEAST_RADIUS:
            (rack, point), centre = joint.on, ".".join(joint.by)
            raise InputError(
                f"the pitch line of {rack} goes through {centre}, the centre of its pinion, whose pitch radius is "
                f"0 m; must be > 0: move {rack}.{point}, which is on that line, or the centre to the side",
                key=f"joints.{joint.name}",
            )
        side = {f"{joint.name}.side": math.copysign(1.0, radius)}
        if first.kind == REVOLUTE:
            return side
        d = geometry.rough_line(first)
        return {joint.on[0]: geometry.rough_place(*joint.on).dot(d) / math.sqrt(d.squared()), **side}

    def group(self, parts: JointParts, link: str, first: JointEntry, joint: JointEntry) -> Group:
        """The rack on its guide `first`, or the pinion on its pin."""
        (rack, point), (pinion, centre), geometry = joint.on, joint.by, parts.geometry
        (d, radius), rail, pin, place = _pitch(joint, geometry), None, "", parts.sides.get(link, 0.0)
        name = parts.pin(pinion, centre)
        if link == rack:
            bar, rail, pin = parts.slider(link, first, point)
            mesh = f"{joint.name}.{point}"
            bar = bar._replace(points={**bar.points, mesh: (0.0, 0.0)})
        else:
            bar, mesh, place = parts.hung(link, first), parts.pin(rack, point), parts.structure.poses[link][2]
        parts.receive(joint, mesh, link)
        by, start = pinion if link == rack else rack, parts.structure.start
        side = parts.sides[f"{joint.name}.side"]
        return RackedLink(bar, joint.name, mesh, by, name, d, radius, side, rail, pin, place, start)

    def dead(self, group: AssurGroup, where: str) -> str:
        """See `SingleLinkKind`: half a turn of the pinion."""
        joint = group.joints[1]
        return (
            f"the pinion of {joint.name} has turned by nearly half a turn from its start at {where}, and may swing "
            "by less than 168 deg about that; take a larger pinion, a shorter way, or a start in its middle; or the "
            "pitch line has come to the other side of its centre"
        )


def _pitch(joint: JointEntry, geometry: Any) -> tuple[Vec2, Any]:
    """The direction of the pitch line of a rack, and how far it lies to the left of the centre of the pinion [m]."""
    rack, point = joint.on
    guide = geometry.structure.joints[joint.table["guide"]]
    d = geometry.direction(guide, GROUND)
    place = geometry.line_through(guide, rack, geometry.point(rack, point))
    return d, d.cross(place - geometry.point(GROUND, joint.table["centre"]))


def _pinned(reader: EntryReader, end: Sequence[str], joints: Sequence[JointTable]) -> dict[str, str]:
    """The points that meet an end of a joint in pins, by link."""
    met = [{tuple(j["on"]), tuple(j["by"])} for j in joints if j["type"] == REVOLUTE]
    # pins join points of one name, too
    met += [{(link, name) for link in links} for name, links in owners_of(reader.points).items()]
    return dict(connected(tuple(end), met))


def _moving(link: str) -> str | None:
    """The name of a link that may move, None for the ground."""
    return None if link == GROUND else link
