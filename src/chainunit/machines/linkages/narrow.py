"""Checks of a linkage over the way of its driver: the least margin of each group between the places at which it is
looked at, and triads."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

from ...core.engines import MATH
from ...core.errors import InputError
from ...groups.triad import MOST_MISFIT, Triad
from ...mechanism.linkage import Linkage
from ...mechanism.machine import Mechanism, derived_numbers

NEAR = 0.35
"""Between two places the margin may fall from here to zero."""


def lows(
    margins_at: Callable[[float], Sequence[float]],
    margins: Sequence[Sequence[float]],
    places: Sequence[float],
) -> Iterator[tuple[int, float, float]]:
    """The number of a group, the place and the value of each low of its margin that may lead to a dead position; NaN
    where the linkage does not close. The `margins` are the margins at the `places`."""
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

    open_at: list[float] = []

    def value(q: float) -> float:
        try:
            y = math.nan if open_at else margins_at(q)[group]
        except (ArithmeticError, ValueError):
            y = math.nan
        if math.isnan(y):
            open_at.append(q)
        return y

    accuracy = {"xatol": 1e-5 * abs(high - low)}
    least = minimize_scalar(value, bounds=sorted((low, high)), method="bounded", options=accuracy)
    return (open_at[0], math.nan) if open_at else (float(least.x), float(least.fun))


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
        if isinstance(group, Triad) and not derived[linkage.before(k + 1).derived_count - 2] <= MOST_MISFIT:
            raise InputError(
                f"the triad of {group.name} does not close all the way round, or moves too sharply to be followed: "
                "change its lengths",
                key=f"links.{group.name}",
            )


def lesser(xp: Any, a: Any, b: Any) -> Any:
    """The lesser of two numbers, NaN where either is: `fmin` of C would pass by a NaN, and so a linkage that does not
    close."""
    return 0.5 * (a + b - xp.abs(a - b))
