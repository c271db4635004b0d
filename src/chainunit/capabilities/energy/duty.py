"""The loads of a year: each in steady running, with the winding as warm as the whole duty makes it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from ...core.quantities import Layout
from ...study.drive import Drive
from ...study.rig import Rig
from ...study.window import mean
from .running import InverterRating, Losses, SteadyLoad, run_steadily, scaled, warm
from .table import LoadShare

_CLOSE = 5.0
"""Difference between the temperature of a run and that of its duty [K] above which it is run once more."""


@dataclass(frozen=True)
class LoadDuty:
    """The runs of the loads by name, and the temperature of the winding in them [K]."""

    shares: Mapping[str, float]
    runs: Mapping[str, SteadyLoad]
    temperature: float

    @property
    def unsteady(self) -> list[str]:
        """The loads whose means do not stand for running that lasts."""
        return [name for name, run in self.runs.items() if not run.lasts]

    @property
    def losses(self) -> Losses:
        """Their mean over the time of running."""
        layout = Layout(Losses)
        values = [[x or 0.0 for x in layout.values(run.losses)] for run in self.runs.values()]
        whole = np.average(values, axis=0, weights=list(self.shares.values()))
        known = layout.values(next(iter(self.runs.values())).losses)
        means = (None if x is None else float(y) for x, y in zip(known, whole, strict=True))
        return Losses(**dict(zip(layout.names, means, strict=True)))

    @property
    def given_back(self) -> float:
        """Mean power that the motor gives back to its supply at moments [W]."""
        return sum(self.shares[name] * run.given_back for name, run in self.runs.items())

    def mean(self, name: str) -> float:
        """Mean of a variable over the time of running."""
        return sum(
            self.shares[load] * mean(run.turns, run.turns[name].values) for load, run in self.runs.items()
        )


def duty_of(
    rig: Rig,
    drive: Drive,
    loads: Mapping[str, LoadShare],
    inverter: InverterRating | None,
    temperature: float,
    hottest: float,
    progress: Callable[[str], None],
) -> LoadDuty:
    """The duty of a `drive`. Its winding begins at `temperature` [K]; where the whole duty makes it warmer or colder
    than that by more than `_CLOSE`, all is run once more at that temperature, at most at the `hottest` [K].

    Raises
    ------
    RunError
        where a run fails.
    """
    whole = sum(each.share for each in loads.values())
    shares = {name: float(each.share) / whole for name, each in loads.items()}
    feed = rig.operation.feed

    def at(temperature: float) -> LoadDuty:
        runs = {}
        for name, each in loads.items():
            progress(name)
            own = scaled(feed, float(each.factor))
            runs[name] = run_steadily(rig, warm(drive, temperature), own, inverter)
        return LoadDuty(shares, runs, temperature)

    first = at(min(temperature, hottest))
    if first.unsteady:
        return first
    settled = drive.motor.settled_temperature(
        drive.fmu_parameters, first.mean("motor.heat"), first.temperature, first.mean(drive.motor_speed)
    )
    settled = min(settled, hottest)
    return first if abs(settled - first.temperature) <= _CLOSE else at(settled)
