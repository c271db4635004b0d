"""A group without a closed form: its coordinates are followed once over the way of the driver.

Plates stand on legs (`chainunit.groups.legs`): the places of the plates are the coordinates of the group, and each
leg gives an equation. Newton's method solves as many equations as there are coordinates; these rows are what is left
of the matrix of the group after the legs are eliminated, and where their determinant vanishes is a dead position.

In a linkage with one crank the coordinates are smooth periodic functions of the crank angle. `FollowedGroup.derive`
follows them once around, from the mode to which `assembly` leads at the crank angle `start`, and keeps them as a
Fourier series. At any angle the series gives coordinates that are nearly right, and Newton's method makes them exact.
So they depend on the crank angle alone, independent of the step and the history. The branch cannot jump; a branch
that ends within the turn has a misfit. A group that comes near to a dead position moves sharply there: it is followed
in smaller steps, and Newton's method takes more of its own. A driver with a range goes through it to and fro, as the
cosine of an angle does in a turn.

Legs that yield may be more than the coordinates: Newton's method then makes the sum of their gaps, squared and
weighted, least.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from itertools import pairwise, repeat
from typing import Any, ClassVar, NamedTuple

from ..core.engines import MATH
from ..core.planar import Motion, Vec2
from .block import least_squares, minus_cofactors
from .group import Group, SolvedGroup
from .joints import LinkageInMotion, Placed
from .legs import Leg, LegAt
from .series import Revolution, series_of

SAMPLES = 20
"""Number of crank angles at which a group is followed once around."""
HARMONICS = 8
"""Number of harmonics in the series of a coordinate."""
MOST_MISFIT = 1e-10
"""Largest misfit of a leg that counts as closed, in parts of its length."""
_LARGE_MISFIT = 1e-9
"""Misfit of legs that yield at which their margin is 0."""
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
        if legs[0].stiffness is not None:
            parts, _ = least_squares([leg.row for leg in legs], [leg.weight for leg in legs])
            pairs = [*zip(legs, parts, strict=True)]
            x = tuple(place + sum(leg.gap * part[k] for leg, part in pairs) for k, place in enumerate(x))
            continue
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


class _Spot(NamedTuple):
    """Coordinates of a group that is followed; the ones a step before, if it comes from there; and the number of such
    steps between two samples."""

    x: tuple[Any, ...]
    last: tuple[Any, ...] | None = None
    parts: int = 1


class SolvedOnLegs(SolvedGroup):
    """A solved group of plates on `legs`. Its `links` are the legs and then the plates; its `margin` is the
    determinant over the lengths of the rods and the sizes of the plates that turn: 0 is a dead position. Of legs that
    yield it is the `hold`, the root mean square of such determinants by stiffness, if the legs fit."""

    __slots__ = ("hold", "legs")

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
        yields = legs[0].stiffness is not None
        for leg in legs:
            size = size if leg.length is None or yields else size * leg.length
        outer, inner = zip(*(leg.joints for leg in legs), strict=True)
        joints = (*held, *outer, *inner)
        super().__init__((*(leg.pose for leg in legs), *plates), joints, size=size)
        if yields:
            # plates have one coordinate, or three; legs that do not fit, or have a stiffness below 0, have no margin
            least, total = xp.maximum(self._matrix.det, 0.0), sum(xp.sqrt(leg.stiffness) ** 2 for leg in legs)
            fit = 1.0 - sum(leg.misfit(xp) * leg.misfit(xp) for leg in legs) * (1.0 / _LARGE_MISFIT) ** 2
            self.hold = xp.sqrt(least / (total if held else total * total * total)) / size
            self.margin = self.hold * fit

    def least_fit(self) -> tuple[float, float, int]:
        """Of legs that yield, by how much the one that strains them most is too short, if the others fit, in parts
        of its length and in m, and its number."""
        gaps = [leg.shortness for leg in self.legs]
        pulls = [leg.stiffness * gap for leg, gap in zip(self.legs, gaps, strict=True)]
        energy = sum(pull * gap for pull, gap in zip(pulls, gaps, strict=True))
        number = max(range(len(pulls)), key=lambda k: abs(pulls[k]))
        gap = energy / pulls[number] if pulls[number] else 0.0
        return abs(gap) / (self.legs[number].length or 1.0), gap, number


class FollowedGroup(Group):
    """A group of plates on legs as data. `assembly` are coordinates from which Newton's method leads to the assembly
    mode at the place `start` of the driver, from which it is followed with a `tracking`. `span` is the range of a
    driver that does not turn round. Its bars are its `legs`, then its plates; `kind` and `name` are for a refusal."""

    kind: ClassVar[str]
    name: str
    legs: Sequence[Leg]
    assembly: Sequence[Any]
    start: float
    tracking: Tracking
    span: Sequence[float]

    @property
    def revolution(self) -> Revolution:
        """The way of the driver."""
        return Revolution(self.start, self.span)

    @property
    def derived_count(self) -> int:
        """The series of its coordinates, the largest misfit, and the least margin."""
        return len(self.assembly) * TERMS + 2

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
        near = self.revolution.values(xp, derived, len(self.assembly), TERMS, q)
        for k, turn in enumerate(self.tracking.turns):
            near[k] = near[k] + turn * q if turn else near[k]
        return self.solved(xp, placed, self._corrected(xp, placed, near, self.tracking.steps))

    def _corrected(self, xp: Any, placed: Any, near: Sequence[Any], steps: int) -> tuple[Any, ...]:
        return corrected(lambda x: self.legs_at(xp, placed, x), near, steps)

    def misfit_at_start(self, xp: Any, before: Callable[[float], LinkageInMotion]) -> float:
        """The largest misfit of a leg at the start."""
        placed = self.at_position(before(self.start))
        legs = self.legs_at(xp, placed, self._corrected(xp, placed, self.assembly, 8))
        return max(float(leg.misfit(xp)) for leg in legs)

    def _followed(
        self, xp: Any, before: Callable[[float], LinkageInMotion], angles: Sequence[float]
    ) -> list[tuple[Any, ...]]:
        """The coordinates at these angles of a turn, each from the ones before it."""
        placed = self.at_position(before(self.revolution.place(angles[0])))
        spot = _Spot(self._corrected(xp, placed, self.assembly, 8))
        course = [spot.x]
        for way, parts in zip(pairwise(angles), self.tracking.parts or repeat(1), strict=False):
            spot = self._moved(xp, before, spot, way, parts)
            course.append(spot.x)
        return course

    def _moved(
        self,
        xp: Any,
        before: Callable[[float], LinkageInMotion],
        spot: _Spot,
        way: tuple[float, float],
        parts: int,
    ) -> _Spot:
        """The group at the end of a way between two angles of a turn, from the `spot` at its begin, in so many
        parts."""
        low, high = way
        for part in range(1, parts + 1):
            angle, near, ratio = low + (high - low) * part / parts, spot.x, spot.parts / parts
            if spot.last is not None:
                near = tuple(
                    (1.0 + ratio) * x - ratio * last for x, last in zip(near, spot.last, strict=True)
                )
            placed = self.at_position(before(self.revolution.place(high if part == parts else angle)))
            spot = _Spot(self._corrected(xp, placed, near, STEPS), spot.x, parts)
        return spot

    def tracked(self, before: Callable[[float], LinkageInMotion]) -> Tracking:
        """How the group is followed with numbers, see `Tracking`; `before` gives the linkage before it at a place of
        the driver [rad, m]."""
        self.tracking = usual = Tracking(self._turns(before))
        with suppress(ArithmeticError, ValueError):
            if self.derive(MATH, before)[-2] <= MOST_MISFIT or self._finely_tracked(before):
                return self.tracking
        return usual

    def _finely_tracked(self, before: Callable[[float], LinkageInMotion]) -> bool:
        """Whether the group closes all the way if it is followed in smaller steps, which it keeps."""
        angles = self.revolution.angles(SAMPLES + 1, SAMPLES)
        self.tracking = Tracking(parts=[MOST_PARTS] * SAMPLES)
        course = self._followed(MATH, before, angles)
        spot, parts = _Spot(course[0]), list[int]()
        for way, aim in zip(pairwise(angles), course[1:], strict=True):
            # the fewest parts that lead to the same place
            counts = (2**k for k in range(MOST_PARTS.bit_length()))
            ends = (self._moved(MATH, before, spot, way, count) for count in counts)
            spot = next(end for end in ends if end.parts == MOST_PARTS or math.dist(end.x, aim) < _SAME)
            parts.append(spot.parts)
        self.tracking = Tracking(parts=parts)
        turns = self._turns(before)
        for steps in range(STEPS, MOST_STEPS + 1):
            self.tracking = Tracking(turns, parts, steps)
            if self._largest_misfit(before) <= MOST_MISFIT:
                return True
        return False

    def _turns(self, before: Callable[[float], LinkageInMotion]) -> tuple[float, ...]:
        """How often each coordinate turns in a turn of the crank."""
        first, *_, last = self._followed(MATH, before, self.revolution.angles(SAMPLES + 1, SAMPLES))
        return tuple(float(round((b - a) / (2.0 * math.pi))) for a, b in zip(first, last, strict=True))

    def _largest_misfit(self, before: Callable[[float], LinkageInMotion]) -> float:
        """The largest misfit of a leg on the way, looked over closely."""
        series = self.derive(MATH, before)
        places = map(self.revolution.place, self.revolution.angles(_CLOSE_LOOK, _CLOSE_LOOK))
        groups = (self.solve(MATH, q, before(q), series) for q in places)
        return max(min(float(leg.misfit(MATH)), 1.0) for group in groups for leg in group.legs)

    def derive(self, xp: Any, before: Callable[[float], LinkageInMotion]) -> list[Any]:
        """The series of the coordinates over the place of the driver, the largest misfit and the least margin on the
        way; `before` gives the linkage before the group at a place [rad, m]."""
        angles = self.revolution.angles(SAMPLES, SAMPLES)
        courses = zip(*self._followed(xp, before, angles), strict=True)
        series: list[Any] = []
        for course, turn in zip(courses, self.tracking.turns or [0.0] * len(self.assembly), strict=True):
            values = [x - turn * q for x, q in zip(course, angles, strict=True)] if turn else course
            series += series_of(values, angles, HARMONICS)
        # the misfit as in a run, at angles halfway between the samples
        misfit, first, least = 0.0, None, None
        for q in angles:
            middle = self.revolution.place(q + math.pi / SAMPLES)
            group = self.solve(xp, middle, before(middle), series)
            for leg in group.legs:
                misfit = xp.maximum(misfit, xp.minimum(leg.misfit(xp), 1.0))
            # relative to the sign of the first margin: a margin that changes sign has passed a dead position
            first = group.margin if first is None else first
            margin = group.margin * first / xp.abs(first)
            least = margin if least is None else xp.minimum(least, margin)
        return [*series, misfit, least]
