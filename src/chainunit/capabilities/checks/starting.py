"""Starts per hour of a motor on the line, beside the number that its maker permits for the bare rotor, reduced by
inertia, counter torque and running.

In a start the cage takes up the heat of its slip, W = integral of (ws - w) M dt = 1/2 J ws^2 M/(M - ML) for a motor
torque M against a counter torque ML; that of the stator goes with it. Beside the start of the bare rotor it is larger
by FI/(1 - ML/MH), and running takes a share of the heat that the surface gives off.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ...core.quantities import Value, declaration, quantity
from ...reading.results import result
from ...study.readings import load_inertia
from ...study.record import StudyRecord
from ...study.verdict import STEADY
from .row import CheckRow, NotChecked
from .tables import StartingTable

_WHAT = "starts per hour by the rule of makers of motors"


@declaration
class StartingData:
    """The start of a study, and the motor."""

    per_hour: Value = quantity("1", "starts an hour that are asked for")
    bare: Value = quantity("1", "permitted starts an hour of the bare rotor, Z0")
    rotor_inertia: Value = quantity("kg.m2", "inertia of the rotor")
    inertia: Value = quantity("kg.m2", "mean inertia at the motor's shaft, with that of the rotor")
    motor_torque: Value = quantity("N.m", "mean torque of the motor in the start, MH")
    counter_torque: Value = quantity("N.m", "mean counter torque in the start, ML")
    current: Value = quantity("A", "RMS current of steady running")
    rated_current: Value = quantity("A", "rated current of the motor")


@result
class Starting(StartingData):
    """The permitted starts, and the factors behind them."""

    inertia_factor: float = quantity("1", "factor of inertia FI")
    torque_factor: float = quantity("1", "factor of the counter torque, KM")
    running_factor: float = quantity("1", "factor of running, KP")
    permitted: float = quantity("1", "permitted starts an hour")


def starting(of: StartingData) -> Starting:
    """The permitted starts of a motor."""
    inertia = of.inertia / of.rotor_inertia
    torque = max(0.0, 1.0 - of.counter_torque / of.motor_torque)
    running = max(0.0, 1.0 - (of.current / of.rated_current) ** 2)
    return Starting(
        **vars(of),
        inertia_factor=inertia,
        torque_factor=torque,
        running_factor=running,
        permitted=of.bare * torque * running / inertia,
    )


def start_torques(time: Any, torque: Any, speed: Any, inertia: float) -> tuple[float, float]:
    """Mean torque of the motor in a start, and mean counter torque [N m]: what of its impulse does not end in the
    motion of the `inertia` [kg m2]. `time` [s], `torque` [N m] and `speed` [rad/s] are of shape (n,)."""
    span = float(time[-1] - time[0])
    motor = float(np.trapezoid(torque, time)) / span
    return motor, max(0.0, motor - inertia * float(speed[-1] - speed[0]) / span)


def find(
    study: StudyRecord, table: StartingTable, asked: float
) -> tuple[Starting | None, list[CheckRow | NotChecked]]:
    """The starts of a study and their check, or the reason against it; the file asks for so many starts an hour, 0
    where it does not say."""
    if study.drive.follows and study.drive.foreign is None:
        # the line on the relay names the starts, too
        return None, []
    if why := _why_none(study, table, asked):
        return None, [NotChecked(_WHAT, why)]
    assert study.plate is not None
    assert study.start is not None
    plate, drive = study.plate.nameplate, study.drive
    rise = study.runs["start_up"].sel(time=slice(None, study.start.start_time))
    inertia = float(drive.fmu_parameters.rotor.J + np.mean(load_inertia(drive, study.steady)))
    time, torque, speed = (rise[name].values for name in ("time", "motor.air_gap_tau", drive.motor_speed))
    motor, counter = start_torques(time, torque, speed, inertia)
    found = starting(
        StartingData(
            per_hour=asked,
            bare=table.permitted or plate.starts,
            rotor_inertia=plate.J,
            inertia=inertia,
            motor_torque=motor,
            counter_torque=counter,
            current=study.answers[STEADY].current_rms,
            rated_current=plate.rated_current,
        )
    )
    return found, list(starting_rows(found))


def starting_rows(of: Starting) -> Iterator[CheckRow]:
    """The row of the starts."""
    at = {name: f"checks.starting.{name}" for name in vars(of)}
    yield CheckRow(
        "motor",
        "starts per hour",
        "Rule of makers of motors, Z = Z0 KJ KM KP (SEW-Eurodrive, Project planning for AC motors)",
        "Z <= Z0 (1 - ML/MH) (1 - (I/IN)^2)/FI, FI = J/JM",
        of.per_hour,
        of.permitted,
        at["per_hour"],
        {
            "Z0": at["bare"],
            "ML": at["counter_torque"],
            "MH": at["motor_torque"],
            "I": at["current"],
            "IN": at["rated_current"],
            "FI": at["inertia_factor"],
        },
    )


def _why_none(study: StudyRecord, table: StartingTable, asked: float) -> str:
    """The reason why the starts are not checked; empty where they are."""
    if study.drive.foreign is not None:
        return "the motor is an FMU, whose starts are not known"
    if study.plate is None:
        return "the motor has no nameplate; take one of a catalogue (system.motor)"
    if not asked:
        return "the file does not say how many; add [starting] with per_hour"
    if not table.permitted and not study.plate.nameplate.starts:
        return "the catalogue gives no permitted starts of the bare rotor; add [starting] with permitted"
    if study.start is None or study.start.start_time is None:
        return "the motor does not come to its speed"
    return ""
