"""A periodic quantity of a turning driver as a series of cosines and sines, from which Newton's method starts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any


def series_of(values: Sequence[Any], angles: Sequence[float], harmonics: int) -> list[Any]:
    """The mean, and the factors of cosine and sine by order, from the values at evenly spaced angles of a turn."""
    count = len(values)
    series = [sum(values) / count]
    for n in range(1, harmonics + 1):
        for wave in (math.cos, math.sin):
            series.append(sum(v * (2.0 / count * wave(n * q)) for v, q in zip(values, angles, strict=True)))
    return series


def values_of(series: Sequence[Any], count: int, terms: int, cos: Any, sin: Any) -> list[Any]:
    """The values of `count` such series, each of so many `terms`, from cosine and sine of the angle; from the cosine
    alone, with None for the sine, if they are even."""
    sums = [series[k * terms] for k in range(count)]
    c, s, last = cos, 0.0 if sin is None else sin, 1.0
    for n in range(1, terms // 2 + 1):
        for k in range(count):
            sums[k] = sums[k] + series[k * terms + 2 * n - 1] * c + series[k * terms + 2 * n] * s
        if sin is None:
            c, last = 2.0 * cos * c - last, c
        else:
            c, s = c * cos - s * sin, s * cos + c * sin
    return sums
