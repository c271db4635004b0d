"""Energy is the judge: properties of random machines in random states."""

from __future__ import annotations

import dataclasses
import math
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from machines import friction_torque, random_loads, random_machine, random_state, torque_by_reactions

from chainunit import EMPTY, ChainUnitMachine, GeometryError, InputError, SideLoads
from chainunit.core import engines
from chainunit.core.engines import numpy_
from chainunit.machines.api import FREE
from chainunit.machines.chain_unit import ChamberForces
from chainunit.machines.crank_rocker import half_width_range
from chainunit.machines.flexible import flexible
from chainunit.machines.parts import Stop


def draw(seed: int, lossless: bool = False):
    """A machine, a state with margin >= 0.1 and loads."""
    rng = np.random.default_rng(seed)
    while True:
        machine = random_machine(rng, lossless=lossless)
        phi, w, a = random_state(rng, machine)
        left, right = random_loads(rng, lossless=lossless), random_loads(rng, lossless=lossless)
        if float(machine.forces(phi).margin) >= 0.1:
            return machine, phi, w, a, left, right


def scale_of(machine, phi, w, a, left, right, stop=FREE) -> float:
    """The sum of the sizes of the torque's terms, before they cancel: rounding is relative to it."""
    out = machine.forces(phi, w, a, left, right, stop)
    forces = [out.crank_pin, out.coupler_pin, out.pivot, out.left.rocker_joint, out.right.rocker_joint]
    size = max(max(abs(float(f.fx)), abs(float(f.fy))) for f in forces)
    return max(1.0, size * machine.p.l / machine.p.ratio)


SEEDS = range(1000)


@pytest.mark.second
def test_two_routes_agree_on_1000_machines():
    worst = 0.0
    for seed in SEEDS:
        machine, phi, w, a, left, right = draw(seed)
        point = (phi, w, a, left, right)
        by_work = machine.forces(*point).tau - friction_torque(machine, phi, w, left, right)
        error = abs(float(by_work - torque_by_reactions(machine, *point)))
        worst = max(worst, error / scale_of(machine, *point))
    assert worst < 1e-9


@pytest.mark.second
def test_power_balance_on_1000_machines():
    """tau w = d/dt energy + dissipation; the rate of energy by dual numbers in time."""
    xp = engines.dual(engines.numpy_())
    worst = 0.0
    for seed in SEEDS:
        machine, phi, w, a, left, right = draw(seed)
        u = ChamberForces.Inputs(
            phi=engines.Dual(phi, w), w=engines.Dual(w, a), a=0.0, left=left, right=right
        )
        rates = ChamberForces.parts[0].equations(
            xp, machine.p, u, None, ChamberForces.shared(xp, machine.p, u, None)
        )
        rate = engines.slope(rates.kinetic_energy) + engines.slope(rates.potential_energy)
        out = machine.forces(phi, w, a, left, right)
        error = abs(float(out.tau * w - rate - out.dissipated_power))
        worst = max(worst, error / (scale_of(machine, phi, w, a, left, right) * max(1.0, abs(w))))
        assert float(out.dissipated_power) >= 0.0
    assert worst < 1e-9


def test_a_stop_holds_and_keeps_every_balance():
    """Torque by two routes, power, slopes and the frame's moment on machines whose rocker is blocked."""
    xp = engines.dual(engines.numpy_())
    for seed in range(200):
        machine, phi, w, a, left, right = draw(seed)
        rng = np.random.default_rng(seed)
        stop = Stop(stiffness=rng.uniform(0, 1e4), damping=rng.uniform(0, 1e3), psi=rng.uniform(-0.5, 0.5))
        point = (phi, w, a, left, right, stop)
        out, free = machine.forces(*point), machine.forces(*point[:-1])
        held = stop.stiffness * (out.rocker.psi - stop.psi) + stop.damping * out.rocker.w
        size = scale_of(machine, *point)
        by_work = out.tau - friction_torque(machine, phi, w, left, right, stop)
        assert abs(float(by_work - torque_by_reactions(machine, *point))) < 1e-9 * size
        u = ChamberForces.Inputs(
            phi=engines.Dual(phi, w), w=engines.Dual(w, a), a=0.0, left=left, right=right, stop=stop
        )
        rates = ChamberForces.parts[0].equations(
            xp, machine.p, u, None, ChamberForces.shared(xp, machine.p, u, None)
        )
        rate = engines.slope(rates.kinetic_energy) + engines.slope(rates.potential_energy)
        assert abs(float(out.tau * w - rate - out.dissipated_power)) < 1e-9 * size * max(1.0, abs(w))
        # the frame bears what the stop holds; the rest of its load comes from bodies and processing
        difference = float(out.frame.moment - free.frame.moment)
        assert abs(difference) < 1e-9 * (1.0 + abs(float(held))) * max(1.0, size * machine.p.ratio)
        slopes = machine.slopes(phi, w, left, right, stop)
        for got, du in (
            (slopes.tau_bias_dphi, {"phi": phi + 1e-30j, "w": w}),
            (slopes.tau_bias_dw, {"phi": phi, "w": w + 1e-30j}),
        ):
            u = ChamberForces.Inputs(**du, left=left, right=right, stop=stop)
            bias = ChamberForces.shared(engines.numpy_(), machine.p, u, None).bias / machine.p.ratio
            assert abs(float(got) - bias.imag / 1e-30) < 1e-9 * max(size, abs(float(got)))


