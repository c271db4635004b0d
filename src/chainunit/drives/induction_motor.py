"""A three-phase squirrel-cage induction motor: on the line, with a soft starter, or on an inverter with V/f control.

The model is the Gamma equivalent circuit in a dq frame that turns with the supply, so that in steady running every
state is constant. Flux linkages `psi` and currents `i` are space vectors of peak phase quantities; `s` means the
stator, `r` the rotor referred to it, `m` magnetising, `l` leakage; `p` is the number of pole pairs, `f` the frequency
of the supply.

    d psi_s/dt = u_s - R_s i_s - j 2 pi f psi_s               i_m = psi_s/L_m
    d psi_r/dt =     - R_r i_r - j (2 pi f - p w) psi_r       i_r = (psi_r - psi_s)/L_l
    tau_air = 3/2 p Im(conj(psi_s) i_s)                       i_s = i_m - i_r
    (J_rotor + J_load) a = tau_air - d w - tau_load
    C dT/dt = losses - cooling(w) (T - T_ambient)/R_th

All leakage is on the rotor side, so that saturation of the main path follows from |psi_s| alone: 1/L_m grows by
(beta |psi_s|)^6. The skin effect of a deep bar raises R_r and lowers L_l with the slip frequency, quasi-steadily, by
2 s^2/(1 + s^2), with s = 1 at standstill on the line. Sources: H. R. Slemon, "Modelling of induction machines for
electric drives", 1989; the saturation curve of motulator, with which the tests compare.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, ClassVar, NamedTuple

from ..core.engines import MATH
from ..core.model import Part, Requirement
from ..core.planar import Vec2
from ..core.ports import LoadInput, measured_terminal
from ..core.quantities import Value, declaration, group, quantity
from ..core.search import lowest
from .motor import (
    T_RATED,
    Motor,
    MotorOutputs,
    MotorParameters,
    MotorPoint,
    Rotor,
    ShaftStates,
    friction_time,
)

_TURN = 2.0 * math.pi


@declaration
class Supply:
    """The line, or the inverter at its corner frequency."""

    V: Value = quantity("V", "line-to-line voltage, RMS", default=400.0, above=0.0, tunable=True)
    f: Value = quantity("Hz", "frequency", default=50.0, above=0.0)


@declaration
class Stator:
    """The stator winding."""

    R: Value = quantity("Ohm", "resistance of a phase at 20 degC", default=3.7, above=0.0, tunable=True)
    alpha: Value = quantity(
        "1/K", "rise of resistance with temperature", default=0.00393, min=0.0, tunable=True
    )
    C: Value = quantity("J/K", "heat capacity of the motor", default=9000.0, above=0.0)
    R_th: Value = quantity(
        "K/W", "thermal resistance to the surroundings at rated speed", default=0.18, above=0.0, tunable=True
    )


@declaration
class Main:
    """The main path of the flux."""

    L: Value = quantity("H", "magnetising inductance, unsaturated", default=0.245, above=0.0)
    beta: Value = quantity(
        "1/Wb", "saturation: 1/L grows by (beta psi)^6; 0 leaves it linear", default=0.0, min=0.0
    )


@declaration
class Cage:
    """The cage of the rotor, referred to the stator."""

    R: Value = quantity("Ohm", "resistance at 20 degC", default=2.1, above=0.0, tunable=True)
    L: Value = quantity("H", "leakage inductance", default=0.023, above=0.0)
    skin_R: Value = quantity("1", "rise of R at standstill by skin effect", default=0.0, min=0.0, max=10.0)
    skin_L: Value = quantity("1", "fall of L at standstill by skin effect", default=0.0, min=0.0, max=0.9)


@declaration
class SoftStart:
    """A ramp of the voltage from switching on; with `voltage` = 1 the motor starts direct on line."""

    voltage: Value = quantity(
        "1", "share of the voltage at the start", default=1.0, above=0.0, max=1.0, kind="percent"
    )
    time: Value = quantity("s", "time in which the voltage rises to its full value", default=1.0, above=0.0)


@declaration
class InverterControl:
    """V/f control with slip compensation."""

    ramp: Value = quantity("Hz/s", "fastest change of frequency", default=50.0, above=0.0, tunable=True)
    lag: Value = quantity("s", "lag of the frequency behind its reference", default=0.02, above=0.0)
    boost: Value = quantity(
        "1", "share of the voltage at frequency zero",
        default=0.05, min=0.0, max=0.5, tunable=True, kind="percent",
    )  # fmt: skip
    slip: Value = quantity(
        "Hz/(N.m)", "slip compensation: frequency added per air-gap torque", default=0.0, min=0.0, tunable=True,
    )  # fmt: skip


@declaration
class InverterSwitch:
    """Whether an inverter feeds the motor."""

    on: Value = quantity(
        "1",
        "true: an inverter feeds the motor and follows w_ref; false: the line does",
        default=False,
        type="Boolean",
    )


@declaration
class Inverter(InverterControl, InverterSwitch):
    """The inverter; its switch is the first of its variables."""


@declaration
class Cooling:
    """The fan on the shaft."""

    still: Value = quantity(
        "1", "cooling at rest as a share of that at rated speed", default=0.4, above=0.0, max=1.0
    )


@declaration
class Parameters(MotorParameters):
    """Parameters of the motor. The start values are a typical 2.2 kW, 4-pole, 400 V machine."""

    pole_pairs: Value = quantity("1", "pole pairs", default=2, min=1, max=24, type="Integer")
    supply: Supply = group(Supply, "supply", default=Supply())
    stator: Stator = group(Stator, "stator", default=Stator())
    main: Main = group(Main, "main flux", default=Main())
    cage: Cage = group(Cage, "cage", default=Cage())
    rotor: Rotor = group(Rotor, "rotor", default=Rotor(J=0.0081))
    soft_start: SoftStart = group(SoftStart, "soft starter", default=SoftStart())
    inverter: Inverter = group(Inverter, "inverter", default=Inverter())
    cooling: Cooling = group(Cooling, "cooling", default=Cooling())


@declaration
class Inputs(LoadInput):
    """The load, the voltage of the supply and the speed demand of the inverter."""

    voltage: Value = quantity(
        "1",
        "share of the supply's voltage; at 0 the terminals are short-circuited, as in a deep dip",
        default=1.0,
        min=0.0,
        max=2.0,
    )
    w_ref: Value = quantity("rad/s", "speed demand of the inverter", default=0.0)


@declaration
class Flux:
    """A flux linkage in the frame of the supply."""

    d: Value = quantity("Wb", "along the voltage")
    q: Value = quantity("Wb", "across the voltage")


@declaration
class StatorState:
    """State of the stator."""

    psi: Flux = group(Flux, "flux linkage")
    T: Value = quantity("K", "winding temperature", nominal=300.0)


@declaration
class CageState:
    """State of the cage."""

    psi: Flux = group(Flux, "flux linkage")


@declaration
class SupplyState:
    """State of the supply."""

    frequency: Value = quantity("Hz", "frequency", nominal=50.0)
    ramp: Value = quantity("1", "share of the voltage that the soft starter lets through")


@declaration
class States(ShaftStates):
    """States of the motor; each is an output, too."""

    stator: StatorState = group(StatorState, "stator")
    cage: CageState = group(CageState, "cage")
    supply: SupplyState = group(SupplyState, "supply")


@declaration
class Outputs(MotorOutputs):
    """Quantities that follow from the states."""

    i: Value = quantity("A", "current of a phase, RMS")
    v: Value = quantity("V", "line-to-line voltage, RMS", nominal=100.0)
    slip: Value = quantity("1", "slip against the supply's present frequency; 1 at rest")
    magnetic_energy: Value = quantity("J", "energy of the magnetic field")


def skin(s: Any) -> Any:
    """The share of the skin effect at the slip frequency `s`, in parts of the supply's frequency: 0 at 0, 1 at 1."""
    return 2.0 * s * s / (1.0 + s * s)


