"""The wishes of a search: objectives, free parameters with bounds, and limits."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ...core.quantities import Value, declaration, percentage, quantity, whole_number
from ...machines.machine import Machine
from ...study.cycle_quantities import CycleBasis, CycleQuantity

TURNS = "clearance"
"""The limit that the machine turns, with a distance."""
SLACK = "slack_free_speed"
"""The limit that no web goes slack up to a speed."""


@declaration
class Optimize(CycleBasis):
    """The search for the best machine."""

    clearance: Value = percentage(
        "least distance from the limits within which the machine turns, as a share of the distance of today",
        default=0.02,
        min=1e-6,
        max=1.0,
    )
    slack_free_speed: Value = quantity(
        "rad/s",
        "crank speed up to which no web goes slack: its mean pull stays above 0; with 0 there is no such limit",
        default=0.0,
        min=0.0,
        max=1000.0,
        kind="speed",
    )
    starts: Value = whole_number("number of starts, spread over the bounds", default=20, min=1, max=10_000)
    seed: Value = whole_number("seed of the starts", default=1, min=0, max=1_000_000_000)
    pareto_points: Value = whole_number(
        "number of points of the front of two objectives", default=9, min=2, max=200
    )


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
    table: Optimize

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
