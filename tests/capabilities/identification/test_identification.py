"""Identification: residuals and their derivatives, and the fit of recordings that the monolithic solution made."""

from __future__ import annotations

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from derivatives import check_derivatives
from scipy.optimize import nnls
from scipy.stats import f
from synthetic import HiddenRun, Logger, synthetic

from chainunit import InputError, RunError
from chainunit.capabilities.identification import information as what_runs_tell
from chainunit.capabilities.identification.information import information
from chainunit.capabilities.identification.posterior import posterior
from chainunit.capabilities.identification.suspects import known_number_tests, suspect_sets
from chainunit.core.native.compilers import compiler
from chainunit.drives.dc_motor import DcMotor
from chainunit.drives.induction_motor import InductionMotor
from chainunit.recordings import fit as fitting
from chainunit.recordings import residuals
from chainunit.recordings.fit import fit, normal_equations
from chainunit.recordings.inspection import inspect_runs
from chainunit.recordings.plant import Plant
from chainunit.recordings.problem import Comparison, Problem, RecordedRun, Sensor, Unknown
from chainunit.recordings.recording import Recording
from chainunit.recordings.residuals import describes, residual_tests, sensor_conflicts
from chainunit.study.config import parse
from chainunit.study.drive import Drive

pytestmark = pytest.mark.skipif(compiler() is None, reason="no C compiler")
TRUTH = {
    "machine.left.material_mass": 41.0,
    "machine.right.material_mass": 24.0,
    "machine.joint_damping": 1.3,
    "machine.pin.friction": 0.09,
}
FORCES = {f"machine.{side}.processing_force": 0.0 for side in ("left", "right")}
NO_FEED = {name: 0.0 for name in TRUTH if "material" in name}
RATE, DURATION, SPEED = 200.0, 12.0, 3.0
MARK, OFFSET, DRIFT = -0.11, 0.03, 4e-5
LOGGER = Logger(
    rate=RATE,
    full={"motor.u": 250.0},
    offset={"motor.i": OFFSET},
    angles=("mark", "motor.count"),
    mark_angle=MARK,
    drift=DRIFT,
)
SOUGHT = (
    Unknown.within("machine.left.material_mass", "kg", 10.0, 60.0),
    Unknown.within("machine.right.material_mass", "kg", 10.0, 60.0),
    Unknown.within("machine.joint_damping", "N.m.s/rad", 0.1, 3.0),
    Unknown.within("machine.pin.friction", "1", 0.02, 0.25),
)
SENSORS = {"motor.i": Sensor(offset=0.2, gain=0.01), "motor.u": Sensor(resolution=250.0 / 2048.0)}


def drive_of(motor=(), **parameters):
    """The packaged drive with other values of its `motor`, by full name, and of its machine."""
    config = parse("")
    values = {name.removeprefix("motor."): x for name, x in dict(motor).items()}
    of_motor = DcMotor.parameter_layout.from_names(values, config.motor.parameters)
    return Drive(DcMotor, of_motor, config.machine.replace(parameters))


def recorded(empty=False, seed=4, **more):
    """A recording of the drive with the true values, and `more` of them, by scipy's integrator."""
    values = {**TRUTH, **FORCES, "motor.w_ref": 150.0} | (NO_FEED if empty else {}) | more
    run = HiddenRun(SPEED, DURATION, values, angle=1.0, before=5.0)
    rng = np.random.default_rng(seed)
    return synthetic(drive_of(), ("motor.i", "motor.u", "motor.w"), run, LOGGER, rng, "monolithic")


def without(recording, *names):
    columns = {name: x for name, x in recording.columns.items() if name not in names}
    return Recording(recording.source, recording.time, columns, recording.heads)


def problem_of(*recordings, empty=(), sought=SOUGHT, motor=(), **machine):
    measured = [name for name in recordings[0].columns if name != "mark"]
    runs = [
        RecordedRun(f"run{k}", each, SPEED, FORCES | {"motor.w_ref": 150.0} | (NO_FEED if k in empty else {}))
        for k, each in enumerate(recordings)
    ]
    plant = Plant(drive_of(motor, **machine), measured, [u.name for u in sought])
    return Problem(plant, runs, sought, SENSORS)


@pytest.fixture(scope="module")
def loaded():
    return recorded()


@pytest.fixture(scope="module")
def empty():
    return recorded(empty=True, seed=5)


