"""The torque on the parts between motor and machine, at the crank: on a torque limiter on the motor's shaft, and at
the output of the gear; in a run, in the events of a study, and in its normal duty."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from ..core.engines import numpy_
from ..drives.gearing import geared_acceleration
from ..drives.induction_steady import steady
from .arrays import Dataset, peak
from .drive import Drive
from .event import Role
from .proposal import DutyPeak
from .readings import crank_torque, load_inertia
from .record import StudyRecord, StudyRuns
from .verdict import START, STEADY

PeakOf = Callable[[Drive, Dataset], float]
"""The peak of a torque in a run, at the crank [N m]."""


def on_coupling(drive: Drive, run: Dataset) -> float:
    """Peak torque in a run on a coupling that sits on the motor shaft behind rotor and added inertia, at the crank
    [N m]: the torque of the motor less the one that accelerates the inertia on its side."""
    return float(drive.at_crank(peak(run[drive.motor_torque].values)))


def gear_torque(drive: Drive, run: Dataset) -> Any:
    """Torque in a run at the output of the gear [N m], shape (time,): in the shaft behind the gear where
    driveline or flywheel are there, else at the crank."""
    slips = drive.line.before_gear is not None
    wheel = drive.geared_line.part("flywheel")
    if wheel is not None and (slips or wheel.ratio != 1.0):
        return run["flywheel.tau"].values * wheel.ratio
    if slips:
        return crank_torque(drive, run)
    behind_gear = bool(drive.whole_line) and drive.driven_machine.ratio == 1.0
    return run[drive.motor_torque].values * drive.ratio if behind_gear else crank_torque(drive, run)


def at_gear(drive: Drive, run: Dataset) -> float:
    """Peak torque in a run at the output of the gear [N m], see `gear_torque`."""
    return peak(gear_torque(drive, run))


CURVE = ("motor.v", "motor.supply.frequency", "machine.tau_bias", "machine.J")
"""The outputs of a run, beside the speed, that `quasi_static_torque` follows from."""


def quasi_static_torque(drive: Drive, run: Dataset, before: float = 0.0) -> Any:
    """Torque in a run at the output of the gear [N m], shape (time,), by load and acceleration: the motor gives the
    torque of its curve at the present speed, voltage and frequency, and accelerates rotor and machine as one body.
    With the inertia `before` [kg m2 at the motor's shaft] it is that on a part which accelerates this inertia, too.

    It lacks the electromagnetic transient of a motor that is switched on, some periods of the line long: play and
    stiffness of a real line change its peaks. The speed of the run overshoots by this transient; the curve brakes no
    more there than the load drives. An inverter switches nothing: its torque is that of the run, as is that of a
    machine that gives no load port, and that behind a part that slips, which softens the transient."""
    if _is_of_run(drive, run):
        return gear_torque(drive, run)
    p, ratio = drive.fmu_parameters, drive.ratio
    voltage, frequency = run["motor.v"].values / p.supply.V, run["motor.supply.frequency"].values
    w = run["motor.w"].values
    motor = steady(numpy_(), p, w, voltage, frequency, p.ambient.T).tau
    inertia = load_inertia(drive, run)
    load = run["machine.tau_bias"].values * drive.ratio_at_machine / ratio
    motor = np.maximum(motor, np.minimum(load, 0.0))
    a = geared_acceleration(numpy_(), load, inertia, w, p.rotor.J, motor, drive.gear.loss)
    return ratio * (load + (inertia + before / (1.0 + drive.gear.loss)) * a)


def _is_of_run(drive: Drive, run: Dataset) -> bool:
    """Whether the quasi-static torque is that of the run."""
    return drive.follows or drive.line.before_gear is not None or any(name not in run for name in CURVE)


def quasi_static_peak(drive: Drive, run: Dataset, peak_of: PeakOf = at_gear, before: float = 0.0) -> float:
    """Peak torque of a part in a run by load and acceleration, at the crank [N m], see `quasi_static_torque`; at
    most what `peak_of` reads from the run, whose motor may speed up faster than its field follows the curve."""
    most = peak_of(drive, run)
    if _is_of_run(drive, run):
        return most
    return min(peak(quasi_static_torque(drive, run, before)), most)


def duty_peak(drive: Drive, runs: Iterable[tuple[str, Dataset]], peak_of: PeakOf) -> DutyPeak:
    """The largest torque, read by `peak_of`, in the runs of normal duty, each with its name: steady running, events
    that may last, and all feed on either side (`all_feed_on`)."""
    return max((DutyPeak(peak_of(drive, run), name) for name, run in runs), key=lambda peak: peak.torque)


def all_feed_on(side: str) -> str:
    """The name of the run with all feed on a side, and while it moves there."""
    return f"all_feed_on_the_{side}"


def peaks_in_events(runs: StudyRuns, *roles: Role) -> dict[str, float]:
    """Peak torque on a coupling in each event with one of these `roles`, or in every event without `roles` [N m]."""
    return {
        name: on_coupling(runs.drive, run)
        for name, run in runs.event_parts.items()
        if not roles or runs.events[name].role in roles
    }


def gear_peaks(runs: StudyRuns) -> dict[str, float]:
    """Peak torque at the output of the gear in steady running, in the start-up and in each event [N m], by the name
    of the run. If the supply is switched, in starts and in disturbances, it is that by load and acceleration."""
    peaks = {STEADY: at_gear(runs.drive, runs.steady), START: quasi_static_peak(runs.drive, runs.rise)}
    for name, run in runs.event_parts.items():
        is_switched = runs.events[name].from_rest or runs.events[name].role is Role.DISTURBANCE
        peaks[name] = (quasi_static_peak if is_switched else at_gear)(runs.drive, run)
    return peaks


def running_peak(study: StudyRecord, peak_of: PeakOf = on_coupling) -> DutyPeak:
    """The largest torque of normal duty without the starts: of steady running, of events that may last, and of the
    runs from which a drive was chosen."""
    runs, proposal = study.runs, study.setup.proposal
    lasting = [
        (name, run)
        for name, run in runs.event_parts.items()
        if runs.events[name].role is Role.DUTY and not runs.events[name].from_rest
    ]
    peaks = [duty_peak(runs.drive, [(STEADY, runs.steady), *lasting], peak_of)]
    if proposal is not None and proposal.duty is not None:
        peaks.append(proposal.duty)
    return max(peaks, key=lambda peak: peak.torque)


def running_words(runs: StudyRuns, run: str) -> str:
    """The case of normal duty of a run, in words."""
    title = runs.title_of(run)
    return title if run == STEADY else f"running ({title})"
