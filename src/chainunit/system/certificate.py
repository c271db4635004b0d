"""The energy residual of a power bond: the certificate that every run carries.

The energy that the driver gave to the load inside its own steps, plus the energy of the feed, must equal the energy
that the machine stored and dissipated. The two sides come from different components and different equations. A
foreign FMU may not have outputs for its energies: then the residual is only the energy that the coupling itself
loses."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.errors import InputError
from .graph import Bond, System

if TYPE_CHECKING:
    import xarray as xr

Feed = Mapping[str, Callable[["xr.Dataset"], Any]]
"""By the full name of each mass input that changes in a run: a function of the run's Dataset that gives dE/dm [J/kg],
the energy of one kilogram at its place in the machine."""


def energy_residual(
    run: xr.Dataset, bond: Bond, feed: Feed | None = None, lead: xr.Dataset | None = None
) -> tuple[xr.DataArray, float]:
    """The missing energy at each instant [J], shape (time,), and its largest absolute value over a reference energy.

    The reference is the energy that went to and fro through the bond (integral of |tau w|), or a millionth of the
    stored energy if this is more: in a machine at rest only rounding errors flow.

    Powers are integrated by Simpson's rule over the communication points. For a run with a jump, `lead` is the run up
    to the jump with the values before it, while `run` has the values after the jump at that instant: each side is
    integrated separately.
    """
    import xarray as xr
    from scipy.integrate import cumulative_simpson

    parts = [run] if lead is None else [lead, run.sel(time=slice(float(lead["time"][-1]), None))]
    balance, throughput = np.zeros(1), 0.0
    for part in parts:
        time = part["time"].values
        tau, w = through(part, bond)
        supply = _supply(part, bond, tau, w)
        loss_power = _storage(part, bond)[1]
        if loss_power is None:
            # the losses of the machine are not known: the torque of the machine counts against that of the driver
            loss_power = _shaft_power(part, bond.machine, bond.flanges[1], tau, w)
        net = supply - supply[0] - cumulative_simpson(loss_power, x=time, initial=0.0)
        for mass, per_kg in (feed or {}).items():
            if mass.partition(".")[0] == bond.machine:
                net = net + _stieltjes(per_kg(part), part[mass].values)
        balance = np.concatenate([balance[:-1], balance[-1] + net])
        throughput += float(np.trapezoid(np.abs(tau * w), time))
    storage = _storage(run, bond)[0]
    if storage is None:
        storage = np.zeros_like(balance)
    gap = balance - (storage - storage[0])
    residual = xr.DataArray(
        gap,
        dims="time",
        attrs={"units": "J", "long_name": f"energy residual of the bond {bond.driver} - {bond.machine}"},
    )
    throughput = max(throughput, 1e-6 * float(np.max(np.abs(storage))), 1e-300)
    return residual, float(np.max(np.abs(gap))) / throughput


def certify(
    run: xr.Dataset, system: System, feed: Feed | None = None, lead: xr.Dataset | None = None
) -> dict[str, tuple[xr.DataArray, float]]:
    """`energy_residual` of every power bond of the system, by the name of the machine that the bond drives."""
    return {bond.machine: energy_residual(run, bond, feed, lead) for bond in system.bonds}


def torque_names(bond: Bond) -> tuple[str, ...]:
    """The full names of the torque of the shaft, that of the machine first."""
    driver, machine = bond.flanges
    sides = ((bond.machine, machine), (bond.driver, driver))
    return tuple(f"{name}.{side.members['tau']}" for name, side in sides if "tau" in side.members)


def shaft_torque(run: xr.Dataset, bond: Bond) -> Any:
    """Torque of the shaft [N m], shape (time,), from the side that has it as a variable.

    Raises
    ------
    InputError
        where neither side has it.
    """
    torque = next((full for full in torque_names(bond) if full in run), None)
    if torque is None:
        raise InputError(
            f"neither {bond.machine} nor {bond.driver} gives the torque of the shaft between them"
        )
    return run[torque].values


def through(run: xr.Dataset, bond: Bond) -> tuple[Any, Any]:
    """Torque [N m] and speed [rad/s] of the shaft, shape (time,); see `shaft_torque`."""
    driver, _ = bond.flanges
    return shaft_torque(run, bond), run[f"{bond.driver}.{driver.members['w']}"].values


def _shaft_power(run: xr.Dataset, name: str, terminal: Any, tau: Any, w: Any) -> Any:
    """Power at a terminal [W], shape (time,), with the torque of that terminal if the run has it, else with `tau`."""
    full = f"{name}.{terminal.members.get('tau', '')}"
    return (run[full].values if full in run else tau) * w


def _supply(run: xr.Dataset, bond: Bond, tau: Any, w: Any) -> Any:
    """The energy that the driver has given to the load [J], shape (time,)."""
    from scipy.integrate import cumulative_simpson

    full = f"{bond.driver}.load_energy"
    if full in run:
        return run[full].values
    power = _shaft_power(run, bond.driver, bond.flanges[0], tau, w)
    return cumulative_simpson(power, x=run["time"].values, initial=0.0)


def _storage(run: xr.Dataset, bond: Bond) -> tuple[Any, Any]:
    """The energy that the machine holds or has passed on [J], and the power that it dissipates [W], shape (time,);
    None for both where the run does not have them."""
    names = [f"{bond.machine}.{x}" for x in ("kinetic_energy", "potential_energy", "dissipated_power")]
    if any(full not in run for full in names):
        return None, None
    kinetic, potential, loss_power = (run[full].values for full in names)
    onward = f"{bond.machine}.load_energy"
    storage = kinetic + potential
    return (storage + run[onward].values if onward in run else storage), loss_power


def _stieltjes(y: Any, m: Any) -> Any:
    """Running integral of y dm."""
    return np.concatenate([[0.0], np.cumsum(0.5 * (y[1:] + y[:-1]) * np.diff(m))])
