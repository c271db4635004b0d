"""The load observer: its gradient, its two covariances, its thresholds, and what it finds."""

from __future__ import annotations

import importlib
import itertools
import math
from pathlib import Path

import control
import fmpy
import numpy as np
import observing
import pytest
from scipy.linalg import expm
from scipy.special import lambertw
from scipy.stats import norm

from chainunit.capabilities.watch.false_loads import ANGLES, false_loads
from chainunit.core.engines import MATH, Dual, dual, numpy_, slope
from chainunit.core.native.compilers import compiler
from chainunit.drives.dc_motor import DcMotor
from chainunit.fmu.native.export import export
from chainunit.machines import load_filter
from chainunit.machines.chain_unit import ChamberForces, SideLoads
from chainunit.machines.load_observer import (
    Inputs,
    LoadObserver,
    Parameters,
    balance,
    densities,
    machine_inputs,
    rotor_torque,
    sizes,
)
from chainunit.mechanism.machine import MachineState, Mechanism
from chainunit.models import MODELS

native = pytest.mark.skipif(compiler() is None, reason="no C compiler")
LOADS = ("left.material_mass", "right.material_mass", "left.processing_force", "right.processing_force")
STATES = ("speed", *LOADS, "torque_offset")


def at(loads, speed=150.0, offset=0.0):
    """States of the observer with these estimates."""
    x = LoadObserver.begin(Parameters(), Inputs(w=speed))
    values = dict(zip(STATES, (speed, *loads, offset), strict=True))
    return LoadObserver.state_layout.from_names(values, x)


def torque_of_machine(p, phi, a, estimates):
    """Torque at the motor's shaft by the machine's own model, with the rotor and the offset [N m]."""
    speed, *loads, offset = estimates
    u = ChamberForces.input_layout.from_names(
        dict(zip(LOADS, loads, strict=True)) | {"phi": phi, "w": speed, "a": a}
    )
    outputs = ChamberForces.evaluate(MATH, p, u)[0]
    return outputs.tau + p.rotor.J * a + p.rotor.d * speed + offset


def acceleration_of_machine(p, phi, torque, estimates):
    """The acceleration that needs this torque, which is linear in it."""
    none, one = (torque_of_machine(p, phi, a, estimates) for a in (0.0, 1.0))
    return (torque - none) / (one - none)


@pytest.mark.parametrize("phi", [3.0, 40.0, 95.0, 233.0])
@pytest.mark.parametrize("loads", [(36.0, 24.0, 300.0, 10.0), (0.0, 0.0, 0.0, 0.0), (5.0, 55.0, 0.0, 900.0)])
def test_the_gradient_is_the_derivative_of_the_machines_torque(phi, loads):
    """By central differences of `ChamberForces`, with friction and damping, so that nothing is linear."""
    p = Parameters(joint_damping=3.0)
    u = Inputs(phi=phi, w=150.0, current=0.9)
    estimates = np.array([143.0, *loads, 0.05])
    b = balance(MATH, p, u, at(loads, 143.0, 0.05))
    torque = rotor_torque(p, u)
    assert b.acceleration == pytest.approx(acceleration_of_machine(p, phi, torque, estimates), rel=1e-9)
    steps = np.array([0.5, 0.2, 0.2, 2.0, 2.0, 0.01])
    for k, width in enumerate(steps):
        change = width * np.eye(6)[k]
        ends = [
            acceleration_of_machine(p, phi, torque, estimates + s * change) for s in (1.0, -1.0, 2.0, -2.0)
        ]
        slope = (8.0 * (ends[0] - ends[1]) - (ends[2] - ends[3])) / (12.0 * width)
        assert b.gradient[k] == pytest.approx(slope, rel=1e-6, abs=1e-9 * abs(b.gradient[-1])), STATES[k]


LOSS = 1.0 / 0.7 - 1.0
"""The loss of a gear of 70 %."""


def behind_gear(**values):
    """Parameters of the observer behind that gear."""
    return LoadObserver.parameter_layout.from_names({"gear.loss": LOSS, **values})


