"""Smooth functions of one variable for the expressions of loads: steps, ramps, and tables.

Their slopes are exact in every engine, and have no jump: a solver steps over them, and the load port follows them.
Standard library only: FMUs carry this file.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

ROUNDED = 0.1
"""Part of the way of a `ramp` over which each of its corners is rounded."""


def _clipped(xp: Any, x: Any) -> tuple[Any, Any]:
    """`x` within 0 and 1, and how far it lies above 1; at 1 both share one slope."""
    above = xp.maximum(x, 0.0)
    inside = xp.minimum(above, 1.0)
    return inside, above - inside


def step(xp: Any, x: Any, width: Any) -> Any:
    """A step from 0 to 1 about x = 0: 0 up to -width/2, 1 from width/2 on, between them a polynomial with two
    continuous derivatives. Its mean over the width is 1/2, so that a force that it switches does the work of a sharp
    one."""
    t, _ = _clipped(xp, x / width + 0.5)
    return t * t * t * (10.0 + t * (6.0 * t - 15.0))


def positive(xp: Any, x: Any, width: Any) -> Any:
    """The positive part of `x`, the integral of `step`: 0 up to -width/2, `x` from width/2 on."""
    t, above = _clipped(xp, x / width + 0.5)
    return width * (t * t * t * t * (2.5 + t * (t - 3.0)) + above)


def positive_integral(xp: Any, x: Any, width: Any) -> Any:
    """The integral of `positive`: 0 up to -width/2."""
    t, above = _clipped(xp, x / width + 0.5)
    inside = t * t * t * t * t * (0.5 + t * (t / 7.0 - 0.5))
    return width * width * (inside + 0.5 * above * (1.0 + above))


def ramp(xp: Any, x: Any, begin: Any, end: Any) -> Any:
    """An even rise from 0 at `begin` to 1 at `end`; both corners are rounded over a tenth of the way. It falls where
    `end` is less than `begin`."""
    t = (x - begin) / (end - begin)
    return positive(xp, t, ROUNDED) - positive(xp, t - 1.0, ROUNDED)


class TableCurve:
    """A table of one variable, between its points by cubic pieces that rise or fall as their ends do (Fritsch and
    Carlson). Over an angle it repeats itself each turn; over a way its ends go on."""

    def __init__(self, places: Sequence[float], values: Sequence[float], turns: bool) -> None:
        """
        Parameters
        ----------
        places : rising, of an angle within one turn [rad, m]
        values : at these places
        turns : whether the coordinate is an angle
        """
        self.turns = turns
        places, values = list(places), list(values)
        if turns:
            places.append(places[0] + 2.0 * math.pi)
            values.append(values[0])
        widths = [b - a for a, b in pairwise(places)]
        rises = [(b - a) / h for a, b, h in zip(values, values[1:], widths, strict=False)]
        slopes = [_mean_slope(rises[k - 1], rises[k], widths[k - 1], widths[k]) for k in range(len(rises))]
        slopes.append(slopes[0])
        if not turns:
            slopes[0] = slopes[-1] = 0.0
        knots = [place - places[0] for place in places]
        pieces = [*zip(widths, rises, slopes, slopes[1:], strict=False)]
        self._first, self._value, self._before = places[0], values[0], 0.0
        if turns:
            # the turn begins within the last piece, not at a point: there the slope would be that of one side alone
            knots.insert(0, knots[-2] - 2.0 * math.pi)
            pieces.insert(0, pieces[-1])
            self._value, self._before = values[-2], 0.5 * widths[-1]
        self._knots, self._pieces = tuple(knots), tuple(pieces)

    def value(self, xp: Any, q: Any) -> Any:
        """The value at the coordinate `q` [rad, m]."""
        total, way = self._value, q - self._first
        if self.turns:  # in one turn, from half of the last piece before the first place on
            x = way + self._before
            way = xp.atan2(-xp.sin(x), -xp.cos(x)) + (math.pi - self._before)
        # where two pieces meet they share the size of one distance, so that the sum of their slopes is right there
        sizes = [xp.abs(way - knot) for knot in self._knots]
        for before, after, (width, rise, begin, end) in zip(sizes, sizes[1:], self._pieces, strict=False):
            t = 0.5 + (before - after) * (0.5 / width)  # from 0 to 1
            # Hermite's cubic, from the value at its begin
            cubic = 3.0 * rise - 2.0 * begin - end + t * (begin + end - 2.0 * rise)
            total = total + width * t * (begin + t * cubic)
        return total


def _mean_slope(before: float, after: float, left: float, right: float) -> float:
    """The slope between two pieces: 0 at a peak, else the weighted harmonic mean."""
    if before * after <= 0.0:
        return 0.0
    a, b = 2.0 * right + left, right + 2.0 * left
    return (a + b) / (a / before + b / after)
