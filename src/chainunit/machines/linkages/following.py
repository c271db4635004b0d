"""A linkage with values, followed over the way of its driver: how its links turn, or where it does not close."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

from ...core.engines import MATH
from ...core.errors import InputError
from ...groups.triad import Triad
from ...mechanism.machine import Mechanism, derived_numbers
from .closing import dead_group, gap_hint, just_closes, open_group
from .narrow import check_triads, lows
from .outputs import DescribedLinkage
from .probes import description_axis
from .structure import Structure
from .way import WHOLE, DriverWay

LEAST_MARGIN = 1e-3
"""Least margin of a group: closer to a dead position its forces have no limit."""
_PLACES = 720
"""Places on a turn, or on a range, at which the end of the closing is looked for."""
_HALVINGS = 60


class RangeEnd(NamedTuple):
    """An end of the range in which a linkage closes: the place of the driver, and the links of the group that closes
    no farther; none where the driver's own range ends."""

    place: float
    links: Sequence[str]


class FollowedLinkage:
    """A `linkage` of this `structure` with numbers, over the `way` of its driver."""

    def __init__(self, structure: Structure, way: DriverWay, linkage: DescribedLinkage) -> None:
        self.structure, self.way, self.linkage = structure, way, linkage
        self._signs: list[float] = []

    @cached_property
    def _derived(self) -> Sequence[float]:
        return derived_numbers(MATH, self.linkage)

    def at(self, q: float) -> Mechanism:
        """The links with the driver at the place `q`.

        Raises
        ------
        ArithmeticError, ValueError
            where a group does not close.
        """
        return Mechanism(MATH, self.linkage, q, self._derived)

    def _margins(self, m: Mechanism) -> list[float]:
        """The margins of the groups, above 0 on the side of the first ones that were asked for."""
        margins = m.margins()
        self._signs = self._signs or [math.copysign(1.0, margin) for margin in margins]
        return [margin * sign for margin, sign in zip(margins, self._signs, strict=True)]

    def _margins_at(self, q: float) -> list[float]:
        return self._margins(self.at(q))

    def turns(self) -> dict[str, tuple[float, float]]:
        """For each link its turns per turn of the driver, and the middle of the rest of its angle [rad].

        Raises
        ------
        InputError
            where the linkage does not close, or passes a dead position, with the place of the driver.
        """
        try:
            derived = self._derived
        except (ArithmeticError, ValueError):
            raise self._not_closing(()) from None
        check_triads(self.linkage, derived)
        places = self.way.closed_places()
        angles: dict[str, list[float]] = {}
        margins_over_way: list[list[float]] = []
        for q in places:
            try:
                m = self.at(q)
            except (ArithmeticError, ValueError):
                raise self._not_closing(derived) from None
            margins_over_way.append(self._margins(m))
            for group, margin in zip(self.structure.groups, margins_over_way[-1], strict=True):
                if not margin > LEAST_MARGIN:
                    raise dead_group(group, self.way.words(q), margin, LEAST_MARGIN)
            self._add_angles(angles, m)
        for k, q, least in lows(self._margins_at, margins_over_way, places):
            if not least > LEAST_MARGIN:
                if math.isnan(least):
                    raise self._open_group(k, derived, q)
                raise dead_group(self.structure.groups[k], self.way.words(q), least, LEAST_MARGIN)
        turns = {}
        for name, (_, *samples) in angles.items():
            rate = self.way.rate(samples)
            rest = [angle - rate * (q - places[0]) for angle, q in zip(samples, places, strict=True)]
            turns[name] = rate, 0.5 * (min(rest) + max(rest)) - rate * places[0]
        return turns

    def _add_angles(self, angles: dict[str, list[float]], m: Mechanism) -> None:
        """Add the angle of each link, without jumps; the first one of each is that of its rough pose."""
        for name in self.structure.links:
            axis = description_axis(m.links[name].u, self.linkage.parts.frames[name])
            angle = math.atan2(axis.y, axis.x)
            before = angles.setdefault(name, [self.structure.poses[name][2]])
            before.append(before[-1] + math.remainder(angle - before[-1], WHOLE))

    def _open_group(self, k: int, derived: Sequence[float], q: float) -> InputError:
        """The refusal of the group `k` of the structure, which does not close at the place `q`; a change point, at
        which it fails to close by rounding, is a dead position."""
        group, where = self.structure.groups[k], self.way.words(q)
        number = k - (len(self.structure.groups) - len(self.linkage.groups))
        if number < 0:
            return open_group(group.links, where)
        if just_closes(self.linkage, number, derived, q):
            return dead_group(group, where, 0.0, LEAST_MARGIN)
        return open_group(group.links, where, gap_hint(self.linkage, number, derived, q, self.way.span))

    def _open_at(self, q: float, derived: Sequence[float]) -> int | None:
        """The number of the first group of the structure that does not close at a place; None where all close."""
        groups = self.structure.groups
        behind_driver = len(groups) - len(self.linkage.groups)
        for k in range(len(groups)):
            number = k + 1 - behind_driver
            part = self.linkage.before(number) if number < len(self.linkage.groups) else self.linkage
            try:
                Mechanism(MATH, part, q, derived[: part.derived_count])
            except (ArithmeticError, ValueError, IndexError):
                return k
        return None

    def _not_closing(self, derived: Sequence[float]) -> InputError:
        """The refusal with the first place at which the linkage does not close, and the group that does not."""
        for q in self.way.places():
            k = self._open_at(q, derived)
            if k is not None:
                return self._open_group(k, derived, q)
        return InputError("the linkage does not close: change its lengths", key="links")

    # the range in which it closes

    def range_words(self) -> str:
        """Words on the range of the driver in which the linkage closes around its start, for a refusal; empty where
        there is none, or where the driver has to go all the way round."""
        if any(isinstance(group, Triad) for group in self.linkage.groups):
            return ""
        ends = self.closing_range()
        if ends is None:
            return ""
        bounds = []
        for end, sense in zip(ends, (1.0, -1.0), strict=True):
            unit = "m" if self.way.linear else "deg"
            group = f" (group of {', '.join(end.links)})" if end.links else ""
            place = self.way.inside(end.place, sense if end.links else 0.0)
            bounds.append((f"{place} {unit}", group))
        (low, of_low), (high, of_high) = bounds
        for_whom = "for a driver that swings, " if self.way.turns else ""
        start = self._start_in_range()
        around = "its start" if start == self.way.start else self.way.words(start)
        return (
            f"; around {around} the linkage closes from {low}{of_low} to {high}{of_high}: {for_whom}write "
            f'range = ["{low}", "{high}"] in [driver], or less, as the forces grow without limit towards such an end'
        )

    def _start_in_range(self) -> float:
        """The start, or the end of the range that is nearest to it: that of a slide may lie outside."""
        low, high = self.way.limits or (-math.inf, math.inf)
        return min(max(self.way.start, low), high)

    def closing_range(self) -> tuple[RangeEnd, RangeEnd] | None:
        """The ends of the range around the start in which all groups close, clear of dead positions; None where they
        do not at the start."""
        start, (low, high) = self._start_in_range(), self.way.limits or (-math.inf, math.inf)
        self._signs = []
        if not self._good(start):
            return None
        ends = []
        for limit, sense in ((low, -1.0), (high, 1.0)):
            reach = WHOLE if math.isinf(limit) else abs(limit - start)
            bad = self._first_bad([start + sense * reach * k / _PLACES for k in range(_PLACES + 1)])
            ends.append(RangeEnd(start + sense * reach, ()) if bad is None else self._end(*bad))
        lower, upper = ends
        return None if upper.place - lower.place >= WHOLE and not self.way.linear else (lower, upper)

    def _good_margins(self, q: float) -> list[float] | None:
        """The margins at a place where all groups close, clear of dead positions; None elsewhere."""
        try:
            margins = self._margins_at(q)
        except (ArithmeticError, ValueError):
            return None
        return margins if all(margin > LEAST_MARGIN for margin in margins) else None

    def _good(self, q: float) -> bool:
        """Whether all groups close at a place, clear of dead positions."""
        return self._good_margins(q) is not None

    def _first_bad(self, places: Sequence[float]) -> tuple[float, float] | None:
        """A good place and the next bad one behind it, of `places` that lie close together; None where all are
        good."""
        passed: list[float] = []
        margins: list[list[float]] = []
        bad = None
        for q in places:
            here = self._good_margins(q)
            if here is None:
                bad = q
                break
            passed.append(q)
            margins.append(here)
        # a low between two places may be bad, too
        bad_places = [
            q for _, q, least in lows(self._margins_at, margins, passed) if not least > LEAST_MARGIN
        ]
        if bad_places:
            bad = min(bad_places, key=lambda q: abs(q - places[0]))
        if bad is None:
            return None
        return [q for q in passed if abs(q - places[0]) < abs(bad - places[0])][-1], bad

    def _end(self, good: float, bad: float) -> RangeEnd:
        """The last good place before a bad one, by halving, and the group that is no farther good."""
        for _ in range(_HALVINGS):
            middle = 0.5 * (good + bad)
            if self._good(middle):
                good = middle
            else:
                bad = middle
        k = self._open_at(bad, self._derived)
        if k is None:
            margins = self._margins_at(bad)
            k = min(range(len(margins)), key=margins.__getitem__)
        return RangeEnd(good, self.structure.groups[k].links)
