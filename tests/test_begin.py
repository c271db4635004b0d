"""A machine that starts empty, behind a shaft line and with flywheels: its start, the settling under its feed,
and the flywheels."""

from __future__ import annotations

import json

import numpy as np
import pytest
import xarray as xr
from event_tables import event_line
from reports import said_of, write

from chainunit.reading.result_entries import ResultEntries
from chainunit.reading.results import as_data
from chainunit.study.config import parse
from chainunit.study.judgement import motor_verdict
from chainunit.study.line.shaft_runs import shaft_findings
from chainunit.study.measures import STARTED
from chainunit.study.run import run_study

pytestmark = pytest.mark.slow

DIP = event_line("dip", turns=1)
LINE = """
empty_start = true
start = "inverter"
[system]
machine = "ChamberForces"
motor = "IE3 4-pole 0.75 kW, 80M"
[gear]
ratio = 50
[starter]
inverter = { ramp = "30 Hz/s", slip = 0.41495086610881765 }  # with a flywheel only where the file gives it
[flywheel]
J = 0.002
compare = [0.1]
fluctuation = 0.02
[driveline]
place = "crank"
alpha1 = "12 deg"
alpha2 = "8 deg"
c2 = 8000
d2 = 20
c3 = 8000
d3 = 20
[run]
crank_speed = "30 rev/min"
settle_turns = 1
turns = 1
step = "2 ms"
"""


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    folder = tmp_path_factory.mktemp("begin")
    study = run_study(parse(DIP + LINE), folder)
    assert study.findings.failure is None
    write(study, folder)
    return study, folder, ResultEntries(json.loads((folder / "result.json").read_text()))


def test_the_feed_comes_once_the_crank_turns_behind_its_line(done):
    """The motor is ahead of the crank by the twist of the shafts: the start is over where the crank is at speed."""
    study, _, result = done
    time = study.runs.start.start_time
    assert time is not None and result["start_up"]["start_time"]["value"] == time
    run = study.runs.series["start_up"].sel(time=time)
    assert float(run["machine.w0"]) >= STARTED * study.setup.config.run.crank_speed
    assert float(run["machine.left.processing_force"]) == 0.0
    # the flywheel that the study has starts as the others do
    own, other = study.findings.by_analysis["flywheels"].wheels
    assert own.answers.start_time == time and other.answers.start_time is not None
    assert "flywheel-does-not-start" not in {warning.code for warning in study.findings.warnings}


def test_every_peak_of_the_run_is_in_a_table(done):
    """From rest to the end: the start, the settling under the feed, the steady turns."""
    study, folder, result = done
    with xr.open_dataset(folder / "result.nc", group="start_up") as run:
        time, torque = run["time"].values, np.abs(run["machine.tau"].values)
    rows = [result["start_up"], result["settling"], result["answers"]["steady"]]
    values = [row["crank_torque_peak"]["value"] for row in rows]
    assert max(values) == pytest.approx(np.max(torque), rel=1e-9)
    # the largest comes with the feed: neither in the start nor in the steady turns
    assert values[1] > 1.005 * max(values[0], values[2])
    fed = time > study.runs.start.start_time
    assert values[0] == pytest.approx(np.max(torque[~fed]), rel=1e-9)
    words = said_of(study)
    assert "Settling under the feed: crank torque, peak" in words
    # it begins with the end of the start-up: a motor that still speeds up is above the limit of running
    title = "Demands of the settling under the feed on the drive, and of the end of the start-up, from 95 %"
    assert title in (folder / "result.md").read_text()
    # and so are those of the bearings
    assert set(result["pins"]) == {"start_up", "settling", "steady", "dip"}


def test_the_driveline_has_its_start(done):
    study, folder, result = done
    steady = study.runs.steady["time"].values[0]
    tau2 = np.abs(study.runs.series["start_up"]["driveline.tau2"].sel(time=slice(None, steady)).values)
    assert result["shaft"]["start_up"]["tau2_peak"]["value"] == np.max(tau2)
    assert (
        shaft_findings(study.findings).answers["start_up"].tau2_peak
        > shaft_findings(study.findings).answers["steady"].tau2_peak
    )
    assert shaft_findings(study.findings).answers["start_up"].turns_of_steady > 0.0
    table = (folder / "result.md").read_text().partition("Torque in the driveline")[2]
    assert "start-up" in table[:200]


