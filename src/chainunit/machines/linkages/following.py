"""A linkage with values, followed over the way of its driver: how its links turn, or where it does not close."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cached_property, partial
from itertools import takewhile
from typing import Any, NamedTuple

from ...core.engines import MATH
from ...core.errors import InputError
from ...groups.followed import MOST_MISFIT, STEPS, FollowedGroup, Tracking, corrected
from ...groups.tetrad import SharedPlate
from ...mechanism.linkage import Linkage
from ...mechanism.machine import Mechanism, derived_numbers
from .closing import LEAST_MARGIN, dead_group, misfit_of_leg, open_group
from .outputs import DescribedLinkage
from .structure import FOLLOWED, Structure
from .way import WHOLE, DriverWay

NEAR = 0.35
"""Between two places the margin may fall from here to zero."""
_PLACES = 720
"""Places on a turn, or on a range, at which the end of the closing is looked for, and the gap of a group."""
_HALVINGS = 60


def signs_of(margins: Sequence[float]) -> list[float]:
    """The signs of margins; with them all later margins count above 0 on this side of a dead position."""
    return [math.copysign(1.0, margin) for margin in margins]


def signed(margins: Sequence[Any], signs: Sequence[float]) -> list[Any]:
    """Margins with these signs."""
    return [margin * sign for margin, sign in zip(margins, signs, strict=True)]


class RangeEnd(NamedTuple):
    """An end of the range in which a linkage closes: the place of the driver, and the links of the group that closes
    no farther; none if the driver's own range ends."""

    place: float
    links: Sequence[str]


