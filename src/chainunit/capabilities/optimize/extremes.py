"""Exact values of quantities over the continuous turn: extremes between the angles of a grid, and means."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from ...mechanism.sampled_quantities import means
from .kernel import Kernel

Sense = Literal["max", "min", "peak"]
_ROUNDS = 12
_EXACT = 1e-11
"""Step of the search for an extreme angle [rad] at which it ends; the value is exact to the square of the step."""
MOST_ANGLES = 2**15
"""Largest number of angles of a grid."""


def grid(points: int) -> Any:
    """Angles evenly over the turn [rad], shape (points,)."""
    return np.arange(points) * (2.0 * math.pi / points)


@dataclass(frozen=True)
class Extreme:
    """An extreme of a signed column: its value without the sign, the angle [rad], the column, and the sign, which is
    +1 where it is a maximum of the column and -1 where it is a minimum."""

    value: float
    angle: float
    column: int
    sign: float


@dataclass(frozen=True)
class Stationary:
    """Angles at which columns have an extreme, one in each lane: `good` where there is one, with the derivatives
    `mixed`, shape (free, lanes), and `curvature` of the slope there; an angle without one is that of the begin."""

    q: Any
    values: Any
    mixed: Any
    curvature: Any
    good: Any


def stationary(kernel: Kernel, x: Any, columns: Any, q: Any, w: Any, sign: Any, reach: float) -> Stationary:
    """The maxima of the columns times `sign` near the angles `q`, by Newton's method within `reach` to either side;
    one column, angle, speed and sign in each lane."""
    at = q.copy()
    good = np.ones(len(q), bool)
    for _ in range(_ROUNDS):
        value, slope, mixed, curvature = kernel.derivatives_by_angle(x, at, w, columns)
        good &= np.isfinite(slope) & (sign * curvature < 0.0)
        with np.errstate(all="ignore"):
            step = np.where(good, -slope / curvature, 0.0)
        good &= np.abs(at + step - q) <= reach
        at = np.where(good, at + step, q)
        if np.all(np.abs(np.where(good, step, 0.0)) < _EXACT):
            break
    if not np.all(good):
        value, _, mixed, curvature = kernel.derivatives_by_angle(x, at, w, columns)
    return Stationary(at, value, mixed, curvature, good)


def peaks_of(values: Any, sign: float, least: float = -math.inf) -> Any:
    """The places of the local maxima of the signed periodic `values` that are at least `least`."""
    y = sign * values
    return np.flatnonzero((y >= np.roll(y, 1)) & (y >= np.roll(y, -1)) & (y >= least))


class TurnValues:
    """Extremes and means of columns at constant crank speed `w` [rad/s]."""

    def __init__(self, kernel: Kernel, w: float) -> None:
        self.kernel, self.w = kernel, w

    def _lanes(self, q: Any) -> tuple[Any, Any]:
        return q, np.full(np.shape(q), self.w)

    def extreme(
        self, x: Any, columns: Sequence[int], sense: Sense, points: int, values: Any = None
    ) -> Extreme:
        """The extreme of some columns at `x`; `values` are those at the angles of a grid with `points`, if they are
        known, shape (rows, points)."""
        q = grid(points)
        if values is None:
            values = self.kernel.values(x, *self._lanes(q))[:, 0]
        candidates = []
        for sign in {"max": (1.0,), "min": (-1.0,), "peak": (1.0, -1.0)}[sense]:
            signed = sign * values[list(columns)]
            if not np.all(np.isfinite(signed)):
                return Extreme(math.nan, math.nan, columns[0], sign)
            top = float(np.max(signed))
            near = top - 0.02 * (top - float(np.min(signed)))
            for column, row in zip(columns, signed, strict=True):
                places = peaks_of(row, 1.0, near)
                if not len(places):
                    continue
                lanes = np.full(len(places), column), *self._lanes(q[places])
                found = stationary(self.kernel, x, *lanes, sign, 2.0 * math.pi / points)
                at, exact = found.q, sign * found.values
                # a kink has its extreme at an angle of the grid
                better = ~(exact >= row[places])
                at, exact = np.where(better, q[places], at), np.where(better, row[places], exact)
                k = int(np.argmax(exact))
                candidates.append(
                    (float(exact[k]), Extreme(sign * float(exact[k]), float(at[k]), column, sign))
                )
        return max(candidates, key=lambda pair: pair[0])[1]

    def mean(self, x: Any, column: int, power: int) -> float:
        """The mean of a column, or of its square, over the continuous turn."""

        def values(q: Any) -> Any:
            return self.kernel.values(x, *self._lanes(q))[column] ** power

        return float(means(values, 0.0, 2.0 * math.pi)[0][0])
