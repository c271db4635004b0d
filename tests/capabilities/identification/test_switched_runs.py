"""Runs that are not steady: the motor is switched off, or its speed is shaken."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from derivatives import check_derivatives
from synthetic import HiddenRun, Logger, synthetic

from chainunit.capabilities.identification.information import information
from chainunit.core.native.compilers import compiler
from chainunit.drives.dc_motor import DcMotor
from chainunit.drives.induction_motor import InductionMotor
from chainunit.recordings.fit import fit
from chainunit.recordings.plant import Plant
from chainunit.recordings.problem import Problem, RecordedRun, Sensor, Unknown
from chainunit.recordings.residuals import residual_tests
from chainunit.recordings.shaft import MeasuredShaft
from chainunit.study.config import parse
from chainunit.study.drive import Drive
from chainunit.system import Profile

pytestmark = [pytest.mark.second, pytest.mark.skipif(compiler() is None, reason="no C compiler")]
SLOW = pytest.mark.slow
MACHINE = parse("").machine
DRIVES = {
    "dc": Drive(DcMotor, parse("").motor.parameters, MACHINE),
    "im": Drive(InductionMotor, InductionMotor.Parameters(), MACHINE),
}
TRUTH = {
    "machine.left.material_mass": 41.0,
    "machine.right.material_mass": 24.0,
    "machine.left.wall_mass": 61.0,
    "machine.rocker.I": 9.0,
    "machine.joint_damping": 1.3,
    "machine.pin.friction": 0.09,
}
SOUGHT = (
    Unknown.within("machine.left.material_mass", "kg", 10.0, 60.0),
    Unknown.within("machine.right.material_mass", "kg", 10.0, 60.0),
    Unknown.within("machine.left.wall_mass", "kg", 30.0, 80.0),
    Unknown.within("machine.rocker.I", "kg.m2", 5.0, 12.0),
    Unknown.within("machine.joint_damping", "N.m.s/rad", 0.1, 3.0),
    Unknown.within("machine.pin.friction", "1", 0.02, 0.25),
)
COLUMNS = {
    "dc": ("motor.i", "motor.u", "motor.w"),
    "im": ("motor.i", "motor.power", "motor.w"),
    "torque": ("crank.tau", "crank.w"),
}
SENSORS = {"motor.i": Sensor(offset=0.2), "crank.tau": Sensor(offset=5.0)}
SHAKEN = Profile(150.0, tuple((2.0 + k, 0.6, 170.0 if k % 2 == 0 else 130.0) for k in range(6)))


def run_of(kind, off=None, duration=8.0, seed=2, w_ref=150.0, angles=("mark",), integrator="monolithic"):
    """A recorded run, whose motor may be switched off later than stated by a millisecond."""
    values = {"motor.w_ref": w_ref} if kind != "im" else {}
    late = None if off is None else off + 1e-3
    hidden = HiddenRun(3.0, duration, {**TRUTH, **values}, angle=1.0, before=4.0, off=late)
    logger = Logger(
        200.0, offset={"motor.i": 0.03, "crank.tau": -1.0}, angles=angles, mark_angle=-0.1, drift=3e-5
    )
    drive = DRIVES["im" if kind == "im" else "dc"]
    recording = synthetic(drive, COLUMNS[kind], hidden, logger, np.random.default_rng(seed), integrator)
    return RecordedRun(f"run{seed}", recording, 3.0, {} if kind == "torque" else values, off=off)


def problem_of(kind, *runs):
    measured = list(dict.fromkeys(name for run in runs for name in run.recording.columns if name != "mark"))
    by = [u.name for u in SOUGHT]
    plant = MeasuredShaft(MACHINE, measured, by) if kind == "torque" else Plant(DRIVES[kind], measured, by)
    return Problem(plant, runs, SOUGHT, SENSORS)


@pytest.fixture
def fine(monkeypatch):
    """Rows of a simulation so near to one another that the derivatives are not those of their interpolation."""
    monkeypatch.setattr("chainunit.recordings.problem.STEP", 4e-4)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["dc", pytest.param("im", marks=SLOW), pytest.param("torque", marks=SLOW)])
def test_derivatives_of_a_coast(kind, fine):
    """By every unknown against differences, through the switch; among them the time of the switch, and inertia and
    friction behind a measured shaft."""
    steady = run_of(kind, seed=1, duration=4.0, integrator="compiled")
    off = run_of(kind, 2.0, duration=4.0, angles=("mark", "motor.count"), integrator="compiled")
    problem = problem_of(kind, steady, off)
    z = problem.start_values
    if kind == "torque":
        z[problem.place["run2.inertia"]], z[problem.place["run2.friction"]] = 8.0, 2.0
    else:
        z[problem.place["run2.off"]] += 3e-4
    check_derivatives(problem, z, 5e-3)


def test_derivatives_of_a_shaken_run(fine):
    run = run_of("dc", w_ref=SHAKEN, duration=5.0, integrator="compiled")
    assert np.ptp(run.recording.columns["motor.w"]) > 40.0
    problem = problem_of("dc", run)
    check_derivatives(problem, problem.start_values)


@pytest.mark.parametrize("kind", ["dc", pytest.param("im", marks=SLOW), "torque"])
@pytest.mark.slow
def test_a_coast_is_identified(kind):
    """Beside a steady run: within four standard deviations, and the residuals are noise. After the switch no electric
    column is compared."""
    problem = problem_of(kind, run_of(kind, seed=1), run_of(kind, 2.5))
    best = fit(problem)
    for name, true in TRUTH.items():
        place = problem.place[name]
        assert abs(best.z[place] - true) < 4.0 * best.deviations[place], name
    if kind == "torque":
        J, d = (best.z[problem.place[f"run2.{name}"]] for name in ("inertia", "friction"))
        rotor = DRIVES["dc"].fmu_parameters.rotor
        assert J == pytest.approx(2500.0 * rotor.J, rel=0.05) and d == pytest.approx(
            2500.0 * rotor.d, rel=0.1
        )
    else:
        place = problem.place["run2.off"]
        assert abs(best.z[place] - 2.501) < 4.0 * best.deviations[place]
    rows = {(each.run, each.column): len(each.residuals) for each in best.comparisons}
    if kind != "torque":
        assert rows["run2", "motor.i"] == pytest.approx(2.5 * 200.0, abs=5)
        assert rows["run2", "motor.w"] == pytest.approx(8.0 * 200.0, abs=6)
    assert all(each.is_noise and 0.9 < each.noise < 1.1 for each in residual_tests(best))


@pytest.mark.parametrize("angles", [("mark",), ("motor.count",)])
def test_a_coast_counts_until_rest(angles):
    """The machine swings with falling amplitude, and is at rest some seconds before the end of 20 s."""
    run = run_of("dc", 3.0, duration=20.0, angles=angles, integrator="compiled")
    if "mark" not in angles:
        columns = {name: x for name, x in run.recording.columns.items() if name != "motor.w"}
        run = replace(run, recording=replace(run.recording, columns=columns))
    (own,) = problem_of("dc", run).runs
    again = run_of("dc", 3.0, duration=20.0, seed=7, integrator="compiled").recording
    speed = again.columns["motor.w"] / 50.0
    end = own.recording.time[-1]
    assert 6.0 < end < 15.0 and np.array_equal(own.recording.time, run.recording.part(end=end).time)
    assert np.max(np.abs(speed[(again.time > end - 1.5) & (again.time < end)])) > 0.3
    assert np.max(np.abs(speed[again.time > end + 0.2])) < 0.36
    steady = run_of("dc", duration=5.0, integrator="compiled")
    assert problem_of("dc", steady).runs == (steady,)


def test_a_coast_tells_inertia():
    """Beside a steady run, wall and rocker are told more sharply by a coast than by a second steady run: while the
    machine swings, its inertia works against no motor."""
    first = run_of("dc", seed=1, integrator="compiled")
    deviations = []
    for second in (run_of("dc", integrator="compiled"), run_of("dc", 2.5, integrator="compiled")):
        problem = problem_of("dc", first, second)
        found = information(problem, problem.start_values, propose=False).determinations
        deviations.append({each.name: each.by_runs for each in found})
    steady, coast = deviations
    for name in ("machine.left.wall_mass", "machine.rocker.I"):
        assert coast[name] < 0.4 * steady[name], name


def test_a_shaken_run_is_identified():
    """By itself, from the reference that is known."""
    problem = problem_of("dc", run_of("dc", w_ref=SHAKEN))
    best = fit(problem)
    for name, true in TRUTH.items():
        place = problem.place[name]
        assert abs(best.z[place] - true) < 4.0 * best.deviations[place], name
    assert all(each.is_noise and 0.9 < each.noise < 1.1 for each in residual_tests(best))
