"""The loop of docs/how-to/fmpy-loop.md against the equations; start values of FMUs against the packaged study."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from chainunit.core.native.compilers import compiler
from chainunit.fmu.description import Interface
from chainunit.fmu.native.export import export
from chainunit.fmu.pack import companion_files
from chainunit.models import MODELS
from chainunit.study.choice import drive_of
from chainunit.study.config import load
from chainunit.study.package import start_of
from chainunit.system import ModelComponent, System, monolithic, shaft_joints

pytestmark = pytest.mark.second

PAGE = Path(__file__).parents[1] / "docs" / "how-to" / "fmpy-loop.md"


@pytest.mark.skipif(compiler() is None, reason="no C compiler")
def test_the_loop_of_the_page_is_of_second_order(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    codes = re.findall(r"```python\n(.*?)^```", PAGE.read_text("utf-8"), re.DOTALL | re.MULTILINE)
    (code,) = (code for code in codes if "FMU2Slave" in code)
    machine, motor = MODELS["ChamberForces"], MODELS["DcMotor"]
    for model in (machine, motor):
        export(model, tmp_path / f"{model.name}.fmu")
    components = {
        "machine": ModelComponent(machine, machine.Parameters(ratio=50.0)),
        "motor": ModelComponent(motor, motor.Parameters(w_start=150.0)),
    }
    system = System(components, shaft_joints("motor", "machine"))
    times = np.arange(501) * 4e-3
    signals = {f"machine.{side}.processing_force": 10.0 for side in ("left", "right")}
    exact = monolithic(system, {"motor.w_ref": 150.0, **signals}, times, rtol=1e-11)
    names = ("motor.w", "motor.armature.i", "machine.tau", "machine.rocker.tau")
    errors = {}
    for every in (1, 4):
        text = code.replace("STEP, STOP = 150.0, 1e-3, 2.0", f"STEP, STOP = 150.0, {4e-3 / every}, 2.0")
        assert text != code or every == 4
        space: dict = {}
        exec(compile(text, PAGE.name, "exec"), space)
        run = np.array(space["rows"])[every - 1 :: every].T
        errors[every] = [
            np.max(np.abs(values - exact[name].values[1:])) / np.max(np.abs(exact[name].values))
            for values, name in zip(run, names, strict=True)
        ]
    capsys.readouterr()
    assert errors[4][0] < 2e-7 and max(errors[4][2:]) < 3e-6
    # a quarter of the step: a sixteenth of the error
    ratios = np.array(errors[1]) / np.array(errors[4])
    assert np.all(ratios[:3] > 12.0) and np.all(ratios[:3] < 20.0), ratios


def test_an_fmu_starts_as_the_packaged_study_or_says_where_not():
    """The page inside the FMU has the exceptions, with the values of the study."""
    config = load(None)
    for name in ("ChamberForces", "ChainUnit"):
        model = MODELS[name]
        variables = (*model.parameter_layout.variables, *model.input_layout.variables)
        declared = {v.name: v.quantity.start for v in variables}
        given = start_of(drive_of(config), config.operation, model)
        different = {key for key, value in given.items() if declared[key] != pytest.approx(value, rel=1e-7)}
        forces = {f"{side}.processing_force" for side in ("left", "right")}
        assert different <= {"ratio", "w", "w_start", *forces}, different
        page = companion_files(Interface(model, {}), "9.9", 2)["documentation/index.html"].decode()
        assert f"ratio is 1 (there {given['ratio']:g})" in page
        assert f"are 0 (there {given['left.processing_force']:g} N a side)" in page
