"""The accelerator: a crank without groups as a machine; closed forms, energy, two routes, inertia, FMU."""

from __future__ import annotations

import math

import fmpy
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from chainunit.core.engines import MATH, Dual, dual, numpy_, slope
from chainunit.core.native.compilers import compiler
from chainunit.fmu.native.export import export
from chainunit.machines.accelerator import Accelerator
from chainunit.machines.api import machine_of

MODEL = Accelerator
UNEVEN = {"rotor.s": 0.03, "joint_damping": 0.4, "pin.friction": 0.1, "ratio": 2.5}


def case(seed, **more):
    rng = np.random.default_rng(seed)
    p = MODEL.check(MODEL.parameter_layout.from_names(UNEVEN | more))
    motion = {"phi": rng.uniform(-9.0, 9.0), "w": rng.uniform(-200.0, 200.0), "a": rng.uniform(-99.0, 99.0)}
    u = MODEL.input_layout.from_names(motion | {"load": rng.uniform(0.0, 900.0)})
    return p, u, MODEL.shared(MATH, p, u, None)


def test_the_packaged_one_needs_the_torque_of_its_material():
    """60 kg m2 behind the shaft; 375 N m at 1400 rev/min are 55 kW."""
    w = 1400.0 * math.pi / 30.0
    out = machine_of(MODEL).outputs(0.3, w, 2.0, MODEL.Feed())
    assert float(out.J) == 60.0 and float(out.margin) == 1.0 and float(out.dJ_dphi) == 0.0
    assert float(out.tau) == pytest.approx(375.0 + 60.0 * 2.0, rel=1e-7)
    assert float(out.dissipated_power) == pytest.approx(55e3, rel=1e-3)
    assert float(out.bearing.fy) == pytest.approx(400.0 * 9.81)
    assert float(out.rim_speed) == pytest.approx(0.45 * w)
    still, back = (float(machine_of(MODEL).outputs(0.3, w).tau) for w in (0.0, -2.0))
    assert still == 0.0 and back == pytest.approx(-375.0, rel=1e-3)


@pytest.mark.parametrize("seed", range(10))
def test_closed_forms(seed):
    """An unbalanced rotor: torque by hand, bearing by Newton's law of its centroid."""
    p, u, s = case(seed)
    m, e, q, w, a = p.rotor.m, p.rotor.s, u.phi / p.ratio, u.w / p.ratio, u.a / p.ratio
    J = p.rotor.I + m * e * e
    out, slopes = MODEL.evaluate(MATH, p, u)
    assert out.J * p.ratio**2 == pytest.approx(J) and out.kinetic_energy == pytest.approx(0.5 * J * w * w)
    growth = e * a * math.cos(q) - e * w * w * math.sin(q), -e * a * math.sin(q) - e * w * w * math.cos(q)
    assert (out.bearing.fx, out.bearing.fy) == pytest.approx((m * growth[0], m * (growth[1] + p.g)))
    held = -m * p.g * e * math.sin(q)
    pressed = math.hypot(m * e * w * w * math.sin(q), m * (p.g - e * w * w * math.cos(q)))
    rubbed = 0.5 * p.pin.friction * p.pin.diameter * pressed
    losses = (
        u.load / math.hypot(w, p.brake.w_smooth) + rubbed / math.hypot(w, p.pin.w_smooth) + p.joint_damping
    ) * w
    assert out.tau * p.ratio == pytest.approx(J * a + held + losses, rel=1e-11)
    assert out.dissipated_power == pytest.approx(losses * w) and out.power == pytest.approx(out.tau * u.w)
    by_work = s.torque(a) - s.effects["pins"].dissipative
    assert s.torque_by_reactions(a) == pytest.approx(by_work, rel=1e-11)
    for got, by in ((slopes.tau_bias_dphi, "phi"), (slopes.tau_bias_dw, "w")):
        moved = MODEL.input_layout.from_names({by: getattr(u, by) + 1e-30j}, u)
        reference = (MODEL.shared(numpy_(), p, moved, None).bias / p.ratio).imag / 1e-30
        assert got == pytest.approx(float(reference), rel=1e-10, abs=1e-12)


@pytest.mark.parametrize("seed", range(10))
def test_power_is_what_is_stored_and_lost(seed):
    p, u, _ = case(seed)
    out = MODEL.evaluate(MATH, p, u)[0]
    moving = MODEL.input_layout.from_names({"phi": Dual(u.phi, u.w), "w": Dual(u.w, u.a)}, u)
    engine = dual(MATH)
    stored_energy = MODEL.parts[0].equations(engine, p, moving, None, MODEL.shared(engine, p, moving, None))
    grows = slope(stored_energy.kinetic_energy) + slope(stored_energy.potential_energy)
    size = abs(out.power) + abs(grows) + abs(out.dissipated_power)
    assert abs(out.power - grows - out.dissipated_power) < 1e-12 * size


@pytest.mark.skipif(compiler() is None, reason="no C compiler")
def test_its_direct_fmu_runs_up(tmp_path):
    """Torque, less that of the material, over the inertia: the speed rises evenly; an unbalanced one against an
    error-controlled solver."""
    direct = MODEL.direct()
    file = export(direct, tmp_path / f"{direct.name}.fmu")
    rows = fmpy.simulate_fmu(
        str(file),
        stop_time=4.0,
        output_interval=0.1,
        start_values={"tau": 975.0, "w_start": 50.0},
        output=["w"],
    )
    np.testing.assert_allclose(rows["w"][-1], 50.0 + 4.0 * (975.0 - 375.0) / 60.0, rtol=1e-7)
    start = {"tau": 20.0, "load": 15.0, "rotor.s": 0.2, "w_start": 2.0}
    p = direct.check(
        direct.parameter_layout.from_names({k: v for k, v in start.items() if k in ("rotor.s", "w_start")})
    )
    u, layout = direct.Inputs(tau=20.0, load=15.0), direct.state_layout
    exact = solve_ivp(
        lambda _, x: direct.derivatives(MATH, p, u, layout.instance([float(v) for v in x])),
        (0.0, 2.0), layout.values(direct.initial_states(MATH, p)), method="Radau", rtol=1e-9, atol=1e-10,
    ).y[:, -1]  # fmt: skip
    end = fmpy.simulate_fmu(
        str(file), stop_time=2.0, output_interval=0.01, start_values=start, output=["phi", "w"]
    )[-1]
    np.testing.assert_allclose(list(end)[1:], exact, rtol=1e-5)