class FollowedLinkage:
    """A `linkage` of this `structure` with numbers, over the `way` of its driver."""

    def __init__(self, structure: Structure, way: DriverWay, linkage: DescribedLinkage) -> None:
        self.structure, self.way, self.linkage = structure, way, linkage
        self._drivers = len(structure.groups) - len(linkage.groups)
        """1 if the first group of the structure is the driver of the linkage, a cylinder; else 0"""
        self.signs: list[float] = []
        """the signs of the margins at the first place of the way, once it is followed"""
        self.margins: list[list[float]] = []
        """the margins with these signs at all places"""

    @cached_property
    def derived(self) -> Sequence[float]:
        """The numbers that the groups derive from the lengths; none if the linkage does not close."""
        try:
            return derived_numbers(MATH, self.linkage)
        except (ArithmeticError, ValueError):
            return ()

    def at(self, q: float) -> Mechanism:
        """The links with the driver at the place `q`.

        Raises
        ------
        ArithmeticError, ValueError, IndexError
            if a group does not close.
        """
        return Mechanism(MATH, self.linkage, q, self.derived)

    def _margins_at(self, signs: Sequence[float], q: float) -> list[float]:
        return signed(self.at(q).margins(), signs)

    def courses(self, near: Mapping[str, float] | None = None) -> dict[str, list[float]]:
        """The angle of each link at the closed places of the way, without jumps, and before them an angle
        near to the first one: at the start, or as `near` says [rad].

        Raises
        ------
        InputError
            if the linkage does not close, or passes a dead position, with the place of the driver.
        """
        places = self.way.closed_places()
        poses = {name: self.structure.poses[name][2] for name in self.structure.links}
        angles = {name: [angle] for name, angle in (near or poses).items()}
        margins = self.margins = []
        try:
            self._check_followed()
            for q in places:
                m = self.at(q)
                self.signs = self.signs or signs_of(m.margins())
                margins.append(signed(m.margins(), self.signs))
                for group, margin in zip(self.structure.groups, margins[-1], strict=True):
                    if not margin > LEAST_MARGIN:
                        raise dead_group(group, self.way.words(q), margin)
                for name, course in angles.items():
                    # without a jump from the one before
                    turn = math.remainder(self.linkage.angle(name, m) - course[-1], WHOLE)
                    course.append(course[-1] + turn)
        except InputError:
            raise
        except (ArithmeticError, ValueError, IndexError):
            raise self._not_closing() from None
        for k, q, least in lows(partial(self._margins_at, self.signs), margins, places):
            if math.isnan(least):
                raise self._open_group(k, q)
            if not least > LEAST_MARGIN:
                raise dead_group(self.structure.groups[k], self.way.words(q), least)
        return angles

    def turns(self, courses: Sequence[Mapping[str, Sequence[float]]]) -> dict[str, tuple[float, float]]:
        """For each link its turns per turn of the driver, and the middle of the rest of its angle [rad], from its
        `courses`."""
        places, turns = self.way.closed_places(), {}
        for name in self.structure.links:
            rate, rest = self.way.rate(courses[0][name][1:]), list[float]()
            for course in courses:
                rest += (a - rate * (q - places[0]) for a, q in zip(course[name][1:], places, strict=True))
            turns[name] = rate, 0.5 * (min(rest) + max(rest)) - rate * places[0]
        return turns

    # where it does not close

    def _before(self, k: int) -> Callable[[float], Mechanism]:
        """The linkage before the group `k` of the structure, of the place of the driver."""
        linkage = self.linkage.before(max(k - self._drivers, 0))
        return lambda q: Mechanism(MATH, linkage, q, self.derived)

    def _open_group(self, k: int, q: float) -> InputError:
        """The refusal of the group `k` of the structure, which does not close at the place `q`."""
        low, high = self.way.span
        places = [q, *(low + (high - low) * n / _PLACES for n in range(_PLACES + 1))]
        group = (self.linkage.driver, *self.linkage.groups)[k + 1 - self._drivers]
        if isinstance(group, SharedPlate) and (fault := self._fault_of_shared(k, group, places[1:])):
            return fault
        where, ground = self.way.words(q), self.linkage.ground
        return open_group(self.structure.groups[k], where, group, ground, self._before(k), places)

    def _fault_of_shared(self, k: int, plate: SharedPlate, places: Sequence[float]) -> InputError | None:
        """The refusal of the group `k` of the structure, a plate on redundant legs: by its first dead position on the
        way from the start, or one before it, or else by the leg that fits least; None if it has no such fault."""
        start, before, signs = plate.start, self._before(k), list[float]()
        worst = 0.0, 0.0, 0, start
        for way in ([q for q in places if q >= start], [q for q in places[::-1] if q < start]):
            near, last = plate.assembly, None
            for q in (start, *way):
                try:
                    m = before(q)
                except (ArithmeticError, ValueError, IndexError):
                    n = self._open_at(q)
                    return None if n is None or n >= k else self._open_group(n, q)
                signs = signs or signs_of(m.margins())
                # a plate that does not close is dead
                margins, fit = [*signed(m.margins(), signs), 0.0], (0.0, 0.0, 0)
                with suppress(ArithmeticError, ValueError):
                    placed = plate.at_position(m)
                    near = corrected(partial(plate.legs_at, MATH, placed), near, 2 * STEPS)
                    group = plate.solved(MATH, placed, near)
                    margins[-1], fit = group.hold, group.least_fit()
                here = q, margins
                if fault := self._dead_ahead(last or here, here):
                    return fault
                last, worst = here, max(worst, (*fit, q))
        part, gap, leg, q = worst
        if not part > MOST_MISFIT:
            return None
        return misfit_of_leg(self.structure.groups[k], leg, gap, self.way.words(q))

    def _dead_ahead(
        self, last: tuple[float, list[float]], here: tuple[float, list[float]]
    ) -> InputError | None:
        """The refusal of the first group whose margin, which falls evenly from the `last` place, is none `here` or at
        the place after; each place has its margins."""
        (last_q, before), (q, margins) = last, here
        for group, margin, more in zip(self.structure.groups, margins, before, strict=False):
            if not min(margin, 2.0 * margin - more) > LEAST_MARGIN:
                ahead = (q - last_q) * margin / (more - margin) if q != last_q else 0.0
                return dead_group(group, self.way.words(q + ahead), 0.0)
        return None

    def _check_followed(self) -> None:
        """Refuse groups on legs that cannot be followed all the way."""
        for group, misfit in misfits(self.linkage, self.derived):
            if misfit <= MOST_MISFIT:
                continue
            k = self.linkage.groups.index(group) + self._drivers
            if isinstance(group, SharedPlate):
                raise self._open_group(k, self.way.start)
            bars, legs = group.bars, len(group.legs)
            links = ", ".join(bar.name for bar in (*bars[legs:], *bars[:legs]))
            sharp = ", or moves too sharply to be followed"
            way = (f"all the way round{sharp}", "let the driver swing by a range")
            if self.way.swings:
                way = (f"over the range of the driver{sharp}", "take a smaller range")
            if group.misfit_at_start(MATH, self._before(k)) > MOST_MISFIT:
                way = (f"at its start, {self.way.words(self.way.start)}", "correct the places in [start]")
            raise InputError(
                f"the {group.kind} of {links} does not close {way[0]}: change its lengths, or {way[1]}",
                key=f"links.{group.name}",
            )

    def _open_at(self, q: float) -> int | None:
        """The number of the first group of the structure that does not close at a place; None if all close."""
        for k in range(len(self.structure.groups)):
            try:
                self._before(k + 1)(q)
            except (ArithmeticError, ValueError, IndexError):
                return k
        return None

    def _not_closing(self) -> InputError:
        """The refusal with the first place at which the linkage does not close, and the group that does not."""
        for q in self.way.places():
            k = self._open_at(q)
            if k is not None:
                return self._open_group(k, q)
        return InputError("the linkage does not close: change its lengths", key="links")

    # the range in which it closes

    def range_words(self) -> str:
        """Words on the range of the driver in which the linkage closes around its start, for a refusal; empty if
        there is none, or if the driver has to go all the way round."""
        if any(group.kind in FOLLOWED for group in self.structure.groups):
            return ""
        ends = self.closing_range(self.way.start)
        if ends is None:
            return ""
        unit = "m" if self.way.linear else "deg"
        least, most = (
            f"{self.way.inside(end.place, sense if end.links else 0.0)} {unit}"
            for end, sense in zip(ends, (1.0, -1.0), strict=True)
        )
        low_group, high_group = (f" (group of {', '.join(end.links)})" if end.links else "" for end in ends)
        return (
            f"; around its start the linkage closes from {least}{low_group} to {most}{high_group}: "
            f"{'for a driver that swings, ' if self.way.turns else ''}write "
            f'range = ["{least}", "{most}"] in [driver], or less, as the forces grow without limit towards such an '
            "end"
        )

    def closing_range(self, start: float) -> tuple[RangeEnd, RangeEnd] | None:
        """The ends of the range around a place in which all groups close, clear of dead positions; None if they do
        not at the place, or if the driver goes all the way round."""
        low, high = self.way.limits or (start - WHOLE, start + WHOLE)
        try:
            signs = signs_of(self.at(start).margins())
        except (ArithmeticError, ValueError, IndexError):
            return None
        if self._good_margins(signs, start) is None:
            return None
        lower, upper = (self._range_end(signs, start, limit) for limit in (low, high))
        return None if upper.place - lower.place >= WHOLE and not self.way.linear else (lower, upper)

    def _good_margins(self, signs: Sequence[float], q: float) -> list[float] | None:
        """The margins at a place at which all groups close, clear of dead positions; None elsewhere."""
        try:
            margins = self._margins_at(signs, q)
        except (ArithmeticError, ValueError, IndexError):
            return None
        return margins if all(margin > LEAST_MARGIN for margin in margins) else None

    def _range_end(self, signs: Sequence[float], start: float, limit: float) -> RangeEnd:
        """The end of the range from a good place `start` towards the `limit`: the last place [rad, m] at which all
        groups close, clear of dead positions, and the group that does not beyond; the limit itself if all are good up
        to it. The signs are as in `signed`."""
        places = [start + (limit - start) * k / _PLACES for k in range(_PLACES + 1)]
        courses = (self._good_margins(signs, q) for q in places)
        margins = [good for good in takewhile(lambda course: course is not None, courses) if good is not None]
        passed, beyond = places[: len(margins)], places[len(margins) :]
        # a low between two places may be bad, too
        between = lows(partial(self._margins_at, signs), margins, passed)
        bad_places = [q for _, q, least in between if not least > LEAST_MARGIN] + beyond[:1]
        if not bad_places:
            return RangeEnd(limit, ())
        bad = min(bad_places, key=lambda q: abs(q - start))
        good = [q for q in passed if abs(q - start) < abs(bad - start)][-1]
        good, bad = self._parted(signs, good, bad)
        return RangeEnd(good, self.structure.groups[self._worst_group(signs, bad)].links)

    def _parted(self, signs: Sequence[float], good: float, bad: float) -> tuple[float, float]:
        """A good and a bad place next to each other between two such places, by halving."""
        for _ in range(_HALVINGS):
            middle = 0.5 * (good + bad)
            if self._good_margins(signs, middle) is None:
                bad = middle
            else:
                good = middle
        return good, bad

    def _worst_group(self, signs: Sequence[float], bad: float) -> int:
        """The number of the group that does not close at a bad place, or else has the least margin there."""
        k = self._open_at(bad)
        if k is not None:
            return k
        margins = self._margins_at(signs, bad)
        return margins.index(min(margins))


