"""The torque on the parts between motor and machine in a run, at the crank: on a safety coupling on the
motor's shaft, and at the output of the gear."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from .arrays import peak
from .drive import Drive
from .readings import crank_torque

if TYPE_CHECKING:
    import xarray as xr

PeakOf = Callable[[Drive, "xr.Dataset"], float]
"""The peak of a torque in a run, at the crank [N m]."""


def on_coupling(drive: Drive, run: xr.Dataset) -> float:
    """Peak torque in a run on a coupling that sits on the motor shaft behind rotor and added inertia, at the crank
    [N m]: the torque of the motor less the one that accelerates the inertia on its side."""
    return peak(run["motor.tau"].values) * drive.ratio


def gear_torque(drive: Drive, run: xr.Dataset) -> Any:
    """Torque in a run at the output of the gear [N m], shape (time,): in the shaft behind the gear where the
    driveline is there, else at the crank."""
    behind_gear = bool(drive.line) and drive.driven_machine.ratio == 1.0
    return run["motor.tau"].values * drive.ratio if behind_gear else crank_torque(drive, run)


def at_gear(drive: Drive, run: xr.Dataset) -> float:
    """Peak torque in a run at the output of the gear [N m], see `gear_torque`."""
    return peak(gear_torque(drive, run))


@dataclass(frozen=True)
class DutyPeak:
    """The largest torque of normal duty without the starts, at the crank [N m], and the run in which it is."""

    torque: float
    run: str


def duty_peak(drive: Drive, runs: Iterable[tuple[str, xr.Dataset]], of: PeakOf) -> DutyPeak:
    """The largest torque `of` the runs of normal duty, each with its name: steady running, events that may last, and
    all feed on either side (`all_feed_on`)."""
    return max((DutyPeak(of(drive, run), name) for name, run in runs), key=lambda peak: peak.torque)


def all_feed_on(side: str) -> str:
    """The name of the run with all feed on a side, and while it moves there."""
    return f"all_feed_on_the_{side}"
