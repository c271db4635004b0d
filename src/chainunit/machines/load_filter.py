"""The filter of `chainunit.machines.load_observer`: rates of a covariance, and of alarms.

Symmetric matrices are lists of rows; states store the upper triangle, row after row. Numbers are those of any engine
`xp`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

UNKNOWNS = ("speed", "left_feed", "right_feed", "left_force", "right_force", "offset")
"""What the filter estimates, in the order of its matrices."""
SIZE = len(UNKNOWNS)
TRIANGLE = tuple((i, j) for i in range(SIZE) for j in range(i, SIZE))
"""The places of the stored entries."""

Matrix = list[list[Any]]


def symmetric(entries: Sequence[Any]) -> Matrix:
    """The matrix of the stored entries."""
    rows: Matrix = [[0.0] * SIZE for _ in range(SIZE)]
    for (i, j), entry in zip(TRIANGLE, entries, strict=True):
        rows[i][j] = rows[j][i] = entry
    return rows


def covariance_rates(
    P: Matrix, gradient: Sequence[Any], decay: Sequence[Any], density: Sequence[Any], rate: Any
) -> list[Any]:
    """Rates of the covariance `P` of a Kalman-Bucy filter, by stored entries (the equation of Riccati):

        dP/dt = A P + P A' + Q - P C' C P rate

    The first unknown is measured, with a noise of the density 1/`rate`; its rate has the `gradient` by all unknowns.
    The others decay by themselves with the rates `decay`. `density` are the densities of the noise that drives each.
    """
    with_rate = [sum(a * p for a, p in zip(gradient, row, strict=True)) for row in P]
    rates = []
    for i, j in TRIANGLE:
        entry = -(P[i][0] * P[j][0] * rate) - (decay[i] + decay[j]) * P[i][j]
        rates.append(entry + _driving_term(i, j, with_rate, density))
    return rates


def error_rates(
    S: Matrix,
    gain: Sequence[Any],
    gradient: Sequence[Any],
    decay: Sequence[Any],
    density: Sequence[Any],
    rate: Any,
) -> list[Any]:
    """Rates of the covariance `S` of the errors that a filter with this `gain` has under noise of other densities
    than its own, by stored entries (the equation of Lyapunov):

        dS/dt = (A - K C) S + S (A - K C)' + Q + K K'/rate
    """
    with_rate = [sum(a * s for a, s in zip(gradient, row, strict=True)) for row in S]
    rates = []
    for i, j in TRIANGLE:
        corrected = gain[i] * S[0][j] + gain[j] * S[0][i] - gain[i] * gain[j] / rate
        driving = _driving_term(i, j, with_rate, density)
        rates.append(driving - corrected - (decay[i] + decay[j]) * S[i][j])
    return rates


def _driving_term(i: int, j: int, with_rate: Sequence[Any], density: Sequence[Any]) -> Any:
    """Entry (i, j) of A P + P A' + Q without the decay. `with_rate` has the covariance of each unknown with the rate
    of the first one, the only rate that depends on other unknowns: so only the first row and column take it."""
    entry: Any = density[i] if i == j else 0.0
    if i == 0:
        entry = entry + with_rate[j]
    if j == 0:
        entry = entry + with_rate[i]
    return entry


def difference(matrix: Matrix, i: int, j: int) -> Any:
    """The variance of the difference of two unknowns."""
    return matrix[i][i] + matrix[j][j] - 2.0 * matrix[i][j]


LEAST_LEVEL = 3.4
"""Least level of an alarm in standard deviations. A permanent error beyond the level is no matter of rates: at this
level 0.7 machines of a thousand have one."""
LEAST_SHARE = 1e-300
"""Least share s of `level`, so that its level is finite: 37."""
_BEYOND = (
    (-43132.9194, 50439.987, 4574.7012, 18.6157993, -0.0448189547),
    (-31737.3158, 58526.6104, 24399.6975, 1071.96994, 1.0),
)
"""The level z less q = sqrt(-2 log(s)), as a quotient of polynomials of q, lowest power first: `bench/level.py`."""


def level(xp: Any, memory: Any, rate: Any) -> Any:
    """The level, in standard deviations, that the size of a stationary Gaussian quantity exceeds `rate` times in some
    time, if it forgets its value in the time `memory`, in the same unit.

    From far below, a quantity that forgets like exp(-t/memory) rises above z, or falls below -z,
    2 z exp(-z^2/2)/(sqrt(2 pi) memory) times. With the diffusion D of a quantity of the variance S^2 its memory is
    S^2/D. A part of S that is constant in each machine has no share in D: then the formula is the mean over machines.

    The level solves z exp(-z^2/2) = s: it is the root of -W(-s^2), with the lower branch of Lambert's function. Its
    relative error is at most 1.2e-8, from `LEAST_LEVEL` to the level of `LEAST_SHARE`; it takes one logarithm.
    """
    share = 0.5 * math.sqrt(2.0 * math.pi) * memory * rate
    most = LEAST_LEVEL * math.exp(-0.5 * LEAST_LEVEL * LEAST_LEVEL)
    q = xp.sqrt(-2.0 * xp.log(xp.maximum(xp.minimum(share, most), LEAST_SHARE)))
    above, below = (_polynomial(factors, q) for factors in _BEYOND)
    return q + above / below


def _polynomial(factors: Sequence[float], x: Any) -> Any:
    """The polynomial with these factors, lowest power first."""
    *others, total = factors
    for factor in reversed(others):
        total = total * x + factor
    return total


_ERF = (0.254829592, -0.284496736, 1.421413741, -1.453152027, 1.061405429)


def normal_probability(xp: Any, z: Any) -> Any:
    """The probability that a standard normal number is below `z`; error below 1e-7 (Abramowitz, Stegun, 7.1.26)."""
    size = xp.abs(z) * math.sqrt(0.5)
    t = 1.0 / (1.0 + 0.3275911 * size)
    tail = 0.5 * (_polynomial(_ERF, t) * t) * xp.exp(-size * size)
    # `tail` below zero, 1 - `tail` above
    above = step(xp, z, 0.0)
    return tail + above * (1.0 - 2.0 * tail)


def step(xp: Any, x: Any, threshold: Any) -> Any:
    """0 if `x` is below `threshold`, 1 if it is above: a steep ramp, which every engine has."""
    return xp.minimum(xp.maximum(1e9 * (x - threshold), 0.0), 1.0)
