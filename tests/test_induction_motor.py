"""The induction motor: against motulator, energy, the equivalent circuit, starters and inverter."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
from induction import (
    COLD,
    LAYOUT,
    SATURATED,
    SKIN,
    advanced,
    at_rest,
    inputs,
    outputs,
    parameters,
    random_states,
    rates,
)
from scipy.integrate import solve_ivp

from chainunit.core import engines
from chainunit.drives.induction_motor import InductionMotor
from chainunit.drives.induction_steady import breakdown, skin, steady, volts_per_hertz
from chainunit.drives.motor import T_RATED


def run(p, u, stop, start=None, step=None):
    """States at the end, with the integrator of the FMU."""
    start = at_rest(p) if start is None else start
    return advanced(p, u, start, stop, step or InductionMotor.internal_step(engines.MATH, p))


def standing(p, w, share=1.0, f=None):
    """The states of steady running, as `steady` has them."""
    s = steady(engines.MATH, p, w, share, f)
    values = {
        "phi": 0.0,
        "w": w,
        "stator.psi.d": s.psi.d,
        "stator.psi.q": s.psi.q,
        "stator.T": T_RATED,
        "cage.psi.d": s.psi_r.d,
        "cage.psi.q": s.psi_r.q,
        "supply.frequency": p.supply.f if f is None else f,
        "supply.ramp": share,
        "load_energy": 0.0,
    }
    return s, [values[name] for name in LAYOUT.names]


# --- motulator ---

START = 0.6  # s: the run-up is over after 0.35
TIMES = np.linspace(0.0, START, 1201)
LOAD = {"load.tau_bias": 5.0, "load.J": 0.02}


def motulator_start(p, u):
    """Torque, current (RMS) and speed of motulator's machine and shaft on a stiff sinusoidal supply."""
    reason = "motulator is not installed (extra clients)"
    model = pytest.importorskip("motulator.drive.model", reason=reason)
    common = pytest.importorskip("motulator.common.model", reason=reason)
    utils = pytest.importorskip("motulator.drive.utils", reason=reason)

    def L_s(psi):
        return p.main.L / (1.0 + (p.main.beta * psi) ** 6)

    machine = model.InductionMachine(
        utils.InductionMachinePars(
            n_p=p.pole_pairs,
            R_s=p.stator.R,
            R_r=p.cage.R,
            L_ell=p.cage.L,
            L_s=L_s if p.main.beta else p.main.L,
        )
    )
    shaft = model.StiffMechanicalSystem(
        J=p.rotor.J + u.load.J, B_L=p.rotor.d, tau_L=lambda t: u.load.tau_bias
    )

    class OnLine(common.Model):
        def __init__(self):
            super().__init__()
            self.subsystems = [machine, shaft]

        def interconnect(self, t):
            phase = cmath.exp(2j * math.pi * p.supply.f * t)
            machine.inp.u_ss = math.sqrt(2.0 / 3.0) * p.supply.V * phase
            machine.inp.w_M = shaft.out.w_M
            shaft.inp.tau_M = machine.out.tau_M

    on_line = OnLine()
    start = np.array(on_line.get_initial_values(), dtype=complex)
    done = solve_ivp(on_line.rhs, (0.0, START), start, "DOP853", TIMES, rtol=1e-9, atol=1e-9)
    on_line.set_states(list(done.y))
    return machine.tau_M, np.abs(machine.i_ss) / math.sqrt(2.0), shaft.state.w_M.real


@pytest.mark.second
@pytest.mark.parametrize("beta", [{}, SATURATED], ids=["linear", "saturated"])
def test_start_is_motulators(beta):
    """Torque, current and speed at every half millisecond of a start direct on line, in parts of their peaks."""
    p, u = parameters({**COLD, **beta}), inputs(LOAD)
    start = LAYOUT.values(InductionMotor.initial_states(engines.MATH, p))
    tight = solve_ivp(
        lambda t, y: rates(p, u)(y.tolist()), (0.0, START), start, "DOP853", TIMES, rtol=1e-9, atol=1e-9
    )
    coarse, step = [start], InductionMotor.internal_step(engines.MATH, p)
    for h in np.diff(TIMES):
        coarse.append(advanced(p, u, coarse[-1], h, step))
    reference = motulator_start(p, u)
    assert reference[2][-1] > 145.0 and max(reference[1]) > 4.0 * reference[1][-1]
    for states, allowed in ((tight.y, 1e-6), (np.array(coarse).T, 1e-5)):
        out = outputs(p, u, states, engines.numpy_())
        for got, there in zip(
            (out.air_gap_tau, out.i, states[LAYOUT.names.index("w")]), reference, strict=True
        ):
            assert np.max(np.abs(got - there)) < allowed * np.max(np.abs(there))


