"""A group without a closed form: its coordinates are followed once around the turn of the crank.

Plates stand on legs (`chainunit.groups.legs`): the places of the plates are the coordinates of the group, and each
leg gives an equation. Newton's method solves as many equations as there are coordinates; these rows are what is left
of the matrix of the group after the legs are eliminated, and where their determinant vanishes is a dead position.

In a linkage with one crank the coordinates are smooth periodic functions of the crank angle. `FollowedGroup.derive`
follows them once around, from the mode to which `assembly` leads at the crank angle `start`, and keeps them as a
Fourier series. At any angle the series gives coordinates that are nearly right, and Newton's method makes them exact.
So they depend on the crank angle alone, independent of the step and the history. The branch cannot jump; a branch
that ends within the turn has a misfit. A group that comes near to a dead position moves sharply there: it is followed
in smaller steps, and Newton's method takes more of its own.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from itertools import pairwise, repeat
from typing import Any, ClassVar, NamedTuple

from ..core.engines import MATH
from ..core.planar import Motion, Vec2
from .block import minus_cofactors
from .group import Group, SolvedGroup
from .joints import LinkageInMotion, Placed
from .legs import Leg, LegAt
from .series import series_of, values_of

SAMPLES = 20
"""Number of crank angles at which a group is followed once around."""
HARMONICS = 8
"""Number of harmonics in the series of a coordinate."""
MOST_MISFIT = 1e-10
"""Largest misfit of a leg that counts as closed, in parts of its length."""
STEPS = 3
"""Steps of Newton's method from the series: three remove an error of 1e-3, as of a pose that moves sharply."""
MOST_STEPS = 6
"""Most steps of Newton's method from the series of a group that moves sharply."""
MOST_PARTS = 32
"""Most parts into which the way between two samples of such a group is divided."""
_CLOSE_LOOK = 720
"""Number of crank angles at which the misfit of such a group is looked over."""
_SAME = 1e-6
"""Difference of coordinates up to which two courses are on the same branch."""
TERMS = 2 * HARMONICS + 1
"""Number of values in such a series; a group derives two more, the largest misfit and the least margin."""


def corrected(
    legs_at: Callable[[Sequence[Any]], Sequence[LegAt]], near: Sequence[Any], steps: int
) -> tuple[Any, ...]:
    """The coordinates after `steps` of Newton's method from `near`; `legs_at` gives the legs by the coordinates. If
    these are nearly right, each step doubles the number of right digits. It also doubles the order up to which their
    derivatives are right."""
    x = (*near,)
    for _ in range(steps):
        legs = legs_at(x)
        minus, det = minus_cofactors([leg.row for leg in legs])
        minus_per = -1.0 / det
        moved = (sum(leg.gap * row[k] for leg, row in zip(legs, minus, strict=True)) for k in range(len(x)))
        x = tuple(place + dx * minus_per for place, dx in zip(x, moved, strict=True))
    return x


class Tracking(NamedTuple):
    """How a group is followed: how often each coordinate `turns` counter-clockwise in a turn of the crank, none at
    all if it is empty (the rest of it is periodic); the number of `parts` of the way between two samples, 1 if it is
    empty; and the `steps` of Newton's method from the series."""

    turns: Sequence[float] = ()
    parts: Sequence[int] = ()
    steps: int = STEPS


USUAL = Tracking()


class SolvedOnLegs(SolvedGroup):
    """A solved group of plates on `legs`. Its `links` are the legs and then the plates; its `margin` is the
    determinant over the lengths of the rods and the sizes of the plates that turn: 0 is a dead position."""

    __slots__ = ("legs",)

    def __init__(
        self,
        xp: Any,
        legs: Sequence[LegAt],
        spots: Sequence[Sequence[Vec2]],
        plates: Sequence[tuple[Vec2 | Motion, Vec2]],
        held: Sequence[Placed] = (),
    ) -> None:
        """
        Parameters
        ----------
        spots : those at which each plate that turns is held [m]
        plates, held : start and unit vector of each plate, see `SolvedGroup`, and the outer joints of the plates
        """
        self.legs = legs
        size = 1.0
        for plate in spots:
            size = size * xp.sqrt(sum((s - plate[k - 1]).squared() for k, s in enumerate(plate)))
        for leg in legs:
            size = size if leg.length is None else size * leg.length
        joints = (*held, *(leg.outer for leg in legs), *(leg.inner for leg in legs))
        super().__init__((*(leg.pose for leg in legs), *plates), joints, size=size)


