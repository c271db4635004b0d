"""The loads of a year: each in steady running, with the winding as warm as the whole duty makes it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace

from ...core.quantities import Layout
from ...study.drive import Drive
from ...study.rig import Rig
from ...study.window import mean
from .running import InverterRating, Losses, SteadyLoad, run_steadily, scaled, warm
from .table import LoadShare

_CLOSE = 0.5
"""Difference between the temperature of a run and that of its duty [K] above which it is run once more; with it the
resistances are right to 0.2 %, and the electric power to a fraction of that."""
_PASSES = 3
"""Most runs of the duty at one temperature each."""


@dataclass(frozen=True)
class LoadDuty:
    """The runs of the loads by name, and the temperature of the winding in them [K]. `is_too_hot` tells whether the
    duty would make it hotter than permitted; then the runs are at the permitted temperature."""

    shares: Mapping[str, float]
    runs: Mapping[str, SteadyLoad]
    temperature: float
    is_too_hot: bool = False

    @property
    def unsteady(self) -> list[str]:
        """The loads whose means do not stand for running that lasts."""
        return [name for name, run in self.runs.items() if not run.lasts]

    @property
    def losses(self) -> Losses:
        """Their mean over the time of running."""
        layout = Layout(Losses)
        places = zip(*(layout.values(run.losses) for run in self.runs.values()), strict=True)
        return layout.instance([None if None in losses else self._mean(losses) for losses in places])

    @property
    def given_back(self) -> float:
        """Mean power that the motor gives back to its supply at moments [W]."""
        return self._mean(run.given_back for run in self.runs.values())

    def mean(self, name: str) -> float:
        """Mean of a variable over the time of running."""
        return self._mean(mean(run.turns, run.turns[name].values) for run in self.runs.values())

    def _mean(self, values: Iterable[float]) -> float:
        """The mean of a value of each run, by the shares of the loads."""
        return sum(share * x for share, x in zip(self.shares.values(), values, strict=True))


def duty_of(
    rig: Rig,
    drive: Drive,
    loads: Mapping[str, LoadShare],
    inverter: InverterRating | None,
    temperature: float,
    hottest: float,
    progress: Callable[[str], None],
    is_steady: bool = False,
) -> LoadDuty:
    """The duty of a `drive`. Its winding begins at `temperature` [K]; where the whole duty makes it warmer or colder
    than that by more than `_CLOSE`, all is run once more at that of the duty, at most at the `hottest` [K]. With
    `is_steady` it is the temperature of this duty, known from elsewhere.

    Raises
    ------
    RunError
        where a run fails.
    """
    whole = sum(load.share for load in loads.values())
    shares = {name: float(load.share) / whole for name, load in loads.items()}
    feed = rig.operation.feed

    def duty_at(temperature: float) -> LoadDuty:
        """The runs of all loads with a winding of this temperature [K]."""
        runs = {}
        for name, load in loads.items():
            progress(name)
            scaled_feed = scaled(feed, float(load.factor))
            runs[name] = run_steadily(rig, warm(drive, temperature), scaled_feed, inverter)
        return LoadDuty(shares, runs, temperature)

    duty = duty_at(min(temperature, hottest))
    for k in range(_PASSES):
        if duty.unsteady:
            return duty
        if is_steady:
            settled = temperature
        else:
            settled = drive.motor.settled_temperature(
                drive.fmu_parameters, duty.mean("motor.heat"), duty.temperature, duty.mean(drive.motor_speed)
            )
        duty = replace(duty, is_too_hot=settled > hottest)
        settled = min(settled, hottest)
        if abs(settled - duty.temperature) <= _CLOSE or k == _PASSES - 1:
            break
        duty = duty_at(settled)
    return duty