def lows(
    margins_at: Callable[[float], Sequence[float]],
    margins: Sequence[Sequence[float]],
    places: Sequence[float],
) -> Iterator[tuple[int, float, float]]:
    """The number of a group, the place and the value of each low of its margin that may lead to a dead position; NaN
    if the linkage does not close. The `margins` are the margins at the `places`."""
    last = len(places) - 1
    for group, margins_of_group in enumerate(zip(*margins, strict=True)):
        for k, here in enumerate(margins_of_group):
            low, high = max(k - 1, 0), min(k + 1, last)
            if here < NEAR and here <= margins_of_group[low] and here <= margins_of_group[high]:
                yield group, *_lowest(margins_at, group, places[low], places[high])


def _lowest(
    margins_at: Callable[[float], Sequence[float]], group: int, low: float, high: float
) -> tuple[float, float]:
    """The place of the least margin of a group in a range that has one low, and that margin; if the linkage does not
    close, the first such place and NaN."""
    from scipy.optimize import minimize_scalar

    open_places: list[float] = []

    def value(q: float) -> float:
        """The margin at a place; NaN from the first place on at which the linkage does not close."""
        try:
            margin = math.nan if open_places else margins_at(q)[group]
        except (ArithmeticError, ValueError):
            margin = math.nan
        if math.isnan(margin):
            open_places.append(q)
        return margin

    accuracy = {"xatol": 1e-5 * abs(high - low)}
    least = minimize_scalar(value, bounds=sorted((low, high)), method="bounded", options=accuracy)
    return (open_places[0], math.nan) if open_places else (float(least.x), float(least.fun))


def lesser(xp: Any, a: Any, b: Any) -> Any:
    """The lesser of two numbers, NaN if either is: `fmin` of C would pass by a NaN, and so a linkage that does not
    close."""
    return 0.5 * (a + b - xp.abs(a - b))


# groups without a closed form


def trackings(linkage: Linkage) -> dict[str, Tracking]:
    """How each triad and tetrad is followed around the turn, by name; the groups of the linkage have it from here on.
    From the first group on that does not close there is none."""
    tracks = {}
    with suppress(ArithmeticError, ValueError):
        for k, group in enumerate(linkage.groups):
            if isinstance(group, FollowedGroup):
                before = linkage.before(k)
                placed = partial(Mechanism, MATH, before, derived=derived_numbers(MATH, before))
                tracks[group.name] = group.tracking = group.tracked(placed)
    return tracks


def misfits(linkage: Linkage, derived: Sequence[Any]) -> Iterator[tuple[FollowedGroup, Any]]:
    """Each triad and tetrad with the largest misfit of its legs over the turn, in parts of their
    lengths."""
    last = 0
    for group in linkage.groups:
        last += group.derived_count
        if isinstance(group, FollowedGroup):
            yield group, derived[last - 2]
