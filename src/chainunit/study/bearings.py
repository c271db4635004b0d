"""The loads of the machine's pins and guides in a run."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from .arrays import Dataset
from .drive import Drive
from .readings import machine_series
from .window import mean

EXPONENT = {"ball": 3.0, "roller": 10.0 / 3.0}
"""Exponent p of the rating life of ISO 281, by the kind of bearing."""


def pin_loads(drive: Drive, run: Dataset) -> dict[str, dict[str, float | None]]:
    """Peak, RMS and, by kind of rolling bearing, equivalent load (mean of ISO 281 over the angle that the pin turns)
    of the reaction of every pin and guide [N]; a guide, which does not turn, has no equivalent load. Empty for a
    machine that is a foreign FMU."""
    if drive.foreign_machine:
        return {}
    table: dict[str, dict[str, float | None]] = {}
    machine = drive.simulated_machine
    angles = machine.pin_turns(machine_series(run))
    for title, name in machine.model.pins.items():
        forces = pin_force(drive, run, title)
        table[title] = {"peak": float(np.max(forces)), "rms": math.sqrt(mean(run, forces**2))}
        for kind, p in EXPONENT.items():
            equivalent = mean_load(forces, angles[name], p) if name in angles else None
            table[title][f"{kind}_equivalent"] = equivalent
    return table


def driver_bearing(drive: Drive) -> str:
    """The title of the bearing in which the driver turns, such as that of O1 of a crank; empty for a machine
    that does not show it, such as a foreign FMU."""
    if drive.foreign_machine:
        return ""
    model = drive.simulated_machine.model
    # the driver is the first group, and its bearing the only joint of it
    ((driver_joint, *_),) = model.topology.groups[0].joints
    titles = {model.joints.get(output): title for title, output in model.pins.items()}
    return titles.get(driver_joint, "")


def pin_force(drive: Drive, run: Dataset, title: str) -> Any:
    """Size of the reaction of a pin or guide of that `title` in a run [N], shape (time,)."""
    output = drive.simulated_machine.model.pins[title]
    return np.hypot(run[f"machine.{output}.fx"].values, run[f"machine.{output}.fy"].values)


_ALIKE = 1e-3
"""Relative difference of peaks up to which they count as equal: the start-up ends where steady running begins."""


def hardest_run(pins: Mapping[str, Mapping[str, Mapping[str, float | None]]], pin: str) -> str:
    """The run with the largest peak of a pin; of equal ones the first."""
    peaks = {run: table[pin]["peak"] or 0.0 for run, table in pins.items()}
    return next(run for run, peak in peaks.items() if peak >= (1.0 - _ALIKE) * max(peaks.values()))


def largest_load(pins: Mapping[str, Mapping[str, Mapping[str, float | None]]], pin: str) -> tuple[float, str]:
    """The largest force of a pin [N], and its `hardest_run`."""
    run = hardest_run(pins, pin)
    return pins[run][pin]["peak"] or 0.0, run


def mean_load(force: Any, angle: Any, exponent: float = 3.0) -> float:
    """Equivalent load of a bearing [N]: the mean of ISO 281 over the angle that it turns.

    P = (integral of F^p |d alpha| / integral of |d alpha|)^(1/p), with `force` [N] and the `angle` [rad] of
    the pin in its bearing, both of shape (n,); p = 3 for ball bearings, 10/3 for rollers. Zero where nothing turns.
    """
    force = np.asarray(force)
    weight = np.abs(np.diff(np.asarray(angle)))
    total = float(np.sum(weight))
    if total == 0.0:
        return 0.0
    middle = 0.5 * (force[1:] + force[:-1])
    return float((np.sum(middle**exponent * weight) / total) ** (1.0 / exponent))
