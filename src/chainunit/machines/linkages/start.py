"""The start pose of a linkage from what a drawing shows: some points, some angles, and the driver.

Where two points of a link are known, or one point and its angle, its pose is known, and so are all its points, the
points that meet them in revolute joints, and the angles of links that slide on it. Rough values do: the pose only
says in which of its modes each group is assembled.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from ...core.errors import InputError
from ...mechanism.assur import GROUND, PRISMATIC, REVOLUTE
from .joint_kind import JointEntry

Point = tuple[float, ...]
"""A place: x, y [m]."""
Pose = tuple[float, ...]
"""x, y [m] and the angle [rad] of a frame."""


class StartPose:
    """Poses that follow from known points and angles.

    Parameters
    ----------
    points : of each link, the ground too, in its own frame [m]
    joints : all joints, with the values of their angles [rad]
    """

    def __init__(
        self, points: Mapping[str, Mapping[str, Point]], joints: Sequence[tuple[JointEntry, float]]
    ) -> None:
        self.points, self.joints = points, joints
        self.slide: tuple[JointEntry, float] | None = None
        self.poses: dict[str, Pose] = {GROUND: (0.0, 0.0, 0.0)}
        self.places: dict[tuple[str, str], Point] = {}
        self.angles: dict[str, float] = {GROUND: 0.0}

    def complete(self) -> dict[str, Pose]:
        """The poses of all links.

        Raises
        ------
        InputError
            for links that are not placed, in one line that says what to add.
        """
        while self._spread():
            pass
        lost = [link for link in self.points if link not in self.poses]
        if lost:
            link = lost[0]
            placed = [name for name in self.points[link] if (link, name) in self.places]
            more = [name for name in self.points[link] if name not in placed]
            wish = (
                f"the angle of {link}, or a place of its point {more[0]}" if more else f"the angle of {link}"
            )
            raise InputError(
                f"the start pose does not place the link{'s' * (len(lost) > 1)} {', '.join(lost)}: give {wish} in "
                "[start]; a rough value does"
            )
        return {link: pose for link, pose in self.poses.items() if link != GROUND}

    def _spread(self) -> bool:
        """Whether a round found anything new."""
        before = len(self.poses), len(self.places), len(self.angles)
        for link, points in self.points.items():
            if link not in self.poses:
                self._pose(link, points)
            if link in self.poses:
                x, y, angle = self.poses[link]
                self.angles.setdefault(link, angle)
                c, s = math.cos(angle), math.sin(angle)
                for name, (px, py) in points.items():
                    self.places.setdefault((link, name), (x + c * px - s * py, y + s * px + c * py))
        self._slid()
        for joint, turn in self.joints:
            (on, by), pair = (joint.on, joint.by), (joint.on[0], joint.by[0])
            if joint.kind == PRISMATIC:
                if pair[1] in self.angles:
                    self.angles.setdefault(pair[0], self.angles[pair[1]] + turn)
                if pair[0] in self.angles:
                    self.angles.setdefault(pair[1], self.angles[pair[0]] - turn)
            elif joint.kind == REVOLUTE:
                for one, other in ((on, by), (by, on)):
                    if one in self.places:
                        self.places.setdefault(other, self.places[one])
        return before != (len(self.poses), len(self.places), len(self.angles))

    def _slid(self) -> None:
        """The point of the joint in which the driver slides, from its way and either link."""
        if self.slide is None:
            return
        joint, way = self.slide
        (on, on_point), (by, by_point) = joint.on, joint.by
        if by not in self.angles:
            return
        (ax, ay), (bx, by_y) = self.points[by][by_point], self.points[by][joint.toward]
        angle = self.angles[by] + math.atan2(by_y - ay, bx - ax)
        dx, dy = way * math.cos(angle), way * math.sin(angle)
        if (by, by_point) in self.places:
            x, y = self.places[by, by_point]
            self.places.setdefault((on, on_point), (x + dx, y + dy))
        elif (on, on_point) in self.places:
            x, y = self.places[on, on_point]
            self.places.setdefault((by, by_point), (x - dx, y - dy))

    def _pose(self, link: str, points: Mapping[str, Point]) -> None:
        placed = [name for name in points if (link, name) in self.places]
        if not placed:
            return
        first = placed[0]
        (px, py), (x, y) = points[first], self.places[link, first]
        if link not in self.angles:
            # the pair of points that lie farthest apart tells the angle best
            far = max(placed, key=lambda name: math.dist(points[name], points[first]))
            (qx, qy), (u, v) = points[far], self.places[link, far]
            if math.dist((px, py), (qx, qy)) == 0.0 or math.dist((x, y), (u, v)) == 0.0:
                return
            turn = math.atan2(v - y, u - x) - math.atan2(qy - py, qx - px)
            self.angles[link] = math.remainder(turn, 2.0 * math.pi)
        c, s = math.cos(self.angles[link]), math.sin(self.angles[link])
        self.poses[link] = x - c * px + s * py, y - s * px - c * py, self.angles[link]
