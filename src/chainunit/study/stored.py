"""Energy that the moving masses hold: what they take up over a turn, and what they lend to a cut."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .arrays import stretches
from .drive import AbsentError, Drive
from .readings import shaft_power

if TYPE_CHECKING:
    import xarray as xr


def energy_behind(drive: Drive, run: xr.Dataset) -> Any:
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


def energy_held(drive: Drive, run: xr.Dataset) -> Any:
    """Energy of all moving masses [J], shape (time,): that of the machine, see `energy_behind`, and that of the
    motor's shaft, where the motor is no foreign FMU."""
    try:
        drive.needs_own("the inertia of its rotor")
    except AbsentError:
        return energy_behind(drive, run)
    return energy_behind(drive, run) + 0.5 * drive.fmu_parameters.rotor.J * run[drive.motor_speed].values ** 2


def energy_gap(drive: Drive, turns: xr.Dataset) -> float:
    """Energy that the moving masses take up between the ends of `turns`, relative to the energy that passes the
    motor's shaft to and fro: the integral of |power|. Negative where they give energy."""
    held = energy_held(drive, turns)
    passed = float(np.trapezoid(np.abs(shaft_power(drive, turns)), turns["time"].values))
    return float(held[-1] - held[0]) / max(passed, 1e-9)


def cutting_power(run: xr.Dataset) -> Any:
    """Power that the stack takes from the blade [W], shape (time,)."""
    vx, vy, fx, fy = (run[f"machine.blade.{name}"].values for name in ("vx", "vy", "cut_fx", "cut_fy"))
    return -(fx * vx + fy * vy)


def stored_shares(turns: xr.Dataset, held: Any) -> tuple[float | None, float | None]:
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
    net = most = work = 0.0
    for a, b in stretches(power > 0.01 * np.max(power)):
        if 0 < a < rows:
            net += float(held[a] - held[b - 1])
            most += float(held[a] - np.min(held[a:b]))
            work += float(np.trapezoid(power[a:b], time[a:b]))
    return (net / work, most / work) if work > 0.0 else (None, None)
