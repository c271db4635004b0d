"""The contactor of the induction motor, and star-delta: an independent integration, energy, limit cases."""

from __future__ import annotations

import cmath
import math
from itertools import pairwise

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
from chainunit.drives.contactor import connection
from chainunit.drives.induction_motor import InductionMotor
from chainunit.drives.induction_steady import steady

LOAD = {"load.tau_bias": 5.0, "load.J": 0.02}
OPEN = {"contactor": 0.0}
W, PSI = LAYOUT.names.index("w"), [LAYOUT.names.index(f"stator.psi.{axis}") for axis in "dq"]
PSI_R = [LAYOUT.names.index(f"cage.psi.{axis}") for axis in "dq"]


def followed(p, u, x, duration, rows=2, *, tight=True):
    """States over a time with constant inputs, shape (states, rows): with error control, or in the FMU's steps."""
    times = np.linspace(0.0, duration, rows)
    if tight:
        of = rates(p, u)
        done = solve_ivp(
            lambda t, y: of(y.tolist()),
            (0.0, duration),
            x,
            "DOP853",
            times,
            rtol=1e-11,
            atol=1e-11,
            max_step=5e-3,
        )
        return done.y
    longest, states = InductionMotor.internal_step(engines.MATH, p), [list(x)]
    for h in np.diff(times):
        states.append(advanced(p, u, states[-1], float(h), longest))
    return np.array(states).T


# --- an independent integration ---


class Stationary:
    """The motor in the frame of the stator, with the currents of stator and cage and the speed as states: in place of
    the fluxes, of the frame of the supply, and of the inverse inductances of the package. `decay` None is an ideal
    opening, in which the current jumps to zero."""

    def __init__(self, p, load, inertia, decay):
        self.p, self.load, self.J, self.decay = p, load, p.rotor.J + inertia, decay
        self.w_s = 2.0 * math.pi * p.supply.f
        self.u = math.sqrt(2.0 / 3.0) * p.supply.V

    def flux(self, i):
        """Flux of the magnetising current `i`, by Newton's method."""
        L, beta, size = self.p.main.L, self.p.main.beta, abs(i)
        psi = L * size
        for _ in range(60):
            excess = psi * (1.0 + (beta * psi) ** 6) / L - size
            change = excess / ((1.0 + 7.0 * (beta * psi) ** 6) / L)
            psi -= change
        return psi * i / size if size else 0.0j

    def stiffness(self, psi):
        """Derivatives of the magnetising current by the flux, 2 x 2, along and across the flux."""
        L, level = self.p.main.L, (self.p.main.beta * abs(psi)) ** 6
        along, across = (1.0 + 7.0 * level) / L, (1.0 + level) / L
        n = psi / abs(psi) if psi else 1.0
        turn = np.array([[n.real, -n.imag], [n.imag, n.real]])
        return turn @ np.diag([along, across]) @ turn.T

    def rates(self, star, closed):
        p, w_s = self.p, self.w_s
        k = 1.0
        if star:
            side = 1.0 if p.switching.preferred else -1.0
            k = cmath.exp(1j * side * math.pi / 6.0) / math.sqrt(3.0)

        def vector(z):
            return np.array([z.real, z.imag])

        def of(t, y):
            i_s, i_r, w = complex(y[0], y[1]), complex(y[2], y[3]), y[4]
            psi = self.flux(i_s + i_r)
            d_psi_r = -p.cage.R * i_r + 1j * p.pole_pairs * w * (psi + p.cage.L * i_r)
            K = self.stiffness(psi)
            if closed:
                d_psi = k * self.u * cmath.exp(1j * w_s * t) - p.stator.R * i_s
                d_i_r = (d_psi_r - d_psi) / p.cage.L
                d_i_s = complex(*(K @ vector(d_psi))) - d_i_r
            else:
                d_i_s = (1j * w_s - (1.0 / self.decay if self.decay else 0.0)) * i_s
                S = np.linalg.inv(K)
                d_i_r = complex(
                    *np.linalg.solve(S + p.cage.L * np.eye(2), vector(d_psi_r) - S @ vector(d_i_s))
                )
            torque = 1.5 * p.pole_pairs * (psi.conjugate() * i_s).imag
            return [
                d_i_s.real,
                d_i_s.imag,
                d_i_r.real,
                d_i_r.imag,
                (torque - p.rotor.d * w - self.load) / self.J,
            ]

        return of

    def opened(self, y):
        """The state behind an ideal opening: the flux of the cage goes on, the current of the stator is zero."""
        i_s, i_r = complex(y[0], y[1]), complex(y[2], y[3])
        psi_r = self.flux(i_s + i_r) + self.p.cage.L * i_r
        low, high = 0.0, 1.0
        while high - low > 1e-15:
            mid = 0.5 * (low + high)
            psi = mid * abs(psi_r)
            current = psi * (1.0 + (self.p.main.beta * psi) ** 6) / self.p.main.L
            low, high = (mid, high) if psi + self.p.cage.L * current < abs(psi_r) else (low, mid)
        current = (1.0 - low) * psi_r / self.p.cage.L
        return np.array([0.0, 0.0, current.real, current.imag, y[4]])

    def run(self, pieces, w_start=0.0):
        """Torque, current of the line (RMS) and speed over the pieces, and the states at the end."""
        t, y, found = 0.0, np.array([0.0, 0.0, 0.0, 0.0, w_start]), []
        for duration, star, closed, rows in pieces:
            if not closed and self.decay is None:
                y = self.opened(y)
            times = t + np.linspace(0.0, duration, rows)
            done = solve_ivp(
                self.rates(star, closed),
                (t, t + duration),
                y,
                "DOP853",
                np.minimum(times, t + duration),
                rtol=1e-11,
                atol=1e-11,
                max_step=5e-3,
            )
            for column in done.y.T:
                i_s, i_r = complex(column[0], column[1]), complex(column[2], column[3])
                torque = 1.5 * self.p.pole_pairs * (self.flux(i_s + i_r).conjugate() * i_s).imag
                line = abs(i_s) / math.sqrt(2.0) / (math.sqrt(3.0) if star else 1.0)
                found.append((torque, line, column[4]))
            t, y = t + duration, done.y[:, -1]
        return np.array(found).T, y


