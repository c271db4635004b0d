"""A third type of motor is one file, here `additions/servo_motor`, and a line in the registry."""

from __future__ import annotations

import json

import numpy as np
import pytest
from additions.servo_motor import ServoMotor
from reports import page_of
from systems import pair

from chainunit.models import MOTORS
from chainunit.reading.result_entries import ResultEntries
from chainunit.study import config, run
from chainunit.study.result import as_dict
from chainunit.system import CoSimulation, Profile, export, monolithic

STUDY = """
title = "A servo motor"

[system]
motor = "ServoMotor"

[motor]
coil.R = 1.5
control.i = 3.0
"""


@pytest.fixture
def registered(monkeypatch):
    monkeypatch.setitem(MOTORS, ServoMotor.name, ServoMotor)


@pytest.mark.compiler
def test_it_runs_as_an_fmu(tmp_path):
    """Its co-simulation with the machine is the monolithic solution of the same equations."""
    system, _ = export(pair("ChamberForces", ServoMotor, values={"machine.ratio": 50.0}), tmp_path, "native")
    signals = {"motor.w_ref": Profile(0.0, ((0.0, 0.2, 150.0),))}
    with CoSimulation(system, signals) as simulation:
        seen = simulation.run(0.5, 5e-4)
    reference = monolithic(system, signals, seen["time"].values)
    for name in ("motor.w", "motor.T"):
        np.testing.assert_allclose(seen[name], reference[name], rtol=1e-4, atol=1e-3)
    np.testing.assert_allclose(seen["motor.tau"].values[-1], reference["motor.tau"].values[-1], rtol=1e-2)


@pytest.mark.second
def test_a_study_names_it(registered, tmp_path):
    choice = config.parse(STUDY)
    study = run.run_study(choice, tmp_path)
    assert study.findings.failure is None and study.setup.drive.motor is ServoMotor
    steady, p = study.runs.answers["steady"], study.setup.drive.parameters
    assert p.coil.R == 1.5 and p.control.ki == pytest.approx(4.0 * p.control.kp)
    assert steady.speed_mean == pytest.approx(choice.run.crank_speed, rel=1e-6)
    # torque of the shaft: the current's, less that of the rotor
    turns = study.runs.steady
    driving = p.coil.k * turns["motor.i"] - p.rotor.d * turns["motor.w"] - p.rotor.J * turns["motor.a"]
    np.testing.assert_allclose(driving, turns["motor.tau"], atol=1e-9)
    kinds = {remark.code for remark in study.findings.warnings}
    reaches_limit = any(answers.current_peak > 0.999 * 3.0 for answers in study.runs.answers.values())
    assert ("current-limit" in kinds) == reaches_limit
    result = ResultEntries(json.loads(json.dumps(as_dict(study))))
    assert result["motor"]["kind"] == "ServoMotor" and result["speed_loop"] == {}
    assert result["control"]["crossover"]["value"] == 20.0
    page = page_of(study)
    assert "ServoMotor" in page and "current limit" in page and "coil.R" in page
