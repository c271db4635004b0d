"""The links of a description with values: their points, masses and lines, in the frames of the description and of a
group.

A description places the points of a link in the link's own frame. A group has frames of its own for its links
(`chainunit.groups`): a `LinkFrame` is the place of such a frame in that of the description.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from ...core.errors import GeometryError, InputError
from ...core.planar import ZERO, Vec2, mirrored, rotated
from ...groups.body import Mass
from ...mechanism.assur import CYLINDER, ELBOW, GROUND
from ...mechanism.expressions import value_of
from .joint_kind import Entry, JointEntry
from .joint_kinds import SINGLES
from .structure import LinkEntry, Structure

ALONG_X = Vec2(1.0, 0.0)
TWO_WAYS = ("RRR", "RRP", "RPR", CYLINDER, ELBOW)
"""Kinds of groups that can be assembled in two ways."""


class LinkFrame(NamedTuple):
    """A frame of a group's link in that of the description: its origin [m] and its x axis, a unit vector."""

    origin: Vec2
    axis: Vec2

    def coordinates(self, point: Vec2) -> Vec2:
        """The coordinates of a point in this frame [m]."""
        return self.components(point - self.origin)

    def components(self, v: Vec2) -> Vec2:
        """The components of a vector in this frame."""
        return Vec2(self.axis.dot(v), self.axis.cross(v))

    def x_axis(self, u: Vec2) -> Vec2:
        """The x axis of the description, from the direction `u` of this frame."""
        e = self.axis
        return Vec2(u.x * e.x + u.y * e.y, u.y * e.x - u.x * e.y)


OWN = LinkFrame(ZERO, ALONG_X)


class LinkGeometry:
    """The links of a `structure` with values: `xp` is the engine, `values` are the quantities by name."""

    def __init__(self, xp: Any, structure: Structure, values: dict[str, Any]) -> None:
        self.xp, self.structure, self.values = xp, structure, values
        self._points: dict[str, dict[str, Vec2]] = {}

    def number(self, entry: Entry) -> Any:
        """The value of an entry."""
        return value_of(self.xp, entry, self.values)

    def vector(self, entries: Sequence[Entry]) -> Vec2:
        """The value of a point."""
        return Vec2(self.number(entries[0]), self.number(entries[1]))

    def point(self, link: str, point: str) -> Vec2:
        """A point of a link in the frame of the description [m]."""
        placed = self._points.setdefault(link, {})
        if point not in placed:
            entries = self.structure.ground if link == GROUND else self.structure.links[link].points
            placed[point] = self.vector(entries[point])
        return placed[point]

    def mass(self, entry: LinkEntry, frame: LinkFrame) -> Mass | None:
        """The body of a link: further masses are parts of it."""
        if not entry.heavy:
            return None
        m, c = self.number(entry.mass), self.vector(entry.centroid)
        inertia = self.number(entry.inertia)
        for point, added in entry.masses.items():
            mass, place = self.number(added), self.point(entry.name, point)
            total = m + mass
            # a link that is massless as yet has its centroid where the mass is
            share = mass / (total + 1e-300)
            inertia = inertia + m * share * (place - c).squared()
            m, c = total, c + (place - c) * share
        place = frame.coordinates(c)
        return Mass(m, place.x, inertia, place.y)

    def span(self, link: str, start: str, end: str) -> tuple[LinkFrame, Any]:
        """The frame of a link from one of its points to another, and their distance.

        Raises
        ------
        GeometryError
            if a parameter brings both points to one place.
        """
        a, b = self.point(link, start), self.point(link, end)
        length = self.xp.sqrt((b - a).squared())
        if isinstance(length, float) and length == 0.0:
            raise GeometryError(f"{link}: its points {start} and {end} are in one place; must be apart")
        return LinkFrame(a, (b - a) * (1.0 / length)), length

    def across(self, joint: JointEntry, v: Vec2, link: str) -> Vec2:
        """A vector of a link's frame in that of the link on the other side of the prismatic joint."""
        angle = self.number(joint.angle)
        turn = Vec2(self.xp.cos(angle), self.xp.sin(angle))
        return rotated(v, turn if joint.on[0] == link else mirrored(turn))

    def direction(self, joint: JointEntry, link: str) -> Vec2:
        """The direction of a prismatic joint's line in the frame of one of its links, a unit vector."""
        by, start = joint.by
        line = self.span(by, start, joint.toward)[0].axis
        return line if by == link else self.across(joint, line, by)

    def line_through(self, joint: JointEntry, link: str, point: Vec2) -> Vec2:
        """The place, in the link on the other side, of a point through which the line of a `point` of the link
        goes."""
        joint_point, other = self.point(link, joint.at(link)), joint.other_link(link)
        return self.point(other, joint.at(other)) + self.across(joint, point - joint_point, link)

    def rough_place(self, link: str, point: str) -> Vec2:
        """A point of a link in the rough pose of the start [m]."""
        x, y, angle = self.structure.poses.get(link, (0.0, 0.0, 0.0))
        turned = rotated(self.point(link, point), Vec2(math.cos(angle), math.sin(angle)))
        return Vec2(x, y) + turned

    def rough_line(self, joint: JointEntry) -> Vec2:
        """The line of a prismatic joint in the rough pose of the start [m]."""
        link, start = joint.by
        return self.rough_place(link, joint.toward) - self.rough_place(link, start)

    def rough_way(self, joint: JointEntry, link: str) -> Any:
        """The way of a link along the line in the link on the other side, in the rough pose of the start [m]."""
        other, place, line = joint.other_link(link), self.rough_place, self.rough_line(joint)
        way = place(link, joint.at(link)) - place(other, joint.at(other))
        return way.dot(line) / self.xp.sqrt(line.squared())


def start_sides(geometry: LinkGeometry) -> dict[str, float]:
    """The assembly mode of each dyad that has two, by its first link, and what the start tells of single links, from
    the rough poses of the structure; the `geometry` has numbers.

    Raises
    ------
    InputError
        if a dyad starts in a dead position, or a single link has no length.
    """
    structure, place, line = geometry.structure, geometry.rough_place, geometry.rough_line
    sides: dict[str, float] = {}
    for group in structure.groups:
        if group.kind in SINGLES:
            seat, joint = (structure.joints[joint.name] for joint in group.joints)
            sides |= SINGLES[group.kind].start(seat, joint, geometry)
        if group.kind not in TWO_WAYS:
            continue
        first, last = group.links[0], group.links[-1]
        outer, inner, other = (structure.joints[joint.name] for joint in group.joints[:3])
        start = place(outer.other_link(first), outer.at(outer.other_link(first)))
        if group.kind == "RRP":
            value = (place(last, inner.at(last)) - start).dot(line(other))
        else:
            end = place(other.other_link(last), other.at(other.other_link(last)))
            if group.kind == "RPR":
                value = (start - end).dot(line(inner))
            else:
                value = (end - start).cross(place(last, inner.at(last)) - start)
        if abs(value) < 1e-9:
            raise InputError(
                f"the start pose does not tell how {first} is assembled: it stands in a dead position; give the "
                "start at another place of the driver",
                key="start",
            )
        sides[first] = math.copysign(1.0, value)
    return sides