class FollowedGroup(Group):
    """A group of plates on legs as data. `assembly` are coordinates from which Newton's method leads to the assembly
    mode at the crank angle `start` [rad], from which it is followed with a `tracking`. Its bars are its `legs`, then
    its plates; `kind` and `name` are for a refusal."""

    kind: ClassVar[str]
    name: str
    legs: Sequence[Leg]
    assembly: Sequence[Any]
    start: float
    tracking: Tracking

    def at_position(self, linkage: LinkageInMotion) -> Any:
        """What it needs of the linkage `linkage` before it."""
        raise NotImplementedError

    def legs_at(self, xp: Any, placed: Any, x: Sequence[Any]) -> Sequence[LegAt]:
        """Its legs at the coordinates `x`, each with its row by them; `placed` is from `at_position`."""
        raise NotImplementedError

    def solved(self, xp: Any, placed: Any, x: Sequence[Any]) -> SolvedOnLegs:
        """The group at the coordinates `x`; `placed` is from `at_position`."""
        raise NotImplementedError

    def solve(self, xp: Any, q: Any, linkage: LinkageInMotion, derived: Sequence[Any]) -> SolvedOnLegs:
        """The group with the linkage `linkage` before it, on the branch that the series `derived` gives."""
        placed = self.at_position(linkage)
        near = values_of(derived, len(self.assembly), TERMS, xp.cos(q), xp.sin(q))
        for k, turn in enumerate(self.tracking.turns):
            near[k] = near[k] + turn * q if turn else near[k]
        return self.solved(xp, placed, self._corrected(xp, placed, near, self.tracking.steps))

    def _corrected(self, xp: Any, placed: Any, near: Sequence[Any], steps: int) -> tuple[Any, ...]:
        return corrected(lambda x: self.legs_at(xp, placed, x), near, steps)

    def _followed(
        self, xp: Any, before: Callable[[float], LinkageInMotion], angles: Sequence[float]
    ) -> list[tuple[Any, ...]]:
        """The coordinates at these crank angles, each from the ones before it."""
        x, last, ratio = self._corrected(xp, self.at_position(before(angles[0])), self.assembly, 8), None, 1.0
        course, parts_before = [x], 1
        for (low, high), parts in zip(pairwise(angles), self.tracking.parts or repeat(1), strict=False):
            ratio = parts_before / parts
            x, last = self._moved(xp, before, (x, last), (low, high), parts, ratio)
            course.append(x)
            parts_before = parts
        return course

    def _moved(
        self,
        xp: Any,
        before: Callable[[float], LinkageInMotion],
        x_last: tuple[tuple[Any, ...], tuple[Any, ...] | None],
        way: tuple[float, float],
        parts: int,
        ratio: float,
    ) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
        """The coordinates at the end of a way, and before its last part; `x_last` are those at its begin and before
        it, and `ratio` is the size of its parts over that of the part before it."""
        (x, last), (low, high) = x_last, way
        for part in range(1, parts + 1):
            q, near = (high if part == parts else low + (high - low) * part / parts), x
            if last is not None:
                near = tuple((1.0 + ratio) * a - ratio * b for a, b in zip(x, last, strict=True))
            x, last, ratio = self._corrected(xp, self.at_position(before(q)), near, STEPS), x, 1.0
        assert last is not None
        return x, last

    def tracked(self, before: Callable[[float], LinkageInMotion]) -> Tracking:
        """How the group is followed with numbers, see `Tracking`; `before` gives the linkage before it at a crank
        angle [rad]."""
        self.tracking = usual = Tracking(self._turns(before))
        with suppress(ArithmeticError, ValueError):
            if self.derive(MATH, before)[-2] <= MOST_MISFIT or self._finely_tracked(before):
                return self.tracking
        return usual

    def _finely_tracked(self, before: Callable[[float], LinkageInMotion]) -> bool:
        """Whether the group closes all the way round if it is followed in smaller steps, which it keeps."""
        angles = [self.start + 2.0 * math.pi * k / SAMPLES for k in range(SAMPLES + 1)]
        self.tracking = Tracking(parts=[MOST_PARTS] * SAMPLES)
        parts = self._least_parts(before, angles, self._followed(MATH, before, angles))
        self.tracking = Tracking(parts=parts)
        turns = self._turns(before)
        for steps in range(STEPS, MOST_STEPS + 1):
            self.tracking = Tracking(turns, parts, steps)
            if self._largest_misfit(before) <= MOST_MISFIT:
                return True
        return False

    def _least_parts(
        self,
        before: Callable[[float], LinkageInMotion],
        angles: Sequence[float],
        course: Sequence[tuple[float, ...]],
    ) -> list[int]:
        """The least number of parts of each way between the `angles` that leads to the `course` there."""
        x, last, chosen = course[0], None, [1]
        for way, aim in zip(pairwise(angles), course[1:], strict=True):
            parts = 1
            while True:
                end, before_end = self._moved(MATH, before, (x, last), way, parts, chosen[-1] / parts)
                if math.dist(end, aim) < _SAME or parts == MOST_PARTS:
                    break
                parts *= 2
            x, last = end, before_end
            chosen.append(parts)
        return chosen[1:]

    def _turns(self, before: Callable[[float], LinkageInMotion]) -> tuple[float, ...]:
        """How often each coordinate turns in a turn of the crank."""
        angles = [self.start + 2.0 * math.pi * k / SAMPLES for k in range(SAMPLES + 1)]
        first, *_, last = self._followed(MATH, before, angles)
        return tuple(float(round((b - a) / (2.0 * math.pi))) for a, b in zip(first, last, strict=True))

    def _largest_misfit(self, before: Callable[[float], LinkageInMotion]) -> float:
        """The largest misfit of a leg around the turn, looked over closely."""
        series = self.derive(MATH, before)
        angles = (2.0 * math.pi * k / _CLOSE_LOOK for k in range(_CLOSE_LOOK))
        groups = (self.solve(MATH, q, before(q), series) for q in angles)
        return max(min(float(leg.misfit(MATH)), 1.0) for group in groups for leg in group.legs)

    def derive(self, xp: Any, before: Callable[[float], LinkageInMotion]) -> list[Any]:
        """The series of the coordinates over the crank angle, the largest misfit and the least margin around;
        `before` gives the linkage before the group at a crank angle [rad]."""
        angles = [self.start + 2.0 * math.pi * k / SAMPLES for k in range(SAMPLES)]
        courses = zip(*self._followed(xp, before, angles), strict=True)
        series: list[Any] = []
        for course, turn in zip(courses, self.tracking.turns or [0.0] * len(self.assembly), strict=True):
            values = [x - turn * q for x, q in zip(course, angles, strict=True)] if turn else course
            series += series_of(values, angles, HARMONICS)
        # the misfit as in a run, at angles halfway between the samples
        misfit, first, least = 0.0, None, None
        for q in angles:
            middle = q + math.pi / SAMPLES
            group = self.solve(xp, middle, before(middle), series)
            for leg in group.legs:
                misfit = xp.maximum(misfit, xp.minimum(leg.misfit(xp), 1.0))
            # relative to the sign of the first margin: a margin that changes sign has passed a dead position
            first = group.margin if first is None else first
            margin = group.margin * first / xp.abs(first)
            least = margin if least is None else xp.minimum(least, margin)
        return [*series, misfit, least]