def test_wall_and_web_turn_as_their_outputs_say():
    """Angles against the places of the pins; speeds and accelerations as exact derivatives by time; and the kinetic
    energy of the organs from the speeds, an independent sum."""
    xp = engines.dual(engines.numpy_())
    for seed in range(200):
        machine, phi, w, a, left, right = draw(seed)
        p = machine.p
        u = ChamberForces.Inputs(phi=engines.Dual(phi, w), w=engines.Dual(w, a), a=a, left=left, right=right)
        state = ChamberForces.shared(xp, p, u, None)
        out = ChamberForces.parts[0].equations(xp, p, u, None, state)
        pins = {
            name: np.array([engines.value(pin.p.x), engines.value(pin.p.y)])
            for name, pin in state.m.pins.items()
        }
        organs = 0.0
        for side, loads in (("left", left), ("right", right)):
            organ, masses = getattr(out, side), getattr(p, side)
            b, a1, a2 = pins[f"B {side}"], pins[f"A1 {side}"], pins["A2"]
            for rod, start, length in ((organ.wall, a1, p.l1), (organ.web, a2, p.l2)):
                angle = engines.value(rod.angle)
                along = length * np.array([math.sin(angle), -math.cos(angle)])
                np.testing.assert_allclose(start + along, b, atol=1e-10 * length)
                assert engines.slope(rod.angle) == pytest.approx(engines.value(rod.w), rel=1e-8, abs=1e-9)
                size = abs(engines.value(rod.w)) ** 2 + abs(engines.value(rod.a))
                assert abs(engines.slope(rod.w) - engines.value(rod.a)) <= 1e-8 * size
            to_a1, to_a2 = (a1 - b) / p.l1, (a2 - b) / p.l2
            spread = engines.value(organ.spread_angle)
            assert 0.0 < spread < math.pi and math.cos(spread) == pytest.approx(to_a1 @ to_a2, abs=1e-10)
            on_web = p.web_share * loads.material_mass
            wall, web = masses.wall_mass + loads.material_mass - on_web, masses.web_mass + on_web
            speed = engines.value(out.rocker.w) * p.e
            psi, turn = engines.value(out.rocker.psi), engines.value(organ.web.w)
            angle = engines.value(organ.web.angle)
            middle = np.array([math.cos(psi), math.sin(psi)]) * speed
            middle = middle + 0.5 * p.l2 * turn * np.array([math.cos(angle), math.sin(angle)])
            organs += 0.5 * web * (middle @ middle + p.rod_inertia * (p.l2 * turn) ** 2 / 12.0)
            of_wall = (p.l1 * engines.value(organ.wall.w)) ** 2
            organs += 0.5 * wall * of_wall * (0.25 + p.rod_inertia / 12.0)
        bare = dataclasses.replace(
            p,
            left=dataclasses.replace(p.left, wall_mass=0.0, web_mass=0.0),
            right=dataclasses.replace(p.right, wall_mass=0.0, web_mass=0.0),
        )
        rest = ChainUnitMachine(bare).forces(phi, w, a, EMPTY, EMPTY).kinetic_energy
        kinetic = engines.value(out.kinetic_energy)
        assert kinetic == pytest.approx(float(rest) + organs, rel=1e-9)