# --- energy ---


def test_supply_power_is_losses_field_and_shaft():
    """At random states, saturated, on the line and on an inverter; the field's power by exact differentiation."""
    rng = np.random.default_rng(3)
    for on in (0.0, 1.0) * 10:
        p = parameters({**SATURATED, "inverter.on": on})
        u = inputs({"load.tau_bias": 3.0, "load.J": 0.01, "voltage": 0.9, "w_ref": 120.0})
        x = random_states(rng)
        seeded = [engines.Dual(v, d) for v, d in zip(x, rates(p, u)(x), strict=True)]
        out = outputs(p, u, x)
        field = engines.slope(outputs(p, u, seeded, engines.dual(engines.MATH)).magnetic_energy)
        powers = [out.supply_power, -out.heat, -field, -out.air_gap_tau * x[LAYOUT.names.index("w")]]
        assert abs(sum(powers)) < 1e-12 * max(map(abs, powers))
        w, d = x[LAYOUT.names.index("w")], dict(zip(LAYOUT.names, rates(p, u)(x), strict=True))
        shaft = (p.rotor.J * out.a + p.rotor.d * w) * w + d["load_energy"]
        assert out.air_gap_tau * w == pytest.approx(shaft, rel=1e-12)


def test_heat_goes_into_the_winding():
    p = parameters({"inverter.on": 0.0})
    x = random_states(np.random.default_rng(4))
    d = dict(zip(LAYOUT.names, rates(p, inputs())(x), strict=True))
    w, T = x[LAYOUT.names.index("w")], x[LAYOUT.names.index("stator.T")]
    fan = p.cooling.still + (1.0 - p.cooling.still) * min(1.0, abs(w) / (50.0 * math.pi))
    carried_off = fan * (T - p.ambient.T) / p.stator.R_th
    assert d["stator.T"] * p.stator.C == pytest.approx(outputs(p, inputs(), x).heat - carried_off, rel=1e-12)


# --- steady running ---

SLIPS = (1.0, 0.5, 0.2, 0.05, 0.01, -0.03)


def circuit(p, slip):
    """Torque, current and power factor of the classical circuit, by impedances."""
    w_s, developed = 2.0 * math.pi * p.supply.f, skin(slip)
    R_r = p.cage.R * (1.0 + p.cage.skin_R * developed)
    L_l = p.cage.L * (1.0 - p.cage.skin_L * developed)
    rotor, main = R_r / slip + 1j * w_s * L_l, 1j * w_s * p.main.L
    behind = 1.0 / (1.0 / rotor + 1.0 / main)
    i = p.supply.V / math.sqrt(3.0) / (p.stator.R + behind)
    air_gap = 3.0 * abs(i * behind / rotor) ** 2 * R_r / slip
    return air_gap / (w_s / p.pole_pairs), abs(i), math.cos(cmath.phase(i))


@pytest.mark.parametrize("given", [{}, SKIN], ids=["plain", "skin effect"])
def test_steady_running_is_the_equivalent_circuit(given):
    """The dynamic model's fluxes stand still (a linear system without saturation) where the circuit says."""
    p, u = parameters(given), inputs()
    fluxes = [LAYOUT.names.index(f"{side}.psi.{axis}") for side in ("stator", "cage") for axis in "dq"]
    for slip in SLIPS:
        w = (1.0 - slip) * math.pi * p.supply.f * 2.0 / p.pole_pairs
        x = LAYOUT.values(InductionMotor.initial_states(engines.MATH, p))
        x[LAYOUT.names.index("w")] = w

        def flux_rates(four, x=x):
            y = list(x)
            for i, psi in zip(fluxes, four, strict=True):
                y[i] = psi
            return np.array(rates(p, u)(y))[fluxes], y

        free = flux_rates([0.0] * 4)[0]
        matrix = np.array([flux_rates(row)[0] - free for row in np.eye(4).tolist()]).T
        out = outputs(p, u, flux_rates(np.linalg.solve(matrix, -free).tolist())[1])
        s = steady(engines.MATH, p, w)
        power_factor = out.supply_power / (math.sqrt(3.0) * out.v * out.i)
        reference = circuit(p, slip)
        for got in ((out.air_gap_tau, out.i, power_factor), (s.air_gap_tau, s.i, s.power_factor)):
            assert got == pytest.approx(reference, rel=1e-9, abs=1e-9)
        assert (s.slip, s.supply_power, s.heat) == pytest.approx(
            (out.slip, out.supply_power, out.heat), rel=1e-9
        )
        assert s.tau == pytest.approx(s.air_gap_tau - p.rotor.d * w, rel=1e-12)