@pytest.mark.parametrize("phi", [3.0, 40.0, 95.0, 233.0])
@pytest.mark.parametrize("speed", [150.0, -150.0])
@pytest.mark.parametrize("current", [15.0, -15.0])
def test_behind_a_gear_the_motor_gives_the_acceleration(phi, speed, current):
    """The model of the motor turns the true loads: by its own equation, and with what the gear passes and loses."""
    loads, p = (36.0, 24.0, 300.0, 10.0), behind_gear()
    u = dict(zip(LOADS, loads, strict=True)) | {"phi": phi, "w": speed}
    machine = ChamberForces.evaluate(MATH, p, ChamberForces.input_layout.from_names(u))[0]
    of_motor = DcMotor.parameter_layout.from_names({"gear.loss": LOSS})
    load = DcMotor.input_layout.from_names({"load.tau_bias": machine.tau_bias, "load.J": machine.J})
    state = DcMotor.initial_states(MATH, of_motor)
    state = DcMotor.state_layout.from_names({"w": speed, "armature.i": current}, state)
    motor = DcMotor.evaluate(MATH, of_motor, load, state)[0]
    b = balance(MATH, p, Inputs(phi=phi, w=speed, current=current), at(loads, speed))
    assert b.acceleration == pytest.approx(motor.a, rel=1e-12)
    passed = machine.tau_bias + machine.J * b.acceleration
    # a current in the direction of turning drives the machine, one against it is driven by the machine
    assert passed * current > 0.0
    lost = math.copysign(LOSS * passed, speed)
    left = of_motor.armature.k * current - of_motor.rotor.d * speed - passed - lost
    assert of_motor.rotor.J * b.acceleration == pytest.approx(left, rel=1e-12)
    sign = math.copysign(1.0, speed * current)
    assert b.felt == pytest.approx(1.0 + sign * LOSS, rel=1e-12)
    assert b.inertia == pytest.approx(of_motor.rotor.J + b.felt * machine.J, rel=1e-12)


def acceleration_behind_gear(p, phi, torque, estimates):
    """Of both signs of the torque that the gear passes, the acceleration at which the torque has this sign."""
    speed, *loads, offset = estimates
    u = dict(zip(LOADS, loads, strict=True)) | {"phi": phi, "w": speed}
    machine = ChamberForces.evaluate(MATH, p, ChamberForces.input_layout.from_names(u))[0]
    driving, answers = torque - offset - p.rotor.d * speed, []
    for sign in (1.0, -1.0):
        felt = 1.0 + p.gear.loss * sign * math.copysign(1.0, speed)
        a = (driving - felt * machine.tau_bias) / (p.rotor.J + felt * machine.J)
        if sign * (machine.tau_bias + machine.J * a) > 0.0:
            answers.append((a, felt))
    (answer,) = answers
    return answer


@pytest.mark.second
@pytest.mark.parametrize("loads", [(36.0, 24.0, 300.0, 10.0), (5.0, 55.0, 0.0, 900.0)])
@pytest.mark.parametrize("speed", [143.0, -143.0])
def test_the_gradient_behind_a_gear(loads, speed):
    """By central differences of the balance by hand, for a torque that drives and one that is driven."""
    p, shares = behind_gear(joint_damping=3.0), set()
    steps = np.array([0.5, 0.2, 0.2, 2.0, 2.0, 0.01])
    for phi, current in itertools.product((3.0, 40.0, 95.0, 233.0), (6.0, -6.0)):
        u, estimates = Inputs(phi=phi, w=150.0, current=current), np.array([speed, *loads, 0.05])
        b = balance(MATH, p, u, at(loads, speed, 0.05))
        torque = rotor_torque(p, u)
        a, felt = acceleration_behind_gear(p, phi, torque, estimates)
        assert b.acceleration == pytest.approx(a, rel=1e-12)
        shares.add(round(felt, 6))
        for k, width in enumerate(steps):
            change = width * np.eye(6)[k]
            ends = [
                acceleration_behind_gear(p, phi, torque, estimates + s * change)[0]
                for s in (1.0, -1.0, 2.0, -2.0)
            ]
            by_differences = (8.0 * (ends[0] - ends[1]) - (ends[2] - ends[3])) / (12.0 * width)
            assert b.gradient[k] == pytest.approx(by_differences, rel=1e-6, abs=1e-9 * abs(b.gradient[-1])), (
                STATES[k]
            )
    assert shares == {round(1.0 + LOSS, 6), round(1.0 - LOSS, 6)}


def test_a_self_locking_gear_has_the_gradient_of_what_the_rotor_feels():
    """The load of such a gear is worth a negative inertia, of which a part counts."""
    p = LoadObserver.parameter_layout.from_names({"gear.loss": 4.0, "ratio": 5.0})
    loads, u = (36.0, 24.0, 300.0, 10.0), Inputs(phi=4.0, w=150.0, current=-6.0)
    b = balance(MATH, p, u, at(loads))
    assert b.inertia == pytest.approx(0.1 * p.rotor.J) and b.felt == -3.0
    for k, width in enumerate([0.5, 0.2, 0.2, 2.0, 2.0, 0.01]):
        changed = np.array([150.0, *loads, 0.0]) + np.outer([width, -width], np.eye(6)[k])
        ends = [balance(MATH, p, u, at(x[1:5], x[0], x[5])).acceleration for x in changed]
        expected = (ends[0] - ends[1]) / (2.0 * width)
        assert b.gradient[k] == pytest.approx(expected, rel=1e-4, abs=1e-9 * abs(b.gradient[-1])), STATES[k]


