"""Quantities that are read from a run of a drive: at the shaft of the motor, at the crank, over whole turns; and the
energy that the moving masses hold, take up over a turn, and lend to a cut."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..drives.gearing import lost_torque
from ..reading.text import number
from ..system import shaft_torque, through
from .arrays import Dataset, peak, stretches
from .drive import AbsentError, Drive


def series(run: Dataset, name: str) -> Any:
    """A variable of a run, shape (time,).

    Raises
    ------
    AbsentError
        where motor or machine do not have the variable.
    """
    if name not in run:
        raise AbsentError(name.partition(".")[0], f"{name}: is not known of this motor or machine")
    return run[name].values


def machine_series(run: Dataset) -> dict[str, Any]:
    """The variables of the machine in a run by name, each of shape (time,)."""
    return {
        name.removeprefix("machine."): run[name].values
        for name in map(str, run.data_vars)
        if name.startswith("machine.")
    }


def load_inertia(drive: Drive, run: Dataset) -> Any:
    """Inertia at the motor's shaft beside the rotor [kg m2], shape (time,); see `Line.at_motor`."""
    return drive.whole_line.at_motor(run["machine.J"].values)


def motor_shaft(drive: Drive, run: Dataset) -> tuple[Any, Any]:
    """Torque of the load [N m] and speed [rad/s] of the motor's shaft, shape (time,)."""
    return through(run, drive.motor_bond)


def shaft_power(drive: Drive, run: Dataset) -> Any:
    """Power at the motor's shaft [W], shape (time,)."""
    full = f"{drive.motor_bond.machine}.power"
    if full in run:
        return run[full].values
    torque, speed = motor_shaft(drive, run)
    return torque * speed


def torque_before_gear(drive: Drive, run: Dataset) -> Any:
    """Torque on the motor's shaft [N m], shape (time,), with the one that the gear loses."""
    torque = run[drive.motor_torque].values
    if drive.line.before_gear is not None:
        return torque
    return torque + lost_torque(np, drive.gear.loss, torque, run[drive.motor_speed].values)


def gear_loss(drive: Drive, run: Dataset) -> Any:
    """Power that the gear loses [W], shape (time,)."""
    if (part := drive.line.before_gear) is not None:
        return run[f"{part.name}.gear_loss"].values
    torque, w = run["motor.tau"].values, run["motor.w"].values
    return lost_torque(np, drive.gear.loss, torque, w) * w + gear_drag(drive, run)


def gear_speed(drive: Drive, run: Dataset) -> Any:
    """Speed of the shaft that turns the gear [rad/s], shape (time,): the motor's, or that behind the parts that
    slip."""
    part = drive.line.before_gear
    return run[drive.motor_speed if part is None else f"{part.name}.driven.w"].values


def gear_drag(drive: Drive, run: Dataset) -> Any:
    """Power that the drag of the gear takes [W], shape (time,): at the speed of the shaft that turns the gear."""
    part = drive.geared_line.before_gear
    drag = drive.gear.d if part is None else part.parameters.gear.d
    return drag * gear_speed(drive, run) ** 2


def crank_torque(drive: Drive, run: Dataset) -> Any:
    """Torque at the crank in a run [N m], shape (time,), also for a machine without its motor."""
    return shaft_torque(run, drive.machine_bond) * drive.ratio_at_machine


def crank_motion(drive: Drive, run: Dataset) -> tuple[Any, Any]:
    """Angle [rad] and speed [rad/s] of the crank in a run, shape (time,), also for a machine without its motor."""
    ratio = drive.ratio_at_machine
    pairs = (
        ("machine.phi0", "machine.w0"),
        ("machine.phi", "machine.w"),
        (drive.crank_output("phi")[0], drive.crank_output("w")[0]),
    )
    phi, w = next(pair for pair in pairs if set(pair) <= set(run))
    return run[phi].values / ratio, run[w].values / ratio


def crank_angle(drive: Drive, run: Dataset) -> Any:
    """Angle of the crank in a run [rad], see `crank_motion`."""
    return crank_motion(drive, run)[0]


def crank_speed(drive: Drive, run: Dataset) -> Any:
    """Speed of the crank in a run [rad/s], see `crank_motion`."""
    return crank_motion(drive, run)[1]