def test_steady_running_stands_still_with_saturation():
    """Also where the main path is so saturated that the flux falls to a third, as at low frequency."""
    rng, least = np.random.default_rng(5), 1.0
    for k in range(60):
        values = {**SKIN, **COLD, "main.beta": rng.uniform(0.0, 3.0), "stator.R": rng.uniform(0.1, 20.0)}
        p = parameters(values)
        f, share = (50.0, 1.0) if k % 2 else (rng.uniform(2.0, 60.0), rng.uniform(0.1, 1.0))
        w = (1.0 - rng.uniform(-0.2, 1.2)) * 2.0 * math.pi * f / p.pole_pairs
        s, x = standing(p, w, share, f)
        linear, _ = standing(parameters(values | {"main.beta": 0.0}), w, share, f)
        fall = math.hypot(s.psi.d, s.psi.q) / math.hypot(linear.psi.d, linear.psi.q)
        least = min(least, fall)
        out, d = outputs(p, inputs(), x), dict(zip(LAYOUT.names, rates(p, inputs())(x), strict=True))
        still = max(abs(d[name]) for name in LAYOUT.names if ".psi." in name)
        assert fall < 1 / 3 or still < 1e-9 * out.v, (k, fall)
        assert fall < 1 / 3 or s[:1] + s[2:3] + s[4:7] == pytest.approx(
            (out.air_gap_tau, out.i, out.supply_power, out.heat, out.slip), rel=1e-9
        )
    assert least < 0.4


def test_long_run_ends_in_steady_running():
    p = parameters({**SKIN, **SATURATED, **COLD})
    x = run(p, inputs({"load.tau_bias": 14.0, "load.J": 0.005}), 1.5)
    w = x[LAYOUT.names.index("w")]
    s = steady(engines.MATH, p, w)
    assert s.tau == pytest.approx(14.0, rel=1e-6)
    assert outputs(p, inputs(), x).i == pytest.approx(s.i, rel=1e-6)


@pytest.mark.parametrize(
    "given", [{}, SKIN, SATURATED | {"stator.R": 9.0}], ids=["plain", "skin", "saturated"]
)
def test_breakdown_is_the_largest_torque(given):
    p = parameters(given)
    b = breakdown(p)
    w = np.linspace(0.0, 2.0 * math.pi * p.supply.f / p.pole_pairs, 20001)
    torques = steady(engines.numpy_(), p, w)
    k = int(np.argmax(torques.tau))
    assert b.tau == pytest.approx(torques.tau[k], rel=1e-7) and b.tau >= torques.tau[k]
    assert b.slip == pytest.approx(torques.slip[k], rel=2e-3)
    assert InductionMotor.largest_torque(p, T_RATED, p.supply.V, p.supply.f) == b.air_gap_tau
    np.testing.assert_array_equal(InductionMotor.limit(engines.numpy_(), p, w), torques.air_gap_tau)


def test_torque_follows_the_square_of_the_voltage():
    p = parameters(SKIN)
    whole, half = (steady(engines.MATH, p, 100.0, share) for share in (1.0, 0.5))
    assert (half.tau + p.rotor.d * 100.0, half.i) == pytest.approx((0.25 * whole.air_gap_tau, 0.5 * whole.i))
    assert half.power_factor == pytest.approx(whole.power_factor)
    assert breakdown(p, 0.5).air_gap_tau == pytest.approx(0.25 * breakdown(p).air_gap_tau, rel=1e-2)


def test_limit_on_an_inverter_is_the_breakdown_torque():
    p = parameters({"inverter.on": 1.0, "inverter.boost": 0.0})
    w = np.array([60.0, 100.0, 150.0, 250.0])
    limit = InductionMotor.limit(engines.numpy_(), p, w)
    for speed, got in zip(w, limit, strict=True):
        f = np.linspace(1.0, 120.0, 5001)
        every = steady(engines.numpy_(), p, speed, volts_per_hertz(engines.numpy_(), p, f), f)
        assert got == pytest.approx(max(every.air_gap_tau), rel=1e-2)
    assert limit[0] > 0.7 * breakdown(p).air_gap_tau and limit[3] < 0.4 * limit[1]


# --- switching, starters, inverter ---