@pytest.mark.parametrize("speed", [150.0, 0.3, 0.0, -80.0])
@pytest.mark.parametrize("current", [0.9, -3.0])
def test_without_a_loss_rotor_and_machine_are_one_body(speed, current):
    """To the bit, with the equation of one shaft."""
    p, loads = Parameters(joint_damping=3.0), [36.0, 24.0, 300.0, 10.0]
    u, w, engine = Inputs(phi=40.0, w=150.0, current=current), speed / p.ratio, dual(MATH)

    def linkage(xp, values):
        sides = (
            SideLoads(material_mass=m, processing_force=f)
            for m, f in zip(values[:2], values[2:], strict=True)
        )
        return ChamberForces.linkage(xp, p, machine_inputs(u, speed, *sides))

    m = Mechanism(MATH, linkage(MATH, loads), u.phi / p.ratio, (), ChamberForces.topology)
    s = MachineState(MATH, m, w)
    inertia = p.rotor.J + s.J / (p.ratio * p.ratio)
    a = (rotor_torque(p, u) - 0.05 - p.rotor.d * speed - s.bias / p.ratio) / inertia
    turning = MachineState(engine, m, Dual(w, 1.0 / p.ratio))
    gradient = [-(p.rotor.d + slope(turning.bias) / p.ratio) / inertia]
    for k in range(4):
        seeded = [Dual(v, 1.0) if i == k else v for i, v in enumerate(loads)]
        one = MachineState(engine, m.with_bodies(linkage(engine, seeded)), w)
        gradient.append(-(slope(one.bias) + slope(one.J) * (a / p.ratio)) / (p.ratio * inertia))
    b = balance(MATH, p, u, at(loads, speed, 0.05))
    assert (b.inertia, b.acceleration, b.felt) == (inertia, a, 1.0)
    assert b.gradient == [*gradient, -1.0 / inertia]


def test_the_signals():
    """A torque, an armature current, and an active power without the losses of the winding."""
    layout = LoadObserver.parameter_layout
    u = Inputs(torque=2.0, current=3.0, power=500.0)
    by = {"signal.current": 0.0}
    assert rotor_torque(layout.from_names({"signal.zero": 0.5}), u) == pytest.approx(3.0 * 1.27 - 0.5)
    assert rotor_torque(layout.from_names(by | {"signal.torque": 1.0}), u) == pytest.approx(2.0)
    power = {"signal.power": 2.0 / 314.0, "signal.resistance": 12.0}
    assert rotor_torque(layout.from_names(by | power), u) == pytest.approx((500.0 - 12.0 * 9.0) * 2.0 / 314.0)


@pytest.mark.parametrize("loss", [0.0, LOSS])
def test_every_engine_gives_the_same(loss):
    """Points of an array, and symbols, whose directional derivative is that of the rates."""
    phi = np.linspace(0.0, 314.0, 7)
    x, p = at((33.0, 27.0, 50.0, 0.0)), LoadObserver.parameter_layout.from_names({"gear.loss": loss})
    rows = LoadObserver.derivatives(numpy_(), p, Inputs(phi=phi, w=151.0, current=0.7), x)
    outputs = LoadObserver.evaluate(numpy_(), p, Inputs(phi=phi, w=151.0, current=0.7), x)[0]
    layout = LoadObserver.parts[0].layout
    for k, one in enumerate(phi):
        u = Inputs(phi=float(one), w=151.0, current=0.7)
        expected = LoadObserver.derivatives(MATH, p, u, x)
        np.testing.assert_allclose(
            [np.broadcast_to(r, phi.shape)[k] for r in rows], expected, rtol=1e-9, atol=1e-12
        )
        expected = layout.values(LoadObserver.evaluate(MATH, p, u, x)[0])
        here = [np.broadcast_to(v, phi.shape)[k] for v in layout.values(outputs)]
        np.testing.assert_allclose(here, expected, rtol=1e-9, atol=1e-12)


def random_filter(rng):
    """A covariance, and a gradient, decays and densities of a filter."""
    root = rng.normal(size=(6, 6))
    decay = np.array([0.0, *rng.uniform(0.0, 1.0, 5)])
    return root @ root.T, rng.normal(size=6), decay, rng.uniform(0.1, 1.0, 6), 40.0


def entries(matrix):
    return np.array([matrix[i, j] for i, j in load_filter.TRIANGLE])


def dense(gradient, decay):
    """The matrix of the linear system."""
    A = -np.diag(decay)
    A[0] += gradient
    return A


