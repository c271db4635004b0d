"""The energy residual of a power bond: the certificate that every run carries.

What the driver gave to the load inside its own steps must be what the machine stored and dissipated, less what
the feed brought. The two are computed on different sides of the coupling, from different equations.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import xarray as xr
from scipy.integrate import cumulative_simpson


@dataclass(frozen=True)
class Bond:
    """A shaft between `driver` and `machine`, by instance name. A machine that drives another one, such as a
    driveline, has the output `load_energy` for what it passes on.

    `feed` gives, for each mass input of the machine that changes in the run, dE/dm [J/kg] as a function of the
    run's Dataset: the energy that a kilogram has on its place in the machine.
    """

    driver: str
    machine: str
    feed: Mapping[str, Callable[[xr.Dataset], Any]] = field(default_factory=dict)


def energy_residual(run: xr.Dataset, bond: Bond) -> tuple[xr.DataArray, float]:
    """The energy that is missing at each instant [J], shape (time,), and its largest size in relation to the
    energy that went to and fro through the bond (integral of |tau w|), or to a millionth of what the machine holds,
    where that is more: in a machine that stands nothing but rounding moves.

    The dissipated power is integrated by Simpson's rule over the communication points.
    """
    time = run["time"].values

    def value(name: str) -> Any:
        return run[f"{bond.machine}.{name}"].values

    def integral(y: Any) -> Any:
        return cumulative_simpson(y, x=time, initial=0.0)

    given = run[f"{bond.driver}.load_energy"].values
    stored = value("kinetic_energy") + value("potential_energy")
    if f"{bond.machine}.load_energy" in run:
        stored = stored + value("load_energy")
    fed = np.zeros_like(given)
    for mass, per_kg in bond.feed.items():
        fed += _stieltjes(per_kg(run), value(mass))
    missing = (given - given[0]) - (stored - stored[0]) - integral(value("dissipated_power")) + fed
    moved = float(np.trapezoid(np.abs(value("power")), time))
    residual = xr.DataArray(
        missing,
        dims="time",
        attrs={"units": "J", "long_name": f"energy residual of the bond {bond.driver} - {bond.machine}"},
    )
    moved = max(moved, 1e-6 * float(np.max(np.abs(stored))), 1e-300)
    return residual, float(np.max(np.abs(missing))) / moved


def _stieltjes(y: Any, m: Any) -> Any:
    """Running integral of y dm."""
    return np.concatenate([[0.0], np.cumsum(0.5 * (y[1:] + y[:-1]) * np.diff(m))])