def test_without_voltage_the_terminals_are_short_circuited():
    p, u = parameters(COLD), inputs({"voltage": 0.0, "load.J": 0.1})
    _, x = standing(p, 152.0)
    assert outputs(p, u, x).supply_power == 0.0
    before = outputs(p, inputs({"load.J": 0.1}), x)
    # currents as at a start, which brake with the energy of the field; open terminals would carry none
    seen = []
    for _ in range(20):
        x = run(p, u, 1e-3, x)
        seen.append(outputs(p, u, x))
    locked = steady(engines.MATH, p, 0.0).i
    assert max(s.i for s in seen) > 0.8 * locked > 3.0 * before.i
    assert min(s.air_gap_tau for s in seen) < -before.air_gap_tau
    assert "At 0 the terminals are short-circuited" in " ".join(InductionMotor.text.split())
    x = run(p, u, 2.0, x)
    out = outputs(p, u, x)
    assert out.i < 1e-4 * before.i and abs(out.air_gap_tau) < 1e-4 * before.air_gap_tau
    # the short-circuited stator brakes while the flux dies away; then friction alone does
    w = x[LAYOUT.names.index("w")]
    assert 0.9 * 152.0 < w < 152.0
    assert out.a == pytest.approx(-p.rotor.d * w / (0.1 + p.rotor.J), rel=1e-4)


def peaks(given, u, stop):
    p, x, seen = parameters(given), None, []
    for _ in range(round(stop / 1e-3)):
        x = run(p, u, 1e-3, x)
        seen.append(outputs(p, u, x))
    return max(s.i for s in seen), max(abs(s.air_gap_tau) for s in seen), x


def test_soft_starter_lowers_the_peaks():
    u = inputs({"load.J": 0.05, "load.tau_bias_dw": 0.05})
    direct = peaks(COLD, u, 1.2)
    soft = peaks({**COLD, "soft_start.voltage": 0.4, "soft_start.time": 0.8}, u, 1.2)
    assert soft[0] < 0.75 * direct[0] and soft[1] < 0.6 * direct[1]
    assert soft[2][LAYOUT.names.index("supply.ramp")] == pytest.approx(1.0, abs=1e-6)
    w = LAYOUT.names.index("w")
    assert soft[2][w] == pytest.approx(direct[2][w], rel=1e-4)


def test_soft_starter_waits_for_the_supply():
    p = parameters({"soft_start.voltage": 0.4, "soft_start.time": 0.8})
    waiting, ramp = inputs({"voltage": 0.0}), LAYOUT.names.index("supply.ramp")
    x = run(p, waiting, 0.5)
    assert x[ramp] == 0.4
    assert run(p, inputs(), 0.4, x)[ramp] == pytest.approx(0.7, rel=1e-9)


def test_the_current_limit_of_the_inverter_holds_its_frequency_back():
    """A heavy load cannot follow the ramp, and the current rises to many times the rated one; with a limit it stays
    there, and the frequency waits. A limit that is not reached changes nothing."""
    u, hertz = (
        inputs({"w_ref": 150.0, "load.tau_bias": 5.0, "load.J": 0.3}),
        LAYOUT.names.index("supply.frequency"),
    )

    def course(limit):
        p, x, currents = parameters({**COLD, "inverter.on": 1.0, "inverter.limit": limit}), None, []
        for _ in range(12):
            x = run(p, u, 0.05, x)
            currents.append(outputs(p, u, x).i)
        return x, currents

    free, held, ample = course(1e6), course(7.0), course(100.0)
    assert max(free[1]) > 15.0 and free[0][hertz] > 25.0
    assert 6.0 < held[1][-1] and max(held[1]) < 1.12 * 7.0 and held[0][hertz] < 12.0
    assert ample[0] == pytest.approx(free[0], rel=1e-12)


@pytest.mark.stages(first=1)
@pytest.mark.parametrize("w_ref", [40.0, 130.0])
def test_inverter_follows_within_the_slip(w_ref):
    u = inputs({"w_ref": w_ref, "load.tau_bias": 6.0, "load.J": 0.01})
    speed, hertz = LAYOUT.names.index("w"), LAYOUT.names.index("supply.frequency")
    errors = []
    for slip in (0.0, 0.1):
        p = parameters({**COLD, "inverter.on": 1.0, "inverter.slip": slip})
        x = run(p, u, 0.3)
        assert x[hertz] < 50.0 * 0.3 + 1e-9  # the ramp holds
        x = run(p, u, 2.2, x)
        w, f = x[speed], x[hertz]
        out = outputs(p, u, x)
        assert f == pytest.approx(w_ref * p.pole_pairs / (2.0 * math.pi) + slip * out.air_gap_tau, rel=1e-4)
        s = steady(engines.MATH, p, w, volts_per_hertz(engines.MATH, p, f), f)
        assert s.tau == pytest.approx(6.0, rel=1e-3) and s.i == pytest.approx(out.i, rel=1e-3)
        errors.append(w_ref - w)
    b = breakdown(p, volts_per_hertz(engines.MATH, p, f), f)
    assert 0.0 < errors[0] < b.slip * w_ref
    assert abs(errors[1]) < 0.5 * errors[0]
