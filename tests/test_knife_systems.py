"""The knife drive with a DC motor, a torque limiter that trips in a hard cut, a cardan line on its crank: each is a
study with the same page; its numbers by another route."""

from __future__ import annotations

import math

import numpy as np
import pytest
from reports import page_of, report_of
from scipy.integrate import cumulative_trapezoid, solve_ivp

from chainunit.core.engines import MATH
from chainunit.core.quantities import Layout
from chainunit.study.config import parse
from chainunit.study.drive_fmus import coasting_model, coasting_parameters
from chainunit.study.line.shaft import driveline_of
from chainunit.study.line.shaft_runs import shaft_findings
from chainunit.study.readings import crank_speed
from chainunit.study.run import run_study

HEAD = 'event = []\n[system]\nmachine = "KnifeDrive"\n'
RUN = "[run]\nsettle_turns = 2\nturns = 1\n"
DC_MOTOR = """
event = []
[system]
machine = "KnifeDrive"
motor = "DcMotor"
[machine]
ratio = 35
[motor]
armature = { R = 0.6, L = 0.01, k = 1.3 }
rotor = { J = 0.02 }
limit = { i = 40, v = 300 }
[flywheel]
J = 0.2
compare = [0.4]
"""
COUPLING = """
[system]
machine = "KnifeDrive"
[machine]
pin = { friction = 0.1 }
[flywheel]
J = 0.8
compare = []
[coupling]
trip_torque = 2500
[[event]]
type = "cut"
force = "60 kN"
turns = 1
"""
CARDAN = """
[driveline]
place = "crank"
alpha1 = "12 deg"
alpha2 = "8 deg"
shaft2 = { section = "round", outer = "60 mm", length = "1.5 m" }
shaft3 = { section = "round", outer = "60 mm", length = "1.5 m" }
damping_ratio = 0.05
J4 = 0.5
"""


def run(text, folder):
    study = run_study(parse(text + RUN), folder)
    assert study.findings.failure is None
    assert max(x for shares in study.runs.certificate.values() for x in shares.values()) < 1e-3
    return study


def sections(study):
    """The sections of the page that have anything in them, each of which the page shows."""
    names = [section.name for section in report_of(study).sections if section.blocks]
    page = page_of(study)
    assert all(f'id="{name}"' in page for name in names)
    return set(names)


COMMON = {
    "answer",
    "question",
    "runs",
    "constant_speed",
    "blade",
    "plots",
    "motion",
    "live",
    "basis",
    "given",
    "not_checked",
}


def cut_work(study):
    return study.findings.by_analysis["blade"].numbers.cut_work


@pytest.mark.slow
def test_a_dc_motor_keeps_the_speed_and_each_flywheel_has_gains_of_its_own(tmp_path):
    study = run(DC_MOTOR, tmp_path)
    steady, drive = study.runs.answers["steady"], study.setup.drive
    assert study.runs.reaches and drive.follows and steady.current_share is None
    # what the armature gives is the work of the cuts and its own friction, and heats the winding
    rows = study.runs.steady
    w = rows["motor.w"].values
    k, d = drive.parameters.armature.k, drive.fmu_parameters.rotor.d
    work = np.trapezoid((k * rows["motor.armature.i"].values - d * w) * w, rows["time"].values)
    assert work == pytest.approx(cut_work(study), rel=0.01)
    heat = float(np.trapezoid(rows["motor.heat"], rows["time"]) / np.ptp(rows["time"].values))
    turning = cut_work(study) * steady.speed_mean / (2.0 * math.pi)
    friction = d * float(np.mean(w**2))
    assert steady.supply_power_mean == pytest.approx(turning + heat + friction, rel=0.01)
    # the same gains over the inertia: half the ripple with about twice the inertia
    light, heavy = (wheel.answers for wheel in study.findings.by_analysis["flywheels"].wheels)
    assert light.speed_ripple == steady.speed_ripple
    shares = light.inertia / heavy.inertia, heavy.speed_ripple / light.speed_ripple
    assert shares[1] == pytest.approx(shares[0], rel=0.1)
    assert sections(study) == COMMON | {"flywheels"}