def test_the_coupler_drives_the_rocker():
    """Its parts across and along the rocker against the momentum of the rocker; and eqs. (7)-(9) of paper 001 for a
    coupler without mass: it pushes along itself, so that R^n is R sin theta and R^t is R cos theta."""
    for seed in range(200):
        machine, phi, w, a, left, right = draw(seed)
        p, out = machine.p, machine.forces(phi, w, a, left, right)
        rocker, body = out.rocker, machine.p.rocker
        along = np.array([math.sin(rocker.psi), -math.cos(rocker.psi)])
        size = scale_of(machine, phi, w, a, left, right)
        torque = p.h * rocker.coupler_tangential - rocker.tau
        torque -= body.m * p.g * body.s * math.sin(rocker.psi)
        inertia = (body.I + body.m * body.s**2) * rocker.a
        assert abs(float(torque - inertia)) < 1e-9 * size * p.ratio * max(1.0, p.h / p.l)
        pull = rocker.coupler_normal + rocker.normal_load + body.m * p.g * math.cos(rocker.psi)
        pull += along @ [out.pivot.fx, out.pivot.fy]
        assert abs(float(pull + body.m * body.s * rocker.w**2)) < 1e-9 * size * p.ratio / p.l * max(1.0, p.l)
        coupler = dataclasses.replace(p.coupler, m=0.0, I=0.0)
        massless = ChainUnitMachine(dataclasses.replace(p, coupler=coupler))
        out = massless.forces(phi, w, a, left, right)
        R = out.rocker.coupler_tangential / math.cos(out.pressure_angle)
        assert abs(R) == pytest.approx(math.hypot(out.coupler_pin.fx, out.coupler_pin.fy), rel=1e-6)
        assert out.rocker.coupler_normal == pytest.approx(
            R * math.sin(out.pressure_angle), rel=1e-6, abs=1e-9
        )


def test_forces_balance_gravity_and_inertia():
    """The frame's load against the momentum of the bodies, an independent sum over the whole machine."""
    xp = engines.numpy_()
    for seed in range(200):
        machine, phi, w, a, left, right = draw(seed)
        p = machine.p
        u = ChamberForces.Inputs(phi=phi, w=w, a=a, left=left, right=right)
        state = ChamberForces.shared(xp, p, u, None)
        wc, ac = w / p.ratio, a / p.ratio
        fx = fy = moment = 0.0
        for body in state.m.bodies.values():
            acc = body.c.p1 * ac + body.c.p2 * wc**2
            fx -= body.m * acc.x
            fy -= body.m * (acc.y + p.g)
            spin = body.link.t1 * ac + body.link.t2 * wc**2
            moment -= body.m * (body.c.p.x * (acc.y + p.g) - body.c.p.y * acc.x) + body.I * spin
        for side in ("left", "right"):
            (_, force, _), at = state.effects[f"{side} processing"].wrenches[0], state.m.pins[f"B {side}"].p
            fx += force.x
            fy += force.y
            moment += at.cross(force)
        out = machine.forces(phi, w, a, left, right)
        size = scale_of(machine, phi, w, a, left, right) * p.ratio
        np.testing.assert_allclose(
            [float(out.frame.fx), float(out.frame.fy), float(out.frame.moment)],
            [fx, fy, moment],
            atol=1e-9 * size * max(1.0, 1 / p.l),
        )


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=40, deadline=None)
def test_slopes_match_the_complex_step(seed):
    """Im f(x + i h)/h has no cancellation: the derivative to rounding, without dual numbers."""
    machine, phi, w, _, left, right = draw(seed)
    slopes = machine.slopes(phi, w, left, right)
    size = scale_of(machine, phi, w, 0.0, left, right) / machine.p.ratio
    for got, du in (
        (slopes.tau_bias_dphi, {"phi": phi + 1e-30j, "w": w}),
        (slopes.tau_bias_dw, {"phi": phi, "w": w + 1e-30j}),
    ):
        u = ChamberForces.Inputs(**du, left=left, right=right)
        bias = ChamberForces.shared(engines.numpy_(), machine.p, u, None).bias / machine.p.ratio
        assert abs(float(got) - bias.imag / 1e-30) < 1e-9 * max(size, abs(float(got)))


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=40, deadline=None)
def test_kinetic_energy_is_the_sum_over_the_bodies(seed):
    """From velocities by a complex step in time, which uses neither J nor the analytic derivatives."""
    machine, phi, w, _, left, right = draw(seed)
    p = machine.p
    h = 1e-30
    u = ChamberForces.Inputs(phi=phi + 1j * h * w, w=w, left=left, right=right)
    state = ChamberForces.shared(engines.numpy_(), p, u, None)
    energy = 0.0
    for body in state.m.bodies.values():
        vx, vy = body.c.p.x.imag / h, body.c.p.y.imag / h
        turning = body.link.u.x.real * body.link.u.y.imag / h - body.link.u.y.real * body.link.u.x.imag / h
        energy += 0.5 * body.m * (vx**2 + vy**2) + 0.5 * body.I * turning**2
    out = machine.forces(phi, w, 0.0, left, right)
    assert float(out.kinetic_energy) == pytest.approx(energy, rel=1e-10, abs=1e-12)
    assert float(out.J) * w * w / 2.0 == pytest.approx(energy, rel=1e-10, abs=1e-12)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=30, deadline=None)
