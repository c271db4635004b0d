"""A three-phase squirrel-cage induction motor: on the line, behind a contactor or in star, with a soft starter, or on
an inverter with V/f control.

The model is the Gamma equivalent circuit in a dq frame that turns with the supply, so that in steady running every
state is constant. Flux linkages `psi` and currents `i` are space vectors of peak phase quantities; `s` means the
stator, `r` the rotor referred to it, `m` magnetising, `l` leakage; `p` is the number of pole pairs, `f` the frequency
of the supply.

    d psi_s/dt = u_s - R_s i_s - j 2 pi f psi_s               i_m = psi_s/L_m
    d psi_r/dt =     - R_r i_r - j (2 pi f - p w) psi_r       i_r = (psi_r - psi_s)/L_l
    tau_air = 3/2 p Im(conj(psi_s) i_s)                       i_s = i_m - i_r
    (J_rotor + J_load) a = tau_air - d w - tau_load
    C dT/dt = losses - cooling(w) (T - T_ambient)/R_th

`contactor` has the voltage u_s of an open contactor, and that of a winding in star.

All leakage is on the rotor side, so that saturation of the main path follows from |psi_s| alone: 1/L_m grows by
(beta |psi_s|)^6. The skin effect of a deep bar raises R_r and lowers L_l with the slip frequency, quasi-steadily, by
2 s^2/(1 + s^2), with s = 1 at standstill on the line. Sources: H. R. Slemon, "Modelling of induction machines for
electric drives", 1989; the saturation curve of motulator, with which the tests compare.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from ..core.model import FmuData, Part, Requirement
from ..core.planar import Vec2
from ..core.ports import LoadInput, measured_terminal
from ..core.quantities import Value, declaration, group, quantity
from .contactor import Switching, connection, opening
from .induction_steady import SLIPS, Flux, breakdown, circuit, skin_slope, steady, volts_per_hertz
from .motor import (
    TERMINALS,
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
        "Hz/(N.m)", "slip compensation: frequency added per air-gap torque; negative for a droop", default=0.0,
        tunable=True,
    )  # fmt: skip
    limit: Value = quantity(
        "A", "current limit, RMS: at it the frequency is held back while the motor drives; 1 MA: none",
        default=1e6, above=0.0, tunable=True, usual=(0.1, 1e6),
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
    switching: Switching = group(Switching, "switching", default=Switching())


@declaration
class Inputs(LoadInput):
    """The load, the voltage of the supply, the speed demand of the inverter, and the contactor."""

    voltage: Value = quantity(
        "1",
        "share of the supply's voltage; at 0 the terminals are short-circuited, as in a deep dip",
        default=1.0,
        min=0.0,
        max=2.0,
    )
    w_ref: Value = quantity("rad/s", "speed demand of the inverter", default=0.0)
    # the bounds leave room for the differences by which tools linearise
    contactor: Value = quantity(
        "1",
        "contactor between line and motor: 1 closed, 0 open; between them, closed for this share of the time",
        default=1.0,
        min=-0.1,
        max=1.1,
    )
    star: Value = quantity(
        "1", "winding: 0 in delta, for which the parameters hold, 1 in star", default=0.0, min=-0.1, max=1.1
    )


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

    i: Value = quantity("A", "current of a phase of the line, RMS")
    v: Value = quantity(
        "V",
        "line-to-line voltage of the line at the winding, RMS; in star 1/sqrt(3) of it, 0 behind an open contactor",
        nominal=100.0,
    )
    slip: Value = quantity("1", "slip against the supply's present frequency; 1 at rest")
    magnetic_energy: Value = quantity("J", "energy of the magnetic field")
    terminal_v: Value = quantity(
        "V",
        "line-to-line voltage at the terminals, RMS; behind an open contactor that of the motor's field",
        nominal=100.0,
    )
    contactor_v: Value = quantity(
        "V", "voltage across the open contactor, line to line, RMS; largest where the motor's field opposes the line",
        nominal=100.0,
    )  # fmt: skip
    arc_power: Value = quantity("W", "losses of the arcs of the contactor", nominal=100.0)


_STALL_GAIN = 4.0
"""Rate of the frequency, in parts of the ramp, over the square of the current, in parts of its limit."""
_STALL_LAGS = 5.0
"""Time constant in which the frequency is taken back, over the lag of the inverter."""


class InductionMotorPoint(MotorPoint):
    """The motor at one state: supply, circuit, shaft."""

    __slots__ = (
        "R_r", "R_s", "cooling", "df", "gap", "heat", "i_d", "i_q", "ir_d", "ir_q", "leak", "psi_r_rate", "psi_rate",
        "ratio", "slip_speed", "u", "u_d", "u_q", "w_s",
    )  # fmt: skip

    def __init__(self, xp: Any, p: Any, u: Any, x: Any) -> None:
        psi, psi_r, f = x.stator.psi, x.cage.psi, x.supply.frequency
        self.w_s = _TURN * f
        self.slip_speed = self.w_s - p.pole_pairs * x.w
        self.R_s, self.R_r, self.leak = circuit(p, self.slip_speed, x.stator.T)
        squared = psi.d * psi.d + psi.q * psi.q
        b = p.main.beta * p.main.beta * squared
        main = (1.0 + b * b * b) / p.main.L
        self.ir_d, self.ir_q = (psi_r.d - psi.d) / self.leak, (psi_r.q - psi.q) / self.leak
        self.i_d, self.i_q = psi.d * main - self.ir_d, psi.q * main - self.ir_q
        by_frequency = 1.0 + p.inverter.on * (volts_per_hertz(xp, p, f) - 1.0)
        self.u = math.sqrt(2.0 / 3.0) * p.supply.V * u.voltage * x.supply.ramp * by_frequency
        ratio_d, ratio_q = connection(u.star, p.switching.preferred)
        self.ratio = Vec2(ratio_d, ratio_q).length(xp)
        self.u_d, self.u_q = self.u * ratio_d, self.u * ratio_q
        self.air_gap = 1.5 * p.pole_pairs * (psi.d * self.i_q - psi.q * self.i_d)
        demand = p.pole_pairs * u.w_ref / _TURN + p.inverter.slip * self.air_gap
        target = p.supply.f + p.inverter.on * (xp.maximum(demand, 0.0) - p.supply.f)
        self.df = xp.maximum(xp.minimum((target - f) / p.inverter.lag, p.inverter.ramp), -p.inverter.ramp)
        self._limit_current(xp, p, f)
        self.heat = 1.5 * (
            self.R_s * (self.i_d * self.i_d + self.i_q * self.i_q)
            + self.R_r * (self.ir_d * self.ir_d + self.ir_q * self.ir_q)
        )
        self.cooling = _cooling(xp, p, x.w)
        self.turn(xp, p, u, x)
        self._flux_rates(p, u, x, main, 6.0 * b * b * p.main.beta * p.main.beta / p.main.L)

    def _limit_current(self, xp: Any, p: Any, f: Any) -> None:
        """Hold the frequency of the inverter back at its current limit; beyond, take it back to that of the rotor,
        by up to the ramp: the slip and with it the current fall. The limit acts while the motor drives."""
        over = 0.5 * (self.i_d * self.i_d + self.i_q * self.i_q) / (p.inverter.limit * p.inverter.limit)
        room = xp.maximum(xp.minimum(_STALL_GAIN * (1.0 - over), 1.0), -1.0)
        back = -xp.minimum(self.slip_speed / _TURN, f) / (_STALL_LAGS * p.inverter.lag)
        held = xp.minimum(self.df, xp.maximum(p.inverter.ramp * room, back))
        drives = xp.maximum(xp.minimum(self.slip_speed, 1.0), 0.0)
        self.df = self.df + drives * (held - self.df)

    def _flux_rates(self, p: Any, u: Any, x: Any, main: Any, bend: Any) -> None:
        """The derivatives of the fluxes, and the voltage by which an open contactor changes that of the winding.
        `main` is 1/L_m [1/H], `bend` twice its derivative by |psi|^2."""
        psi, psi_r = x.stator.psi, x.cage.psi
        rotor_d = -self.R_r * self.ir_d + self.slip_speed * psi_r.q
        rotor_q = -self.R_r * self.ir_q - self.slip_speed * psi_r.d
        closed_d = self.u_d - self.R_s * self.i_d + self.w_s * psi.q
        closed_q = self.u_q - self.R_s * self.i_q - self.w_s * psi.d
        # the skin effect changes the leakage with the slip
        rated = _TURN * p.supply.f
        slope = (
            skin_slope(self.slip_speed / rated)
            * (_TURN * p.inverter.on * self.df - p.pole_pairs * self.a)
            / rated
        )
        leak_rate = -p.cage.L * p.cage.skin_L * slope
        pull = (rotor_d - self.ir_d * leak_rate) / self.leak, (rotor_q - self.ir_q * leak_rate) / self.leak
        currents = self.i_d, self.i_q
        open_d, open_q = opening(
            (psi.d, psi.q), main + 1.0 / self.leak, bend, pull, currents, p.switching.decay
        )
        away = 1.0 - u.contactor
        self.gap = away * (open_d - closed_d), away * (open_q - closed_q)
        self.psi_rate = closed_d + self.gap[0], closed_q + self.gap[1]
        self.psi_r_rate = rotor_d, rotor_q

    def rates(self, xp: Any, p: Any, u: Any, x: Any) -> list[Any]:
        """Time derivatives of the states after the derivatives of the shaft's states."""
        # the soft starter runs while the supply is on, up to the full voltage
        limit = (1.0 - x.supply.ramp) / 2e-3
        rise = xp.minimum((1.0 - p.soft_start.voltage) / p.soft_start.time, limit)
        return [
            *self.psi_rate,
            self.warming(p, p.stator, x.stator.T, self.cooling),
            *self.psi_r_rate,
            p.inverter.on * self.df,
            rise * xp.minimum(u.voltage * 1e3, 1.0) * u.contactor,
        ]