def of_package(p, given, pieces, x=None, *, tight=True):
    """Torque, current of the line and speed over the pieces, and the states at the end."""
    x, found = at_rest(p) if x is None else x, []
    for duration, star, closed, rows in pieces:
        u = inputs({**given, "star": float(star), "contactor": float(closed)})
        states = followed(p, u, x, duration, rows, tight=tight)
        for y in states.T:
            out = outputs(p, u, y)
            found.append((out.air_gap_tau, out.i, y[W]))
        x = states[:, -1].tolist()
    return np.array(found).T, x


STAR_DELTA = [(0.25, 1, 1, 251), (0.04, 1, 0, 81), (0.3, 0, 1, 301)]
"""A start in star, the pause, and delta: duration [s], star, closed, rows."""
INTERRUPTED = [*STAR_DELTA, (0.06, 0, 0, 61), (0.15, 0, 1, 151), (0.013, 0, 0, 14), (0.1, 0, 1, 101)]
"""The same with two interruptions, which end at other phases of the field."""


def agree(got, there, share):
    for one, other in zip(got, there, strict=True):
        assert np.max(np.abs(one - other)) < share * np.max(np.abs(other))


@pytest.mark.second
@pytest.mark.parametrize(
    "given", [{}, SATURATED, {"switching.preferred": 0.0}], ids=["linear", "saturated", "other"]
)
def test_star_delta_and_reclosing_are_an_independent_integration(given):
    """Torque, current and speed at every half or whole millisecond, to 1e-7 of the peaks, and to 2e-5 with the
    steps of the FMU."""
    p = parameters({**COLD, **given})
    there, _ = Stationary(p, 5.0, 0.02, p.switching.decay).run(INTERRUPTED)
    got, _ = of_package(p, LOAD, INTERRUPTED)
    agree(got, there, 1e-7)
    coarse, _ = of_package(p, LOAD, INTERRUPTED, tight=False)
    agree(coarse, there, 2e-5)
    # the first closing after star and the first reclosing are shocks, unlike the second reclosing
    ends = np.cumsum([rows for *_, rows in INTERRUPTED])
    peaks = [float(np.max(there[1, a:b])) for a, b in pairwise(ends)]
    assert peaks[1] > 20.0 and peaks[3] > 20.0 > 10.0 > peaks[5] and np.max(there[2]) > 145.0