def test_a_ripple_that_the_line_makes_is_not_the_flywheels(done):
    """The motor runs evenly, the crank behind the joints does not: the study names the joints and asks for no
    flywheel."""
    study, _, _ = done
    findings = study.findings.by_analysis["flywheels"]
    own, heavy = (wheel.answers for wheel in findings.wheels)
    w, crank = (study.runs.steady[name].values for name in ("motor.w", "machine.w0"))
    assert own.motor_ripple == pytest.approx(np.ptp(w) / np.mean(w), rel=1e-12) and own.motor_ripple < 0.01
    assert own.speed_ripple == pytest.approx(np.ptp(crank) / np.mean(crank), rel=1e-2)
    assert own.speed_ripple > findings.permitted_fluctuation > own.motor_ripple and findings.least is None
    messages = {warning.code: warning.text for warning in study.findings.warnings}
    assert "Make the bends equal" in messages["ripple-behind-flywheel"]
    # nor is a heavier one praised with which the drive swings
    assert heavy.speed_ripple > 2.0 * own.speed_ripple and "0.100 kg m" in messages["heavier-flywheel-worse"]
    assert " at motor " in said_of(study)


@pytest.mark.parametrize(("gains", "told"), [("", True), ("speed_control = { kp = 0.1, ki = 0.6 }", False)])
def test_it_is_said_where_the_gains_follow_the_flywheel(gains, told, tmp_path):
    text = f"""
{event_line("right_empties", turns=1)}
[flywheel]
J = 0.002
fluctuation = 0.2
compare = [0.004]
[motor]
{gains}
[run]
turns = 1
settle_turns = 1
step = 0.002
"""
    study = run_study(parse(text), tmp_path)
    assert study.findings.failure is None
    words = "tuned to the inertia with each flywheel"
    assert (words in said_of(study)) is told
    assert as_data(study.findings.by_analysis["flywheels"])["retuned"] is told


HEAVY = """
empty_start = true
[system]
machine = "KnifeDrive"
motor = "IE3 4-pole 2.2 kW, 100L"
[feed]
cut_force = "20 kN"
[gear]
efficiency = 1
J = {J}
[run]
crank_speed = "40 rev/min"
settle_turns = 4
turns = 4
step = "4 ms"
"""


def _heavy(J: float, folder):
    study = run_study(parse(DIP + HEAVY.format(J=J)), folder)
    assert study.findings.failure is None
    return study


def test_a_heavy_machine_is_waited_for_until_it_has_its_speed(tmp_path):
    """A rotor that speeds up for 40 s is fed at speed, and the turns that are evaluated gain nothing: a change of the
    speed that is small in itself takes power that is not of the load."""
    study = _heavy(10.0, tmp_path)
    steady, start = study.runs.answers["steady"], study.runs.start
    assert (
        start.start_time == pytest.approx(study.runs.started.rig.fed_from) and 35.0 < start.start_time < 45.0
    )
    warnings = {each.code: each for each in study.findings.warnings}
    assert not {"fed-before-speed", "speed-drifts"} & set(warnings)
    # as long as that no rotor may be locked
    long, locked = warnings["motor-start"].quantities, study.setup.config.plate.nameplate.locked_time
    worst = max(each.start_time for each in study.findings.by_analysis["starts"].starts)
    assert long["value"][0] == max(start.start_time, worst) > 2.0 * locked and long["limit"][0] == locked
    assert worst == pytest.approx(start.start_time, rel=0.01)
    verdict = motor_verdict(study)
    assert verdict.holds == "in part" and "its start takes too long" in verdict.text
    turns, J = study.runs.steady, study.setup.drive.fmu_parameters.rotor.J
    energy = 0.5 * J * turns["motor.w"].values ** 2
    work = steady.power_mean * float(turns["time"][-1] - turns["time"][0])
    assert abs(energy[-1] - energy[0]) < 0.05 * work
    # the energy of a cut goes to and fro between rotor and blade
    swing = study.findings.by_analysis["constant_speed"].numbers.energy_swing
    by_hand = swing / (J * float(np.mean(turns["motor.w"])) ** 2)
    assert steady.speed_ripple == pytest.approx(by_hand, rel=0.15)


def test_a_feed_that_comes_before_the_speed_is_told(tmp_path):
    """A machine that would take minutes to speed up is fed, and the study says with which speed."""
    study = _heavy(400.0, tmp_path)
    (remarks,) = [each for each in study.findings.warnings if each.code == "fed-before-speed"]
    assert (
        remarks.quantities["fed"][0] == study.runs.started.rig.fed_from
        and study.runs.start.start_time is None
    )
    assert remarks.quantities["speed"][0] < 0.5 * study.setup.config.run.crank_speed
    assert "larger motor" in remarks.text
