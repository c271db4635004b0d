"""From the description of a linkage to its Assur groups: frames of links, rails, and assembly modes.

A description places the points of a link in the link's own frame. A group has frames of its own for its links
(`chainunit.groups`): a `LinkFrame` is the place of such a frame in that of the description. Standard library only:
FMUs carry this file.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from ...core.errors import InputError
from ...core.planar import ZERO, Vec2
from ...groups.body import Bar, Mass
from ...groups.cylinder import Cylinder
from ...groups.driver import Crank, Driver, Ram
from ...groups.dyad import Dyad
from ...groups.group import Group, Rail
from ...groups.legs import BlockLeg, Leg, RodLeg, SlotLeg
from ...groups.sliding import RPR, RRP
from ...groups.triad import Pose, Triad
from ...groups.yokes import PRP, RPP
from ...mechanism.assur import GROUND, REVOLUTE, AssurGroup
from ...mechanism.expressions import value_of
from .structure import CYLINDER, Entry, JointEntry, LinkEntry, Structure

ALONG_X = Vec2(1.0, 0.0)


class LinkFrame(NamedTuple):
    """A frame of a group's link in that of the description: its origin [m] and its x axis, a unit vector."""

    origin: Vec2
    axis: Vec2

    def of(self, point: Vec2) -> Vec2:
        """A point in this frame."""
        return self.of_vector(point - self.origin)

    def of_vector(self, v: Vec2) -> Vec2:
        """A vector in this frame."""
        return Vec2(self.axis.dot(v), self.axis.cross(v))


OWN = LinkFrame(ZERO, ALONG_X)


def rotated(v: Vec2, by: Vec2) -> Vec2:
    """A vector that is turned by the angle of the unit vector `by`."""
    return Vec2(v.x * by.x - v.y * by.y, v.x * by.y + v.y * by.x)


def mirrored(by: Vec2) -> Vec2:
    """The unit vector of the opposite angle."""
    return Vec2(by.x, -by.y)