def _outputs(xp: Any, p: Any, u: Any, x: Any, s: InductionMotorPoint) -> Outputs:
    """The outputs of the motor: those of every motor, RMS of current and voltages, powers and stored energy."""
    psi = x.stator.psi
    squared = psi.d * psi.d + psi.q * psi.q
    b = p.main.beta * p.main.beta * squared
    # energy of the main field: the integral of i_m d psi; of the leakage field: L i^2/2
    main = 0.5 * squared * (1.0 + 0.25 * b * b * b) / p.main.L
    leakage = 0.5 * s.leak * (s.ir_d * s.ir_d + s.ir_q * s.ir_q)
    gap_d, gap_q = s.gap
    per_line = math.sqrt(1.5) / s.ratio
    return Outputs(
        **s.outputs(),
        i=math.sqrt(0.5) * Vec2(s.i_d, s.i_q).length(xp) * s.ratio,
        v=math.sqrt(1.5) * s.u * s.ratio * u.contactor,
        slip=s.slip_speed / xp.maximum(s.w_s, 1e-3 * _TURN * p.supply.f),
        supply_power=1.5 * (s.u_d * s.i_d + s.u_q * s.i_q),
        heat=s.heat,
        magnetic_energy=1.5 * (main + leakage),
        terminal_v=per_line * Vec2(s.u_d + gap_d, s.u_q + gap_q).length(xp),
        contactor_v=per_line * Vec2(gap_d, gap_q).length(xp),
        arc_power=-1.5 * (gap_d * s.i_d + gap_q * s.i_q),
    )


