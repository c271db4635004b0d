"""The start pose of a linkage from what a drawing shows: some points, some angles, and the driver.

Where two points of a link are known, or one point and its angle, its pose is known, and so are all its points, the
points that meet them in revolute joints, and the angles of links that slide on it. Rough values do: the pose only
says in which of its modes each group is assembled, and a start that does not tell it is refused. A point x, y is the
complex number x + y j [m].
"""

from __future__ import annotations

import math
from cmath import phase, rect
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from ...core.engines import MATH
from ...core.errors import InputError
from ...mechanism.assur import GROUND, PRISMATIC, REVOLUTE, AssurGroup
from ...mechanism.machine import Mechanism
from .geometry import TWO_WAYS
from .joint_kind import JointEntry
from .model import LinkageDescription
from .names import LinkPoint

_AS_FAR = 0.8
"""Share of its distance from the other way that a start may be away from the way that is taken."""
_SAME = 1e-6
"""Angle [rad] by which a link has the same angle in both ways."""


class StartPose:
    """Poses that follow from known points and angles.

    Parameters
    ----------
    points : of each link, the ground too, in its own frame [m]
    joints : all joints, with the values of their angles [rad]
    """

    def __init__(
        self, points: Mapping[str, Mapping[str, complex]], joints: Sequence[tuple[JointEntry, float]]
    ) -> None:
        self.points, self.joints = points, joints
        self.slides: list[tuple[JointEntry, float]] = []
        """the joints in which drivers slide, each with its way there [m]"""
        self.poses: dict[str, tuple[complex, float]] = {GROUND: (0j, 0.0)}
        """the origin of the frame of a link, and its angle [rad]"""
        self.places: dict[LinkPoint, complex] = {}
        self.angles: dict[str, float] = {GROUND: 0.0}

    def complete(self) -> dict[str, tuple[float, float, float]]:
        """The poses of all links: x, y [m] and angle [rad].

        Raises
        ------
        InputError
            for links that are not placed, in one line that says what to add.
        """
        while self._spread():
            pass
        lost = [link for link in self.points if link not in self.poses]
        if lost:
            more = [name for name in self.points[lost[0]] if (lost[0], name) not in self.places]
            wish = f"the angle of {lost[0]}" + (f", or a place of its point {more[0]}" if more else "")
            raise InputError(
                f"the start pose does not place the link{'s' * (len(lost) > 1)} {', '.join(lost)}: give {wish} in "
                "[start]; a rough value does"
            )
        return {
            link: (origin.real, origin.imag, angle)
            for link, (origin, angle) in self.poses.items()
            if link != GROUND
        }

    def _spread(self) -> bool:
        """One round of conclusions: from points and angles to the pose of a link, from a pose to all points of its
        link, and over the joints to other links. Returns whether it found anything new."""
        before = len(self.poses), len(self.places), len(self.angles)
        for link, points in self.points.items():
            if link not in self.poses:
                self._pose(link, points)
            if link in self.poses:
                origin, angle = self.poses[link]
                self.angles.setdefault(link, angle)
                for name, point in points.items():
                    self.places.setdefault((link, name), origin + rect(1.0, angle) * point)
        self._slid()
        for joint, turn in self.joints:
            (on, _), (by, _) = joint.on, joint.by
            if joint.kind == PRISMATIC:
                if by in self.angles:
                    self.angles.setdefault(on, self.angles[by] + turn)
                if on in self.angles:
                    self.angles.setdefault(by, self.angles[on] - turn)
            elif joint.kind == REVOLUTE:
                for one, other in ((joint.on, joint.by), (joint.by, joint.on)):
                    if one in self.places:
                        self.places.setdefault(other, self.places[one])
        return before != (len(self.poses), len(self.places), len(self.angles))

    def _slid(self) -> None:
        """The point of each joint in which a driver slides, from its way and either link; or the angle of its line,
        from both points."""
        for joint, way in self.slides:
            link, start = joint.by
            line = self.points[link][joint.toward] - self.points[link][start]
            if link not in self.angles and joint.on in self.places and joint.by in self.places:
                drawn = self.places[joint.on] - self.places[joint.by]
                self.angles[link] = math.remainder(phase(drawn) - phase(line), 2.0 * math.pi)
            if link not in self.angles:
                continue
            moved = rect(way, self.angles[link] + phase(line))
            if joint.by in self.places:
                self.places.setdefault(joint.on, self.places[joint.by] + moved)
            elif joint.on in self.places:
                self.places.setdefault(joint.by, self.places[joint.on] - moved)

    def _pose(self, link: str, points: Mapping[str, complex]) -> None:
        """The pose of a link from its angle and a point, or from two points, if these are known."""
        placed = [name for name in points if (link, name) in self.places]
        if not placed:
            return
        point, place = points[placed[0]], self.places[link, placed[0]]
        if link not in self.angles:
            # the pair of points that lie farthest apart tells the angle best
            far = max(placed, key=lambda name: abs(points[name] - point))
            arm, placed_arm = points[far] - point, self.places[link, far] - place
            if arm == 0.0 or placed_arm == 0.0:
                return
            self.angles[link] = math.remainder(phase(placed_arm) - phase(arm), 2.0 * math.pi)
        self.poses[link] = place - rect(1.0, self.angles[link]) * point, self.angles[link]