@pytest.mark.second
def test_a_short_decay_is_an_ideal_opening():
    """The peaks and the states tend to those of a current that jumps to zero, in proportion to the time constant."""
    ideal, _ = Stationary(parameters({**COLD, **SATURATED}), 5.0, 0.02, None).run(INTERRUPTED)
    far = []
    for decay in (4e-4, 2e-4, 1e-4):
        p = parameters({**COLD, **SATURATED, "switching.decay": decay})
        got, _ = of_package(p, LOAD, INTERRUPTED)
        far.append(
            [float(np.max(np.abs(a - b)[-100:]) / np.max(np.abs(b))) for a, b in zip(got, ideal, strict=True)]
        )
    for coarse, fine, finest in zip(*far, strict=True):
        assert finest < 5e-3
        assert fine / coarse == pytest.approx(0.5, abs=0.1) and finest / fine == pytest.approx(0.5, abs=0.1)


# --- the open contactor ---


def running(p, w, given=None):
    """The states of steady running at the speed `w`."""
    s = steady(engines.MATH, p, w)
    x = at_rest(p)
    x[W], x[LAYOUT.names.index("supply.ramp")] = w, 1.0
    for places, psi in ((PSI, s.psi), (PSI_R, s.psi_r)):
        for place, axis in zip(places, "dq", strict=True):
            x[place] = getattr(psi, axis)
    return s, x


HELD = {"load.J": 1e6}
"""A load that holds the speed."""


def test_an_open_motor_coasts_with_a_field_that_decays():
    """Without current the flux of the cage falls with its time constant and turns with the rotor; the voltage at the
    terminals is that which it induces."""
    p = parameters(COLD)
    w, T = 150.0, (p.main.L + p.cage.L) / p.cage.R
    s, x = running(p, w)
    u = inputs({**OPEN, **HELD})
    states = followed(p, u, x, 0.3, 301)
    psi_r = states[PSI_R[0]] + 1j * states[PSI_R[1]]
    t, slip_speed = np.linspace(0.0, 0.3, 301), 2.0 * math.pi * 50.0 - p.pole_pairs * w
    late = t >= 0.03  # 30 time constants of the contactor
    free = psi_r[late] * np.exp((1.0 / T + 1j * slip_speed) * t[late])
    assert np.max(np.abs(free - free[0])) < 1e-8 * abs(free[0])
    # the flux is continuous: what it loses while the currents vanish is of the order of that time
    assert abs(psi_r[1] - psi_r[0]) < 0.05 * abs(psi_r[0])
    out = outputs(p, u, states, engines.numpy_())
    assert np.max(out.i[late]) < 1e-9 * s.i and np.max(np.abs(out.air_gap_tau[late])) < 1e-9 * s.air_gap_tau
    assert np.max(np.abs(out.supply_power[late])) < 1e-8 * s.supply_power and np.all(out.v == 0.0)
    induced = abs(-1.0 / T + 1j * p.pole_pairs * w) * p.main.L / (p.main.L + p.cage.L) * np.abs(psi_r)
    np.testing.assert_allclose(out.terminal_v[late], math.sqrt(1.5) * induced[late], rtol=1e-8)
    line = math.sqrt(2.0 / 3.0) * p.supply.V
    residual = (-1.0 / T + 1j * p.pole_pairs * w) * p.main.L / (p.main.L + p.cage.L) * psi_r
    np.testing.assert_allclose(
        out.contactor_v[late], math.sqrt(1.5) * np.abs(line - residual[late]), rtol=1e-8
    )