def _circuit(p: Any, slip_speed: Any, T: Any) -> tuple[Any, Any, Any]:
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
    R_s, R_r, leak = _circuit(p, slip_speed, T)
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


_SLIPS = tuple(10.0 ** (k / 10.0) for k in range(-30, 1))


def breakdown(p: Any, voltage_share: float = 1.0, f: float | None = None, T: float = T_RATED) -> Steady:
    """Steady running at the largest torque of the shaft, between standstill and synchronous speed; arguments as in
    `steady`.

    It is the first maximum below synchronous speed: with a strong skin effect the torque rises again towards
    standstill. The slip has a relative accuracy of 1e-5, the torque therefore one of about 1e-10.
    """
    synchronous = _TURN * (p.supply.f if f is None else f) / p.pole_pairs

    def at(slip: float) -> Steady:
        return steady(MATH, p, (1.0 - slip) * synchronous, voltage_share, f, T)

    k, tau = 0, at(_SLIPS[0]).tau
    while k + 1 < len(_SLIPS) and (next_tau := at(_SLIPS[k + 1]).tau) >= tau:
        k, tau = k + 1, next_tau
    low, high = _SLIPS[max(k - 1, 0)], _SLIPS[min(k + 1, len(_SLIPS) - 1)]
    slip, _ = lowest(lambda slip: -float(at(slip).tau), low, high)
    return max(at(slip), at(high), key=lambda s: s.tau)


