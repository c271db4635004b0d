"""The recommended setting of the torque limiter of a sized drive, and its effect in the overloads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ...drives.catalogue_couplings import CatalogueCoupling
from ...study.arrays import Dataset, peak
from ...study.coupling import hardest_start, pull_out
from ...study.drive import Drive
from ...study.event import Role
from ...study.judgement import wrong_runs
from ...study.record import StudyRecord, StudyRuns
from ...study.sections import Coupling
from ...study.torques import at_gear, gear_torque, peaks_in_events, running_peak
from ...study.verdict import STEADY
from .parts import coupling_for
from .protection import CouplingEffect, Setting, goal


def recommended_setting(study: StudyRecord, couplings: Sequence[CatalogueCoupling] = ()) -> Setting | None:
    """The recommended torque limiter of a sized drive, judged by the events of the study, with its effects in the
    overloads that open it. None if no motor fits, if the file gives a coupling, which cuts off the peaks from which
    the setting follows, or if the study ended before steady running.

    Runs whose energy balance is not kept are left out; with one of normal duty among them there are no overloads. A
    product among the `couplings` of a catalogue that can be set so is tried with its own release time.
    """
    setup, runs = study.setup, study.runs
    if setup.insufficient or setup.config.coupling or STEADY not in runs.answers:
        return None
    events, wrong = setup.config.events, wrong_runs(runs)
    wrong_duty = [n for n in wrong if n not in events or events[n].from_rest or events[n].role is Role.DUTY]
    shocks, disturbances = (peaks_in_events(runs, role) for role in (Role.SHOCK, Role.DISTURBANCE))
    setting = Setting(
        running=running_peak(study).torque,
        start=hardest_start(study).torque,
        motor=pull_out(runs),
        gear=setup.config.drive.gear.torque_limit,
        line=setup.drive.at_crank(setup.drive.line.stall_torque),
        overloads={} if wrong_duty else {n: peak for n, peak in shocks.items() if n not in wrong},
        disturbances={n: peak for n, peak in disturbances.items() if n not in wrong},
        wrong=wrong_duty or [n for n in wrong if n in shocks],
    )
    if setting.obstacle is not None:
        return setting
    product = coupling_of(runs, setting, couplings)
    release = None if product is None else float(product.data.release_time)
    by_shock = effects(study, setting.least, release=release)
    return replace(setting, effects={n: by_shock[n] for n in setting.opens})


def coupling_of(
    runs: StudyRuns, setting: Setting, couplings: Sequence[CatalogueCoupling]
) -> CatalogueCoupling | None:
    """The torque limiter of the catalogues for that setting, see `coupling_for`; it turns with the motor's shaft."""
    fastest = peak(runs.steady[runs.drive.motor_speed].values)
    return coupling_for(couplings, runs.drive.at_motor_shaft(setting.least), fastest)


def effects(
    study: StudyRecord,
    setting: float,
    runs: Mapping[str, Dataset] | None = None,
    release: float | None = None,
) -> dict[str, CouplingEffect]:
    """The effect of a coupling with this setting [N m at the crank] in each shock that opens it, by name; it passes
    torque for the `release` time [s], by default the declared one. `runs` are other runs of the shocks without a
    coupling, from their begin on; by default the runs of the study."""
    drive, release = study.setup.drive, Coupling().release_time if release is None else release
    if runs is None:
        names = peaks_in_events(study.runs, Role.SHOCK)
        runs = {name: run for name, run in study.runs.event_parts.items() if name in names}
    trips = {name: _trip_time(drive, run, setting) for name, run in runs.items()}
    limit = study.setup.config.drive.gear.torque_limit
    return {
        name: _effect(drive, runs[name], trip, release, limit)
        for name, trip in trips.items()
        if trip is not None
    }


def _trip_time(drive: Drive, run: Dataset, setting: float) -> float | None:
    """The time at which the torque of the motor's shaft passes the `setting` [N m at the crank]; None if it never
    does."""
    time, torque = run["time"].values, drive.at_crank(np.abs(run[drive.motor_torque].values))
    passed = np.flatnonzero(torque > setting)
    if not passed.size:
        return None
    around = slice(max(int(passed[0]) - 1, 0), int(passed[0]) + 1)
    return float(np.interp(setting, torque[around], time[around]))


def _effect(drive: Drive, run: Dataset, trip: float, release: float, limit: float) -> CouplingEffect:
    """The effect of a coupling that opens at the time `trip` [s] in a `run` without one. Both runs are the same until
    no torque passes it any more."""
    time, end = run["time"].values, trip + release
    until = run.sel(time=slice(None, end))
    rows = until.sizes["time"]
    at_end = run.isel(time=slice(rows - 1, rows + 1)).interp(time=[min(end, float(time[-1]))])
    without = at_gear(drive, run)
    goal_torque = goal(without, limit)
    above = int(np.argmax(np.abs(gear_torque(drive, run)) > goal_torque))
    return CouplingEffect(
        without,
        with_coupling=max(at_gear(drive, until), at_gear(drive, at_end)),
        goal=goal_torque,
        release=max(float(time[max(above - 1, 0)]) - trip, 0.0),
        current=peak(until[f"motor.{drive.motor.current}"].values),
    )