@pytest.mark.parametrize(
    "given",
    [SATURATED, SKIN, {**SATURATED, **SKIN, "inverter.on": 1.0, "inverter.slip": 0.05}],
    ids=["saturated", "skin", "inverter"],
)
def test_no_current_flows_through_an_open_contactor(given):
    """Also where the inductances change with flux and slip, and while the speed and the frequency change fast."""
    p = parameters({**given, "w_start": 120.0})
    x = followed(p, inputs({"w_ref": 120.0, "load.J": 0.01}), at_rest(p), 0.4)[:, -1].tolist()
    u = inputs({**OPEN, "load.tau_bias": 12.0, "load.J": 0.002, "w_ref": 20.0})
    before = outputs(p, inputs({"load.J": 0.01, "w_ref": 120.0}), x).i
    states = followed(p, u, x, 0.08, 81)
    out = outputs(p, u, states, engines.numpy_())
    late = slice(40, None)
    assert states[W, 40] - states[W, -1] > 30.0 and out.terminal_v[-1] > 10.0
    assert np.max(out.i[late]) < 1e-7 * before and before > 1.0
    assert np.max(np.abs(out.air_gap_tau[late])) < 1e-6
    frequency = states[LAYOUT.names.index("supply.frequency")]
    assert (frequency[0] - frequency[-1] > 3.0) == bool(p.inverter.on)


def test_an_opening_of_no_time_changes_nothing():
    """The change by an interruption is proportional to its time, where that is short."""
    p = parameters(COLD)
    _, x = running(p, 150.0)
    calm, _ = of_package(p, LOAD, [(0.05, 0, 1, 51)], x)
    far = []
    for time in (1e-5, 1e-6):
        got, _ = of_package(p, LOAD, [(time, 0, 0, 2), (0.05 - time, 0, 1, 51)], x)
        far.append(float(np.max(np.abs(got[0, 2:] - calm[0]))) / float(np.max(calm[0])))
    assert far[1] < 1e-2 and far[1] / far[0] == pytest.approx(0.1, rel=0.1)


def test_after_a_long_interruption_the_motor_starts_afresh():
    """The field has decayed: closing is switching on at that speed."""
    p = parameters({**COLD, **SATURATED})
    _, x = running(p, 150.0)
    T = (p.main.L + p.cage.L) / p.cage.R
    late = followed(p, inputs({**HELD, **OPEN}), x, 20.0 * T)[:, -1].tolist()
    fresh = at_rest(parameters({**COLD, **SATURATED, "w_start": late[W]}))
    pieces = [(0.1, 0, 1, 201)]
    got, _ = of_package(p, HELD, pieces, late)
    there, _ = of_package(p, HELD, pieces, fresh)
    agree(got, there, 1e-7)
    assert np.max(there[1]) > 20.0


@pytest.mark.second
def test_reclosing_is_hardest_in_opposition():
    """At the same speed the current of a reclosing follows the voltage across the contactor: largest shortly before
    the field, which decays, is in opposition. It then brakes harder than any start."""
    p = parameters({**COLD, "cage.R": 0.7})  # a field that lasts, as of a large motor
    s, x = running(p, 150.0)
    load = {**HELD, "load.tau_bias": s.air_gap_tau}
    slip_speed = 2.0 * math.pi * 50.0 - p.pole_pairs * 150.0
    opposed = math.pi / slip_speed
    voltages, currents, torques = [], [], []
    times = opposed * np.array([0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0])
    for time in times:
        y = followed(p, inputs({**load, **OPEN}), x, time)[:, -1].tolist()
        voltages.append(outputs(p, inputs({**load, **OPEN}), y).contactor_v)
        got, _ = of_package(p, load, [(0.1, 0, 1, 501)], y)
        currents.append(float(np.max(got[1])))
        torques.append(float(np.min(got[0])))
    first, _ = of_package(p, load, [(0.1, 0, 1, 501)], at_rest(parameters({"w_start": 150.0})))
    assert np.argmax(voltages) == np.argmax(currents) == 2 and np.argmin(torques) == 3
    assert 1.3 * p.supply.V < voltages[2] < 2.0 * p.supply.V
    assert currents[2] > 1.3 * np.max(first[1]) and torques[3] < 7.0 * np.min(first[0])
    per_volt = np.max(first[1]) / p.supply.V
    np.testing.assert_allclose(np.array(currents) / np.array(voltages), per_volt, rtol=0.2)