def test_the_rates_of_both_covariances_are_riccatis_and_lyapunovs():
    P, gradient, decay, density, rate = random_filter(np.random.default_rng(2))
    A, C = dense(gradient, decay), np.eye(1, 6)
    expected = A @ P + P @ A.T + np.diag(density) - P @ C.T @ C @ P * rate
    rates = load_filter.covariance_rates(load_filter.symmetric(entries(P)), gradient, decay, density, rate)
    np.testing.assert_allclose(rates, entries(expected), rtol=1e-12)
    gain = (P @ C.T * rate)[:, 0]
    closed = A - np.outer(gain, C)
    S = P + np.eye(6)
    expected = closed @ S + S @ closed.T + np.diag(density) + np.outer(gain, gain) / rate
    rates = load_filter.error_rates(load_filter.symmetric(entries(S)), gain, gradient, decay, density, rate)
    np.testing.assert_allclose(rates, entries(expected), rtol=1e-12)
    # the error of an optimal filter under its own noise is its covariance
    rates = load_filter.error_rates(load_filter.symmetric(entries(P)), gain, gradient, decay, density, rate)
    riccati = load_filter.covariance_rates(load_filter.symmetric(entries(P)), gradient, decay, density, rate)
    np.testing.assert_allclose(rates, riccati, rtol=1e-9, atol=1e-12)


def test_probability_and_level():
    for z in (-9.0, -3.0, -0.5, 0.0, 0.2, 1.0, 4.0):
        assert load_filter.normal_probability(MATH, z) == pytest.approx(norm.cdf(z), abs=1e-7)
    z = load_filter.level(MATH, 0.5, 1e-6)
    assert 2.0 * z * math.exp(-0.5 * z * z) / (math.sqrt(2.0 * math.pi) * 0.5) == pytest.approx(
        1e-6, rel=1e-6
    )
    # an error that does not change has no rate, but a share of the machines
    assert load_filter.level(MATH, 1e9, 1e-6) == pytest.approx(load_filter.LEAST_LEVEL, rel=1.2e-8)


def test_the_level_is_that_of_lambert():
    """From the least level to that of the least share, and the slope by the logarithm of the share."""
    z = np.linspace(load_filter.LEAST_LEVEL, 37.26, 2001)
    memory = 2.0 * z * np.exp(-0.5 * z * z) / math.sqrt(2.0 * math.pi)
    levels = load_filter.level(numpy_(), memory, 1.0)
    np.testing.assert_allclose(levels, z, rtol=1.2e-8)
    share = z * np.exp(-0.5 * z * z)
    seen = share > 1e-150  # whose square is a number
    np.testing.assert_allclose(levels[seen], np.sqrt(-lambertw(-(share[seen] ** 2), -1).real), rtol=1.2e-8)
    slopes = [slope(load_filter.level(dual(MATH), Dual(x, x), 1.0)) for x in memory[1:]]
    np.testing.assert_allclose(slopes, -1.0 / (z - 1.0 / z)[1:], rtol=2e-6)
    # the level of a rate that no machine shows stays finite
    assert load_filter.level(MATH, 1e-200, 1e-200) == pytest.approx(37.27, abs=0.01)


# -- at the machine


@pytest.fixture(scope="module")
def observer(tmp_path_factory):
    """The native FMU of the observer."""
    return export(MODELS["LoadObserver"], tmp_path_factory.mktemp("observer") / "observer.fmu")


@pytest.fixture(scope="module")
def quiet():
    """20 s of the machine with equal feed."""
    return observing.course({}, 20.0)


@native
def test_without_noise_the_estimates_are_exact(observer, quiet):
    """Feeds that are not those at the start, and a force; equal loads without imbalance."""
    values = observing.noise_of(quiet)
    names = [*LOADS, "torque_offset", "imbalance.feed", "alarm", "rocker.tau", "left.web_pull"]
    result = observing.observe(observer, quiet, values | {"feed.expected": 20.0}, names)
    np.testing.assert_allclose(result[:2, -1], 30.0, rtol=2e-3)
    assert np.max(np.abs(result[2:4, -1])) < 1.0 and abs(result[4, -1]) < 1e-3
    assert not np.any(result[6])
    signals = {
        "machine.left.material_mass": observing.Profile(25.0),
        "machine.right.processing_force": observing.Profile(200.0),
    }
    other = observing.course(signals, 20.0)
    result = observing.observe(observer, other, values, names)
    np.testing.assert_allclose(result[:4, -1], [25.0, 30.0, 0.0, 200.0], rtol=5e-3, atol=2.0)
    # what follows from the loads is that of the machine at this motion
    p = ChamberForces.parameter_layout.from_names({"ratio": observing.RATIO})
    a = (other[1, -1] - other[1, -3]) / (2.0 * observing.STEP)
    sides = [SideLoads(material_mass=m, processing_force=f) for m, f in ((25.0, 0.0), (30.0, 200.0))]
    u = machine_inputs(Inputs(phi=other[0, -2]), other[1, -2], *sides, a)
    outputs = ChamberForces.evaluate(MATH, p, u)[0]
    assert result[7, -2] == pytest.approx(outputs.rocker.tau, rel=0.02)
    assert result[8, -2] == pytest.approx(outputs.left.web_pull, rel=0.02)