@pytest.mark.second
def test_derivatives_of_residuals(loaded):
    """By every unknown, of every column, against differences."""
    problem = problem_of(loaded)
    z = problem.start_values
    z[problem.place["run0.temperature"]], z[problem.place["gain(motor.i)"]] = 305.0, 1.02
    z[problem.place["run0.count.2"]], z[problem.place["run0.drift"]] = 0.7, 3e-5
    assert {each.column for each in problem.comparisons(z)} == set(loaded.columns)
    check_derivatives(problem, z)


@pytest.mark.stages(first=1)
@pytest.mark.parametrize("angle", ["mark", "motor.count", None])
def test_a_loaded_and_an_empty_run_are_identified(loaded, empty, angle):
    """With a mark, with an encoder, and with neither, from the middle of the bounds: within four standard deviations,
    and the residuals are noise. The feed is told to parts of a kilogram."""
    leave_out = [name for name in ("mark", "motor.count") if name != angle]
    problem = problem_of(*(without(each, *leave_out) for each in (loaded, empty)), empty=(1,))
    best = fit(problem)
    deviation = dict(zip(problem.place, best.deviations, strict=True))
    found = dict(zip(problem.place, best.z, strict=True))
    for name, true in TRUTH.items():
        assert abs(found[name] - true) < 4.0 * deviation[name], name
        assert deviation[name] < 0.05 * true, name
    assert abs(found["run0.offset(motor.i)"] - OFFSET) < 4.0 * deviation["run0.offset(motor.i)"]
    if angle == "mark":
        assert abs(found["mark.angle"] - MARK) < 4.0 * deviation["mark.angle"] < 0.1
    for key, share in best.mean_squares.items():
        # there are five marks
        assert 0.02 < share < 3.0 if key[1] == "mark" else 0.85 < share < 1.15, key


@pytest.mark.parametrize("angle", ["mark", "motor.count"])
@pytest.mark.second
def test_a_minute_of_an_induction_motor_from_many_starts(angle):
    """A motor without speed control loses step with a simulated one of another load, by parts of a turn in a minute,
    and its encoder counts thousandths of a degree: from all starts the fit ends at the same point, soon."""
    values = {"machine.pin.friction": 0.18, "machine.joint_damping": 0.4, "machine.left.material_mass": 55.0}
    sought = [
        Unknown.within(name, unit, low, high)
        for name, unit, low, high in (
            ("machine.pin.friction", "1", 0.02, 0.25),
            ("machine.joint_damping", "N.m.s/rad", 0.1, 2.5),
            ("machine.left.material_mass", "kg", 5.0, 70.0),
        )
    ]
    drive = Drive(InductionMotor, InductionMotor.Parameters(), parse("").machine)
    logger = Logger(rate=200.0, angles=(angle,), drift=-3e-5, offset={"motor.i": 0.02})
    hidden = HiddenRun(3.08, 60.0, values, angle=1.3, temperature=310.0)
    measured = ("motor.i", "motor.power")
    recording = synthetic(drive, measured, hidden, logger, np.random.default_rng(5))
    run = RecordedRun("run", recording, 3.08)
    plant = Plant(drive, [name for name in recording.columns if name != "mark"], [u.name for u in sought])
    seen = []
    best = fit(
        Problem(plant, [run], sought, {"motor.i": Sensor(offset=0.1)}),
        starts=3,
        progress=lambda count, _: seen.append(count),
    )
    assert (best.starts, best.agreeing) == (3, 3)
    assert seen == list(range(1, best.rounds + 1)) and best.rounds <= 30
    for u, found, deviation in zip(sought, best.z, best.deviations, strict=False):
        assert abs(found - values[u.name]) < 4.0 * deviation, u.name
        assert deviation < 0.05 * u.prior_deviation, u.name
    assert all(0.5 < share < 1.1 for share in best.mean_squares.values())


