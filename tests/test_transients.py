"""Blocks of transients in compiled code, and in Python without a compiler: against the monolithic solution, and each
run as if it were alone."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import RK45

from chainunit import InputError
from chainunit.batch import transients
from chainunit.batch.transients import Transients, profile_rows
from chainunit.core import integrators
from chainunit.core.engines import MATH
from chainunit.core.native.compilers import compiler
from chainunit.drives.dc_motor import DcMotor
from chainunit.machines.chain_unit import ChamberForces
from chainunit.study.config import parse
from chainunit.study.drive import Drive
from chainunit.system import Profile, compiled, monolithic

KEPT = ["motor.tau", "motor.air_gap_tau", "machine.rocker.tau", "motor.w", "motor.phi"]
DRIVEN = ["motor.w_ref", "machine.left.processing_force"]
STEP, STOP = 1e-3, 1.2


pytestmark = pytest.mark.skipif(compiler() is None, reason="no C compiler")


def drive_of(text=""):
    config = parse(text)
    return Drive(DcMotor, config.motor.parameters, config.machine), config


def events(drive, force, at=0.7):
    """A start, and a lump that jams the left side."""
    ramp = Profile(0.0, ((0.0, 0.6, 3.0 * drive.ratio),))
    return {DRIVEN[0]: ramp, DRIVEN[1]: Profile(10.0, ((at, 0.02, force), (at + 0.2, 0.02, 10.0)))}


class Rig:
    """The drive as a compiled model, and its loop."""

    def __init__(self, text="", **options):
        self.drive, config = drive_of(text)
        component = compiled(self.drive.graph)
        self.model, self.p = component.model, component.parameters
        self.loads = self.drive.loads(config.feed)
        inputs = self.model.input_layout.from_names(self.loads)
        self.start = self.model.state_layout.values(self.model.begin(self.model.check(self.p), inputs))
        self.loop = Transients(self.model, KEPT, driven=DRIVEN, changes=2, **options)

    def run(self, signals, stop=STOP, **options):
        """The runs of a list of signals by input."""
        table = [[profile_rows(each[name], 2) for each in signals] for name in DRIVEN]
        stops = np.broadcast_to(stop, len(signals))
        options = {"states": self.start, "begin": 0.0, "step": STEP, "stop": stops, **options}
        states = options.pop("states")
        return self.loop.run(self.p, self.loads, states, signals=np.moveaxis(table, 1, -1), **options)


@pytest.fixture(scope="module")
def rig():
    return Rig(guarded=["motor.tau"])


@pytest.mark.parametrize("longest", [None, 20.0 * STEP])
def test_a_run_is_the_monolithic_solution(rig, longest):
    """Also with long steps, between whose ends the rows lie."""
    signals = events(rig.drive, 1500.0)
    result = rig.run([signals], longest=longest)
    reference = monolithic(rig.drive.graph, {**rig.loads, **signals}, result.times[0])
    assert result.count[0] == 1201 and not result.failed.any()
    for k, name in enumerate(KEPT):
        wanted = reference[name].values
        assert np.max(np.abs(result.rows[k, 0] - wanted)) < 1e-7 * np.max(np.abs(wanted)), name


@pytest.mark.second
def test_chains_are_the_monolithic_solution_to_their_tolerance():
    rig = Rig('organ = "chain"\n[chain]\nrods = 4\n')
    signals = events(rig.drive, 200.0)
    result = rig.run([signals, events(rig.drive, 300.0)], stop=0.8)
    times = result.times[0]
    reference = monolithic(rig.drive.graph, {**rig.loads, **signals}, times, rtol=1e-9)
    assert rig.model.controlled and not result.failed.any()
    for k, name in enumerate(KEPT):
        wanted = reference[name].values
        assert np.max(np.abs(result.rows[k, 0] - wanted)) < 2e-6 * np.max(np.abs(wanted)), name
    # error control of a lane does not depend on its neighbours
    alone = rig.run([events(rig.drive, 300.0)], stop=0.8)
    np.testing.assert_array_equal(alone.rows[:, 0], result.rows[:, 1])


def test_runs_do_not_know_one_another(rig):
    """Different events and ends, in one block and alone, in one thread or two: the same bits."""
    many = [events(rig.drive, force, at) for force, at in ((0.0, 0.2), (1500.0, 0.3), (2500.0, 0.5))] * 4
    stop = np.linspace(0.4, 1.0, len(many)) + 0.0004
    block = rig.run(many, stop=stop)
    threads = rig.run(many, stop=stop, workers=2)
    for k in range(len(many)):
        alone = rig.run([many[k]], stop=stop[k])
        n = int(block.count[k])
        assert n == alone.count[0] == threads.count[k] == int(np.ceil(stop[k] / STEP)) + 1
        assert block.times[k, n - 1] == stop[k]  # the last step is shorter
        np.testing.assert_array_equal(block.rows[:, k, :n], alone.rows[:, 0])
        np.testing.assert_array_equal(threads.rows[:, k, :n], alone.rows[:, 0])


def test_a_run_goes_on_from_its_states(rig):
    signals = [events(rig.drive, 1500.0), events(rig.drive, 500.0)]
    whole = rig.run(signals)
    first = rig.run(signals, stop=0.75)
    rest = rig.run(signals, states=first.states, begin=0.75)
    np.testing.assert_allclose(rest.rows, whole.rows[:, :, 750:], rtol=1e-10, atol=1e-10)
    # each run from a time of its own
    first = rig.run(signals, stop=[0.7, 0.8])
    rest = rig.run(signals, states=first.states, begin=[0.7, 0.8])
    assert rest.count.tolist() == [501, 401] and rest.times[1, 0] == 0.8
    for k, n in enumerate(rest.count):
        np.testing.assert_allclose(rest.rows[:, k, :n], whole.rows[:, k, 1201 - n :], rtol=1e-10, atol=1e-10)


def test_a_guard_ends_one_run_alone(rig):
    signals = [events(rig.drive, force) for force in (0.0, 3000.0)]
    free = rig.run(signals)
    limit = 0.9 * np.max(np.abs(free.rows[0, 1]))
    ended = rig.run(signals, limits=np.full((1, 2), limit))
    beyond = np.flatnonzero(np.abs(free.rows[0, 1]) > limit)
    assert ended.count.tolist() == [1201, beyond[0] + 1] and not ended.failed.any()
    n = int(ended.count[1])
    np.testing.assert_array_equal(ended.rows[:, 1, :n], free.rows[:, 1, :n])
    np.testing.assert_array_equal(ended.rows[:, 0], free.rows[:, 0])


def test_parameters_may_differ_between_runs(rig):
    names = ["machine.crank.m", "motor.armature.R"]
    model, signals = rig.model, events(rig.drive, 1000.0)
    loop = Transients(model, KEPT, varying=names, driven=DRIVEN, changes=2)
    table = np.repeat([[profile_rows(signals[name], 2)] for name in DRIVEN], 2, axis=1)
    varying = np.array([[40.0, 80.0], [9.5, 7.0]])
    options = {"begin": 0.0, "step": STEP, "stop": np.full(2, 1.0)}
    both = loop.run(
        rig.p, rig.loads, rig.start, varying=varying, signals=np.moveaxis(table, 1, -1), **options
    )
    for k in range(2):
        p = model.parameter_layout.from_names(dict(zip(names, varying[:, k], strict=True)), rig.p)
        one = rig.loop.run(
            p, rig.loads, rig.start, signals=np.moveaxis(table, 1, -1)[..., :1],
            **{**options, "stop": np.ones(1)},
        )  # fmt: skip
        np.testing.assert_allclose(both.rows[:, k], one.rows[:, 0], rtol=1e-10, atol=1e-9)
    assert np.max(np.abs(both.rows[0, 0] - both.rows[0, 1])) > 0.01


def test_states_that_leave_all_bounds_fail_alone(rig):
    wild = np.repeat(np.array(rig.start, float)[:, None], 2, axis=1)
    wild[rig.model.state_layout.names.index("motor.w"), 1] = 1e200
    result = rig.run([events(rig.drive, 0.0)] * 2, states=wild, stop=0.1)
    assert result.failed.tolist() == [False, True] and result.count[0] == 101 and result.count[1] < 3
    assert np.isfinite(result.rows[:, 0]).all()


def test_the_profile_is_that_of_the_signals(rig):
    """The rows of a profile give its values: a motor without load follows nothing else."""
    profile = Profile(1.0, ((0.1, 0.2, 3.0), (0.5, 0.1, -2.0)))
    before, *changes = profile_rows(profile, 3)
    assert len(changes) == 9 and changes[-1] == -2.0
    t = np.linspace(0.0, 1.0, 101)
    value, last = before, before
    for begin, duration, after in np.reshape(changes, (3, 3)):
        s = np.clip((t - begin) / duration, 0.0, 1.0)
        value, last = value + (after - last) * s**3 * (10.0 + s * (6.0 * s - 15.0)), after
    np.testing.assert_allclose(value, profile(t), rtol=1e-14)
    assert profile_rows(7.0, 1) == [7.0, np.inf, 1.0, 7.0]
    with pytest.raises(ValueError, match="3 changes"):
        profile_rows(Profile(0.0, ((0.0, 1.0, 1.0), (1.0, 1.0, 2.0), (2.0, 1.0, 0.0))), 2)


def test_wrong_requests_are_refused(rig):
    with pytest.raises(InputError, match="has no states"):
        Transients(ChamberForces, ["tau"])
    with pytest.raises(InputError, match=r"motor\.tua: no such output.*motor\.tau"):
        Transients(rig.model, ["motor.tua"])
    assert rig.model.internal_step(MATH, rig.model.with_derived(MATH, rig.p)) < STEP


def without_compiler(monkeypatch):
    monkeypatch.setattr(transients, "compiler", lambda: None)
    assert not transients.can_run()


def test_without_a_compiler_python_makes_the_runs(rig, monkeypatch):
    """Runs of different ends, with a guard, varying values, and states that leave all bounds, as the fast loop."""
    signals = [events(rig.drive, force, 0.02) for force in (500.0, 1500.0)]
    stop, limits = [0.1004, 0.08], np.array([[np.inf, 20.0]])
    wild = np.repeat(np.array(rig.start, float)[:, None], 2, axis=1)
    wild[rig.model.state_layout.names.index("motor.w"), 1] = 1e200
    fast, failed = rig.run(signals, stop=stop, limits=limits), rig.run(signals, states=wild, stop=0.01)
    without_compiler(monkeypatch)
    own = Rig(guarded=["motor.tau"])
    assert type(own.loop._loop).__name__ == "PythonLoop"
    result = own.run(signals, stop=stop, limits=limits)
    assert result.count.tolist() == fast.count.tolist() and result.count[0] == 102
    for k, n in enumerate(fast.count):
        wanted = fast.rows[:, k, :n]
        scale = np.max(np.abs(wanted), axis=1, keepdims=True)
        assert np.max(np.abs(result.rows[:, k, :n] - wanted) / scale) < 1e-7
    np.testing.assert_allclose(result.states, fast.states, rtol=1e-7, atol=1e-9)
    rest = own.run(signals, states=result.states, begin=stop, stop=0.11)
    again = rig.run(signals, states=result.states, begin=stop, stop=0.11)
    np.testing.assert_allclose(
        rest.rows[:, 0, : rest.count[0]], again.rows[:, 0, : again.count[0]], rtol=1e-6
    )
    own_failed = own.run(signals, states=wild, stop=0.01)
    assert own_failed.failed.tolist() == failed.failed.tolist() == [False, True]
    names = ["machine.crank.m", "motor.armature.R"]
    loop = Transients(own.model, KEPT, varying=names, driven=DRIVEN, changes=2)
    table = np.array([[profile_rows(signals[0][name], 2)] for name in DRIVEN])
    options = {"signals": np.moveaxis(table, 1, -1), "begin": 0.0, "step": STEP, "stop": [0.02]}
    varied = loop.run(own.p, own.loads, own.start, varying=np.array([[80.0], [7.0]]), **options)
    p = own.model.parameter_layout.from_names({names[0]: 80.0, names[1]: 7.0}, own.p)
    wanted = rig.loop.run(p, rig.loads, rig.start, **options).rows
    np.testing.assert_allclose(varied.rows, wanted, rtol=1e-7, atol=1e-9)


@pytest.mark.second
def test_without_a_compiler_python_makes_the_runs_of_chains(monkeypatch):
    """They need the control of the error."""
    text = 'organ = "chain"\n[chain]\nrods = 2\n'
    fast = Rig(text)
    signals = events(fast.drive, 200.0, 0.01)
    wanted = fast.run([signals], stop=0.03).rows[:, 0]
    without_compiler(monkeypatch)
    rows = Rig(text).run([signals], stop=0.03).rows[:, 0]
    assert np.max(np.abs(rows - wanted) / np.max(np.abs(wanted), axis=1, keepdims=True)) < 1e-6


def test_directions_need_a_compiler(monkeypatch):
    without_compiler(monkeypatch)
    with pytest.raises(InputError, match=r"^no C compiler .*chainunit\[cross\].* found$"):
        Rig(by=["machine.left.web_mass"])


@pytest.mark.second
def test_a_direction_gives_the_derivative_of_the_run(rig):
    """By a parameter, an input and a state at the start, each against differences of runs, through a lump that the
    loop of the control follows. The values themselves are those of a run without directions."""
    by = {"machine.left.web_mass": 2.0, "machine.right.material_mass": 3.0}
    own = Rig(by=list(by), varying=["machine.left.web_mass"])
    signals, size, n = events(rig.drive, 400.0), 1e-4, len(rig.start)
    mass = own.drive.machine.by_name["left.web_mass"]
    phi = own.model.state_layout.names.index("motor.phi")
    states, directions = np.zeros((2 * n, 3)), np.diag(list(by.values()))
    states[:n] = np.array(rig.start)[:, None]
    states[n + phi, 2] = 0.5
    result = own.run(
        [signals] * 3,
        states=states,
        directions=np.hstack([directions, np.zeros((2, 1))]),
        varying=np.full((1, 3), mass),
    )

    def ends(k, sign):
        """The run with a small step in this direction."""
        start, loads = states[:n, :1].copy(), dict(own.loads)
        start[phi] += sign * size * 0.5 * (k == 2)
        loads["machine.right.material_mass"] += sign * size * 3.0 * (k == 1)
        own_mass = np.full((1, 1), mass + sign * size * 2.0 * (k == 0))
        table = [[profile_rows(signals[name], 2)] for name in DRIVEN]
        return own.loop.run(
            own.p,
            loads,
            np.vstack([start, 0.0 * start]),
            begin=0.0,
            step=STEP,
            stop=[STOP],
            varying=own_mass,
            signals=np.moveaxis(table, 1, -1),
            directions=np.zeros((2, 1)),
        ).rows[:, 0]

    for k in range(3):
        differences = (ends(k, 1.0) - ends(k, -1.0)) / (2.0 * size)
        for row, name in enumerate(KEPT):
            peak = np.max(np.abs(differences[row]))
            assert peak > 1e-6
            assert np.max(np.abs(result.slopes[row, k] - differences[row])) < 2e-5 * peak, (k, name)
    alone = rig.run([signals])
    for row in range(len(KEPT)):
        peak = np.max(np.abs(alone.rows[row]))
        assert np.max(np.abs(result.rows[row, 1] - alone.rows[row, 0])) < 1e-9 * peak


def test_the_dense_output_is_of_fourth_order():
    """At the end of a step it is the solution, within it meets the conditions of fourth order, and the coefficients
    are those of scipy."""
    weights = np.array(integrators.DENSE)
    np.testing.assert_array_equal(weights, RK45.P)
    np.testing.assert_allclose(weights.sum(axis=1), [*integrators.STAGES[-1], 0.0], atol=1e-14)
    nodes = np.array(integrators.NODES)
    for z in (0.2, 0.5, 0.9):
        share = weights @ np.array([z, z**2, z**3, z**4])
        for k in range(4):
            assert share @ nodes**k == pytest.approx(z ** (k + 1) / (k + 1), abs=1e-13)