def accelerations(p, row, estimates):
    """The acceleration at several estimates, shape (6, n), by the machine's own model, without its derivatives."""
    speed, *loads, offset = estimates
    u = ChamberForces.input_layout.from_names(
        dict(zip(LOADS, loads, strict=True)) | {"phi": row[0], "w": speed}
    )
    s = ChamberForces.shared(numpy_(), p, u, None)
    torque = p.signal.current * row[2] - offset - p.rotor.d * speed - s.bias / p.ratio
    return torque / (p.rotor.J + s.J / p.ratio**2)


def discrete(p, rows, x, P, parts=12):
    """An extended Kalman filter in discrete time, with differences for derivatives and matrix exponentials; each row
    is divided into `parts`. The estimates after each row, and the last covariance."""
    h, scale = observing.STEP / parts, np.array(sizes(p))
    noise = np.array([0.0, *densities(p)]) * scale**2
    decay = np.array([0.0, *(0.5 * q for q in densities(p))])
    widths = np.diag([0.5, 0.1, 0.1, 2.0, 2.0, 0.01])
    C, R = np.eye(1, 6), p.noise.w**2 / p.noise.rate / h
    estimates = []
    for row in rows.T:
        points = np.hstack([x[:, None], x[:, None] + widths, x[:, None] - widths])
        a = accelerations(p, row, points)
        jacobian = (a[1:7] - a[7:]) / (2.0 * np.diag(widths))
        A = np.zeros((6, 6))
        A[0] = jacobian
        noise[0] = (p.noise.torque * jacobian[5]) ** 2 / p.noise.rate
        # the covariance alone forgets, see `densities`
        F = expm((A - np.diag(decay)) * h)
        move = expm(A * h)
        known = x
        for _ in range(parts):
            K = (P @ C.T / (P[0, 0] + R))[:, 0]
            x = x + K * (row[1] - x[0])
            P = (np.eye(6) - np.outer(K, C)) @ P
            # the rate at the estimate that the differences were taken at, and its linear change
            drift = np.zeros(6)
            drift[0] = a[0] - jacobian @ known
            x = move @ x + drift * h
            P = F @ P @ F.T + np.diag(noise) * h
        estimates.append(x)
    return np.array(estimates).T, P


@pytest.mark.second
@native
def test_a_discrete_filter_by_other_means_gives_the_same(observer, quiet):
    """On the same noisy rows, with loads that are not those at the start."""
    rows = observing.noisy(quiet[:, :800])
    values = observing.noise_of(quiet) | {"feed.expected": 27.0, "force.expected": 20.0}
    p = LoadObserver.parameter_layout.from_names(values)
    names = [
        *STATES,
        "surprise",
        *(f"covariance.{n}" for n in ("left_feed_left_feed", "right_force_right_force")),
    ]
    result = observing.observe(observer, rows, values, names)
    size = observing.noise_of(quiet)["noise.w"] / math.sqrt(2.0 * 0.02 * 1000.0)
    assert np.max(np.abs(result[6])) < 6.0 * size  # no jump, which only the observer knows
    start = np.array([rows[1, 0], 27.0, 27.0, 20.0, 20.0, 0.0])
    estimates, P = discrete(
        p, rows[:, :-1], start, np.diag([0.1, 1.0, 1.0, 0.01, 0.01, 1.0]) * np.outer(sizes(p), sizes(p))
    )
    difference = np.abs(estimates - result[:6, 1:])[:, 400:]
    assert np.all(np.max(difference, axis=1) < 1e-3 * np.array([150.0, 30.0, 30.0, 1000.0, 1000.0, 1.0]))
    for place, column in ((1, 7), (4, 8)):
        assert P[place, place] / sizes(p)[place] ** 2 == pytest.approx(result[column, -1], rel=1e-2)