@pytest.mark.second
def test_the_residuals_tell_a_wrong_machine(loaded, empty):
    """Of the right one they are noise of the size that is stated. A crank that is longer by 2 % leaves orders of the
    crank in them, which noise of twice the size does not."""
    recordings = [without(each, "motor.count") for each in (loaded, empty)]
    problem = problem_of(*recordings, empty=(1,))
    right = residual_tests(fit(problem))
    assert [(each.run, each.column) for each in right] == [
        (f"run{k}", name) for k in (0, 1) for name in ("motor.i", "motor.u", "motor.w")
    ]
    assert all(each.is_noise and 0.9 < each.noise < 1.1 for each in right)
    loud = Problem(problem.plant, problem.runs, SOUGHT, {**SENSORS, "motor.w": Sensor(noise=0.005)})
    best = fit(loud)
    (own, *_) = [each for each in residual_tests(best) if each.column == "motor.w"]
    assert own.is_noise and 1.8 < own.noise < 2.2
    # the column counts by its measured noise, and the deviations are those that follow from it
    np.testing.assert_allclose(
        best.deviations[: len(SOUGHT)], fit(problem).deviations[: len(SOUGHT)], rtol=0.02
    )
    wrong = problem_of(*recordings, empty=(1,), r=0.153)
    worst = max(residual_tests(fit(wrong)), key=lambda each: each.statistic)
    assert worst.column == "motor.i" and worst.statistic > 2.0 * worst.limit and worst.reason == "orders"


@pytest.mark.second
def test_a_wrong_gear_strains_the_clock(loaded):
    """With a mark on the crank and a speed of the motor, a gear that is off by 2 % looks as a clock that is."""
    recording = without(loaded, "motor.count")
    right = problem_of(recording)
    best = fit(right)
    assert sensor_conflicts(right, best) == [] and describes(right, best, residual_tests(best))
    assert not describes(right, replace(best, is_ended=False), residual_tests(best))
    wrong = problem_of(recording, ratio=51.0)
    best = fit(wrong)
    conflicts = sensor_conflicts(wrong, best)
    assert not describes(wrong, best, residual_tests(best))
    assert not describes(wrong, best, residual_tests(best), [conflict.name for conflict in conflicts[1:]])
    assert describes(wrong, best, [], [conflict.name for conflict in conflicts])
    (drift,) = [each for each in conflicts if each.name == "run0.drift"]
    assert abs(drift.deviations) > 50.0 and drift.value == pytest.approx(5e-5 * drift.deviations)


@pytest.mark.parametrize(
    ("left_out", "column"),
    [((), "mark"), (("mark",), "motor.count"), (("mark", "motor.count"), "motor.i")],
)
def test_the_stated_speed_is_that_of_the_recording(loaded, left_out, column):
    """Another one is refused by the column that tells it best, with the speed of the recording; a run with that speed
    is accepted."""
    recording = without(loaded, *left_out)

    def run_at(speed):
        problem = problem_of(recording)
        values = problem.runs[0].values | {"motor.w_ref": 50.0 * speed}
        run = RecordedRun("run", recording, speed, values)
        return Problem(problem.plant, [run], SOUGHT, SENSORS)

    for stated in (28.0 / 26.0, 0.985):
        with pytest.raises(InputError) as refusal:
            inspect_runs(run_at(stated * SPEED), 1)
        words = str(refusal.value)
        assert f"column {column}" in words and f"crank_speed is {stated * SPEED:.5g} rad/s" in words
        (remedy,) = re.findall('crank_speed = "(.*) rev/min"', words)
        assert float(remedy) * np.pi / 30.0 == pytest.approx(SPEED, rel=1e-3)
        inspect_runs(run_at(float(remedy) * np.pi / 30.0), 1)


@pytest.mark.parametrize("times", [2.0, 3.0])
def test_a_stated_speed_that_the_motor_cannot_reach_is_refused_with_that_of_the_recording(loaded, times):
    problem = problem_of(loaded)
    values = problem.runs[0].values | {"motor.w_ref": 50.0 * times * SPEED}
    run = RecordedRun("run", loaded, times * SPEED, values)
    with pytest.raises(InputError, match=rf"the crank turns at {SPEED:.3f}\d* rad/s"):
        inspect_runs(Problem(problem.plant, [run], SOUGHT, SENSORS), 1)


def test_a_fit_that_still_improves_says_so(loaded, monkeypatch):
    """It stops after the most rounds, and names the column that it does not describe."""
    problem = problem_of(without(loaded, "motor.count"))
    assert fit(problem).is_ended
    monkeypatch.setattr(fitting, "MOST_ROUNDS", 2)
    cut = fit(problem)
    assert not cut.is_ended
    worst, size = cut.worst
    assert size == pytest.approx(max(np.sqrt(np.mean(each.residuals**2)) for each in cut.comparisons))
    assert np.sqrt(np.mean(worst.residuals**2)) == pytest.approx(size)


