"""Values that only an FMU needs of a model follow from its declarations and terminals."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import fmpy
import numpy as np
import pytest

import chainunit
from chainunit.core.model import Model, Part, Terminal
from chainunit.core.ports import NO_LOAD, LoadPort, PortSlopes, PortValues, flanges, load_terminal
from chainunit.core.printing.kernels import frequent_outputs
from chainunit.core.quantities import Value, declaration, group, quantity
from chainunit.fmu import backends, recipe
from chainunit.fmu.description import Interface
from chainunit.fmu.native import export as native
from chainunit.fmu.recipe import icon
from chainunit.fmu.reference import excitation
from chainunit.models import MODELS


@declaration
class GearParameters:
    ratio: Value = quantity("1", "ratio", default=2.0, above=0.0)


@declaration
class GearInputs:
    load: LoadPort = group(LoadPort, "load", default=NO_LOAD)
    share: Value = quantity("1", "a share that starts on its bound", default=1.0, min=0.0, max=1.0)


@declaration
class GearOutputs(PortSlopes, PortValues):
    pass


Gear = Model(
    name="Gear",
    text="No states; takes a port and shows one.",
    description="a gear",
    Parameters=GearParameters,
    Inputs=GearInputs,
    terminals=(load_terminal(), load_terminal("load.", "machine")),
    parts=(
        Part(
            GearOutputs,
            lambda xp, p, u, x, shared: GearOutputs(
                tau_bias=u.load.tau_bias / p.ratio,
                J=u.load.J / p.ratio**2,
                dJ_dphi=0.0 * u.share,
                phi0=u.load.phi0,
                w0=u.load.w0,
                tau_bias_dphi=u.load.tau_bias_dphi,
                tau_bias_dw=u.load.tau_bias_dw,
            ),
        ),
    ),
)


@pytest.mark.parametrize("model", [*MODELS.values(), Gear], ids=[*MODELS, "Gear"])
def test_every_input_moves_smoothly_within_its_bounds(model):
    interface = Interface(model, {})
    inputs = excitation(interface)
    t = np.linspace(0.0, 1.0, 1001)
    table = {name: np.array([inputs(x)[name] for x in t]) for name in model.input_layout.names}
    for v in model.input_layout.variables:
        values = table[v.name]
        assert all(v.quantity.admits(x) for x in values), v.name
        moved = np.ptp(values)
        assert moved > 1e-4 * np.abs(values).max() > 0.0, v.name
        assert np.abs(np.diff(values, 2)).max() < 1e-3 * moved, v.name
    if {"phi", "w", "a"} <= table.keys():
        for of, by in (("phi", "w"), ("w", "a")):
            np.testing.assert_allclose(np.gradient(table[of], t)[1:-1], table[by][1:-1], atol=1e-4)


def test_a_load_suits_the_shaft_that_takes_it():
    """A rotor ten times as heavy has ten times the load: both run up alike."""
    light, heavy = (excitation(Interface(MODELS["DcMotor"], {"rotor.J": J}))(0.1) for J in (0.0035, 0.035))
    for name in ("load.tau_bias", "load.J", "load.dJ_dphi", "load.tau_bias_dphi", "load.tau_bias_dw"):
        assert heavy[name] == pytest.approx(10.0 * light[name])
    assert light["load.J"] == pytest.approx(0.0035 * (1.0 + 0.3 * math.sin(0.6)))


def test_outputs_that_connect_are_often_asked_for():
    flange = {"phi", "w", "a", "tau"}
    port = {"tau_bias", "tau_bias_dphi", "tau_bias_dw", "J", "dJ_dphi", "phi0", "w0"}
    assert frequent_outputs(MODELS["ChamberForces"]) == flange | port
    measured = {"armature.i", "supply_power"}
    assert frequent_outputs(MODELS["DcMotor"]) == flange | measured | {f"load.{name}" for name in port}
    assert frequent_outputs(MODELS["ChainUnit"]) == flange


def test_icons_follow_from_the_terminals():
    icons = {
        file.read_bytes(): file.name for file in (Path(chainunit.__file__).parent / "data/icons").iterdir()
    }

    def shown(model):
        p = Interface(model, {}).start_parameters
        return {kind: icons[icon(model, kind, model.sketch(p))] for kind in ("svg", "png")}

    for name, reference in {
        "ChamberForces": "machine", "ChainUnit": "machine", "ChainUnitFlexible": "machine",
        "DcMotor": "motor", "InductionMotor": "motor", "CardanDriveline": "line", "KnifeDrive": "KnifeDrive",
        "FluidCoupling": "line", "VBelt": "line",
    }.items():  # fmt: skip
        assert shown(MODELS[name]) == {"svg": f"{reference}.svg", "png": f"{reference}.png"}
    assert shown(Gear)["svg"] == "line.svg"
    other = Gear.altered(name="Other", terminals=(Terminal("x", "other", "", {}), *flanges("inflow")))
    assert shown(other)["svg"] == "machine.svg"


def test_values_that_do_not_follow_stand_in_the_model():
    assert Interface(Gear, {}).experiment == {}
    assert Interface(MODELS["InductionMotor"], {}).experiment == {"step": 5e-5, "stop": 2.0}
    for model in MODELS.values():
        assert set(model.fmu_data.sizes) <= set(model.input_layout.names)


@pytest.mark.parametrize("backend", ["python", pytest.param("native", marks=pytest.mark.compiler)])
def test_an_export_runs_no_script(backend, tmp_path, monkeypatch):
    """A native export found its default experiment by running the script of a Python FMU."""
    monkeypatch.setattr(recipe, "recipes", lambda: pytest.fail("the scripts are for pythonfmu"))
    monkeypatch.setitem(sys.modules, "pythonfmu", None)
    native.recipes()  # the C layer lies there, too
    backends.export(MODELS["InductionMotor"], tmp_path / "a.fmu", backend=backend)
    experiment = fmpy.read_model_description(str(tmp_path / "a.fmu")).defaultExperiment
    assert (experiment.stepSize, experiment.stopTime) == ("5e-05", "2")
