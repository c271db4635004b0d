"""The internal integrator of models with states in a co-simulation FMU.

The classical Runge-Kutta method with equal steps: its cost is known beforehand, it needs no error control
that could give up in the middle of a step, and with steps well below the model's shortest time constant its
error (fourth order) lies far below that of the coupling (second order). Standard library only.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence


def rk4(
    rates: Callable[[float, Sequence[float]], Sequence[float]],
    x: Sequence[float],
    step: float,
    longest: float,
) -> list[float]:
    """The states `step` later, in equal substeps of at most `longest`; `rates` gives their derivatives at a time
    since the start of the step, and the states there."""
    n = max(1, math.ceil(step / longest - 1e-9))
    h = step / n
    now = list(x)
    for s in range(n):
        begin, middle, end = s * h, (s + 0.5) * h, (s + 1) * h
        k1 = rates(begin, now)
        k2 = rates(middle, [v + 0.5 * h * k for v, k in zip(now, k1, strict=True)])
        k3 = rates(middle, [v + 0.5 * h * k for v, k in zip(now, k2, strict=True)])
        k4 = rates(end, [v + h * k for v, k in zip(now, k3, strict=True)])
        now = [
            v + h / 6.0 * (a + 2.0 * (b + c) + d) for v, a, b, c, d in zip(now, k1, k2, k3, k4, strict=True)
        ]
    return now
