"""A number that is sought from recordings."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Unknown:
    """A number that is sought: its start value, its bounds, and its prior, the start value with the standard
    deviation `prior_deviation`. Bounds alone have the standard deviation of an even distribution."""

    name: str
    unit: str
    start: float
    low: float
    high: float
    prior_deviation: float
    is_nuisance: bool = False
    is_even: bool = False

    @classmethod
    def within(cls, name: str, unit: str, low: float, high: float) -> Unknown:
        """One of which only the bounds are known."""
        return cls(name, unit, 0.5 * (low + high), low, high, (high - low) / math.sqrt(12.0), is_even=True)

    @property
    def interval(self) -> tuple[float, float]:
        """The ends of the interval that contains the number beforehand: its bounds, or 95 % of its prior in them."""
        if self.is_even:
            return self.low, self.high
        half = 1.96 * self.prior_deviation
        return max(self.low, self.start - half), min(self.high, self.start + half)