class InductionMotorPoint(MotorPoint):
    """The motor at one state: supply, circuit, shaft."""

    __slots__ = (
        "R_r", "R_s", "cooling", "df", "heat", "i_d", "i_q", "ir_d", "ir_q", "leak", "main", "slip_speed", "u", "w_s",
    )  # fmt: skip

    def __init__(self, xp: Any, p: Any, u: Any, x: Any) -> None:
        psi, psi_r, f = x.stator.psi, x.cage.psi, x.supply.frequency
        self.w_s = _TURN * f
        self.slip_speed = self.w_s - p.pole_pairs * x.w
        self.R_s, self.R_r, self.leak = _circuit(p, self.slip_speed, x.stator.T)
        squared = psi.d * psi.d + psi.q * psi.q
        b = p.main.beta * p.main.beta * squared
        self.main = (1.0 + b * b * b) / p.main.L
        self.ir_d, self.ir_q = (psi_r.d - psi.d) / self.leak, (psi_r.q - psi.q) / self.leak
        self.i_d, self.i_q = psi.d * self.main - self.ir_d, psi.q * self.main - self.ir_q
        by_frequency = 1.0 + p.inverter.on * (volts_per_hertz(xp, p, f) - 1.0)
        self.u = math.sqrt(2.0 / 3.0) * p.supply.V * u.voltage * x.supply.ramp * by_frequency
        self.air_gap = 1.5 * p.pole_pairs * (psi.d * self.i_q - psi.q * self.i_d)
        demand = p.pole_pairs * u.w_ref / _TURN + p.inverter.slip * self.air_gap
        target = p.supply.f + p.inverter.on * (xp.maximum(demand, 0.0) - p.supply.f)
        self.df = xp.maximum(xp.minimum((target - f) / p.inverter.lag, p.inverter.ramp), -p.inverter.ramp)
        self.heat = 1.5 * (
            self.R_s * (self.i_d * self.i_d + self.i_q * self.i_q)
            + self.R_r * (self.ir_d * self.ir_d + self.ir_q * self.ir_q)
        )
        self.cooling = InductionMotor.cooling(xp, p, x.w)
        self.turn(p, u, x)

    def rates(self, xp: Any, p: Any, u: Any, x: Any) -> list[Any]:
        """Time derivatives of the states after the derivatives of the shaft's states."""
        psi, psi_r = x.stator.psi, x.cage.psi
        # the soft starter runs while the supply is on, up to the full voltage
        limit = (1.0 - x.supply.ramp) / 2e-3
        rise = xp.minimum((1.0 - p.soft_start.voltage) / p.soft_start.time, limit)
        return [
            self.u - self.R_s * self.i_d + self.w_s * psi.q,
            -self.R_s * self.i_q - self.w_s * psi.d,
            self.warming(p, p.stator, x.stator.T, self.cooling),
            -self.R_r * self.ir_d + self.slip_speed * psi_r.q,
            -self.R_r * self.ir_q - self.slip_speed * psi_r.d,
            p.inverter.on * self.df,
            rise * xp.minimum(u.voltage * 1e3, 1.0),
        ]


def _outputs(xp: Any, p: Any, u: Any, x: Any, s: InductionMotorPoint) -> Outputs:
    psi = x.stator.psi
    squared = psi.d * psi.d + psi.q * psi.q
    b = p.main.beta * p.main.beta * squared
    # energy of the main field: the integral of i_m d psi; of the leakage field: L i^2/2
    main = 0.5 * squared * (1.0 + 0.25 * b * b * b) / p.main.L
    leakage = 0.5 * s.leak * (s.ir_d * s.ir_d + s.ir_q * s.ir_q)
    return Outputs(
        **s.outputs(),
        i=math.sqrt(0.5) * Vec2(s.i_d, s.i_q).length(xp),
        v=math.sqrt(1.5) * s.u,
        slip=s.slip_speed / xp.maximum(s.w_s, 1e-3 * _TURN * p.supply.f),
        supply_power=1.5 * s.u * s.i_d,
        heat=s.heat,
        magnetic_energy=1.5 * (main + leakage),
    )