def turns_made(drive: Drive, run: Dataset) -> float:
    """Turns that the crank makes from the first to the last row of a run."""
    return float(_turns(drive, run)[-1])


def _turns(drive: Drive, run: Dataset) -> Any:
    """The turns of the crank since the first row of a run, shape (time,)."""
    angle = crank_angle(drive, run)
    return (angle - angle[0]) / (2.0 * math.pi)


_AT_SPEED = 0.95
"""Speed of a motor over its last one from which on it takes the current of its start no more."""
_ROUNDING = 1e-9
"""Turns that a run which ends on a whole turn may miss by rounding."""


def _whole(turns: Any) -> int:
    """The largest number of whole turns that the crank makes, by `_turns`."""
    return math.floor(float(np.max(turns)) + _ROUNDING)


def only_whole_turns(drive: Drive, run: Dataset, most: float = math.inf) -> Dataset | None:
    """The part of the run from its first row until the crank has made the largest number of whole turns, at most
    `most`, both ends included; None where it makes less than one turn.

    The last row is interpolated linearly; in periodic running it equals the first.
    """
    import xarray as xr

    turned = _turns(drive, run)
    turns = min(_whole(turned), most)
    if turns < 1:
        return None
    last = int(np.argmax(turned >= turns - _ROUNDING))
    share = min(1.0, (turns - turned[last - 1]) / (turned[last] - turned[last - 1]))

    def closed(x: Any) -> Any:
        return np.append(x[:last], x[last - 1] + share * (x[last] - x[last - 1]))

    return xr.Dataset(
        {name: ("time", closed(x.values), x.attrs) for name, x in run.data_vars.items()},
        {"time": ("time", closed(run["time"].values), run["time"].attrs)},
        run.attrs,
    )


def has_turn(drive: Drive, run: Dataset) -> bool:
    """Whether the crank makes a whole turn in a run."""
    return _whole(_turns(drive, run)) >= 1


def less_than_a_turn(drive: Drive, run: Dataset) -> str:
    """The words on a run without a whole turn of the crank."""
    turns, time = number(turns_made(drive, run), "1"), run["time"].values
    span = number(float(time[-1] - time[0]), "s")
    return f"the {drive.driver_noun} makes {turns} of a turn in the {span} that are evaluated"


def largest_torque(drive: Drive, run: Dataset, T: float) -> Any:
    """Largest air-gap torque that the motor can give at each instant of a run [N m], shape (time,), with its winding
    at `T` [K]; see `Motor.largest_torque`."""
    drive.needs_own("the largest torque")
    braking = run["motor.air_gap_tau"].values * run["motor.w"].values < 0.0
    columns = []
    for name, resolution in drive.motor.limited_by.items():
        x = run[f"motor.{name}"].values
        if name == "w":
            x = np.where(braking, -np.abs(x), np.abs(x))
        # instants that are alike to this resolution are computed once
        unit = resolution * max(peak(x), 1e-9)
        columns.append(np.round(x / unit) * unit)
    instants, place = np.unique(np.stack(columns), axis=1, return_inverse=True)
    limits = [
        drive.motor.largest_torque(drive.fmu_parameters, T, *map(float, instant)) for instant in instants.T
    ]
    return np.array(limits)[np.reshape(place, -1)]


def pull_out_torque(drive: Drive, run: Dataset, T: float) -> float:
    """Largest torque at the crank [N m] that the motor gives while a rising load slows it down from the mean state of
    a run until it stalls, with the winding at `T` [K], or that a part of the line passes on at most; see
    `Motor.pull_out`."""
    torque = min(motor_pull_out(drive, run, T), drive.line.stall_torque)
    return float(drive.at_crank(torque / (1.0 + drive.gear_at_rotor.loss)))


def motor_run_up(drive: Drive, run: Dataset, started: float | None) -> float | None:
    """Time from rest for which the motor takes the current of its start [s], in a `run` from rest: until the machine
    has `started` [s] or, before a part that decouples, until the motor has its speed at the end of the run; None for
    a machine that does not start."""
    if started is None or not drive.line.decouples:
        return started
    speed = run[drive.motor_speed].values
    return float(run["time"].values[np.argmax(speed >= _AT_SPEED * speed[-1])])


