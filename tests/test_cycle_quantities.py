"""Quantities of a turn: each is that of the machine's own outputs over the turn, for one machine and for arrays."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from chainunit import ChainUnitMachine, InputError
from chainunit.core.native.compilers import compiler
from chainunit.machines.knife_drive import KnifeDrive
from chainunit.machines.linkages.file import read_linkage
from chainunit.machines.machine import Machine
from chainunit.study.cycle import cycle
from chainunit.study.cycle_quantities import CycleBasis, cycle_quantity, evaluate

WATT = read_linkage(Path(__file__).parents[1] / "examples" / "linkages" / "watt_six_bar.toml")
ENGINE = "native" if compiler() else "numpy"
NAMES = (
    "peak(crank_torque)", "rms(tau)", "max(force(crank_bearing))", "min(margin)", "range(rocker.psi)", "mean(power)",
    "installed_power", "energy_per_year", "box.width", "box.height",
)  # fmt: skip


def _by_hand(machine, speed, basis):
    """The same quantities from the outputs and the pins of the machine itself."""
    turn = cycle(machine, speed, machine.model.Feed(), 720)
    out, w = turn.outputs, speed * machine.ratio
    rms = math.sqrt(np.mean(out.tau**2))
    pins = machine.drive(turn.angle * machine.ratio).pins.values()
    x, y = (
        np.concatenate([np.ravel(getattr(pin.p, axis) + 0.0 * turn.angle) for pin in pins]) for axis in "xy"
    )
    return {
        "peak(crank_torque)": np.max(np.abs(turn.crank_torque)),
        "rms(tau)": rms,
        "max(force(crank_bearing))": np.max(np.hypot(out.crank_bearing.fx, out.crank_bearing.fy)),
        "min(margin)": np.min(out.margin),
        "range(rocker.psi)": np.ptp(out.rocker.psi),
        "mean(power)": np.mean(out.tau * w),
        "installed_power": w * max(rms, np.max(np.abs(out.tau)) / basis.overload),
        "energy_per_year": np.mean(out.tau * w) * 3600.0 * basis.operating_hours,
        "box.width": np.ptp(x),
        "box.height": np.ptp(y),
    }


@pytest.mark.parametrize("overload", [1.0, 1.6, 10.0])
def test_one_machine(overload):
    machine, basis = ChainUnitMachine(ratio=12.0), CycleBasis(operating_hours=3000.0, overload=overload)
    quantities = [cycle_quantity(name, machine.model) for name in NAMES]
    out = evaluate(machine, quantities, 2.5, basis=basis, engine=ENGINE)
    for name, value in _by_hand(machine, 2.5, basis).items():
        assert float(out[name]) == pytest.approx(value, rel=1e-12), name
    assert out["installed_power"].attrs["units"] == "W" and out["box.width"].attrs["units"] == "m"


def test_arrays_of_machines():
    """Each entry is that of the machine with these values; a geometry that cannot turn has its reason."""
    machine = ChainUnitMachine()
    quantities = [cycle_quantity(name, machine.model) for name in NAMES]
    r, ratio = [0.1, 0.15, 3.0], [1.0, 20.0]
    speed = xr.DataArray([1.0, 3.0], dims="speed")
    out = evaluate(machine, quantities, speed, values={"r": r, "ratio": ratio}, engine=ENGINE)
    for k, length in enumerate(r[:2]):
        for n, turns in enumerate(ratio):
            own = _by_hand(machine.replace(r=length, ratio=turns), 3.0, CycleBasis())
            for name, value in own.items():
                at = {d: i for d, i in (("r", k), ("ratio", n), ("speed", 1)) if d in out[name].dims}
                assert float(out[name][at]) == pytest.approx(value, rel=1e-12), name
    assert out.reason.isel(r=2).all() and not out.reason.isel(r=slice(2)).any()
    assert np.isnan(out["installed_power"].isel(r=2)).all()


@pytest.mark.stages(first=1)
@pytest.mark.parametrize("machine", [Machine(KnifeDrive), Machine(WATT)], ids=lambda m: m.model.name)
def test_other_machines(machine):
    names = ("peak(crank_torque)", "installed_power", "energy_per_year", "box.width")
    out = evaluate(machine, [cycle_quantity(name, machine.model) for name in names], 4.0, engine="numpy")
    tau = cycle(machine, 4.0, machine.model.Feed(), 720).crank_torque
    assert float(out["peak(crank_torque)"]) == pytest.approx(np.max(np.abs(tau)), rel=1e-12)
    year = 4.0 * 3600.0 * 4000.0  # the knife drive has no losses: its mean is rounding
    rounding = 1e-12 * year * np.max(np.abs(tau))
    assert float(out["energy_per_year"]) == pytest.approx(np.mean(tau) * year, rel=1e-9, abs=rounding)
    assert float(out["box.width"]) > 0.0


def test_columns_of_a_batch():
    """The quantities beside the outputs are columns of any batch, with derivatives."""
    machine = ChainUnitMachine()
    phi, step = np.linspace(0.0, 6.0, 7), 1e-6
    values = {"phi": phi, "w": 3.0}
    out = machine.batch(values, ["force(pivot)", "x(A)", "crank_torque"], by=["r"], engine=ENGINE)
    own = machine.outputs(phi, 3.0)
    np.testing.assert_allclose(out["force(pivot)"], np.hypot(own.pivot.fx, own.pivot.fy), rtol=1e-12)
    np.testing.assert_allclose(out["x(A)"], machine.drive(phi).pins["A"].p.x, rtol=1e-12)
    near = [machine.replace(r=0.15 + s).outputs(phi, 3.0).pivot for s in (step, -step)]
    slope = (np.hypot(near[0].fx, near[0].fy) - np.hypot(near[1].fx, near[1].fy)) / (2.0 * step)
    np.testing.assert_allclose(out["d(force(pivot))/d(r)"], slope, rtol=1e-5, atol=1e-2)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("peek(tau)", "must be one of installed_power"),
        ("instaled_power", 'was "installed_power" meant?'),
        ("peak(taux)", "has no output taux"),
        ("max(force(pivott))", 'was "force(pivot)" meant?'),
    ],
)
def test_refusals(name, words):
    with pytest.raises(InputError) as error:
        cycle_quantity(name, ChainUnitMachine().model)
    assert words in str(error.value)
