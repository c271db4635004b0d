"""The largest torques on the parts between motor and machine in the events of a study and in its normal duty."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

from .event import Role
from .protection import CouplingEffect, goal
from .record import StudyRecord
from .sections import Coupling
from .torques import DutyPeak, PeakOf, at_gear, duty_peak, gear_torque, on_coupling
from .verdict import STEADY


def from_event_on(study: StudyRecord, name: str) -> xr.Dataset:
    """The part of a run from the begin of its event on."""
    return study.runs[name].sel(time=slice(study.event[name], None))


def peaks_in_events(study: StudyRecord, *roles: Role, of: PeakOf = on_coupling) -> dict[str, float]:
    """Peak torque in each event with one of these `roles`, or in every event without `roles` [N m]."""
    events = study.config.events
    return {
        name: of(study.drive, from_event_on(study, name))
        for name in study.event
        if name in study.runs and (not roles or events[name].role in roles)
    }


def running_peak(study: StudyRecord, of: PeakOf = on_coupling) -> DutyPeak:
    """The largest torque of normal duty without the starts: of steady running, of events that may last, and of the
    runs of sizing with all feed on either side."""
    events = study.config.events
    lasting = [
        (name, from_event_on(study, name))
        for name in study.event
        if name in study.runs and events[name].role is Role.DUTY and not events[name].from_rest
    ]
    peaks = [duty_peak(study.drive, [(STEADY, study.steady), *lasting], of)]
    if study.sizing is not None and not study.insufficient and study.sizing.best.duty is not None:
        peaks.append(study.sizing.best.duty)
    return max(peaks, key=lambda peak: peak.torque)


def running_words(study: StudyRecord, run: str) -> str:
    """The case of normal duty of a run, in words."""
    title = study.title_of(run)
    return title if run == STEADY else f"running ({title})"


def effects(
    study: StudyRecord,
    setting: float,
    runs: Mapping[str, xr.Dataset] | None = None,
    release: float | None = None,
) -> dict[str, CouplingEffect]:
    """The effect of a coupling with this setting [N m at the crank] in each shock that opens it, by name; it passes
    torque for the `release` time [s], by default the declared one. `runs` are other runs of the shocks without a
    coupling, from their begin on; by default those of the study."""
    drive, release = study.drive, Coupling().release_time if release is None else release
    if runs is None:
        names = peaks_in_events(study, Role.SHOCK)
        runs = {name: from_event_on(study, name) for name in names}
    found = {}
    for name, run in runs.items():
        time, torque = run["time"].values, np.abs(run["motor.tau"].values) * drive.ratio
        passed = np.flatnonzero(torque > setting)
        if not passed.size:
            continue
        k = int(passed[0])
        before = slice(max(k - 1, 0), k + 1)
        trip = float(np.interp(setting, torque[before], time[before]))
        end = trip + release
        # up to the opening the run is the same as without the coupling
        until = run.sel(time=slice(None, end))
        rows = until.sizes["time"]
        last = run.isel(time=slice(rows - 1, rows + 1)).interp(time=[min(end, float(time[-1]))])
        without = at_gear(drive, run)
        wanted = goal(without, study.config.gear.torque_limit)
        above = int(np.argmax(np.abs(gear_torque(drive, run)) > wanted))
        in_time = max(float(time[max(above - 1, 0)]) - trip, 0.0)
        with_coupling = max(at_gear(drive, until), at_gear(drive, last))
        found[name] = CouplingEffect(without, with_coupling, wanted, in_time)
    return found