# --- star and delta ---


def test_star_with_the_whole_winding_voltage_is_delta():
    """Star on a line of sqrt(3) times the voltage: the same torque and speed, the same power, 1/sqrt(3) of the
    current."""
    delta, star = (parameters({**SATURATED, "supply.V": V}) for V in (400.0, 400.0 * math.sqrt(3.0)))
    for tight in (True, False):
        got, x = of_package(star, LOAD, [(0.5, 1, 1, 201)], tight=tight)
        there, y = of_package(delta, LOAD, [(0.5, 0, 1, 201)], tight=tight)
        agree(got, (there[0], there[1] / math.sqrt(3.0), there[2]), 1e-6)
    one, other = (outputs(p, inputs({"star": float(p is star)}), at) for p, at in ((star, x), (delta, y)))
    for name in ("supply_power", "v", "heat", "magnetic_energy"):
        assert getattr(one, name) == pytest.approx(getattr(other, name), rel=1e-6)
    assert one.terminal_v == pytest.approx(math.sqrt(3.0) * other.terminal_v, rel=1e-9)
    assert max(one.contactor_v, other.contactor_v) < 1e-20


def test_star_takes_a_third_of_torque_and_current():
    """Of a linear motor, at any speed."""
    p = parameters(COLD)
    for w in (0.0, 80.0, 145.0):
        s = steady(engines.MATH, p, w)
        x = at_rest(p)
        x[W] = w
        y = followed(p, inputs({"star": 1.0, **HELD}), x, 5.0)[:, -1].tolist()
        out = outputs(p, inputs({"star": 1.0}), y)
        assert (out.air_gap_tau, out.i, out.v) == pytest.approx(
            (s.air_gap_tau / 3.0, s.i / 3.0, 400.0 / math.sqrt(3.0)), rel=1e-5
        )
        largest = InductionMotor.largest_torque(p, 293.15, out.v, 50.0)
        assert largest == pytest.approx(InductionMotor.largest_torque(p, 293.15, 400.0, 50.0) / 3.0, rel=1e-2)


@pytest.mark.stages(first=1)
@pytest.mark.parametrize("pause", [0.02, 0.04, 0.06])
def test_the_preferred_delta_follows_the_field(pause):
    """In the change from star to delta near the full speed the preferred connection takes less current."""
    peaks = []
    for preferred in (1.0, 0.0):
        p = parameters({**COLD, "switching.preferred": preferred})
        got, _ = of_package(
            p, {"load.tau_bias": 2.0, "load.J": 0.02}, [(1.5, 1, 1, 2), (pause, 1, 0, 2), (0.1, 0, 1, 401)]
        )
        assert got[2, 1] > 145.0
        peaks.append(float(np.max(got[1])))
    assert peaks[0] < 0.92 * peaks[1]


def test_the_ratio_of_star():
    for preferred, side in ((1.0, 1.0), (0.0, -1.0)):
        assert connection(0.0, preferred) == (1.0, 0.0)
        k = complex(*connection(1.0, preferred))
        assert abs(k) == pytest.approx(1.0 / math.sqrt(3.0), rel=1e-15)
        assert cmath.phase(k) == pytest.approx(side * math.pi / 6.0, rel=1e-15)


# --- energy ---