@native
def test_python_control_gives_the_mean_covariance(observer):
    """A slow filter sees the mean of the information over a turn: torques of order n count against the noise of the
    torque and of the acceleration at that order."""
    rows = observing.course({}, 80.0)
    values = observing.noise_of(rows) | {"feed.change": 0.06, "force.change": 0.2, "offset.change": 2e-5}
    p = LoadObserver.parameter_layout.from_names(values)
    names = [
        "left_feed_left_feed",
        "right_feed_right_feed",
        "left_force_left_force",
        "right_force_right_force",
    ]
    result = observing.observe(observer, rows, values, [f"covariance.{name}" for name in names])
    count = round(observing.TURN / observing.STEP)
    found = np.mean(result[:, -count:], axis=1)
    phi = np.arange(256) / 256 * 2.0 * math.pi * p.ratio
    b = balance(numpy_(), p, Inputs(phi=phi, w=150.0, current=0.49), at((30.0, 30.0, 0.0, 0.0)))
    scale = np.array(sizes(p))
    rates = np.array([np.broadcast_to(g, phi.shape) for g in b.gradient[1:]]) * scale[1:, None]
    spectrum = np.fft.fft(rates, axis=1) / 256
    order = np.fft.fftfreq(256, 1.0 / 256) * 2.0 * math.pi / observing.TURN
    noise = (p.noise.torque**2 * np.mean(b.gradient[5] ** 2) + (order * p.noise.w) ** 2) / p.noise.rate
    information = np.real(np.einsum("in,jn,n->ij", spectrum, spectrum.conj(), 1.0 / noise))
    q = np.array(densities(p))
    values, vectors = np.linalg.eigh(information)
    C = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
    _, P, _ = control.lqe(-np.diag(0.5 * q), np.eye(5), C, np.diag(q), np.eye(5))
    # the mean over a turn leaves out the changes within it
    np.testing.assert_allclose(found, np.diag(P)[:4], rtol=0.15)


ALARM = ["alarm", "grounds.feed", "grounds.force"]


def first_alarm(result, begin):
    """Time from the event at the time `begin` to the first alarm, and the side; no alarm came before."""
    alarm, first = result[0], round(begin / observing.STEP)
    assert not np.any(alarm[:first])
    rows = np.flatnonzero(alarm[first:])
    return (rows[0] * observing.STEP, alarm[first + rows[0]]) if len(rows) else (math.inf, 0.0)


@native
@pytest.mark.parametrize(("begin", "side"), [(6.0, "left"), (6.3, "right"), (7.2, "left"), (7.8, "right")])
def test_a_fifth_of_the_feed_that_shifts_is_found_within_a_turn(observer, begin, side):
    """With 3 % fluctuation in the threshold, 1 % noise, and at several angles of the crank."""
    rows = observing.course(observing.shifted(begin, 0.2, side=side), begin + observing.TURN)
    result = observing.observe(observer, observing.noisy(rows), observing.noise_of(rows), ALARM)
    time, found = first_alarm(result, begin)
    assert time < observing.TURN and found == {"left": 1.0, "right": -1.0}[side]
    assert abs(result[1, -1]) > abs(result[2, -1])  # it rests on the feed


@native
@pytest.mark.parametrize(("begin", "side"), [(8.0, "left"), (8.7, "right")])
def test_a_twentieth_that_shifts_is_found_within_three_turns(observer, begin, side):
    """Where the feed does not fluctuate, with a slower filter."""
    rows = observing.course(observing.shifted(begin, 0.05, side=side), begin + 3.0 * observing.TURN)
    values = {"feed.fluctuation": 0.0, "feed.change": 0.6, "force.fluctuation": 0.0, "force.change": 5.0}
    result = observing.observe(observer, observing.noisy(rows), values | observing.noise_of(rows), ALARM)
    time, found = first_alarm(result, begin)
    assert time < 3.0 * observing.TURN and found == {"left": 1.0, "right": -1.0}[side]


@native
@pytest.mark.parametrize(
    ("begin", "side"), [(6.0, "left"), (6.3, "right"), (6.6, "left"), (7.0, "right"), (7.6, "left")]
)
def test_a_jam_of_one_side_is_found(observer, begin, side):
    """1,500 N on one web for 1 s: the alarm rests on the force, and at no time of the jam names the other side."""
    rows = observing.course(observing.jammed(begin, side=side), begin + 1.0)
    result = observing.observe(observer, observing.noisy(rows), observing.noise_of(rows), ALARM)
    hand = {"left": 1.0, "right": -1.0}[side]
    time, found = first_alarm(result, begin)
    assert time < 0.6 and found == hand
    assert not np.any(result[0] == -hand)
    assert hand * result[2, -1] > max(1.0, abs(result[1, -1]))


@native
def test_a_mirrored_machine_gives_a_mirrored_alarm(observer):
    """Shifts to either side: the sides change their places in the estimates and in the alarm."""
    found = []
    for side in ("left", "right"):
        rows = observing.course(observing.shifted(6.0, 0.3, side=side), 9.0)
        names = ["alarm", "imbalance.feed", "left.overload", "right.overload"]
        result = observing.observe(observer, observing.noisy(rows), observing.noise_of(rows), names)
        found.append(result[:, -1])
    left, right = found
    assert left[0] == 1.0 == -right[0]
    assert left[1] == pytest.approx(-right[1], abs=2.0) and left[1] == pytest.approx(18.0, abs=2.0)
    assert left[2] > 0.8 > 0.1 > left[3] and right[3] > 0.8 > 0.1 > right[2]