class LinkageParts:
    """The groups of a linkage with values: `xp` is the engine, `values` are the quantities by name.

    `frames` has the frame of each link in its group; `receivers` the key of each joint's reaction in the groups (pin
    and link), with the sign that turns it into the force on the link that the description names first.
    """

    def __init__(
        self,
        xp: Any,
        structure: Structure,
        values: Mapping[str, Any],
        sides: Mapping[str, float] | None = None,
    ) -> None:
        """
        Parameters
        ----------
        sides : the assembly modes, of a triad the turns of its ternary link; None to find modes by the rough poses,
            which takes numbers and `MATH`
        """
        self.xp, self.structure, self.values = xp, structure, values
        self.sides: dict[str, float] = dict(sides or {})
        self._known_sides = sides is not None
        self.frames: dict[str, LinkFrame] = {GROUND: OWN}
        self.receivers: dict[str, tuple[tuple[str, str], float]] = {}
        self._points: dict[str, dict[str, Vec2]] = {}
        self._carriers = {self.pin(GROUND, name): GROUND for name in structure.ground}
        first, *rest = [*structure.groups, None]
        cylinder = first is not None and first.kind == CYLINDER
        self.driver = self._cylinder(first) if first is not None and cylinder else self._driver()
        self.groups: tuple[Group, ...] = tuple(
            self._group(each) for each in (rest if cylinder else structure.groups) if each is not None
        )

    def number(self, entry: Entry) -> Any:
        """The value of an entry."""
        return value_of(self.xp, entry, self.values)

    def vector(self, entries: tuple[Entry, Entry]) -> Vec2:
        """The value of a point."""
        return Vec2(self.number(entries[0]), self.number(entries[1]))

    def point(self, link: str, point: str) -> Vec2:
        """A point of a link in the frame of the description [m]."""
        known = self._points.setdefault(link, {})
        if point not in known:
            entries = self.structure.ground if link == GROUND else self.structure.links[link].points
            known[point] = self.vector(entries[point])
        return known[point]

    def pin(self, link: str, point: str) -> str:
        """The name of a point in the linkage."""
        return self.structure.pins[link, point]

    def pin_on(self, link: str, point: str) -> str:
        """The name of a point that this very link carries, of several that meet in it."""
        pin = self.pin(link, point)
        return pin if self._carriers.get(pin) == link else f"{link}.{point}"

    @property
    def ground(self) -> dict[str, Vec2]:
        """Places of the ground pins [m]."""
        return {self.pin(GROUND, name): self.point(GROUND, name) for name in self.structure.ground}

    # bars

    def _bar(self, link: str, frame: LinkFrame, start: str = "", length: Any = None) -> Bar:
        """The bar of a link in a frame; it starts from the pin `start`."""
        entry = self.structure.links[link]
        self.frames[link] = frame
        points = {}
        for name in entry.points:
            pin = self.pin(link, name)
            if pin in self._carriers:
                if self._carriers[pin] == link or (link, name) not in self.structure.marked:
                    continue
                pin = f"{link}.{name}"
            at = frame.of(self.point(link, name))
            points[pin], self._carriers[pin] = (at.x, at.y), link
        return Bar(link, start, length, self._mass(entry, frame), points)

    def _mass(self, entry: LinkEntry, frame: LinkFrame) -> Mass | None:
        """The body of a link: further masses are parts of it."""
        if not entry.heavy:
            return None
        m, c = self.number(entry.mass), self.vector(entry.centroid)
        inertia = self.number(entry.inertia)
        for point, added in entry.masses.items():
            more, at = self.number(added), self.point(entry.name, point)
            total = m + more
            # a link that is massless as yet has its centroid where the mass is
            share = more / (total + 1e-300)
            inertia = inertia + m * share * (at - c).squared()
            m, c = total, c + (at - c) * share
        at = frame.of(c)
        return Mass(m, at.x, inertia, at.y)

    def _between(self, link: str, start: str, end: str) -> tuple[LinkFrame, Any]:
        """The frame of a link from one of its points to another, and their distance."""
        a, b = self.point(link, start), self.point(link, end)
        length = self.xp.sqrt((b - a).squared())
        return LinkFrame(a, (b - a) * (1.0 / length)), length

    # joints

    def _turn(self, joint: JointEntry) -> Vec2:
        """The unit vector of the angle of `on` less that of `by`."""
        angle = self.number(joint.angle)
        return Vec2(self.xp.cos(angle), self.xp.sin(angle))

    def _line(self, joint: JointEntry) -> Vec2:
        """The direction of a prismatic joint's line in its link `by`, a unit vector."""
        link, start = joint.by
        return self._between(link, start, joint.toward)[0].axis

    def _across(self, joint: JointEntry, v: Vec2, link: str) -> Vec2:
        """A vector of a link's frame in that of the link on the other side of the prismatic joint."""
        turn = self._turn(joint)
        return rotated(v, turn if joint.on[0] == link else mirrored(turn))

    def _direction(self, joint: JointEntry, link: str) -> Vec2:
        """The direction of a prismatic joint's line in the frame of one of its links."""
        line = self._line(joint)
        return line if joint.by[0] == link else self._across(joint, line, joint.by[0])

    def _line_through(self, joint: JointEntry, link: str, point: Vec2) -> Vec2:
        """The place, in the link on the other side, of a point through which the line of a `point` of the link
        goes."""
        own, other = self.point(link, joint.at(link)), joint.other(link)
        return self.point(other, joint.at(other)) + self._across(joint, point - own, link)

    def _rail(self, joint: JointEntry, link: str, point: Vec2) -> Rail:
        """The line along which a `point` of the link moves in a link before it."""
        of = joint.other(link)
        frame = self.frames[of]
        at = frame.of(self._line_through(joint, link, point))
        return Rail(None if of == GROUND else of, at, frame.of_vector(self._direction(joint, of)))

    def _receive(self, joint: JointEntry, pin: str, link: str) -> None:
        """The reaction of a joint acts in the groups at that pin on that link."""
        self.receivers[joint.name] = (pin, link), 1.0 if joint.on[0] == link else -1.0

    def _outer(self, joint: JointEntry, link: str) -> str:
        """The pin of a link before it from which a link starts."""
        other = joint.other(link)
        pin = self.pin_on(other, joint.at(other))
        self._receive(joint, pin, link)
        return pin

    def _guide(self, joint: JointEntry, link: str) -> str:
        """The pin at which the force of a sliding joint counts: the point of `on`."""
        pin = self.pin_on(*joint.on)
        self._receive(joint, pin, link)
        return pin

    # the driver and the groups

    def _driver(self) -> Driver:
        entry, xp = self.structure.driver, self.xp
        joint, link = self.structure.joints[entry.joint], entry.link
        if not entry.linear:
            frame = LinkFrame(self.point(link, joint.at(link)), ALONG_X)
            zero = self.number(entry.zero)
            start = self._outer(joint, link)
            bar = self._bar(link, frame, start)
            end = next(iter(bar.points), start)
            return Crank(bar, end, Vec2(xp.cos(zero), xp.sin(zero)), entry.sense)
        sign = 1.0 if joint.on[0] == link else -1.0
        along = self._direction(joint, link) * sign
        frame = LinkFrame(self.point(link, joint.at(link)), along)
        rail = Rail(None, self.point(GROUND, joint.at(GROUND)), self._direction(joint, GROUND) * sign)
        bar = self._bar(link, frame)
        return Ram(bar, rail, self._guide(joint, link), self.pin_on(link, joint.at(link)))

    def _cylinder(self, group: AssurGroup) -> Driver:
        barrel, rod, lever = group.links
        slide = self.structure.joints[self.structure.driver.joint]
        p, c, q = (self.structure.joints[joint.name] for joint in group.joints)
        inner = self._inner(c, rod, lever)
        # from the barrel to the rod
        along = {link: self._direction(slide, link) for link in (barrel, rod)}
        if slide.on[0] == barrel:
            along = {link: -v for link, v in along.items()}
        frames = {
            link: LinkFrame(self.point(link, joint.at(link)), along[link])
            for link, joint in ((barrel, p), (rod, c))
        }
        (near, far) = (frame.of(self.point(link, slide.at(link))) for link, frame in frames.items())
        bars = self._bar(barrel, frames[barrel], self._outer(p, barrel)), self._bar(rod, frames[rod])
        swung = self._rod(lever, q, c)

        def turn() -> Any:
            start, end = self._rough(GROUND, p), self._rough(GROUND, q)
            return (end - start).cross(self._rough(lever, c) - start)

        return Cylinder(
            bars[0],
            inner,
            bars[1],
            swung,
            near.x - far.x,
            near.y - far.y,
            far.y,
            self._guide(slide, rod),
            self._side(barrel, turn),
        )

    def _group(self, group: AssurGroup) -> Group:
        joints = [self.structure.joints[j.name] for j in group.joints]
        if group.kind == "triad":
            return self._triad(group.links[0], group.links[1:], joints[:3], joints[3:])
        build: Callable[..., Group] = {
            "RRR": self._rrr, "RRP": self._rrp, "RPR": self._rpr, "PRP": self._prp, "RPP": self._rpp
        }[group.kind]  # fmt: skip
        return build(*group.links, *joints)

    def _rod(self, link: str, outer: JointEntry, inner: JointEntry) -> Bar:
        start = self._outer(outer, link)
        frame, length = self._between(link, outer.at(link), inner.at(link))
        return self._bar(link, frame, start, length)

    def _rrr(self, first: str, second: str, p: JointEntry, b: JointEntry, q: JointEntry) -> Group:
        inner = self._inner(b, first, second)
        bars = self._rod(first, p, b), self._rod(second, q, b)

        def turn() -> Any:
            start, end = self._rough(p.other(first), p), self._rough(q.other(second), q)
            return (end - start).cross(self._rough(second, b) - start)

        return Dyad(inner, *bars, self._side(first, turn))

    def _inner(self, joint: JointEntry, first: str, second: str) -> str:
        """The pin between two links, which the second one carries."""
        pin = self.pin(second, joint.at(second))
        self._carriers[pin] = second
        self._receive(joint, pin, first)
        return pin

    def _side(self, first: str, value: Callable[[], Any]) -> float:
        """The assembly mode of a dyad, from the sign of a value of the rough poses."""
        if not self._known_sides:
            rough = float(value())
            if abs(rough) < 1e-9:
                raise InputError(
                    f"the start pose does not tell how {first} is assembled: it stands in a dead position; give the "
                    "start at another place of the driver",
                    key="start",
                )
            self.sides[first] = math.copysign(1.0, rough)
        return self.sides[first]

    def _slider(self, link: str, rail: JointEntry, at: str) -> tuple[Bar, Rail, str]:
        """A block whose frame starts at the point `at` on its rail."""
        point = self.point(link, at)
        line = self._rail(rail, link, point)
        bar = self._bar(link, LinkFrame(point, self._direction(rail, link)))
        return bar, line, self._guide(rail, link)

    def _rrp(self, first: str, slider: str, p: JointEntry, c: JointEntry, g: JointEntry) -> Group:
        inner = self._inner(c, first, slider)
        rod = self._rod(first, p, c)
        bar, rail, guide = self._slider(slider, g, c.at(slider))

        def along() -> Any:
            return (self._rough(slider, c) - self._rough(p.other(first), p)).dot(self._rough_line(g))

        return RRP(inner, rod, bar, rail, guide, self._side(first, along))

    def _rpr(self, first: str, second: str, p: JointEntry, g: JointEntry, q: JointEntry) -> Group:
        frames = [
            LinkFrame(self.point(link, j.at(link)), self._direction(g, link))
            for link, j in ((first, p), (second, q))
        ]
        block, line = (
            frame.of(self.point(link, g.at(link)))
            for frame, link in zip(frames, (first, second), strict=True)
        )
        starts = self._outer(p, first), self._outer(q, second)
        bars = [
            self._bar(link, frame, start)
            for link, frame, start in zip((first, second), frames, starts, strict=True)
        ]

        def along() -> Any:
            arm = self._rough(p.other(first), p) - self._rough(q.other(second), q)
            return arm.dot(self._rough_line(g))

        offset = line.y - block.y
        return RPR(bars[0], bars[1], offset, self._guide(g, first), self._side(first, along))

    def _prp(self, first: str, second: str, g: JointEntry, c: JointEntry, h: JointEntry) -> Group:
        inner = self._inner(c, first, second)
        one, one_rail, one_guide = self._slider(first, g, c.at(first))
        other, other_rail, other_guide = self._slider(second, h, c.at(second))
        return PRP(inner, one, other, one_rail, other_rail, (one_guide, other_guide))

    def _rpp(self, block: str, yoke: str, p: JointEntry, s: JointEntry, g: JointEntry) -> Group:
        pin = self.point(block, p.at(block))
        start = self._outer(p, block)
        along = self._direction(g, yoke)
        origin = self._line_through(s, block, pin)
        rail = self._rail(g, yoke, origin)
        own = LinkFrame(origin, along)
        slot = own.of_vector(self._direction(s, yoke))
        in_block = self._across(s, along, yoke)
        bars = self._bar(block, LinkFrame(pin, in_block), start), self._bar(yoke, own)
        return RPP(*bars, rail, slot, (self._guide(s, block), self._guide(g, yoke)))

    def _triad(
        self, ternary: str, legs: Sequence[str], outer: Sequence[JointEntry], inner: Sequence[JointEntry]
    ) -> Group:
        # the ternary link carries the pins
        self._carriers |= {self.pin(ternary, j.at(ternary)): ternary for j in inner if j.kind == REVOLUTE}
        # before the legs: one that slides in it may do so at a point of it
        plate = self._bar(ternary, OWN)
        built = [self._leg(*each, ternary) for each in zip(legs, outer, inner, strict=True)]
        x, y, angle = self.structure.poses[ternary]
        mass = plate.mass or Mass(0.0, 0.0, 0.0, 0.0)
        first, second, third = built
        pose = Pose(x, y, angle)
        turns = self.sides.get(ternary, 0.0)
        return Triad(ternary, mass, (first, second, third), plate.points, pose, self.structure.start, turns)

    def _leg(self, link: str, outer: JointEntry, inner: JointEntry, ternary: str) -> Leg:
        pin = self.pin(ternary, inner.at(ternary))
        if inner.kind == REVOLUTE:
            arm = self.point(ternary, inner.at(ternary))
            self._receive(inner, pin, link)
            if outer.kind == REVOLUTE:
                return RodLeg(self._rod(link, outer, inner), pin, arm)
            bar, rail, guide = self._slider(link, outer, inner.at(link))
            return BlockLeg(bar, pin, arm, rail, guide)
        point = self.point(link, outer.at(link))
        start = self._outer(outer, link)
        at = self._line_through(inner, link, point)
        bar = self._bar(link, LinkFrame(point, self._direction(inner, link)), start)
        return SlotLeg(bar, at, self._direction(inner, ternary), self._guide(inner, link))

    # the assembly, by rough poses

    def _rough(self, link: str, joint: JointEntry) -> Vec2:
        """The rough place of a joint's point."""
        return self._rough_point(link, self.point(link, joint.at(link)))

    def _rough_point(self, link: str, point: Vec2) -> Vec2:
        x, y, angle = (0.0, 0.0, 0.0) if link == GROUND else self.structure.poses[link]
        return Vec2(x, y) + rotated(point, Vec2(math.cos(angle), math.sin(angle)))

    def _rough_line(self, joint: JointEntry) -> Vec2:
        link, start = joint.by
        ends = (self._rough_point(link, self.point(link, each)) for each in (start, joint.toward))
        a, b = ends
        return b - a