def check_start(described: LinkageDescription) -> None:
    """Refuse a start that lies nearly as far from one way of assembling a dyad as from the other, measured by the
    angles of its links.

    Raises
    ------
    InputError
        in one line, with both places of the pin, or both angles of the link, that the start may give.
    """
    structure = described.structure
    here = described.followed.at(structure.start)
    for group in structure.groups:
        if group.kind in TWO_WAYS:
            _check(described, group, [here, _other_way(described, group)])


def _other_way(described: LinkageDescription, group: AssurGroup) -> Mechanism:
    """The linkage at its start, up to a dyad, or a cylinder, that is assembled in the other way."""
    structure, linkage = described.structure, described.at_start
    # a cylinder that is the first driver is no group of the linkage
    count = structure.groups.index(group) + 1 - (len(structure.groups) - len(linkage.groups))
    part = linkage.before(count)
    if count == 0:
        part = replace(part, driver=_turned(part.driver))
    else:
        part = replace(part, groups=(*part.groups[:-1], _turned(part.groups[-1])))
    return Mechanism(MATH, part, structure.start, described.start_derived)


def _turned(dyad: Any) -> Any:
    """A dyad, or a cylinder, that is assembled in the other way."""
    return replace(dyad, side=-dyad.side)


def _check(described: LinkageDescription, group: AssurGroup, assembled: Sequence[Mechanism]) -> None:
    """Refuse a start that does not tell in which of both ways a dyad is assembled."""
    structure, linkage = described.structure, described.at_start
    joint = structure.joints[group.joints[1].name]
    angles = [[linkage.angle(link, m) for link in group.links] for m in assembled]
    pins = [m.pins.get(linkage.parts.pin(*joint.by)) for m in assembled]
    rough = [structure.poses[link][2] for link in group.links]
    near, far = (
        sum(
            abs(math.remainder(angle - start, 2.0 * math.pi))
            for angle, other, start in zip(pose, angles[k - 1], rough, strict=True)
            if abs(math.remainder(angle - other, 2.0 * math.pi)) > _SAME
        )
        for k, pose in enumerate(angles)
    )
    if near <= _AS_FAR * far:
        return
    number = group.links.index(joint.by[0]) if joint.by[0] in group.links else 0
    key = f"start.angles.{group.links[number]}"
    ways = [f'"{math.degrees(pose[number]):.4g} deg"' for pose in angles]
    if group.kind != "RPR" and None not in pins:
        key = f"start.points.{joint.by[1]}"
        ways = [f'["{1e3 * pin.p.x:.4g} mm", "{1e3 * pin.p.y:.4g} mm"]' for pin in pins if pin is not None]
    raise InputError(
        f"the start does not tell in which of two ways {' and '.join(group.links)} are assembled, as it lies nearly "
        f"as far from the one as from the other; give a value near to one of both: {' or '.join(ways)}",
        key,
    )
