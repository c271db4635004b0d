"""Energy is the judge: properties of random machines in random states."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from machines import random_loads, random_machine, random_state

from chainunit import EMPTY, ChainUnit, SideLoads, engines
from chainunit.machines.chain_unit import ChamberForces


def draw(seed: int, lossless: bool = False):
    """A machine, a state with margin >= 0.1 and loads."""
    rng = np.random.default_rng(seed)
    while True:
        machine = random_machine(rng, lossless=lossless)
        phi, w, a = random_state(rng, machine)
        left, right = random_loads(rng, lossless=lossless), random_loads(rng, lossless=lossless)
        if float(machine.forces(phi).margin) >= 0.1:
            return machine, phi, w, a, left, right


def scale_of(machine, phi, w, a, left, right) -> float:
    """What the torque's terms add up to before they cancel: rounding is relative to this."""
    out = machine.forces(phi, w, a, left, right)
    forces = [out.crank_pin, out.coupler_pin, out.pivot, out.left.rocker_joint, out.right.rocker_joint]
    size = max(max(abs(float(f.fx)), abs(float(f.fy))) for f in forces)
    return max(1.0, size * machine.p.l / machine.p.ratio)


SEEDS = range(1000)


def test_two_routes_agree_on_1000_machines():
    worst = 0.0
    for seed in SEEDS:
        machine, phi, w, a, left, right = draw(seed)
        point = (phi, w, a, left, right)
        by_work = machine.forces(*point).tau - machine.friction_torque(phi, w, left, right)
        error = abs(float(by_work - machine.torque_by_reactions(*point)))
        worst = max(worst, error / scale_of(machine, *point))
    assert worst < 1e-9


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
        for body in state.m.bodies:
            acc = body.c.p1 * ac + body.c.p2 * wc**2
            fx -= body.m * acc.x
            fy -= body.m * (acc.y + p.g)
            spin = body.link.t1 * ac + body.link.t2 * wc**2
            moment -= body.m * (body.c.p.x * (acc.y + p.g) - body.c.p.y * acc.x) + body.I * spin
        for organ, force in zip((state.m.left, state.m.right), state.bias.processing_forces, strict=True):
            fx += force.x
            fy += force.y
            moment += organ.dyad.b.p.cross(force)
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
        bias = ChamberForces.shared(engines.numpy_(), machine.p, u, None).bias.total / machine.p.ratio
        assert abs(float(got) - bias.imag / 1e-30) < 1e-9 * max(size, abs(float(got)))


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=40, deadline=None)
def test_inertia_is_twice_the_kinetic_energy(seed):
    machine, phi, w, _, left, right = draw(seed)
    out = machine.forces(phi, w, 0.0, left, right)
    assert float(out.kinetic_energy) == pytest.approx(0.5 * float(out.J) * w * w, rel=1e-12)
    assert float(machine.forces(phi, w, 2.0, left, right).tau) == pytest.approx(
        float(out.tau_bias + 2.0 * out.J), rel=1e-9, abs=1e-9
    )


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=30, deadline=None)
def test_friction_and_processing_turn_with_the_motion(seed):
    """Without gravity the torque at -w is the mirror of that at +w where it is dissipation."""
    machine, phi, w, _, left, right = draw(seed)
    forward = machine.forces(phi, w, 0.0, left, right).dissipated_power
    backward = machine.forces(phi, -w, 0.0, left, right).dissipated_power
    if machine.p.pin.friction == 0.0 or (left.processing_force == 0.0 and right.processing_force == 0.0):
        assert float(forward) == pytest.approx(float(backward), rel=1e-9, abs=1e-12)
    assert float(backward) >= 0.0


def test_conservative_forces_do_no_work_over_a_turn():
    machine, *_ = draw(7, lossless=True)
    loads = SideLoads(material_mass=12.0, processing_force=0.0)
    phi = np.linspace(0.0, 2 * np.pi * machine.p.ratio, 256, endpoint=False)
    tau = machine.forces(phi, 5.0, 0.0, loads, EMPTY).tau
    assert abs(np.mean(tau)) < 1e-10 * np.max(np.abs(tau))


def test_mirrored_machine():
    """A rocker that hangs still loads both sides alike."""
    chamber = ChainUnit().chamber(0.0)
    assert float(chamber.left.tangential_load) == pytest.approx(float(chamber.right.tangential_load))
    assert float(chamber.left.support.fx) == pytest.approx(-float(chamber.right.support.fx))
    assert float(chamber.rocker.tau) == pytest.approx(0.0, abs=1e-9)


def test_a_massless_side_carries_nothing():
    machine = ChainUnit({"right.wall_mass": 0.0, "right.web_mass": 0.0})
    out = machine.forces(np.linspace(0, 6, 50), 3.0, 1.0)
    for force in (out.right.support, out.right.hinge, out.right.rocker_joint):
        assert np.all(force.fx == 0.0) and np.all(force.fy == 0.0)
    assert np.all(np.isfinite(machine.slopes(np.linspace(0, 6, 50), 3.0).tau_bias_dphi))


def test_nothing_is_infinite_at_rest():
    out = ChainUnit().evaluate({"phi": 0.3, "left.processing_force": 100.0})
    assert all(np.isfinite(v) for v in out.values())
    assert out["dissipated_power"] == 0.0


def test_frozen_declarations():
    with pytest.raises(dataclasses.FrozenInstanceError):
        ChainUnit().p.r = 1.0
