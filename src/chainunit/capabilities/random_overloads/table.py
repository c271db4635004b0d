"""The table [monte_carlo] of a study file: declarations only."""

from __future__ import annotations

from dataclasses import dataclass

from ...core.quantities import Value, declaration, quantity, whole_number
from ...study.event_table import RandomRuns


@declaration
class MonteCarlo:
    """Overloads at random crank angles and times."""

    runs: Value = whole_number("number of runs; with 0 there are none", default=0, min=0, max=1_000_000)
    duration: Value = quantity(
        "s", "time that is followed after the event", default=2.0, min=0.05, max=1e4, usual=(0.05, 600.0)
    )
    seed: Value = whole_number("seed of the random numbers", default=1, min=0, max=1_000_000_000)


@dataclass(frozen=True)
class RandomPlan(RandomRuns):
    """The runs, and the `seed` of their random numbers."""

    seed: int
