"""Smooth functions of one variable for the expressions of loads: steps, ramps, and tables.

Their slopes are exact in every engine, and have no jump: a solver steps over them, and the load port follows them.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from functools import cached_property
from itertools import pairwise
from operator import mul
from typing import Any, NamedTuple

import numpy as np

from ..core import engines, jets

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


class _Piece(NamedTuple):
    """A piece of a table from a `place` on: from its `value` there on, a polynomial of the part of its width, from 0
    to 1. `per_width` is 1 by the width."""

    place: Any
    per_width: Any
    value: Any
    linear: Any
    square: Any
    cubic: Any

    def at(self, way: Any) -> tuple[Any, Any]:
        """Value and slope at a place of it."""
        t = (way - self.place) * self.per_width
        value = self.value + t * (self.linear + t * (self.square + t * self.cubic))
        return value, (self.linear + t * (2.0 * self.square + t * (3.0 * self.cubic))) * self.per_width


class TableCurve:
    """A table of one variable, between its points by cubic pieces that rise or fall as their ends do (Fritsch and
    Carlson), or by a cubic spline, which has a continuous second derivative, too. Over an angle it repeats itself
    each turn; over a way its ends go on."""

    def __init__(
        self, places: Sequence[float], values: Sequence[float], turns: bool, spline: bool = False
    ) -> None:
        """
        Parameters
        ----------
        places : rising, of an angle within one turn [rad, m]
        values : at these places
        turns : whether the coordinate is an angle
        spline : whether the pieces form a spline
        """
        self.turns, self._first = turns, places[0]
        abscissas, values = [place - places[0] for place in places], list(values)
        if turns:
            abscissas.append(2.0 * math.pi)
            values.append(values[0])
        widths = [b - a for a, b in pairwise(abscissas)]
        rises = [(b - a) / h for a, b, h in zip(values, values[1:], widths, strict=False)]
        slopes = [_mean_slope(rises[k - 1], rises[k], widths[k - 1], widths[k]) for k in range(len(rises))]
        if spline:
            slopes = _spline_slopes(rises, widths, turns)
        slopes.append(slopes[0])
        if not turns:
            slopes[0] = slopes[-1] = 0.0
        self._pieces = [
            # Hermite's cubic
            _Piece(a, 1.0 / h, value, h * begin, h * (3.0 * rise - 2.0 * begin - end), h * (begin + end - 2.0 * rise))
            for a, h, value, rise, begin, end in zip(
                abscissas, widths, values, rises, slopes, slopes[1:], strict=False
            )
        ]  # fmt: skip
        self._later, self._length = abscissas[1:-1], abscissas[-1]

    def value(self, xp: Any, q: Any) -> Any:
        """The value at the coordinate `q` [rad, m]."""
        x = q - self._first
        if self.turns:
            x = xp.atan2(-xp.sin(x), -xp.cos(x)) + math.pi
        if isinstance(x, jets.Jet):
            x = x if self.turns else xp.minimum(xp.maximum(x, 0.0), self._length)
            return self._piece(engines.value(x.parts[0])).at(x)[0]
        way = engines.value(x)
        if not self.turns:
            way = xp.minimum(xp.maximum(way, 0.0), self._length)
        value, slope = self._piece(way).at(way)
        return engines.Dual(value, slope * x.d) if isinstance(x, engines.Dual) else value

    def _piece(self, way: Any) -> _Piece:
        """The piece at a number, those at an array, or the one at a symbol, by which nothing can be looked up: there
        each of its numbers is a sum of steps."""
        if isinstance(way, float | int):
            return self._pieces[bisect_right(self._later, way)]
        if type(way).__module__ == "numpy":
            later, columns = self._arrays
            return _Piece(*columns[:, later.searchsorted(way, "right")])
        first, *_ = self._pieces
        passed = [way >= place for place in self._later]
        steps = [
            (after - before for before, after in pairwise(column))
            for column in zip(*self._pieces, strict=True)
        ]
        return _Piece(
            *(sum(map(mul, passed, column), begin) for begin, column in zip(first, steps, strict=True))
        )

    @cached_property
    def _arrays(self) -> tuple[Any, Any]:
        return np.array(self._later), np.array(self._pieces).T


def _spline_slopes(rises: Sequence[float], widths: Sequence[float], turns: bool) -> list[float]:
    """The slopes of a spline at its places without the last one, which around a turn is the first one again; over a
    way it begins and ends level."""
    size, after = len(rises), [1.0 / width for width in widths]
    system, right = np.zeros((size, size)), np.zeros(size)
    for k in range(size):
        system[k, k] += 2.0 * (after[k - 1] + after[k])
        system[k, k - 1] += after[k - 1]
        system[k, (k + 1) % size] += after[k]
        right[k] = 3.0 * (rises[k - 1] * after[k - 1] + rises[k] * after[k])
    if not turns:
        system[0], right[0] = np.eye(size)[0], 0.0
    return [float(slope) for slope in np.linalg.solve(system, right)]


def _mean_slope(before: float, after: float, left: float, right: float) -> float:
    """The slope between two pieces: 0 at a peak, else the weighted harmonic mean."""
    if before * after <= 0.0:
        return 0.0
    a, b = 2.0 * right + left, right + 2.0 * left
    return (a + b) / (a / before + b / after)