@native
def test_a_measured_speed_that_jumps_is_no_load(observer, quiet):
    """An observer that starts at another speed finds the loads."""
    rows = quiet.copy()
    rows[1, 0] = 0.0
    names = ["speed", *LOADS[:2], "alarm"]
    result = observing.observe(observer, rows, observing.noise_of(quiet), names)
    assert np.all(np.isfinite(result))
    assert result[0, -1] == pytest.approx(rows[1, -1], rel=1e-2)
    np.testing.assert_allclose(result[1:3, -1], 30.0, rtol=0.02)
    assert not np.any(result[3])


@pytest.mark.second
@native
def test_covariances_stay_positive(observer, quiet):
    """Over long running, with precise sensors, with a jam, and at rest, where nothing is seen and no variance exceeds
    that of the spread."""
    places = [f"{matrix}.{name}" for matrix in ("covariance", "quiet") for name in entries_of()]
    still = np.repeat(quiet[:, :1], 20_000, axis=1)
    still[1:] = 0.0
    way = quiet[0, -1] - quiet[0, 0]
    long = np.hstack([np.array([quiet[0] + k * way, *quiet[1:]]) for k in range(5)])
    jam = observing.course(observing.jammed(2.0), 6.0)
    precise = {"noise.w": 0.05, "noise.torque": 1e-4}
    for rows, values in ((long, {}), (jam, {}), (jam, precise), (still, {})):
        result = observing.observe(observer, rows, values, places)[:, ::50]
        for matrix in (result[:21], result[21:]):
            for column in matrix.T:
                whole = np.array(load_filter.symmetric(column))
                assert np.linalg.eigvalsh(whole)[0] > -1e-12
        assert np.all(np.isfinite(result))
    assert np.max(result[:21]) <= 1.0 + 1e-9


def entries_of():
    """The names of the stored entries."""
    return [f"{load_filter.UNKNOWNS[i]}_{load_filter.UNKNOWNS[j]}" for i, j in load_filter.TRIANGLE]


# -- errors of the machine's parameters


@native
def test_false_loads_are_those_of_a_wrong_machine(observer, quiet):
    """A web that is 10 % heavier than in the observer, and a wall: the observer estimates what was predicted."""
    # the acceleration of the course, by the angles of a turn
    count = round(observing.TURN / observing.STEP)
    last = slice(quiet.shape[1] - 2 * count, quiet.shape[1])
    crank = quiet[0, last] / observing.RATIO
    a = np.gradient(quiet[1, last], observing.STEP) / observing.RATIO
    angles = np.arange(ANGLES) * 2.0 * math.pi / ANGLES
    order = np.argsort(crank % (2.0 * math.pi))
    a = np.interp(angles, (crank % (2.0 * math.pi))[order], a[order], period=2.0 * math.pi)
    p = Parameters()
    names = ["left.web_mass", "right.wall_mass"]
    false = false_loads(p, names, np.diag([1.0, 4.0]), 3.0, a)
    for name, start in zip(names, (21.6, 54.0), strict=True):
        change = 0.02 * start
        values = observing.noise_of(quiet) | {name: start + change}
        (imbalance,) = observing.observe(observer, quiet, values, ["imbalance.feed"])
        found = np.mean(imbalance[-2 * count :])
        answer = false.by_parameter[name]
        assert found == pytest.approx(change * (answer[0] - answer[1]), rel=0.1), name
    web, wall = (false.by_parameter[name] for name in names)
    expected = math.hypot(web[0] - web[1], 2.0 * (wall[0] - wall[1]))
    assert false.imbalance == pytest.approx(expected)


def test_false_loads_of_the_feed_itself():
    """A heavier web with all material on the web is like feed, except for the length over which it lies: none."""
    false = false_loads(Parameters(), ["left.web_mass"], [[1.0]], 3.0)
    np.testing.assert_allclose(false.by_parameter["left.web_mass"], [-1.0, 0.0, 0.0, 0.0, 0.0], atol=1e-6)
    assert false.imbalance == pytest.approx(1.0)
    # a number that the observer does not know counts as right
    both = false_loads(Parameters(), ["left.mass", "left.web_mass"], np.diag([9.0, 1.0]), 3.0)
    assert list(both.by_parameter) == ["left.web_mass"] and both.imbalance == false.imbalance