def _follows(p: Any) -> bool:
    """Whether the motor runs on an inverter."""
    return bool(p.inverter.on)


def _torque_limit(xp: Any, p: Any, w: Any) -> Any:
    """On the line the torque of a cold motor at this speed; on an inverter the largest torque at any frequency,
    with an error of about 1 % (the current limit of the inverter is not in the model)."""
    on_line = steady(xp, p, w).air_gap_tau
    most = on_line * 0.0
    for slip in SLIPS:
        f = xp.maximum(p.pole_pairs * w / _TURN, 0.0) + slip * p.supply.f
        most = xp.maximum(most, steady(xp, p, w, volts_per_hertz(xp, p, f), f).air_gap_tau)
    return on_line + p.inverter.on * (most - on_line)


def _cooling(xp: Any, p: Any, w: Any) -> Any:
    """Cooling by the fan on the shaft: least at rest, full at synchronous speed and above."""
    speed_share = xp.minimum(xp.abs(w) * p.pole_pairs / (_TURN * p.supply.f), 1.0)
    return p.cooling.still + (1.0 - p.cooling.still) * speed_share


def _largest_torque(p: Any, T: float, *point: float) -> float:
    """The pull-out torque at the present voltage [V] and frequency [Hz] of the motor."""
    return float(breakdown(p, point[0] / p.supply.V, point[1], T).air_gap_tau) if min(point) > 0.0 else 0.0