def test_what_dissipates_is_the_same_both_ways_without_gravity_and_processing(seed):
    """Inertia forces are quadratic in w: at -w every pin carries the same, and loses the same power."""
    machine, phi, w, *_ = draw(seed)
    floating = machine.replace(g=0.0)
    forward = floating.forces(phi, w).dissipated_power
    assert float(forward) == pytest.approx(
        float(floating.forces(phi, -w).dissipated_power), rel=1e-12, abs=1e-300
    )


def test_conservative_forces_do_no_work_over_a_turn():
    machine, *_ = draw(7, lossless=True)
    loads = SideLoads(material_mass=12.0, processing_force=0.0)
    phi = np.linspace(0.0, 2 * np.pi * machine.p.ratio, 256, endpoint=False)
    tau = machine.forces(phi, 5.0, 0.0, loads, EMPTY).tau
    assert abs(np.mean(tau)) < 1e-10 * np.max(np.abs(tau))


def test_mirrored_machine():
    """A rocker that hangs still loads both sides alike."""
    chamber = ChainUnitMachine().chamber(0.0)
    assert float(chamber.left.tangential_load) == pytest.approx(float(chamber.right.tangential_load))
    assert float(chamber.left.support.fx) == pytest.approx(-float(chamber.right.support.fx))
    assert float(chamber.rocker.tau) == pytest.approx(0.0, abs=1e-9)


def test_a_massless_side_carries_nothing():
    machine = ChainUnitMachine({"right.wall_mass": 0.0, "right.web_mass": 0.0})
    out = machine.forces(np.linspace(0, 6, 50), 3.0, 1.0)
    for force in (out.right.support, out.right.hinge, out.right.rocker_joint):
        assert np.all(force.fx == 0.0) and np.all(force.fy == 0.0)
    assert np.all(np.isfinite(machine.slopes(np.linspace(0, 6, 50), 3.0).tau_bias_dphi))


def test_nothing_is_infinite_at_rest():
    out = ChainUnitMachine().evaluate({"phi": 0.3, "left.processing_force": 100.0})
    assert all(np.isfinite(v) for v in out.values())
    assert out["dissipated_power"] == 0.0


def test_outputs_have_the_common_shape():
    phi, w = np.linspace(0.0, 6.0, 4)[:, None], np.array([1.0, 2.0, 3.0])
    out = ChainUnitMachine().forces(
        phi, w, left=SideLoads(material_mass=[1.0, 2.0, 3.0], processing_force=0.0)
    )
    part = ChamberForces.parts[0]
    assert {np.shape(v) for v in part.layout.values(out)} == {(4, 3)}
    assert {np.shape(v) for v in ChainUnitMachine().evaluate({"phi": phi, "w": w}).values()} == {(4, 3)}


