"""Checks of a linkage over the way of its driver: the least margin of each group between the places at which it is
looked at, and triads. Standard library only: FMUs carry this file."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

from ...engines import MATH
from ...errors import InputError
from ...groups.triad import MOST_MISFIT, Triad
from ...mechanism.linkage import Linkage
from ...mechanism.machine import Mechanism, derived_numbers

NEAR = 0.35
"""Between two places the margin may fall from here to zero."""
_GOLDEN = 0.6180339887498949
_STEPS = 24


def lows(
    margins_at: Callable[[float], Sequence[float]],
    courses: Sequence[Sequence[float]],
    places: Sequence[float],
) -> Iterator[tuple[int, float, float]]:
    """The number of a group, the place and the value of each low of its margin that may lead to a dead position; NaN
    where the linkage does not close. The `courses` are the margins at the `places`."""
    last = len(places) - 1
    for group, course in enumerate(zip(*courses, strict=True)):

        def margin(q: float, group: int = group) -> float:
            try:
                return margins_at(q)[group]
            except (ArithmeticError, ValueError):
                return math.nan

        for k, here in enumerate(course):
            low, high = max(k - 1, 0), min(k + 1, last)
            if here < NEAR and here <= course[low] and here <= course[high]:
                yield group, *_lowest(margin, places[low], places[high])


def _lowest(margin: Callable[[float], float], low: float, high: float) -> tuple[float, float]:
    """The place of the least margin in a range, and that margin, by golden sections; the first that is NaN."""
    a, b = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
    at_a, at_b = margin(a), margin(b)
    for _ in range(_STEPS):
        for q, value in ((a, at_a), (b, at_b)):
            if math.isnan(value):
                return q, value
        if at_a < at_b:
            high, b, at_b = b, a, at_a
            a = high - _GOLDEN * (high - low)
            at_a = margin(a)
        else:
            low, a, at_a = a, b, at_b
            b = low + _GOLDEN * (high - low)
            at_b = margin(b)
    return (a, at_a) if at_a < at_b else (b, at_b)


def turns_of_triads(linkage: Linkage) -> dict[str, float]:
    """The turns of the ternary link of each triad in a turn of the crank, by name; the triads know them from here on.
    One that does not close has none."""
    turns = {}
    for k, group in enumerate(linkage.groups):
        if isinstance(group, Triad):
            before = linkage.before(k)
            try:
                placed = partial(_placed, before, derived_numbers(MATH, before))
                turns[group.name] = group.turns = group.turns_in_a_turn(MATH, placed)
            except (ArithmeticError, ValueError):
                break
    return turns


def _placed(linkage: Linkage, derived: Sequence[Any], q: float) -> Mechanism:
    return Mechanism(MATH, linkage, q, derived)


def check_triads(linkage: Linkage, derived: Sequence[Any]) -> None:
    """Refuse triads that cannot be followed all the way round.

    Raises
    ------
    InputError
        in one line.
    """
    for k, group in enumerate(linkage.groups):
        if isinstance(group, Triad) and not derived[linkage.before(k + 1).derived - 2] <= MOST_MISFIT:
            raise InputError(
                f"the triad of {group.name} does not close all the way round, or moves too sharply to be followed: "
                "change its lengths",
                key=f"links.{group.name}",
            )


def lesser(xp: Any, a: Any, b: Any) -> Any:
    """The lesser of two numbers, NaN where either is: `fmin` of C would pass by a NaN, and so a linkage that does not
    close."""
    return 0.5 * (a + b - xp.abs(a - b))