@pytest.mark.slow
def test_a_coupling_opens_in_a_hard_cut_and_the_machine_comes_to_rest(tmp_path):
    study = run(COUPLING, tmp_path)
    answers = study.runs.answers["hard_cut"]
    coasting = study.runs.series["hard_cut_coasting"]
    assert 0.0 < answers.coupling_trip_time < answers.standstill_time < answers.coupling_trip_time + 0.01
    run_up = study.runs.series["hard_cut"]
    at = int(
        np.argmin(
            np.abs(run_up["time"].values - study.runs.event_times["hard_cut"] - answers.coupling_trip_time)
        )
    )
    before, after = run_up["motor.tau"].values[at - 1 : at + 1] * study.setup.drive.ratio
    assert before < 2500.0 <= after
    # behind it the stack stops the blade within a millisecond; then it creeps through, and what it loses in height
    # goes to stack and pins
    energy = coasting["machine.kinetic_energy"].values + coasting["machine.potential_energy"].values
    time, w = coasting["time"].values, coasting["machine.w"].values
    assert coasting["machine.kinetic_energy"].values[0] == pytest.approx(answers.energy_behind)
    assert w[0] > 50.0 and np.all((w[1:] > 0.0) & (w[1:] < 0.01 * w[0]))
    losses = cumulative_trapezoid(coasting["machine.dissipated_power"].values[1:], time[1:], initial=0.0)
    assert np.max(np.abs(energy[1:] + losses - energy[1])) < 1e-3
    # the same by another integrator, from where the coupling let go
    model = coasting_model(study.setup.drive)
    p = model.with_derived(MATH, model.parameter_layout.from_names(coasting_parameters(study.setup.drive)))
    u = model.input_layout.from_names({"tau": 0.0, "cut_force": 6e4})
    states = Layout(model.States)

    def rate(t, x):
        return model.derivatives(MATH, p, u, states.instance(list(x)))

    start = [float(coasting[f"machine.{x}"][0]) for x in ("phi", "w")]
    span = time[0], time[10]
    other = solve_ivp(rate, span, start, "Radau", t_eval=time[:11], rtol=1e-8, atol=1e-9)
    way = coasting["machine.phi"].values[:11] - start[0]
    assert way == pytest.approx(other.y[0] - start[0], abs=1e-4 * np.max(way))
    assert sections(study) == COMMON | {"flywheels", "starts", "checks", "relay_classes"}


@pytest.mark.slow
def test_a_cardan_line_on_the_crank(tmp_path):
    study = run(HEAD + "[flywheel]\nJ = 0.8\ncompare = []\nfluctuation = 0.045\n" + CARDAN, tmp_path)
    steady, rows = study.runs.answers["steady"], study.runs.steady
    # the line gives on what the motor puts in: of a turn the work of the cut
    tau, w = rows["driveline.tau3"].values, crank_speed(study.setup.drive, rows)
    work = np.trapezoid(tau * w, rows["time"].values)
    assert work == pytest.approx(cut_work(study), rel=0.01)
    assert steady.crank_torque_mean == pytest.approx(cut_work(study) / (2.0 * math.pi), rel=0.02)
    shaft = shaft_findings(study.findings).answers["steady"]
    assert shaft.tau2_rigid == pytest.approx(steady.crank_torque_peak, rel=0.05)
    assert 1.0 < shaft.amplification < 1.5
    # least and largest frequency of the line, by the formula for two masses at their ends
    line, turn = driveline_of(study.setup.drive), study.findings.by_analysis["constant_speed"].numbers
    motor = study.setup.drive.fmu_parameters.rotor.J * study.setup.drive.ratio**2
    c = line.c2 * line.c3 / (line.c2 + line.c3)
    for J, k in (
        (turn.inertia_largest, study.setup.statics.modes.k_least),
        (turn.inertia_least, study.setup.statics.modes.k_largest),
    ):
        assert k == pytest.approx(math.sqrt(c * (1.0 / motor + 1.0 / (line.J4 + J))), rel=0.03)
    assert sections(study) >= COMMON | {"flywheels", "shaft"}