def test_half_widths_that_close_are_those_of_brute_force():
    """The distance of A2 from A1 over the swing, walked through, against the range; also where |l1 - l2| < e."""
    rng, kinds = np.random.default_rng(7), set()
    for _ in range(4000):
        e, l1, l2 = rng.uniform(0.05, 1.5, 3)
        swing, z = rng.uniform(0.05, 1.2), rng.uniform(0.0, 2.5)
        psi = np.linspace(-swing, swing, 201)
        distance = np.hypot(z + e * np.sin(psi), e * np.cos(psi))
        spare = min(float(np.min(distance)) - abs(l1 - l2), l1 + l2 - float(np.max(distance)))
        low, high = half_width_range(engines.MATH, e, l1, l2, swing, z)
        if abs(spare) > 1e-9:
            assert (low < z < high) == (spare > 0.0), (e, l1, l2, swing, z)
        for end, sign in ((low, 1.0), (high, -1.0)):
            if 0.0 < end and low < high:
                at = np.hypot(end + e * np.sin(psi), e * np.cos(psi))
                assert min(abs(np.min(at) - abs(l1 - l2)), abs(np.max(at) - l1 - l2)) < 1e-9
                assert low < end + sign * 1e-6 * (high - low) < high
        kinds.add((spare > 0.0, low == 0.0, abs(l1 - l2) < e * np.cos(swing), z < e * np.sin(swing)))
    # narrower than the swing of A2, too, with and without a gap in the range
    assert {(True, True, True, True), (True, True, False, True), (True, False, False, False)} <= kinds


@pytest.mark.parametrize(("l1", "l2", "z"), [(1.0, 0.9, 0.1), (1.35, 0.545, 0.02)])
def test_a_machine_that_is_narrower_than_its_swing_turns(l1, l2, z):
    machine = ChainUnitMachine(l1=l1, l2=l2, z=z)
    (psi, _), _ = machine.rocker_extremes()
    assert z < machine.p.e * np.sin(psi)
    phi = np.linspace(0.0, 2.0 * np.pi, 721)
    out = machine.forces(phi, 2.0, 0.0, SideLoads(material_mass=30.0, processing_force=0.0), EMPTY)
    assert np.all(np.isfinite(out.tau)) and float(np.min(out.margin)) > 0.01
    assert np.allclose(torque_by_reactions(machine, phi), machine.forces(phi).tau, atol=1e-9)


def test_a_gap_of_half_widths_is_refused_with_its_limits():
    with pytest.raises(GeometryError, match=r"z = 0\.1 m: .* must be > 0 and < (\S+) m") as refusal:
        ChainUnitMachine(l1=1.35, l2=0.545, z=0.1)
    limit = float(re.search(r"< (\S+) m$", str(refusal.value))[1])
    assert ChainUnitMachine(l1=1.35, l2=0.545, z=limit - 1e-5).p.z > 0.0
    with pytest.raises(GeometryError, match=r"z = 0\.2 m: .* must be > (\S+) and < (\S+) m"):
        ChainUnitMachine(l1=1.35, l2=0.545, z=0.2)


def test_a_side_that_is_not_there_cannot_go_slack():
    one_sided = ChainUnitMachine({"right.wall_mass": 0.0, "right.web_mass": 0.0})
    assert 1.0 < one_sided.slack_speed() < 10.0
    bare = one_sided.replace({"left.wall_mass": 0.0, "left.web_mass": 0.0})
    assert bare.slack_speed() == bare.pushed_speed() == np.inf


def test_a_web_is_slack_by_its_mean_pull_and_pushed_at_an_end_before():
    """The mean of both ends is that of a chain of a single rod for web and wall; its equations are others."""
    machine, feed = ChainUnitMachine(ratio=50.0), SideLoads(material_mass=300.0, processing_force=10.0)
    model, xp = flexible(1, 1), numpy_()
    undamped = {f"organ.{name}": 0.0 for name in ("eta", "end_damping", "fold_stiffness")}
    p = model.parameter_layout.from_names(machine.by_name | undamped)
    phi = np.linspace(0.0, 100.0 * np.pi, 90, endpoint=False)
    for speed in (1.0, 4.0, 9.0):
        u = model.Inputs(phi=phi, w=speed * 50.0, a=0.0, left=feed, right=feed)
        sides = model.evaluate(xp, p, u, model.start(xp, p, u))[0]
        rods = [getattr(getattr(sides, side), f"pull_{k}") for k in (2, 1) for side in ("left", "right")]
        np.testing.assert_allclose(machine.mean_pulls(speed, feed, feed, 90), rods, rtol=1e-9, atol=1e-6)
        out = machine.forces(phi, speed * 50.0, 0.0, feed, feed)
        ends = machine.organ_pulls(out.rocker.psi, out.rocker.w, out.rocker.a, feed, feed)
        np.testing.assert_allclose(np.minimum(*ends["left"]["web"].values()), out.left.web_pull, atol=1e-8)
        np.testing.assert_allclose(
            np.minimum(*ends["right"]["wall"].values()), out.right.wall_pull, atol=1e-8
        )
    # 300 kg a side: the web is pushed at B at rest already, and a chain is taut up to four fifths of its mode
    assert machine.pushed_speed(feed, feed) == 0.0
    slack = machine.slack_speed(feed, feed)
    assert 4.0 < slack < 9.0
    webs = machine.mean_pulls(np.array([0.999, 1.001]) * slack, feed, feed)[:2]
    assert np.min(webs[:, 0]) > 0.0 > np.min(webs[:, 1])