def motor_pull_out(drive: Drive, run: Dataset, T: float) -> float:
    """The pull-out torque of the motor at its shaft [N m], see `pull_out_torque`."""
    drive.needs_own("the pull-out torque")
    return float(drive.motor.pull_out(drive.fmu_parameters, T, *_mean_supply(drive, run)))


def breakdown_speed(drive: Drive, run: Dataset) -> float:
    """Speed of the crank [rad/s] below which a load stalls the motor, at the mean supply and temperature of a run; 0
    where the motor has no such speed, or a part of the line slips before. See `Motor.breakdown_speed`."""
    drive.needs_own("the breakdown speed")
    T = float(np.mean(run[f"motor.{drive.motor.temperature}"].values))
    if math.isfinite(drive.line.stall_torque) and drive.line.stall_torque < motor_pull_out(drive, run, T):
        return 0.0
    return drive.motor.breakdown_speed(drive.fmu_parameters, T, *_mean_supply(drive, run)) / drive.ratio


def _mean_supply(drive: Drive, run: Dataset) -> list[float]:
    """The means over a run of the variables `Motor.limited_by`."""
    return [float(np.mean(run[f"motor.{name}"].values)) for name in drive.motor.limited_by]


def energy_behind(drive: Drive, run: Dataset) -> Any:
    """Kinetic and potential energy of the machine, and of the line before it [J], shape (time,). The energy of a part
    that does not tell it, as a foreign FMU may, is left out; a flywheel has no potential energy."""
    held = np.zeros(run.sizes["time"])
    for part in ("machine", *(part.name for part in drive.line)):
        names = [f"{part}.{kind}_energy" for kind in ("kinetic", "potential")]
        if set(names) <= set(run):
            held = held + run[names[0]].values + run[names[1]].values
    if (name := "flywheel.kinetic_energy") in run:
        held = held + run[name].values
    return held


def energy_held(drive: Drive, run: Dataset) -> Any:
    """Energy of all moving masses [J], shape (time,): that of the machine, see `energy_behind`, and that of the
    motor's shaft, where the motor is no foreign FMU."""
    try:
        drive.needs_own("the inertia of its rotor")
    except AbsentError:
        return energy_behind(drive, run)
    return energy_behind(drive, run) + 0.5 * drive.fmu_parameters.rotor.J * run[drive.motor_speed].values ** 2


def energy_gap(drive: Drive, turns: Dataset) -> float:
    """Energy that the moving masses take up between the ends of `turns`, relative to the energy that passes the
    motor's shaft to and fro: the integral of |power|. Negative where they give energy."""
    held = energy_held(drive, turns)
    passed = float(np.trapezoid(np.abs(shaft_power(drive, turns)), turns["time"].values))
    return float(held[-1] - held[0]) / max(passed, 1e-9)


def cutting_power(run: Dataset) -> Any:
    """Power that the stack takes from the blade [W], shape (time,)."""
    vx, vy, fx, fy = (run[f"machine.blade.{name}"].values for name in ("vx", "vy", "cut_fx", "cut_fy"))
    return -(fx * vx + fy * vy)


def stored_shares(turns: Dataset, held: Any) -> tuple[float | None, float | None]:
    """Energy that the motor's shaft and the machine give to a cut, of the energy `held` by them [J], shape (time,),
    over the work of the cut: from the begin of the cut to its end, and from the begin to their least energy. None
    where nothing is cut. The rest of the work comes from the motor through the air gap, less friction.
    Towards the end of a cut, where the blade slows down, the motor may already restore their energy. `turns`
    are whole, periodic turns.
    """
    power, time = cutting_power(turns), turns["time"].values
    if not np.max(power) > 0.0:
        return None, None
    rows = len(time)
    # a cut that begins before the last row ends in the turns after it
    time = np.append(time, time[1:] + time[-1] - time[0])
    power, held = (np.append(x, x[1:]) for x in (power, held))
    given_to_end = given_to_least = work = 0.0
    for begin, end in stretches(power > 0.01 * np.max(power)):
        # a stretch at the first row has begun before it, and comes once more
        if 0 < begin < rows:
            given_to_end += float(held[begin] - held[end - 1])
            given_to_least += float(held[begin] - np.min(held[begin:end]))
            work += float(np.trapezoid(power[begin:end], time[begin:end]))
    return (given_to_end / work, given_to_least / work) if work > 0.0 else (None, None)
