"""Steady running of an induction motor: the Gamma circuit with the values of a slip, its state of constant fluxes,
and its breakdown; see `induction_motor` for the model and its sources."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from ..core.engines import MATH
from ..core.planar import Vec2
from ..core.quantities import Value, declaration, quantity
from .motor import T_RATED

_TURN = 2.0 * math.pi


@declaration
class Flux:
    """A flux linkage in the frame of the supply."""

    d: Value = quantity("Wb", "along the voltage")
    q: Value = quantity("Wb", "across the voltage")


def skin(s: Any) -> Any:
    """The share of the skin effect at the slip frequency `s`, in parts of the supply's frequency: 0 at 0, 1 at 1."""
    return 2.0 * s * s / (1.0 + s * s)


def skin_slope(s: Any) -> Any:
    """The derivative of `skin` by the slip frequency."""
    whole = 1.0 + s * s
    return 4.0 * s / (whole * whole)


def circuit(p: Any, slip_speed: Any, T: Any) -> tuple[Any, Any, Any]:
    """Resistances of stator and cage [Ohm] and the leakage inductance [H] at this slip [rad/s, electrical] and
    temperature [K]."""
    share = skin(slip_speed * (1.0 / (_TURN * p.supply.f)))
    warm = 1.0 + p.stator.alpha * (T - T_RATED)
    return (
        p.stator.R * warm,
        p.cage.R * warm * (1.0 + p.cage.skin_R * share),
        p.cage.L * (1.0 - p.cage.skin_L * share),
    )


def volts_per_hertz(xp: Any, p: Any, f: Any) -> Any:
    """Share of the voltage that the inverter gives at the frequency `f` [Hz]: V/f with a boost at low frequency, and
    the full voltage above the corner frequency."""
    return xp.minimum(p.inverter.boost + (1.0 - p.inverter.boost) * f / p.supply.f, 1.0)


class Steady(NamedTuple):
    """Steady running at one speed. Values that are also outputs of the model have the same names and units; `psi` and
    `psi_r` are the states."""

    air_gap_tau: Any
    tau: Any
    """torque for a load, after friction and windage"""
    i: Any
    power_factor: Any
    supply_power: Any
    heat: Any
    slip: Any
    psi: Flux
    psi_r: Flux


_ITERATIONS = 20


def steady(xp: Any, p: Any, w: Any, voltage_share: Any = 1.0, f: Any = None, T: Any = T_RATED) -> Steady:
    """The state in which every flux is constant, at the rotor speed `w` [rad/s].

    `voltage_share` is the share of the supply's voltage, `f` the frequency [Hz] (by default that of the supply), `T`
    the temperature of the windings [K]. With all derivatives 0 the model's equations are the Gamma circuit,

        i_r = -(g + j b) psi_s        g + j b = j w_r/(R_r + j w_r L_l)        w_r = 2 pi f - p w
        u_s = (R_s (1/L_m + g) + j (2 pi f + R_s b)) psi_s

    and |psi_s|^2, on which L_m depends, follows by Newton's method. From the flux without saturation it falls
    monotonically to the root, because |u_s|^2 is a growing and convex function of it. The result is exact where
    saturation lowers the flux at this voltage to no less than a third.
    """
    w_s = _TURN * (p.supply.f if f is None else f)
    slip_speed = w_s - p.pole_pairs * w
    R_s, R_r, leak = circuit(p, slip_speed, T)
    rotor = slip_speed / (R_r * R_r + slip_speed * slip_speed * leak * leak)
    g, b = rotor * slip_speed * leak, rotor * R_r
    u = math.sqrt(2.0 / 3.0) * p.supply.V * voltage_share
    quadrature = w_s + R_s * b
    beta_2 = p.main.beta * p.main.beta
    beta_6 = beta_2 * beta_2 * beta_2
    phase = R_s * (1.0 / p.main.L + g)
    squared = u * u / (phase * phase + quadrature * quadrature)
    for _ in range(_ITERATIONS):
        cube = beta_6 * squared * squared * squared
        phase = R_s * ((1.0 + cube) / p.main.L + g)
        impedance = phase * phase + quadrature * quadrature
        slope = impedance + 6.0 * phase * R_s * cube / p.main.L
        squared = squared - (squared * impedance - u * u) / slope
    main = (1.0 + beta_6 * squared * squared * squared) / p.main.L
    phase = R_s * (main + g)
    impedance = phase * phase + quadrature * quadrature
    psi = Flux(d=u * phase / impedance, q=-u * quadrature / impedance)
    ir_d, ir_q = psi.q * b - psi.d * g, -psi.q * g - psi.d * b
    i_d, i_q = psi.d * main - ir_d, psi.q * main - ir_q
    current = Vec2(i_d, i_q).length(xp)
    air_gap = 1.5 * p.pole_pairs * squared * b
    return Steady(
        air_gap_tau=air_gap,
        tau=air_gap - p.rotor.d * w,
        i=math.sqrt(0.5) * current,
        power_factor=i_d / current,
        supply_power=1.5 * u * i_d,
        heat=1.5 * (R_s * (i_d * i_d + i_q * i_q) + R_r * (ir_d * ir_d + ir_q * ir_q)),
        slip=slip_speed / xp.maximum(w_s, 1e-3 * _TURN * p.supply.f),
        psi=psi,
        psi_r=Flux(d=psi.d + leak * ir_d, q=psi.q + leak * ir_q),
    )


SLIPS = tuple(10.0 ** (k / 10.0) for k in range(-30, 1))
"""Slips from 0.1 % to standstill, evenly in their logarithm, among which the largest torque is sought."""


def breakdown(p: Any, voltage_share: float = 1.0, f: float | None = None, T: float = T_RATED) -> Steady:
    """Steady running at the largest torque of the shaft, between standstill and synchronous speed; arguments as in
    `steady`.

    It is the first maximum below synchronous speed: with a strong skin effect the torque rises again towards
    standstill. The slip has a relative accuracy of 1e-5, the torque therefore one of about 1e-10.
    """
    from scipy.optimize import minimize_scalar

    synchronous = _TURN * (p.supply.f if f is None else f) / p.pole_pairs

    def steady_at(slip: float) -> Steady:
        return steady(MATH, p, (1.0 - slip) * synchronous, voltage_share, f, T)

    k, tau = 0, steady_at(SLIPS[0]).tau
    while k + 1 < len(SLIPS) and (next_tau := steady_at(SLIPS[k + 1]).tau) >= tau:
        k, tau = k + 1, next_tau
    low, high = SLIPS[max(k - 1, 0)], SLIPS[min(k + 1, len(SLIPS) - 1)]
    accuracy = {"xatol": 1e-6 * (high - low)}
    most = minimize_scalar(
        lambda slip: -steady_at(slip).tau, bounds=(low, high), method="bounded", options=accuracy
    )
    return max(steady_at(float(most.x)), steady_at(high), key=lambda s: s.tau)
