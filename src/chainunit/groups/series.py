"""A quantity over the way of a driver as a series of cosines and sines, from which Newton's method starts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple


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


class Revolution(NamedTuple):
    """The way of a driver as a turn: its place `start` [rad, m], and the `span` of one that goes to and fro as the
    cosine of the angle does; empty for one that turns round."""

    start: float
    span: Sequence[float]

    def _part(self, q: Any) -> Any:
        """A place in the span, from -1 to 1."""
        low, high = self.span
        return (q - 0.5 * (low + high)) * (2.0 / (high - low))

    def place(self, angle: float) -> float:
        """The place of the driver at an angle."""
        if not self.span:
            return angle
        low, high = self.span
        return 0.5 * (low + high + (high - low) * math.cos(angle))

    def angles(self, count: int, steps: int) -> list[float]:
        """Angles from the start on, in steps of which so many go round."""
        start = math.acos(min(max(self._part(self.start), -1.0), 1.0)) if self.span else self.start
        return [start + 2.0 * math.pi * k / steps for k in range(count)]

    def values(self, xp: Any, series: Sequence[Any], count: int, terms: int, q: Any) -> list[Any]:
        """The values of `count` series over the angle at a place of the driver, see `values_of`."""
        cos, sin = (self._part(q), None) if self.span else (xp.cos(q), xp.sin(q))
        return values_of(series, count, terms, cos, sin)
