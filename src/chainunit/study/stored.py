"""Energy that flywheel and moving masses lend to a cut."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from .arrays import stretches


def cutting_power(run: xr.Dataset) -> Any:
    """Power that the stack takes from the blade [W], shape (time,)."""
    vx, vy, fx, fy = (run[f"machine.blade.{name}"].values for name in ("vx", "vy", "cut_fx", "cut_fy"))
    return -(fx * vx + fy * vy)


def stored_shares(turns: xr.Dataset, inertia: float) -> tuple[float | None, float | None]:
    """Energy that rotor and flywheel (together with the `inertia` [kg m2]) and machine give to a cut, over
    the work of the cut: from the begin of the cut to its end, and from the begin to their least energy. None
    where nothing is cut. The rest of the work comes from the motor through the air gap, less friction.
    Towards the end of a cut, where the blade slows down, the motor may already restore their energy. `turns`
    are whole, periodic turns.
    """
    power, time = cutting_power(turns), turns["time"].values
    if not np.max(power) > 0.0:
        return None, None
    stored = (
        0.5 * inertia * turns["motor.w"].values ** 2
        + turns["machine.kinetic_energy"].values
        + turns["machine.potential_energy"].values
    )
    rows = len(time)
    # a cut that begins before the last row ends in the turns after it
    time = np.append(time, time[1:] + time[-1] - time[0])
    power, stored = (np.append(x, x[1:]) for x in (power, stored))
    net = most = work = 0.0
    for a, b in stretches(power > 0.01 * np.max(power)):
        if 0 < a < rows:
            net += float(stored[a] - stored[b - 1])
            most += float(stored[a] - np.min(stored[a:b]))
            work += float(np.trapezoid(power[a:b], time[a:b]))
    return (net / work, most / work) if work > 0.0 else (None, None)