def test_frozen_declarations():
    with pytest.raises(dataclasses.FrozenInstanceError):
        ChainUnitMachine().p.r = 1.0


BAD = [
    ("material_mass", -50.0, r"left.material_mass = -50 kg: must be >= 0 kg and <= 1e\+06 kg"),
    ("material_mass", math.nan, "left.material_mass = nan kg: must be finite"),
    ("material_mass", np.array([1.0, -1e-3, 2.0]), "left.material_mass = -0.001 kg: must be >= 0 kg"),
    ("processing_force", math.inf, "left.processing_force = inf N: must be finite"),
]


@pytest.mark.parametrize(("name", "value", "told"), BAD)
def test_loads_out_of_bounds_are_refused_by_name(name, value, told):
    machine = ChainUnitMachine()
    loads = dataclasses.replace(EMPTY, **{name: value})
    for call in (
        lambda: machine.forces(0.5, 3.0, left=loads),
        lambda: machine.slopes(0.5, 3.0, left=loads),
        lambda: machine.chamber(0.1, left=loads),
        lambda: machine.hanging("left", 0.1, loads),
        lambda: machine.evaluate({f"left.{name}": value}),
        lambda: machine.least_web_pull(3.0, left=loads),
        lambda: machine.slack_speed(left=loads),
    ):
        with pytest.raises(InputError, match=told):
            call()


@pytest.mark.parametrize(
    "bad", [math.nan, math.inf, np.array([0.0, math.nan]), np.array([[1.0], [-math.inf]])]
)
def test_motion_that_is_not_finite_is_refused_by_name(bad):
    machine = ChainUnitMachine()
    for name in ("phi", "w", "a"):
        state = {"phi": 0.5, "w": 3.0, "a": 0.0, name: bad}
        with pytest.raises(InputError, match=rf"^{name} = (nan|inf|-inf) .*must be a finite number"):
            machine.forces(**state)
        with pytest.raises(InputError, match=rf"^{name} = "):
            machine.evaluate(state)
    for name in ("psi", "w", "a"):
        with pytest.raises(InputError, match=rf"^{name} = .* of the rocker"):
            machine.chamber(**{"psi": 0.1, name: bad})


def test_what_is_beyond_a_bound_by_rounding_counts_as_the_bound():
    machine = ChainUnitMachine()
    off = SideLoads(material_mass=-1e-12, processing_force=np.array([-1e-9, 0.0]))
    none = machine.forces(0.5, 3.0, left=EMPTY)
    assert np.array_equal(machine.forces(0.5, 3.0, left=off).tau, np.full(2, none.tau))


def test_a_rocker_angle_at_which_no_organ_can_be_assembled():
    """Refused alone, NaN in an array; nearer than the limit on either side both are there."""
    machine = ChainUnitMachine()
    with pytest.raises(GeometryError, match=r"psi = 2 rad: the right organ cannot be assembled, A1-A2 = "):
        machine.chamber(2.0)
    psi = np.linspace(-2.5, 2.5, 101)
    swept = machine.chamber(psi)
    known = []
    for x in psi:
        try:
            known.append(float(machine.chamber(float(x)).rocker.tau))
        except GeometryError:
            known.append(math.nan)
    np.testing.assert_allclose(swept.rocker.tau, known, rtol=1e-12)
    assert 0 < np.isnan(known).sum() < len(known)
    # each side is masked by itself
    assert np.any(np.isnan(swept.right.web_pull) & ~np.isnan(swept.left.web_pull))
