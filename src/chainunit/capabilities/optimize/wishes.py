"""The wishes of a search: objectives, free parameters with bounds, and limits."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from ...machines.machine import Machine
from ...study.cycle_quantities import CycleBasis, CycleQuantity

TURNS = "clearance"
"""The limit that the machine turns, with a distance."""
SLACK = "slack_free_speed"
"""The limit that no web goes slack up to a speed."""


@dataclass(frozen=True)
class TurnLimit:
    """Limits of a quantity of the turn; None where there is none on that side."""

    quantity: CycleQuantity
    low: float | None
    high: float | None

    @property
    def name(self) -> str:
        """The name of the quantity, by which the limit is called."""
        return self.quantity.name

    def is_missed(self, value: float) -> bool:
        """Whether a value is outside the limits by more than a millionth of them."""
        is_below = self.low is not None and value < self.low - 1e-6 * abs(self.low)
        is_above = self.high is not None and value > self.high + 1e-6 * abs(self.high)
        return is_below or is_above or math.isnan(value)


@dataclass(frozen=True)
class Wishes:
    """What is searched."""

    machine: Machine
    feed: Any
    crank_speed: float
    """[rad/s]"""
    objectives: tuple[CycleQuantity, ...]
    free: Mapping[str, tuple[float, float]]
    """least and largest value of each free parameter"""
    limits: tuple[TurnLimit, ...]
    clearance: float
    """distance from the requirements of the model, as a share of the value of today"""
    slack_free_speed: float = 0.0
    """crank speed up to which no web goes slack [rad/s]; 0 without that wish"""
    basis: CycleBasis = field(default_factory=CycleBasis)
    starts: int = 20
    seed: int = 1
    pareto_points: int = 9

    @property
    def names(self) -> tuple[str, ...]:
        """The free parameters."""
        return tuple(self.free)

    @property
    def today(self) -> Any:
        """Their values today, shape (free,)."""
        import numpy as np

        by_name = self.machine.by_name
        return np.array([by_name[name] for name in self.free])