class InductionMotor(Motor):
    """A squirrel-cage induction motor, on the line or on an inverter, that owns the shaft and takes a load port.

    With the start values the motor starts direct on line. With `soft_start.voltage` below 1 it has a soft starter.
    With `inverter.on` = 1 it runs on an inverter and follows `w_ref`. The input `voltage` makes dips. At 0 the
    terminals are short-circuited: as long as the field lasts, currents as large as at the start flow and brake the
    shaft. A motor that a contactor cuts off, with open terminals, would coast; this is not in the model.
    """

    name = "InductionMotor"
    description = (
        "Squirrel-cage induction motor (dynamic dq model), direct on line, with a soft starter or V/f inverter; "
        "takes a load port"
    )
    Parameters = Parameters
    Inputs = Inputs
    States = States
    Point = InductionMotorPoint
    current, temperature, winding = "i", "stator.T", "stator"
    terminals = (*Motor.terminals, measured_terminal(current="i", power="supply_power"))
    limited_by: ClassVar[Mapping[str, float]] = {"v": 1e-3, "supply.frequency": 1e-3}
    required = (
        Requirement(
            "cage.L",
            "H",
            "the fluxes change faster than the internal integrator can follow",
            ("stator.R", "cage.R", "cage.skin_R", "cage.skin_L"),
        ),
    )
    control = "an inverter, which follows the speed asked for by its frequency"

    @staticmethod
    def follows(p: Any) -> bool:
        """Whether the motor runs on an inverter."""
        return bool(p.inverter.on)

    @staticmethod
    def limit(xp: Any, p: Any, w: Any) -> Any:
        """On the line the torque of a cold motor at this speed; on an inverter the largest torque at any frequency,
        with an error of about 1 % (the current limit of the inverter is not in the model)."""
        on_line = steady(xp, p, w).air_gap_tau
        most = on_line * 0.0
        for slip in _SLIPS:
            f = xp.maximum(p.pole_pairs * w / _TURN, 0.0) + slip * p.supply.f
            most = xp.maximum(most, steady(xp, p, w, volts_per_hertz(xp, p, f), f).air_gap_tau)
        return on_line + p.inverter.on * (most - on_line)

    @staticmethod
    def cooling(xp: Any, p: Any, w: Any) -> Any:
        """Cooling by the fan on the shaft: least at rest, full at synchronous speed and above."""
        speed_share = xp.minimum(xp.abs(w) * p.pole_pairs / (_TURN * p.supply.f), 1.0)
        return p.cooling.still + (1.0 - p.cooling.still) * speed_share

    @staticmethod
    def largest_torque(p: Any, T: float, *at: float) -> float:
        """The breakdown torque at the present voltage [V] and frequency [Hz] of the motor."""
        return float(breakdown(p, at[0] / p.supply.V, at[1], T).air_gap_tau) if min(at) > 0.0 else 0.0

    @staticmethod
    def pull_out(p: Any, T: float, *at: float) -> float:
        """The breakdown torque after friction and windage."""
        return float(breakdown(p, at[0] / p.supply.V, at[1], T).tau) if min(at) > 0.0 else 0.0

    @staticmethod
    def breakdown_speed(p: Any, T: float, *at: float) -> float:
        """The speed of the breakdown torque after friction and windage."""
        V, f = at
        slip = float(breakdown(p, V / p.supply.V, f, T).slip) if min(V, f) > 0.0 else 1.0
        return (1.0 - slip) * _TURN * f / p.pole_pairs

    @staticmethod
    def requirements(xp: Any, p: Any) -> Iterator[tuple[Any, Any, Any]]:
        """The limit of the leakage: no time constant of the fluxes below 1 microsecond."""
        yield p.cage.L, 1e-6 * _resistance(p) / (1.0 - p.cage.skin_L), math.inf

    @staticmethod
    def internal_step(xp: Any, p: Any) -> Any:
        """The least of a quarter of the fluxes' time constant, 1/12 rad of the supply, `friction_time`, 0.25 ms."""
        by_flux = 0.25 * p.cage.L * (1.0 - p.cage.skin_L) / _resistance(p)
        longest = xp.minimum(xp.minimum(2.5e-4, 1.0 / (12.0 * _TURN * p.supply.f)), by_flux)
        return xp.minimum(longest, friction_time(xp, p.rotor))

    @staticmethod
    def initial_states(xp: Any, p: Any) -> Any:
        """The states without flux at the start, at ambient temperature; an inverter starts at frequency 0."""
        return States(
            phi=p.phi_start,
            w=p.w_start,
            stator=StatorState(psi=Flux(d=0.0, q=0.0), T=p.ambient.T),
            cage=CageState(psi=Flux(d=0.0, q=0.0)),
            supply=SupplyState(frequency=p.supply.f * (1.0 - p.inverter.on), ramp=p.soft_start.voltage),
            load_energy=0.0,
        )

    parts = (Part(Outputs, _outputs),)


def _resistance(p: Any) -> Any:
    return p.stator.R + p.cage.R * (1.0 + p.cage.skin_R)
