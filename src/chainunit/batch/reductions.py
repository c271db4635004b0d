"""Quantities of a cycle, computed while the states go by, so that the states need not be stored."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Reduction:
    """A reduction of a column over the last dimension: in words, as a function of an array, and in C.

    In C a vector starts with `begin`, takes up each vector of values by `take` and ends as `end`, where ``{a}`` is
    the vector, ``{y}`` the values, ``{one}`` 1 for a lane that counts and 0 for one that does not, and ``{n}`` the
    number of values.
    """

    words: str
    of_array: Any
    begin: str
    take: str
    end: str


REDUCTIONS = {
    "min": Reduction(
        "least", lambda x: np.min(x, axis=-1), "V(INFINITY)", "fmin_v({a},{y})", "lane_least({a})"
    ),
    "max": Reduction(
        "largest", lambda x: np.max(x, axis=-1), "V(-INFINITY)", "fmax_v({a},{y})", "lane_largest({a})"
    ),
    "peak": Reduction(
        "largest absolute value",
        lambda x: np.max(np.abs(x), axis=-1),
        "V(0.0)",
        "fmax_v({a},fabs_v({y}))",
        "lane_largest({a})",
    ),
    "mean": Reduction(
        "mean", lambda x: np.mean(x, axis=-1), "V(0.0)", "{a}+{one}*{y}", "lane_sum({a})/(double)({n})"
    ),
    "rms": Reduction(
        "root of the mean square",
        lambda x: np.sqrt(np.mean(x * x, axis=-1)),
        "V(0.0)",
        "{a}+{one}*{y}*{y}",
        "sqrt(lane_sum({a})/(double)({n}))",
    ),
}
"""By name."""
