"""Starts per hour that a maker permits for the bare rotor of a motor, reduced by inertia, counter torque and running.

In a start the cage takes up the heat of its slip, W = integral of (ws - w) M dt = 1/2 J ws^2 M/(M - ML) for a motor
torque M against a counter torque ML; that of the stator goes with it. Beside the start of the bare rotor it is larger
by FI/(1 - ML/MH), and running takes a share of the heat that the surface gives off.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..core.quantities import Value, declaration, quantity
from ..drives.nameplate import Nameplate
from ..reading.results import result
from .arrays import Dataset
from .drive import Drive
from .readings import load_inertia, motor_run_up


def standard_inertia(
    drive: Drive, plate: Nameplate, steady: Dataset, start: str
) -> tuple[float, float] | None:
    """The inertia at the motor's shaft beside its rotor [kg m2], and the one that IEC 60034-12 demands of a motor of
    design N at 50 Hz to bring up to speed: 0.04 P^0.9 p^2.5, with P in kW and p pairs of poles. None for another
    start or frequency, and before a part that decouples."""
    if start not in ("direct", "star-delta") or plate.frequency != 50.0 or drive.line.decouples:
        return None
    inertia = np.mean(load_inertia(drive, steady)) + drive.fmu_parameters.rotor.J - plate.J
    return float(inertia), 0.04 * (plate.power / 1e3) ** 0.9 * (plate.poles / 2.0) ** 2.5


@declaration
class StartingData:
    """The start of a study, and the motor."""

    per_hour: Value = quantity("1", "starts an hour that are asked for")
    bare: Value = quantity("1", "permitted starts an hour of the bare rotor, Z0")
    rotor_inertia: Value = quantity("kg.m2", "inertia of the rotor")
    inertia: Value = quantity(
        "kg.m2", "mean inertia that the motor starts, at its shaft, with that of the rotor"
    )
    motor_torque: Value = quantity("N.m", "mean torque of the motor in the start, MH")
    counter_torque: Value = quantity("N.m", "mean counter torque in the start, ML")
    current: Value = quantity("A", "RMS current of steady running")
    rated_current: Value = quantity("A", "rated current of the motor")


@result
class PermittedStarts(StartingData):
    """The permitted starts and their factors."""

    inertia_factor: float = quantity("1", "factor of inertia FI")
    torque_factor: float = quantity("1", "factor of the counter torque, KM")
    running_factor: float = quantity("1", "factor of running, KP")
    permitted: float = quantity("1", "permitted starts an hour")


def permitted_starts(data: StartingData, most: float = math.inf) -> PermittedStarts:
    """The permitted starts of a motor, at most so many an hour as another rule permits."""
    inertia = data.inertia / data.rotor_inertia
    torque = max(0.0, 1.0 - data.counter_torque / data.motor_torque)
    running = max(0.0, 1.0 - (data.current / data.rated_current) ** 2)
    return PermittedStarts(
        **vars(data),
        inertia_factor=inertia,
        torque_factor=torque,
        running_factor=running,
        permitted=min(most, data.bare * torque * running / inertia),
    )


def starting_data(
    drive: Drive,
    plate: Nameplate,
    start: Dataset,
    steady: Dataset,
    *,
    per_hour: float,
    bare: float,
    current: float,
) -> StartingData:
    """The data of a `start` from rest until the machine has its speed, and of `steady` running after it. Before a
    part that decouples the start ends with `motor_run_up`.

    Parameters
    ----------
    per_hour, bare : starts an hour that are asked for, and permitted starts an hour of the bare rotor
    current : RMS current of running [A]
    """
    moved = np.mean(drive.whole_line.in_run_up(steady["machine.J"].values))
    inertia = float(drive.fmu_parameters.rotor.J + moved)
    start = start.sel(time=slice(None, motor_run_up(drive, start, float(start["time"].values[-1]))))
    time, torque, speed = (start[name].values for name in ("time", "motor.air_gap_tau", "motor.w"))
    motor, counter = start_torques(time, torque, speed, inertia)
    return StartingData(
        per_hour=per_hour,
        bare=bare,
        rotor_inertia=plate.J,
        inertia=inertia,
        motor_torque=motor,
        counter_torque=counter,
        current=current,
        rated_current=plate.rated_current,
    )


def start_torques(time: Any, torque: Any, speed: Any, inertia: float) -> tuple[float, float]:
    """Mean torque of the motor in a start, and mean counter torque [N m]: what of its impulse does not end in the
    motion of the `inertia` [kg m2]. `time` [s], `torque` [N m] and `speed` [rad/s] are of shape (n,)."""
    span = float(time[-1] - time[0])
    motor = float(np.trapezoid(torque, time)) / span
    return motor, max(0.0, motor - inertia * float(speed[-1] - speed[0]) / span)