def _pull_out(p: Any, T: float, *point: float) -> float:
    """The pull-out torque after friction and windage."""
    return float(breakdown(p, point[0] / p.supply.V, point[1], T).tau) if min(point) > 0.0 else 0.0


def _breakdown_speed(p: Any, T: float, *point: float) -> float:
    """The speed of the pull-out torque after friction and windage."""
    V, f = point
    slip = float(breakdown(p, V / p.supply.V, f, T).slip) if min(V, f) > 0.0 else 1.0
    return (1.0 - slip) * _TURN * f / p.pole_pairs


def _limits(xp: Any, p: Any) -> Iterator[tuple[Any, Any, Any]]:
    """The limit of the leakage: no time constant of the fluxes below 1 microsecond."""
    yield p.cage.L, 1e-6 * _resistance(p) / (1.0 - p.cage.skin_L), math.inf


def _internal_step(xp: Any, p: Any) -> Any:
    """The least of a quarter of the time constant of the fluxes and of the contactor, 1/12 rad of the supply,
    `friction_time`, 0.25 ms."""
    by_flux = 0.25 * p.cage.L * (1.0 - p.cage.skin_L) / _resistance(p)
    longest = xp.minimum(xp.minimum(2.5e-4, 1.0 / (12.0 * _TURN * p.supply.f)), by_flux)
    return xp.minimum(xp.minimum(longest, 0.25 * p.switching.decay), friction_time(xp, p.rotor))


def _initial_states(xp: Any, p: Any) -> Any:
    """The states without flux at the start, at ambient temperature; an inverter starts at frequency 0."""
    return States(
        phi=p.phi_start,
        w=p.w_start,
        stator=StatorState(psi=Flux(d=0.0, q=0.0), T=p.ambient.T),
        cage=CageState(psi=Flux(d=0.0, q=0.0)),
        supply=SupplyState(frequency=p.supply.f * (1.0 - p.inverter.on), ramp=p.soft_start.voltage),
        load_energy=0.0,
    )


InductionMotor = Motor(
    name="InductionMotor",
    text="""A squirrel-cage induction motor, on the line or on an inverter, that owns the shaft and takes a load port.

    With the start values the motor starts direct on line. With `soft_start.voltage` below 1 it has a soft starter.
    With `inverter.on` = 1 it runs on an inverter and follows `w_ref`. The input `voltage` makes dips. At 0 the
    terminals are short-circuited: as long as the field lasts, currents as large as at the start flow and brake the
    shaft. With the input `contactor` at 0 the terminals are open: the currents vanish in `switching.decay`, the motor
    coasts, and its field decays with the time constant of the cage; a contactor that closes meanwhile finds the field
    at its phase. With `star` at 1 the winding is in star. A soft starter does not begin anew after an opening.
    """,
    # the flux at switching on turns at the supply's frequency and hardly decays
    fmu_data=FmuData(experiment={"step": 5e-5, "stop": 2.0}),
    description=(
        "Squirrel-cage induction motor (dynamic dq model), direct on line, with a soft starter or V/f inverter; "
        "takes a load port"
    ),
    Parameters=Parameters,
    Inputs=Inputs,
    States=States,
    Point=InductionMotorPoint,
    current="i",
    temperature="stator.T",
    winding="stator",
    terminals=(*TERMINALS, measured_terminal(current="i", power="supply_power")),
    limited_by={"v": 1e-3, "supply.frequency": 1e-3},
    required=(
        Requirement(
            "cage.L",
            "H",
            "the fluxes change faster than the internal integrator can follow",
            ("stator.R", "cage.R", "cage.skin_R", "cage.skin_L"),
        ),
    ),
    control="an inverter, which follows the speed asked for by its frequency",
    parts=(Part(Outputs, _outputs),),
    follows=_follows,
    limit=_torque_limit,
    cooling=_cooling,
    largest_torque=_largest_torque,
    pull_out=_pull_out,
    breakdown_speed=_breakdown_speed,
    requirements=_limits,
    internal_step=_internal_step,
    initial_states=_initial_states,
)


def _resistance(p: Any) -> Any:
    return p.stator.R + p.cage.R * (1.0 + p.cage.skin_R)