@pytest.mark.second
def test_a_known_number_that_is_wrong_is_suspicious(loaded, empty):
    """The crank that is 2 % longer is told from the right one, with its right length; the residuals of the right
    machine agree with its numbers. No speed by which a law is smooth is among them."""
    recordings = [without(each, "motor.count") for each in (loaded, empty)]
    right = problem_of(*recordings, empty=(1,))
    found = known_number_tests(right, fit(right))
    names = {each.name for each in found.tests}
    assert {
        "machine.r",
        "machine.z",
        "motor.speed_control.kp",
        "motor.armature.R",
        "machine.coupler.m",
    } <= names
    assert not any("smooth" in name for name in names) and not names & {u.name for u in SOUGHT}
    assert not found.are_rejected and found.law is not None
    wrong = problem_of(*recordings, empty=(1,), r=0.153)
    found = known_number_tests(wrong, fit(wrong))
    (own,) = [each for each in found.tests if each.name == "machine.r"]
    assert own.is_rejected and own.known == 0.153
    assert own.known + own.change == pytest.approx(0.15, abs=4.0 * own.deviation) and own.deviation < 5e-4


@pytest.mark.slow
def test_wrong_gains_are_the_suspects(loaded, empty):
    """Of a converter whose gains are taken for others; with those of the recorded one the model describes the
    recordings."""
    recordings = [without(each, "motor.count") for each in (loaded, empty)]
    right = {"motor.speed_control.kp": 0.1017, "motor.speed_control.ki": 0.6102}
    factors = {"motor.speed_control.kp": 0.6, "motor.speed_control.ki": 1.3}
    wrong = {name: factors[name] * x for name, x in right.items()}
    problem = problem_of(*recordings, empty=(1,), motor=wrong)
    best = fit(problem)
    assert known_number_tests(problem, best).are_rejected
    first, *others = suspect_sets(problem, best, assumed=["motor.speed_control.kp"])
    assert first.describes and first.excess == 0.0 and others == []
    assert {each.name: each.known for each in first.suspects} == pytest.approx(wrong)
    assert {each.name: each.preferred for each in first.suspects} == pytest.approx(right, rel=0.03)
    assert {each.name: each.stated for each in first.suspects} == {
        "motor.speed_control.kp": False,
        "motor.speed_control.ki": True,
    }


@pytest.mark.second
def test_another_law_of_friction_is_suspicious():
    """Friction that is full at ten times the speed is told from that of the model, with nearly the right speed."""
    law = {"machine.pin.w_smooth": 0.2}
    recordings = [without(recorded(k == 1, 4 + k, **law), "motor.count") for k in range(2)]
    wrong = problem_of(*recordings, empty=(1,))
    own = known_number_tests(wrong, fit(wrong)).law
    assert own.is_rejected and own.known == 0.02
    assert own.known + own.change == pytest.approx(0.2, abs=0.02 + 4.0 * own.deviation)


@pytest.mark.second
def test_a_law_with_which_the_machine_does_not_run_is_left_out(loaded, monkeypatch):
    """One that is nearer to that of the model stands in its place."""
    problem = problem_of(without(loaded, "motor.count"))
    best, own, laws = fit(problem), Problem.comparisons, []

    def comparisons(self, z, workers=1):
        laws.append(self.runs[0].values.get("machine.pin.w_smooth", 0.0))
        if laws[-1] > 0.1:
            raise RunError("it stalls")
        return own(self, z, workers)

    monkeypatch.setattr(Problem, "comparisons", comparisons)
    found = known_number_tests(problem, best).law
    assert laws[-2:] == [0.2, 0.04]
    assert np.isfinite(found.change) and not found.is_rejected


def test_the_statistic_of_noise_is_that_of_its_distribution():
    """Its mean is the number of waves, and it exceeds its limit as seldom as is stated; an order of known size is
    found in the unit of the column."""
    rng, angle = np.random.default_rng(7), np.linspace(0.0, 60.0, 1500)
    found = [
        residuals.residual_test(
            Comparison("run", "motor.i", rng.standard_normal(1500), None, (), angle, 0.2), 0.99
        )
        for _ in range(300)
    ]
    assert np.mean([each.statistic for each in found]) == pytest.approx(40.0, abs=2.0)
    assert np.mean([each.is_noise for each in found]) > 0.97  # the limit is that of 1 %
    wave = rng.standard_normal(1500) + 0.9 * np.cos(3.0 * angle + 0.4)
    own = residuals.residual_test(Comparison("run", "motor.i", wave, None, (), angle, 0.2), 0.99)
    assert own.orders[0] == (3, pytest.approx(0.18, abs=0.02)) and not own.is_noise


