"""The search for the least value of a function of one number."""

from __future__ import annotations

import math
from collections.abc import Callable

_GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
_STEPS = 24


def lowest(value_at: Callable[[float], float], low: float, high: float) -> tuple[float, float]:
    """The place of the least value in a range that has one low, and that value, by golden sections: the place has
    an error of 1e-5 of the range at most. Where a value is NaN, the first such place."""
    a, b = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
    at_a, at_b = value_at(a), value_at(b)
    for _ in range(_STEPS):
        for q, value in ((a, at_a), (b, at_b)):
            if math.isnan(value):
                return q, value
        if at_a < at_b:
            high, b, at_b = b, a, at_a
            a = high - _GOLDEN * (high - low)
            at_a = value_at(a)
        else:
            low, a, at_a = a, b, at_b
            b = low + _GOLDEN * (high - low)
            at_b = value_at(b)
    return (a, at_a) if at_a < at_b else (b, at_b)