def test_supply_power_is_losses_arcs_field_and_shaft():
    """At random states and any share of contactor and star; the field's power by exact differentiation."""
    rng = np.random.default_rng(7)
    for k in range(40):
        p = parameters({**SATURATED, "inverter.on": float(k % 2), "switching.preferred": float(k % 3 > 0)})
        u = inputs(
            {
                "load.tau_bias": 3.0,
                "load.J": 0.01,
                "w_ref": 120.0,
                "contactor": [0.0, 1.0, rng.uniform()][k % 3],
                "star": [0.0, 1.0, rng.uniform()][k // 3 % 3],
            }
        )
        x = random_states(rng)
        seeded = [engines.Dual(v, d) for v, d in zip(x, rates(p, u)(x), strict=True)]
        out = outputs(p, u, x)
        field = engines.slope(outputs(p, u, seeded, engines.dual(engines.MATH)).magnetic_energy)
        shaft = out.air_gap_tau * x[W]
        powers = [out.supply_power, -out.heat, -out.arc_power, -field, -shaft]
        assert abs(sum(powers)) < 1e-12 * max(map(abs, powers))
        assert (out.arc_power == 0.0) == (u.contactor == 1.0)


def test_the_energy_of_an_interruption_is_kept():
    """Over a run: energy of the line, heat, arcs, field and shaft, each integrated."""
    p, x, u_of = parameters({**COLD, **SATURATED}), None, lambda c: inputs({**LOAD, "contactor": c})
    _, x = running(p, 150.0)
    total = dict.fromkeys(("supply_power", "heat", "arc_power", "shaft"), 0.0)
    first = outputs(p, u_of(1.0), x).magnetic_energy
    for duration, closed in ((0.02, 1.0), (0.06, 0.0), (0.1, 1.0)):
        u = u_of(closed)

        def extended(_, y, u=u):
            own = y[: len(LAYOUT.names)].tolist()
            out = outputs(p, u, own)
            powers = [out.supply_power, out.heat, out.arc_power, out.air_gap_tau * own[W]]
            return [*InductionMotor.derivatives(engines.MATH, p, u, LAYOUT.instance(own)), *powers]

        done = solve_ivp(extended, (0.0, duration), [*x, *total.values()], "DOP853", rtol=1e-11, atol=1e-11)
        x, energies = done.y[: len(LAYOUT.names), -1].tolist(), done.y[len(LAYOUT.names) :, -1]
        total = dict(zip(total, map(float, energies), strict=True))
    change = outputs(p, u_of(1.0), x).magnetic_energy - first
    rest = total["supply_power"] - total["heat"] - total["arc_power"] - total["shaft"] - change
    assert abs(rest) < 1e-8 * total["supply_power"]
    assert total["arc_power"] > 0.0


def test_the_arcs_take_the_energy_that_the_field_loses():
    """With a short decay the line gives hardly any energy meanwhile, and the flux of the cage stays."""
    shares = []
    for decay in (4e-4, 2e-4, 1e-4):
        p = parameters({**COLD, "switching.decay": decay})
        _, x = running(p, 150.0)
        u = inputs({**OPEN, **HELD})
        times = np.linspace(0.0, 15.0 * decay, 3001)
        out = outputs(p, u, followed(p, u, x, times[-1], len(times)), engines.numpy_())
        arcs = float(np.trapezoid(out.arc_power, times))
        psi_r = math.hypot(*(x[place] for place in PSI_R))
        before = outputs(p, inputs(), x).magnetic_energy
        after = 0.75 * psi_r**2 / (p.main.L + p.cage.L)
        shares.append(arcs / (before - after))
    assert shares[-1] == pytest.approx(1.0, abs=0.3)
    errors = [abs(share - 1.0) for share in shares]
    assert errors[1] / errors[0] == pytest.approx(0.5, abs=0.1) and errors[2] / errors[1] == pytest.approx(
        0.5, abs=0.1
    )


def test_a_soft_starter_waits_for_the_contactor():
    p = parameters({"soft_start.voltage": 0.4, "soft_start.time": 0.8})
    ramp = LAYOUT.names.index("supply.ramp")
    x = followed(p, inputs(OPEN), at_rest(p), 0.5)[:, -1].tolist()
    assert x[ramp] == 0.4
    assert followed(p, inputs(), x, 0.4)[ramp, -1] == pytest.approx(0.7, rel=1e-9)


def test_a_fast_contactor_sets_the_step():
    step = InductionMotor.internal_step(engines.MATH, parameters({"switching.decay": 1e-4}))
    assert step == pytest.approx(2.5e-5)
    assert InductionMotor.internal_step(engines.MATH, parameters()) > 2.0 * step