def test_false_loads_behind_a_gear_whose_torque_changes_its_sign():
    """A heavier web is like feed there, too: the gear passes the torque of both alike. The observer's balance, which
    knows no web that is heavier, has the asked acceleration with these false loads."""
    p = behind_gear()
    angles = np.arange(ANGLES) * 2.0 * math.pi / ANGLES
    a = 4.0 * np.sin(angles)
    u = {"phi": angles * p.ratio, "w": 3.0 * p.ratio, "a": a * p.ratio} | dict.fromkeys(LOADS[:2], 30.0)
    passed = ChamberForces.evaluate(numpy_(), p, ChamberForces.input_layout.from_names(u))[0].tau
    assert np.min(passed) < 0.0 < np.max(passed)
    false = false_loads(p, ["left.web_mass"], [[1.0]], 3.0, a)
    np.testing.assert_allclose(false.by_parameter["left.web_mass"], [-1.0, 0.0, 0.0, 0.0, 0.0], atol=1e-6)


@native
def test_the_threshold_widens_by_the_false_imbalance(observer, quiet):
    """In the measure of the uncertainty beside noise and fluctuation."""
    thresholds = []
    for uncertainty in (0.0, 2.0, 20.0):
        values = observing.noise_of(quiet) | {"imbalance.uncertainty": uncertainty}
        rows = observing.observe(observer, quiet[:, :8000], values, ["imbalance.feed_threshold"])
        thresholds.append(rows[0, -1])
    assert thresholds[0] < thresholds[1] < thresholds[2]
    assert 3.0 * 20.0 < thresholds[2] < 6.0 * 20.0


@native
@pytest.mark.slow
@pytest.mark.parametrize("values", [{}, {"feed.time": 3.0}, {"feed.fluctuation": 0.0, "feed.change": 0.6}])
def test_false_alarms_are_fewer_than_permitted(observer, values, monkeypatch):
    """At 1,000 permitted in a million turns some hundred are counted: not more, and the formula is not far off."""
    monkeypatch.syspath_prepend(Path(__file__).parents[1] / "bench")
    bench = importlib.import_module("observer")
    counts, rates, _ = bench.false_alarms(observer, 1000.0, 5_000, 40, values=values)
    assert 0.1e-3 < np.sum(rates) < 1e-3, counts


@pytest.mark.second
@native
def test_thresholds_of_the_linear_filter(observer, monkeypatch):
    """The estimates of the linear filter on the periodic solution have less variance than the thresholds assume."""
    monkeypatch.syspath_prepend(Path(__file__).parents[1] / "bench")
    bench = importlib.import_module("observer")
    monkeypatch.setattr(bench, "RUN_IN", 30.0)
    spread = {rate: bench.periodic_filter(observer, {"alarm.rate": rate}) for rate in (1.0, 1000.0)}
    for rate, periodic in spread.items():
        levels = periodic.thresholds / periodic.stationary()
        memory = 0.5  # in turns, of estimates that follow within a turn
        assert np.all(levels > load_filter.level(MATH, 2.0 * memory, 0.5e-6 * rate))
        assert np.all(levels < 1.5 * load_filter.level(MATH, 0.5 * memory, 0.5e-6 * rate))


@pytest.mark.second
@native
@pytest.mark.parametrize("fmi", [2, 3])
def test_the_alarm_rises_in_model_exchange_as_in_co_simulation(native_fmus, fmi):
    """In the importer that solves it: an integer, at one row of both kinds, as half of the feed shifts."""
    rows = observing.course(observing.shifted(2.0, 0.5), 4.0)
    times = np.arange(rows.shape[1]) * observing.STEP
    names = [
        ("time", float),
        ("phi", float),
        ("w", float),
        ("current", float),
        ("torque", float),
        ("power", float),
    ]
    table = np.array([(t, *row, 0.0, 0.0) for t, row in zip(times, rows.T, strict=True)], dtype=names)
    runs = {}
    for kind, more in (("CoSimulation", {"step_size": observing.STEP}), ("ModelExchange", {})):
        runs[kind] = fmpy.simulate_fmu(
            native_fmus["LoadObserver", fmi][0],
            fmi_type=kind,
            start_values=observing.noise_of(rows),
            input=table,
            output=["alarm", "grounds.feed"],
            stop_time=times[-1],
            output_interval=1e-2,
            relative_tolerance=1e-5,
            **more,
        )
    for run in runs.values():
        (k,) = np.flatnonzero(np.diff(run["alarm"]))
        assert run["alarm"].dtype == np.int32 and list(run["alarm"][[0, k, k + 1, -1]]) == [0, 0, 1, 1]
        assert run["time"][k + 1] == pytest.approx(3.13, abs=0.3)
        # the ground passes 1 there
        assert run["grounds.feed"][k - 1] < 1.0 < run["grounds.feed"][k + 2]
    ends = [run["time"][np.flatnonzero(run["alarm"])[0]] for run in runs.values()]
    assert ends[0] == pytest.approx(ends[1], abs=0.02)
