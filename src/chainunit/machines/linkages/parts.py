"""From the description of a linkage to its Assur groups: bars with their frames, rails, and assembly modes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from ...core.planar import Vec2, rotated
from ...groups.body import Bar, Mass
from ...groups.driver import Course, Crank, Cylinder, Driver, Elbow, Ram
from ...groups.dyad import PRP, RPP, RPR, RRP, Dyad
from ...groups.followed import USUAL
from ...groups.group import Group
from ...groups.joints import GuideData, HingeData, Rail
from ...groups.legs import BlockLeg, Leg, RodLeg, SlotLeg
from ...groups.tetrad import Plate, SharedPlate, Tetrad
from ...groups.triad import Pose, Triad
from ...mechanism.assur import CYLINDER, DRIVER, ELBOW, GROUND, REVOLUTE, SHARED, TETRAD, TRIAD, AssurGroup
from .geometry import ALONG_X, OWN, LinkFrame, LinkGeometry
from .joint_kind import JointEntry
from .joint_kinds import SINGLES
from .structure import DriverEntry


class LinkageParts:
    """The groups of a linkage whose links have this `geometry`.

    `frames` has the frame of each link in its group; `receivers` the key of each joint's reaction in the groups (pin
    and link), with the sign that turns it into the force on the link that the description names first.
    """

    def __init__(
        self,
        geometry: LinkGeometry,
        sides: Mapping[str, Any],
        courses: Mapping[str, Callable[[Any, Any], Course]],
    ) -> None:
        """
        Parameters
        ----------
        sides : the assembly modes, of a triad or tetrad its `Tracking`, by the first link of each group
        courses : the courses of further drivers, by the joint of each
        """
        self.geometry, self.structure, self.sides = geometry, geometry.structure, sides
        self.frames: dict[str, LinkFrame] = {GROUND: OWN}
        self.receivers: dict[str, tuple[tuple[str, str], float]] = {}
        self._carriers = {self.pin(GROUND, name): GROUND for name in self.structure.ground}
        """by pin, the first link that has it: all others hang on this one there"""
        self._courses, first = courses, self.structure.driver
        groups = list(self.structure.groups)
        slide = self.structure.joints[first.joint]
        cylinder = groups.pop(0) if GROUND not in slide.links else None
        self.driver = self._driver(first, first.link) if cylinder is None else self._between(cylinder)
        self.groups: list[Group] = []
        for group in groups:
            self.groups.append(self._group(group))

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
        return {self.pin(GROUND, name): self.geometry.point(GROUND, name) for name in self.structure.ground}

    # bars

    def bar(self, link: str, frame: LinkFrame, start: str = "", length: Any = None) -> Bar:
        """The bar of a link in a frame, with a `length` [m] if it has two joints; it starts from the pin `start`. It
        carries the points that no link before it carries. A point that an earlier link carries is named anew, as
        ``link.point``, if a load or a joint asks for the one of this very link (`Structure.marked`), and else left
        out."""
        entry = self.structure.links[link]
        self.frames[link] = frame
        points = {}
        for name in entry.points:
            pin = self.pin(link, name)
            if pin in self._carriers:
                if self._carriers[pin] == link or (link, name) not in self.structure.marked:
                    continue
                pin = f"{link}.{name}"
            place = frame.coordinates(self.geometry.point(link, name))
            points[pin], self._carriers[pin] = (place.x, place.y), link
        return Bar(link, start, length, self.geometry.mass(entry, frame), points)

    def hung(self, link: str, joint: JointEntry, along: Vec2 = ALONG_X) -> Bar:
        """The bar of a link that starts from the pin of a joint with a link before it, in the direction `along`."""
        frame = LinkFrame(self.geometry.point(link, joint.at(link)), along)
        return self.bar(link, frame, self.outer(joint, link))

    # joints

    def _rail(self, joint: JointEntry, link: str, point: Vec2) -> Rail:
        """The line along which a `point` of the link moves in a link before it."""
        carrier = joint.other_link(link)
        frame = self.frames[carrier]
        place = frame.coordinates(self.geometry.line_through(joint, link, point))
        along = frame.components(self.geometry.direction(joint, carrier))
        return Rail(None if carrier == GROUND else carrier, place, along)

    def receive(self, joint: JointEntry, pin: str, link: str) -> None:
        """The reaction of a joint acts in the groups at that pin on that link."""
        self.receivers[joint.name] = (pin, link), 1.0 if joint.on[0] == link else -1.0

    def outer(self, joint: JointEntry, link: str) -> str:
        """The pin of a link before it from which a link starts."""
        other = joint.other_link(link)
        pin = self.pin_on(other, joint.at(other))
        self.receive(joint, pin, link)
        return pin

    def _guide(self, joint: JointEntry, link: str) -> str:
        """The pin at which the force of a sliding joint counts: the point of `on`."""
        pin = self.pin_on(*joint.on)
        self.receive(joint, pin, link)
        return pin

    # the driver and the groups

    def _driver(self, entry: DriverEntry, link: str) -> Driver:
        """The driver of a link: a crank about its pin, or a ram on its line in the ground."""
        geometry, course = self.geometry, self._courses.get(entry.joint)
        joint = self.structure.joints[entry.joint]
        if not entry.linear:
            bar, on = self.hung(link, joint), joint.other_link(link)
            end = next(iter(bar.points), bar.pin)
            start, sense = self._turn(entry, link, on, self.frames[link])
            return Crank(bar, end, start, sense, course, None if on == GROUND else on)
        sign = 1.0 if joint.on[0] == link else -1.0
        along = geometry.direction(joint, link) * sign
        frame = LinkFrame(geometry.point(link, joint.at(link)), along)
        rail = Rail(None, geometry.point(GROUND, joint.at(GROUND)), geometry.direction(joint, GROUND) * sign)
        bar = self.bar(link, frame)
        return Ram(bar, rail, self._guide(joint, link), self.pin_on(link, joint.at(link)), course)

    def _turn(self, entry: DriverEntry, link: str, on: str, frame: LinkFrame) -> tuple[Vec2, float]:
        """The direction of a link's frame in that of the link that it turns on, at the place 0 of the driver, and its
        sense."""
        zero, sense = self.geometry.number(entry.zero), 1.0 if link == entry.link else -1.0
        start = Vec2(self.geometry.xp.cos(zero), self.geometry.xp.sin(zero) * sense)
        return self.frames[on].components(rotated(frame.axis, start)), sense * entry.sense

    def _between(self, group: AssurGroup) -> Driver:
        """The driver of two links that it moves against each other, which turn a lever: a cylinder or two arms."""
        p, c, q, drive = (self.structure.joints[joint.name] for joint in group.joints)
        near, far, lever = group.links
        if group.kind == CYLINDER:
            return self._cylinder(group.links, p, c, q, drive)
        inner, joint = self._inner(c, far, lever), self._inner(drive, far, near)
        bar, swung = self._rod(near, p, drive), self._rod(lever, q, c)
        frame, length = self.geometry.span(far, drive.at(far), c.at(far))
        arm = self.bar(far, frame, joint, length)
        entry = next(entry for entry in self.structure.drivers if entry.joint == drive.name)
        turn, course = self._turn(entry, far, near, frame), self._courses.get(drive.name)
        return Elbow(bar, joint, arm, inner, swung, *turn, self.sides[near], course)

    def _cylinder(
        self, links: Sequence[str], p: JointEntry, c: JointEntry, q: JointEntry, slide: JointEntry
    ) -> Driver:
        """A cylinder: its barrel, the rod that slides in it, and the lever that it turns."""
        barrel, rod, lever = links
        geometry, inner = self.geometry, self._inner(c, rod, lever)
        # from the barrel to the rod
        in_barrel, in_rod = (
            -line if slide.on[0] == barrel else line
            for line in (geometry.direction(slide, barrel), geometry.direction(slide, rod))
        )
        barrel_bar = self.hung(barrel, p, in_barrel)
        rod_bar = self.bar(rod, LinkFrame(geometry.point(rod, c.at(rod)), in_rod))
        near, far = (
            self.frames[link].coordinates(geometry.point(link, slide.at(link))) for link in (barrel, rod)
        )
        swung, shift = self._rod(lever, q, c), near - far
        guide, side = self._guide(slide, rod), self.sides[barrel]
        course = self._courses.get(slide.name)
        return Cylinder(barrel_bar, inner, rod_bar, swung, shift.x, shift.y, far.y, guide, side, course)

    # joints by their letters: p and q join a link with those before, b and c are the pin between two links, g and h
    # are guides on links before, s is the slot between two links

    def _group(self, group: AssurGroup) -> Group:
        """The group of that kind with the numbers of its links."""
        joints = [self.structure.joints[j.name] for j in group.joints]
        if group.kind == DRIVER:
            entry = next(entry for entry in self.structure.further if entry.joint == joints[0].name)
            return self._driver(entry, group.links[0])
        if group.kind in (CYLINDER, ELBOW):
            return self._between(group)
        if group.kind == TRIAD:
            return self._triad(group.links[0], group.links[1:], joints[:3], joints[3:])
        if group.kind == TETRAD:
            return self._tetrad(group.links, joints)
        if group.kind == SHARED:
            return self._shared(group.links[0], group.links[1:], joints)
        if group.kind in SINGLES:
            return SINGLES[group.kind].group(self, group.links[0], *joints)
        build: Callable[..., Group] = {
            "RRR": self._rrr, "RRP": self._rrp, "RPR": self._rpr, "PRP": self._prp, "RPP": self._rpp
        }[group.kind]  # fmt: skip
        return build(*group.links, *joints)

    def _rod(self, link: str, outer: JointEntry, inner: JointEntry) -> Bar:
        start = self.outer(outer, link)
        frame, length = self.geometry.span(link, outer.at(link), inner.at(link))
        return self.bar(link, frame, start, length)

    def _rrr(self, first: str, second: str, p: JointEntry, b: JointEntry, q: JointEntry) -> Group:
        inner = self._inner(b, first, second)
        return Dyad(inner, self._rod(first, p, b), self._rod(second, q, b), self.sides[first])

    def _inner(self, joint: JointEntry, first: str, second: str) -> str:
        """The pin between two links, which the second one carries."""
        pin = self.pin(second, joint.at(second))
        self._carriers[pin] = second
        self.receive(joint, pin, first)
        return pin

    def slider(self, link: str, rail: JointEntry, start: str) -> tuple[Bar, Rail, str]:
        """A block whose frame starts at the point `start` on its rail."""
        point = self.geometry.point(link, start)
        line = self._rail(rail, link, point)
        bar = self.bar(link, LinkFrame(point, self.geometry.direction(rail, link)))
        return bar, line, self._guide(rail, link)

    def _rrp(self, first: str, slider: str, p: JointEntry, c: JointEntry, g: JointEntry) -> Group:
        inner = self._inner(c, first, slider)
        rod = self._rod(first, p, c)
        return RRP(inner, rod, *self.slider(slider, g, c.at(slider)), self.sides[first])

    def _rpr(self, first: str, second: str, p: JointEntry, g: JointEntry, q: JointEntry) -> Group:
        """The first link on its pin with a block, which slides on a line of the second link on its own pin."""
        geometry = self.geometry
        one = self.hung(first, p, geometry.direction(g, first))
        other = self.hung(second, q, geometry.direction(g, second))
        block, line = (
            self.frames[link].coordinates(geometry.point(link, g.at(link))) for link in (first, second)
        )
        return RPR(one, other, line.y - block.y, self._guide(g, first), self.sides[first])

    def _prp(self, first: str, second: str, g: JointEntry, c: JointEntry, h: JointEntry) -> Group:
        inner = self._inner(c, first, second)
        one, one_rail, one_guide = self.slider(first, g, c.at(first))
        other, other_rail, other_guide = self.slider(second, h, c.at(second))
        return PRP(inner, one, other, one_rail, other_rail, (one_guide, other_guide))

    def _rpp(self, block: str, yoke: str, p: JointEntry, s: JointEntry, g: JointEntry) -> Group:
        """A block on its pin, in the slot of a yoke that slides on a line in a link before."""
        geometry = self.geometry
        along = geometry.direction(g, yoke)
        origin = geometry.line_through(s, block, geometry.point(block, p.at(block)))
        rail = self._rail(g, yoke, origin)
        one = self.hung(block, p, geometry.across(s, along, yoke))
        other = self.bar(yoke, LinkFrame(origin, along))
        slot = self.frames[yoke].components(geometry.direction(s, yoke))
        return RPP(one, other, rail, slot, (self._guide(s, block), self._guide(g, yoke)))

    def _triad(
        self, ternary: str, legs: Sequence[str], outer: Sequence[JointEntry], inner: Sequence[JointEntry]
    ) -> Group:
        """The ternary link on its three legs; it carries the pins between."""
        # the ternary link carries the pins
        self._carriers |= {self.pin(ternary, j.at(ternary)): ternary for j in inner if j.kind == REVOLUTE}
        # before the legs: one that slides in it may do so at a point of it
        plate = self.bar(ternary, OWN)
        built = [self._leg(*ends, ternary) for ends in zip(legs, outer, inner, strict=True)]
        first, second, third = built
        mass, pose = plate.mass or Mass(0.0, 0.0, 0.0, 0.0), Pose(*self.structure.poses[ternary])
        return Triad(ternary, mass, (first, second, third), plate.points, pose, **self._course_of(ternary))

    def _course_of(self, name: str) -> dict[str, Any]:
        """How a group that is followed is tracked, and over which way."""
        tracking = self.sides.get(name, USUAL)
        return {"start": self.structure.start, "tracking": tracking, "span": self.structure.span}

    def _shared(self, name: str, links: Sequence[str], joints: Sequence[JointEntry]) -> Group:
        """A plate on legs that share its force, and the joint that holds it besides, if one does."""
        count = len(links)
        outer, inner = joints[-2 * count : -count], joints[-count:]
        held, x = None, [*self.structure.poses[name]]
        if len(joints) > 2 * count:
            held, *x = self._plate(name, joints[0], inner)
        else:
            self._carriers |= {self.pin(name, j.at(name)): name for j in inner if j.kind == REVOLUTE}
        bar = held.bar if held else self.bar(name, OWN)
        legs = [self._leg(*ends, name) for ends in zip(links, outer, inner, strict=True)]
        stiffness = [self.geometry.number(self.structure.links[link].stiffness) for link in links]
        return SharedPlate(name, held, bar, legs, stiffness, x, **self._course_of(name))

    def _tetrad(self, links: Sequence[str], joints: Sequence[JointEntry]) -> Group:
        """Two links, each on its outer joint, with two legs between them; they carry the pins of the legs."""
        first, x1 = self._plate(links[0], joints[0], joints[2:4])
        second, x2 = self._plate(links[1], joints[1], joints[4:])
        one, other = (self._leg(links[k], joints[k], joints[k + 2], links[1]) for k in (2, 3))
        return Tetrad(links[0], (first, second), (one, other), (x1, x2), **self._course_of(links[0]))

    def _plate(self, link: str, outer: JointEntry, inner: Sequence[JointEntry]) -> tuple[Plate, Any]:
        """A plate of a tetrad, by its `outer` joint and those with the legs, and its rough coordinate."""
        geometry, pins = self.geometry, [joint for joint in inner if joint.kind == REVOLUTE]
        self._carriers |= {self.pin(link, joint.at(link)): link for joint in pins}
        held: HingeData | GuideData
        if outer.kind == REVOLUTE:
            bar, x = self.hung(link, outer), self.structure.poses[link][2]
            held = HingeData(bar.pin, link)
        else:
            (bar, rail, guide), x = self.slider(link, outer, outer.at(link)), geometry.rough_way(outer, link)
            held = GuideData(guide, link, rail)
        arms = ((self.pin(link, j.at(link)), geometry.point(link, j.at(link))) for j in pins)
        return Plate(bar, held, {pin: self.frames[link].coordinates(arm) for pin, arm in arms}), x

    def _leg(self, link: str, outer: JointEntry, inner: JointEntry, ternary: str) -> Leg:
        """A leg by its joints: a rod between two pins, a block on a line before it, or a slot in the plate at its
        end, the ternary link of a triad."""
        pin, frame = self.pin(ternary, inner.at(ternary)), self.frames[ternary]
        if inner.kind == REVOLUTE:
            arm = frame.coordinates(self.geometry.point(ternary, inner.at(ternary)))
            self.receive(inner, pin, link)
            if outer.kind == REVOLUTE:
                return RodLeg(self._rod(link, outer, inner), pin, arm)
            bar, rail, guide = self.slider(link, outer, inner.at(link))
            return BlockLeg(bar, pin, arm, rail, guide)
        place = self.geometry.line_through(inner, link, self.geometry.point(link, outer.at(link)))
        bar = self.hung(link, outer, self.geometry.direction(inner, link))
        along = frame.components(self.geometry.direction(inner, ternary))
        return SlotLeg(bar, frame.coordinates(place), along, self._guide(inner, link))
