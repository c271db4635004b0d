"""The synthetic recordings of `examples/identification`: their truth is found in them, and the script makes them."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from chainunit.core.native.compilers import compiler
from chainunit.drives.dc_motor import DcMotor
from chainunit.machines.chain_unit import ChamberForces
from chainunit.recordings.fit import fit
from chainunit.recordings.plant import Plant
from chainunit.recordings.problem import Problem, RecordedRun, Sensor, Unknown
from chainunit.recordings.recording import read_recording
from chainunit.recordings.residuals import residual_tests
from chainunit.study.config import parse
from chainunit.study.drive import Drive

FOLDER = Path(__file__).parents[3] / "examples" / "identification"
TRUTH = json.loads((FOLDER / "truth.json").read_text("utf-8"))
LOADED = TRUTH["runs"]["loaded"]["feed"]
LAYOUTS = ChamberForces.parameter_layout, ChamberForces.input_layout
UNITS = {v.name: v.unit for layout in LAYOUTS for v in layout.variables}


def test_they_are_modest():
    files = list(FOLDER.glob("*.csv.gz"))
    assert {file.name for file in files} == {f"{name}.csv.gz" for name in TRUTH["runs"]}
    assert sum(file.stat().st_size for file in files) < 1e6
    for file in files:
        recording = read_recording(file)
        assert set(recording.columns) == {"motor.i", "motor.u", "motor.w", "mark"}
        assert recording.step == pytest.approx(1.0 / TRUTH["sensors"]["rate"])


@pytest.mark.slow
@pytest.mark.skipif(compiler() is None, reason="no C compiler")
def test_the_hidden_machine_is_identified():
    """With a scale that weighs its parts to 5 %, and a current clamp of 1 %, from a loaded and an empty run: the feed
    to 3 %, friction and damping to 5 %, all within four standard deviations."""
    rng, sought = np.random.default_rng(3), []
    for name, true in (TRUTH["machine"] | LOADED).items():
        if name in LOADED or name in ("pin.friction", "joint_damping"):
            sought.append(Unknown.within(f"machine.{name}", UNITS[name], 0.2 * true, 2.0 * true))
        else:
            weighed = true * (1.0 + 0.05 * rng.standard_normal())
            low, high = 0.5 * weighed, 1.5 * weighed
            sought.append(Unknown(f"machine.{name}", UNITS[name], weighed, low, high, 0.05 * weighed))
    config = parse("")
    sensors = {
        name: Sensor(
            resolution=full / 2048.0, gain=0.01 * (name == "motor.i"), offset=0.1 * (name == "motor.i")
        )
        for name, full in TRUTH["sensors"]["full"].items()
    }
    speed = TRUTH["crank_speed"]
    reference = {"motor.w_ref": speed * config.machine.ratio}
    none = {f"machine.{name}": 0.0 for name in LOADED}
    runs = [
        RecordedRun(name, read_recording(FOLDER / f"{name}.csv.gz"), speed, reference | known)
        for name, known in (("loaded", {}), ("empty", none))
    ]
    plant = Plant(
        Drive(DcMotor, config.motor.parameters, config.machine), list(sensors), [u.name for u in sought]
    )
    best = fit(Problem(plant, runs, sought, sensors))
    for u, found, deviation in zip(sought, best.z, best.deviations, strict=False):
        name = u.name.removeprefix("machine.")
        true = (TRUTH["machine"] | LOADED)[name]
        assert abs(found - true) < 4.0 * deviation, name
        if name in LOADED:
            assert abs(found - true) < 0.03 * true, name
        elif name in ("pin.friction", "joint_damping"):
            assert abs(found - true) < 0.05 * true, name
    assert all(each.is_noise and 0.97 < each.noise < 1.03 for each in residual_tests(best))


@pytest.mark.slow
def test_the_script_makes_them(tmp_path):
    """Again the same numbers, but for the last step of the converter."""
    script = FOLDER / "make_recordings.py"
    process = subprocess.run(
        [sys.executable, "-W", "error", script, tmp_path], capture_output=True, text=True
    )
    assert process.returncode == 0 and "24000 rows" in process.stdout, process.stderr
    assert json.loads((tmp_path / "truth.json").read_text("utf-8")) == TRUTH
    for name in TRUTH["runs"]:
        here, again = (read_recording(folder / f"{name}.csv.gz") for folder in (FOLDER, tmp_path))
        np.testing.assert_array_equal(here.time, again.time)
        np.testing.assert_array_equal(here.columns["mark"], again.columns["mark"])
        for column, full in TRUTH["sensors"]["full"].items():
            step = full / 2048.0
            assert np.max(np.abs(here.columns[column] - again.columns[column])) < 1.01 * step
            assert np.mean(here.columns[column] != again.columns[column]) < 1e-3