@pytest.mark.second
def test_a_proposed_run_with_fewer_rows_tells_the_same(loaded, monkeypatch):
    """Each row counts for those that it stands for, and a mark as before."""
    problem, own = problem_of(without(loaded, "motor.count")), what_runs_tell._simulated
    found, rows = [], []

    def simulated(problem, run, z, workers):
        rows.append(len(run.recording.time))
        return own(problem, run, z, workers)

    monkeypatch.setattr(what_runs_tell, "_simulated", simulated)
    for step in (1e-2, 1e-6):
        monkeypatch.setattr(what_runs_tell, "SPARSE", step)
        proposals = information(problem, problem.start_values).proposals
        found.append({each.words: (each.factor, each.determined) for each in proposals})
    few, every = found
    assert set(rows) == {len(loaded.time), len(loaded.time) // 2} and len(few) > 3
    for words, (factor, told) in few.items():
        assert every[words] == (pytest.approx(factor, rel=0.01), told), words


def test_slow_changes_are_no_noise():
    """Noise of any size is noise; slow changes that outweigh it are not, and their size is that of the change. Small
    ones count as noise."""
    rng, angle = np.random.default_rng(8), np.linspace(0.0, 60.0, 1500)
    slow = np.sin(np.linspace(0.0, 23.0, 1500))

    def checked(change, noise):
        wave = change * slow + noise * rng.standard_normal(1500)
        return residuals.residual_test(Comparison("run", "motor.i", wave, None, (), angle, 0.2), 0.99)

    loud = [checked(0.0, 5.0) for _ in range(300)]
    assert np.mean([each.slow > each.slow_limit for each in loud]) < 0.03  # the limit is that of 1 %
    assert np.mean([each.is_noise for each in loud]) > 0.96 and loud[0].noise == pytest.approx(5.0, rel=0.1)
    assert checked(0.5, 1.0).is_noise and checked(0.5, 1.0).slow > checked(0.5, 1.0).slow_limit
    own = checked(4.0, 1.0)
    assert own.reason == "slow" and not own.is_noise and own.statistic < own.limit
    assert own.changes == pytest.approx(0.2 * 4.0 / np.sqrt(2.0), rel=0.1)


def test_low_orders_of_the_crank_are_no_slow_changes():
    """A wrong dimension leaves them beside higher ones that are not looked at; residuals of zero are no fault."""
    angle = np.linspace(0.0, 60.0, 1500)
    rng = np.random.default_rng(9)
    wave = 4.0 * sum(np.cos(k * angle + k) for k in (1, 2, 3, 31)) + rng.standard_normal(1500)
    own = residuals.residual_test(Comparison("run", "motor.i", wave, None, (), angle, 0.2), 0.99)
    assert own.reason == "orders" and own.slow < own.slow_limit and own.noise > residuals.EXCESS_NOISE
    exact = residuals.residual_test(Comparison("run", "motor.i", 0.0 * wave, None, (), angle, 0.2), 0.99)
    assert exact.is_noise and exact.noise == exact.statistic == exact.slow == 0.0


def test_the_residuals_of_a_swinging_machine_are_checked():
    """Over a part of a turn the orders are nearly one another's sums, but the statistic of noise is that of its
    distribution, and does not stand on the last digits of the angle."""
    rng, swing = np.random.default_rng(7), 0.6 * np.exp(-np.linspace(0.0, 3.0, 1100))
    angle = 4.0 + swing * np.cos(np.linspace(0.0, 40.0, 1100))
    found = []
    for _ in range(300):
        noise = rng.standard_normal(1100)
        own, near = (
            residuals.residual_test(
                Comparison("run", "crank.tau", noise, None, (), angle * factor, 0.2), 0.99
            )
            for factor in (1.0, 1.0 + 1e-12)
        )
        assert near.statistic == pytest.approx(own.statistic, rel=1e-6) and near.limit == own.limit
        assert own.noise == pytest.approx(1.0, abs=0.1)
        found.append(own)
    # the limit is that of 1 %; the mean is the number of combinations that the swing resolves
    assert np.mean([each.is_noise for each in found]) > 0.97
    (count,) = [k for k in range(1, 41) if abs(k * f.ppf(0.99, k, 1099 - k) - found[0].limit) < 1e-6]
    assert 3 < count < 20
    assert np.mean([each.statistic for each in found]) == pytest.approx(count, rel=0.1)
    wrong = rng.standard_normal(1100) + 1.5 * np.cos(3.0 * angle)
    own = residuals.residual_test(Comparison("run", "crank.tau", wrong, None, (), angle, 0.2), 0.99)
    assert not own.is_noise and own.statistic > 5.0 * own.limit


def test_the_distribution_of_numbers_that_are_told_is_normal(loaded, empty):
    """Around the fit, with its deviations and correlations."""
    problem = problem_of(*(without(each, "motor.count") for each in (loaded, empty)), empty=(1,))
    best, count = fit(problem), len(SOUGHT)
    found = posterior(problem, best)
    for each, x, s in zip(found.marginals, best.z, best.deviations, strict=False):
        assert each.value == pytest.approx(x, abs=0.15 * s)
        assert each.deviation == pytest.approx(s, rel=0.1)
        assert (each.high - each.low) / (2.0 * 1.96 * s) == pytest.approx(1.0, abs=0.15)
    size = best.deviations[:count]
    own = found.covariance / np.outer(size, size)
    np.testing.assert_allclose(own, best.covariance[:count, :count] / np.outer(size, size), atol=0.15)


def test_the_distribution_of_numbers_that_are_not_told_is_that_of_their_bounds(loaded):
    """One run tells the sum of feed and web alone: each of them lies within bounds that hold for both, and evenly."""
    sought = [
        Unknown.within("machine.left.material_mass", "kg", 20.0, 60.0),
        Unknown.within("machine.left.web_mass", "kg", 15.0, 30.0),
    ]
    problem = problem_of(without(loaded, "motor.count"), sought=sought)
    best = fit(problem)
    found = posterior(problem, best)
    feed, web = found.samples.T
    total = float(np.sum(best.z[:2]))
    assert np.std(feed + web) < 0.5
    assert found.samples[:, 1].min() > 15.0 and found.samples[:, 1].max() < 30.0
    low, high = max(15.0, total - 60.0), min(30.0, total - 20.0)
    assert found.marginals[1].value == pytest.approx(0.5 * (low + high), abs=0.4)
    assert found.marginals[1].deviation == pytest.approx((high - low) / np.sqrt(12.0), rel=0.06)
    assert found.marginals[1].low == pytest.approx(low + 0.025 * (high - low), abs=0.3)
    assert found.marginals[0].high == pytest.approx(total - low - 0.025 * (high - low), abs=0.4)


@pytest.mark.parametrize("runs_up_to", [3.0, 2.5])
def test_a_product_bends_the_distribution(runs_up_to):
    """Of two numbers of which the data tell the product alone, against the integral over the distribution. Without
    the second derivatives the mean is off by a quarter of the deviation. They come from the largest part of a step
    with which the machine runs."""
    data = 6.0 + np.random.default_rng(0).standard_normal(400)

    class Product:
        unknowns = sought = (Unknown.within("a", "1", 2.0, 3.0), Unknown.within("b", "1", 2.0, 2.6))
        start_values, prior_deviations = np.array([2.5, 2.3]), np.array([1.0, 0.6]) / np.sqrt(12.0)
        bounds = np.array([2.0, 2.0]), np.array([3.0, 2.6])

        def comparisons(self, z, workers=1):
            if z[0] > runs_up_to:
                raise RunError("the states left all bounds")
            slopes = np.tile([z[1], z[0]], (len(data), 1))
            yield Comparison("run", "x", data - z[0] * z[1], slopes, (0, 1), None, 1.0)

        def thinned(self, step):
            return self

    problem, product = Product(), np.mean(data)
    found = posterior(problem, normal_equations(problem, np.array([2.4, product / 2.4])))
    axes = np.linspace(2.0, 3.0, 1001), np.linspace(2.0, 2.6, 601)
    a, b = np.meshgrid(*axes, indexing="ij")
    density = np.exp(-0.5 * len(data) * (product - a * b) ** 2)
    mean = np.sum(a * density) / np.sum(density)
    deviation = np.sqrt(np.sum((a - mean) ** 2 * density) / np.sum(density))
    assert found.marginals[0].value == pytest.approx(mean, abs=0.1 * deviation)
    assert found.marginals[0].deviation == pytest.approx(deviation, rel=0.06)


def test_a_number_beyond_its_bound_is_held_there():
    """Against the integral over the distribution; the number beside it follows."""
    rng = np.random.default_rng(0)
    rows = np.repeat([[1.0, 1.0], [1.0, 2.0]], 200, axis=0)
    data = rows @ [5.0, 3.0] + rng.standard_normal(400)

    class Straight:
        unknowns = sought = (Unknown.within("a", "1", 6.0, 20.0), Unknown.within("b", "1", 0.0, 10.0))
        start_values, prior_deviations = np.array([13.0, 5.0]), np.array([14.0, 10.0]) / np.sqrt(12.0)
        bounds = np.array([6.0, 0.0]), np.array([20.0, 10.0])

        def comparisons(self, z, workers=1):
            yield Comparison("run", "x", data - rows @ z, rows, (0, 1), None, 1.0)

        def thinned(self, step):
            return self

    b = float(np.linalg.lstsq(rows[:, 1:], data - 6.0, rcond=None)[0][0])
    problem = Straight()
    found = posterior(problem, normal_equations(problem, np.array([6.0, b])))
    assert found.active_bounds == ("a",)
    axes = np.linspace(6.0, 6.5, 1201), np.linspace(b - 0.6, b + 0.3, 901)
    a, b = np.meshgrid(*axes, indexing="ij")
    squares = sum((d - x * a - y * b) ** 2 for d, (x, y) in zip(data, rows, strict=True))
    density = np.exp(-0.5 * (squares - squares.min()))
    for k, x in enumerate((a, b)):
        mean = np.sum(x * density) / np.sum(density)
        deviation = np.sqrt(np.sum((x - mean) ** 2 * density) / np.sum(density))
        assert found.marginals[k].value == pytest.approx(mean, abs=0.1 * deviation)
        assert found.marginals[k].deviation == pytest.approx(deviation, rel=0.1)
    assert 6.0 <= found.marginals[0].low < found.marginals[0].high < 6.3


@pytest.mark.second
def test_two_numbers_in_a_corner_are_not_held():
    """Two numbers that are truly at their bounds, of which the data tell the sum well and the difference hardly."""
    for seed in range(20):
        rng = np.random.default_rng(seed)
        rows = np.column_stack([np.ones(400), 1.0 + 0.01 * rng.standard_normal(400)])
        data = rng.standard_normal(400)

        class Corner:
            unknowns = sought = tuple(Unknown.within(name, "1", 0.0, 10.0) for name in "ab")
            start_values, prior_deviations = np.array([5.0, 5.0]), np.array([10.0, 10.0]) / np.sqrt(12.0)
            bounds = np.array([0.0, 0.0]), np.array([10.0, 10.0])

            def comparisons(self, z, workers=1, data=data, rows=rows):
                yield Comparison("run", "x", data - rows @ z, rows, (0, 1), None, 1.0)

            def thinned(self, step):
                return self

        problem = Corner()
        found = posterior(problem, normal_equations(problem, nnls(rows, data)[0]))
        assert found.active_bounds == () and 0.0 < found.marginals[0].high < 0.5


@pytest.mark.parametrize("size", [1.0, 5.0, 20.0])
def test_noise_of_any_size_is_measured(size):
    """Also of a column with outliers."""
    residuals = size * np.random.default_rng(2).standard_normal(20_000)
    residuals[::500] = 60.0 * size
    of = Comparison("run", "motor.i", residuals, None, (), None, 1.0)
    ((_, found),) = fitting._measured_noises(SimpleNamespace(comparisons=[of])).items()
    assert found == pytest.approx(size, rel=0.05)


def test_a_number_without_a_sum_that_is_told():
    """Of two numbers, one of which leaves no trace."""
    own = tuple(Unknown.within(name, "1", 0.0, 1.0) for name in "ab")
    problem = SimpleNamespace(sought=own, prior_deviations=np.array([u.prior_deviation for u in own]))
    assert what_runs_tell._combinations(problem, np.diag([1e6, 1e-3])) == ()


@pytest.mark.parametrize("rows", [30, 42, 120])
def test_of_few_rows_few_orders_are_looked_at(rows):
    """Noise exceeds the limit as seldom as with many rows, and a wave is found."""
    rng, angle = np.random.default_rng(7), np.linspace(0.0, 30.0, rows)
    noises = [rng.standard_normal(rows) for _ in range(400)]
    found = [
        residuals.residual_test(Comparison("run", "motor.i", x, None, (), angle, 1.0), 0.95) for x in noises
    ]
    assert np.mean([each.is_noise for each in found]) == pytest.approx(0.95, abs=0.03)
    wave = noises[0] + 5.0 * np.cos(angle)
    assert not residuals.residual_test(
        Comparison("run", "motor.i", wave, None, (), angle, 1.0), 0.95
    ).is_noise


def test_what_is_known_beforehand_counts(loaded):
    """The normal equations are those of the runs and of what is known beforehand."""
    problem = problem_of(without(loaded, "motor.count"))
    at = normal_equations(problem, problem.start_values)
    assert at.matrix - at.fisher == pytest.approx(np.diag(1.0 / problem.prior_deviations**2))
    np.testing.assert_allclose(at.covariance @ at.matrix, np.eye(len(at.z)), atol=1e-6)
    assert np.all(at.deviations <= problem.prior_deviations * (1.0 + 1e-9))


def test_a_quantity_that_the_drive_does_not_have():
    with pytest.raises(
        InputError, match=r"motor\.power2: is not measured at this drive; there are motor\.i, motor\.u"
    ):
        Plant(drive_of(), ["motor.power2"], ["machine.r"])


WITH_MASSES = (
    *SOUGHT,
    Unknown.within("machine.left.web_mass", "kg", 8.0, 40.0),
    Unknown.within("machine.crank.m", "kg", 20.0, 60.0),
    Unknown.within("machine.coupler.m", "kg", 10.0, 50.0),
)


@pytest.mark.second
def test_what_runs_cannot_tell_is_named(loaded, empty):
    """In one run the material on the left web acts as the web itself. An empty run tells them apart, and is what is
    proposed."""
    recordings = [without(each, "motor.count") for each in (loaded, empty)]
    one = information(problem_of(recordings[0], sought=WITH_MASSES))
    (change,) = one.null_space
    assert sorted(name for name, _ in change.terms) == ["machine.left.material_mass", "machine.left.web_mass"]
    assert [c for _, c in change.terms] == [1.0, pytest.approx(-1.0, abs=1e-4)]
    told = {each.name: each for each in one.determinations}
    assert not told["machine.left.web_mass"].is_determined and told["machine.left.web_mass"].by_runs > 500.0
    assert told["machine.right.material_mass"].is_determined
    assert {each.by_both <= each.prior_deviation for each in one.determinations} == {True}
    best = one.proposals[0]
    assert best.words == "empty" and best.factor > max(each.factor for each in one.proposals[1:]) > 1.0
    both = information(problem_of(*recordings, empty=(1,), sought=WITH_MASSES), propose=False)
    assert both.null_space == () and both.proposals == ()
    factors = [a.by_both / b.by_both for a, b in zip(one.determinations, both.determinations, strict=True)]
    # the proposal was simulated from the start values, without noise
    assert np.exp(np.mean(np.log(factors))) == pytest.approx(best.factor, rel=0.1)


def test_a_combination_has_the_deviation_that_is_stated(loaded):
    """By the covariance, as a quadratic form of its coefficients as they are written. It is much
    less than that of its first number."""
    problem = problem_of(without(loaded, "motor.count"), sought=WITH_MASSES)
    found = information(problem, propose=False)
    assert found.combinations
    fisher = normal_equations(problem, problem.initial_point()).fisher
    covariance = np.linalg.inv(fisher + np.diag(1.0 / problem.prior_deviations**2))
    for each in found.combinations:
        places = [problem.place[name] for name, _ in each.terms]
        weights = np.array([c for _, c in each.terms])
        own = np.sqrt(weights @ covariance[np.ix_(places, places)] @ weights)
        assert each.deviation == pytest.approx(own, rel=1e-3)
        assert own < 0.2 * np.sqrt(covariance[places[0], places[0]])
        assert str(each).startswith(each.terms[0][0].removeprefix("machine."))


def test_the_expected_deviations_are_those_of_the_fit(loaded, empty):
    """But for the measured noise, which deviates from the stated one by parts of a hundred in 2400 rows."""
    problem = problem_of(*(without(each, "motor.count") for each in (loaded, empty)), empty=(1,))
    best = fit(problem)
    expected = [each.by_both for each in information(problem, best.z, propose=False).determinations]
    np.testing.assert_allclose(expected, best.deviations[: len(SOUGHT)], rtol=0.05)
