"""The common form of all groups: an Assur group as data, and the same group solved at one position.

A kind of group says which bars and joints it has, and where its links are at a position. Its motion, its reactions
and its margin follow from the rows of its joints.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import zip_longest
from typing import Any, ClassVar, NamedTuple

from ..core.planar import ZERO, Link, Motion, Vec2
from .block import GroupMatrix, Row
from .body import Bar, Load
from .joints import SLIDES, UNKNOWNS, HingeData, Joint, JointData, LinkageInMotion, Placed, Rail, Seat, Third


class SolvedGroup:
    """A group at one position: its `links` in the order of the group's bars, the `pins` that it adds, the `margin`,
    which is 0 in a dead position, and the `slides` in its sliding joints, in the order of the group's `guides`."""

    __slots__ = ("_joints", "_matrix", "_rates", "_seats", "course", "links", "margin", "pins", "slides")

    def __init__(
        self,
        poses: Sequence[tuple[Vec2 | Motion, Vec2]],
        joints: Sequence[Placed],
        margin: Any = None,
        size: Any = 1.0,
        ends: Sequence[Seat] = (),
        course: Sequence[Any] | None = None,
    ) -> None:
        """
        Parameters
        ----------
        poses : start and unit vector of each link; a start on a pin before the group as its motion
        margin : margin, None for the determinant of the joints over the `size`
        ends : pins that the group adds besides those between its links
        course : of a driver, the derivatives of its place by q
        """
        self._joints, self.course = joints, course
        rows: list[Row] = []
        stiffness = {}
        for joint in joints:
            rows += joint.rows()
            if joint.stiffness is not None:
                stiffness[len(rows) - 1] = joint.stiffness
        matrix = self._matrix = GroupMatrix(UNKNOWNS * len(poses), rows, stiffness)
        self._rates: list[list[Any]] = []
        for _ in range(2):
            self._rates.append(self._next_rates())
        first, second = ([_rate(z, k) for k in range(len(poses))] for z in self._rates)
        self.links = tuple(
            Link(start if isinstance(start, Motion) else Motion(start, p1, p2), u, t1, t2)
            for (start, u), (p1, t1), (p2, t2) in zip(poses, first, second, strict=True)
        )
        self.margin = matrix.det / size if margin is None else margin
        self.slides = tuple(slide for joint in joints if (slide := joint.slide(self._rates)))
        self._seats = [*(seat for joint in joints if (seat := joint.seat)), *ends]
        self.pins = tuple(
            self.links[k].pin if arm is ZERO else self.links[k].carried(arm) for k, arm in self._seats
        )

    def _next_rates(self, before: Sequence[Third | None] = ()) -> list[Any]:
        """The unknowns of the next order."""
        joints = zip_longest(self._joints, before)
        return self._matrix.solve([b for joint, third in joints for b in joint.right(self._rates, third)])

    def third_derivatives(self, before: Sequence[Third | None]) -> tuple[Sequence[Third], Sequence[Vec2]]:
        """Third derivatives by q of each link and of each pin that the group adds; `before` has the third
        derivatives of the pins and lines before the group, by joint."""
        z = self._next_rates(before)
        thirds = [_rate(z, k) for k in range(len(self.links))]
        return thirds, [self.links[k].third_derivative(arm, *thirds[k]) for k, arm in self._seats]

    def reactions(self, loads: Sequence[Load]) -> tuple[list[Vec2], Any]:
        """Forces in the group's joints, in their order [N], from the load of each link; that of a sliding joint is a
        `GuideForce`. Of a driver also the torque, or the force, along q that holds against the loads [N m, N]."""
        right = [x for force, moment in loads for x in (-force.x, -force.y, -moment, 0.0)]
        multipliers = iter(self._matrix.solve_transposed(right))
        forces, efforts = zip(*(joint.force(multipliers) for joint in self._joints), strict=True)
        effort = next((effort for effort in efforts if effort is not None), None)
        return [force for force in forces if force is not None], effort


def _rate(z: Sequence[Any], link: int) -> Third:
    """The derivatives of the start and of the angle of a link among unknowns."""
    x, y, turn, _ = z[UNKNOWNS * link : UNKNOWNS * (link + 1)]
    return Vec2(x, y), turn


class Outline(NamedTuple):
    """A closed curve that a picture shows: its `points` [m], if lengths are numbers, count from a pin, in the
    direction of a `frame`."""

    pin: str
    frame: Rail
    points: Callable[[], Vec2]


class Group:
    """A group as data."""

    shares: ClassVar[bool] = False
    """Whether legs of it share a force by their stiffness."""

    @property
    def derived_count(self) -> int:
        """The number of values that `derive` computes from the lengths, once before a run."""
        return 0

    @property
    def bars(self) -> tuple[Bar, ...]:
        """Its links. A bar with a `pin` starts from this pin of the linkage before the group."""
        return tuple(value for value in vars(self).values() if isinstance(value, Bar))

    @property
    def joints(self) -> tuple[JointData, ...]:
        """Its joints, in the order of `SolvedGroup.reactions`."""
        raise NotImplementedError

    @property
    def pins(self) -> Mapping[str, str]:
        """The pins that the group adds, each with the link on which further groups at this pin hang."""
        return {j.pin: j.by for j in self.joints if isinstance(j, HingeData) and j.by is not None}

    @property
    def guides(self) -> Mapping[Joint, str | None]:
        """Its sliding joints, each with the link on which the opposite reaction acts, None for the ground."""
        return {(joint.pin, joint.link): joint.carrier({}) for joint in self.joints if joint.form == SLIDES}

    @property
    def circles(self) -> tuple[tuple[str, str], ...]:
        """The circles that a picture of it shows, each by the pins at its centre and on its rim; one with the same
        pin twice is a motor."""
        return ()

    @property
    def outlines(self) -> Mapping[str, Outline]:
        """The curves that a picture of it shows, by name."""
        return {}

    def derive(self, xp: Any, before: Callable[[float], LinkageInMotion]) -> list[Any]:
        """Numbers that follow from its lengths; `before` gives the linkage before the group at a crank angle
        [rad]."""
        return []

    def solve(self, xp: Any, q: Any, linkage: LinkageInMotion, derived: Sequence[Any]) -> SolvedGroup:
        """The group at the coordinate `q` of the driver [rad, m]; `linkage` has the links before the group there."""
        raise NotImplementedError
