"""The equivalent circuit of an induction motor from its nameplate and catalogue data.

Six values of the catalogue - torque, current and power factor in rated running, pull-out torque, torque and
current with the rotor locked - give six parameters: two resistances, leakage, magnetising inductance, and the changes
of resistance and leakage at standstill by the skin effect. Values that no catalogue has are declared in
`Assumptions`.

The model has no iron and stray losses. `stator.R` is fitted so that the copper losses include them in rated running;
it is therefore larger than the resistance by an ohmmeter. In small motors the pull-out torque would be too small
with that resistance; there the fit departs from power factor and efficiency first (`_WEIGHTS`). Saturation
(`main.beta`) stays 0, because it follows from no value of a catalogue; `cage.skin_L` includes the fall of the leakage
by saturation of the teeth in the locked motor.

Rated running and breakdown refer to the warm motor, `Assumptions.rise` above the model's ambient temperature, the
locked rotor to the cold motor. The steady temperature in rated running is therefore the rated one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType
from typing import Any

import numpy as np

from ..core.engines import MATH, Dual, dual, slope, value
from ..core.errors import Faults, InputError
from ..core.quantities import Layout, Value, complaint, declaration, quantity, violations
from .induction_motor import InductionMotor, Parameters
from .induction_steady import Steady, breakdown, steady
from .motor import T_RATED

_TURN = 2.0 * math.pi


@declaration
class Nameplate:
    """The values of the nameplate and the catalogue of a motor."""

    power: Value = quantity("W", "rated power at the shaft", above=0.0)
    voltage: Value = quantity("V", "rated voltage, line to line, RMS", default=400.0, above=0.0)
    frequency: Value = quantity("Hz", "rated frequency", default=50.0, above=0.0)
    poles: Value = quantity("1", "number of poles", min=2.0, max=48.0)
    speed: Value = quantity("rad/s", "rated speed", above=0.0, kind="speed")
    efficiency: Value = quantity("1", "rated efficiency", above=0.0, max=1.0)
    power_factor: Value = quantity("1", "rated power factor", above=0.0, max=1.0)
    current: Value = quantity(
        "A",
        "rated current of a line; 0: it follows from power, efficiency and power factor",
        default=0.0,
        min=0.0,
    )
    breakdown_ratio: Value = quantity("1", "pull-out torque over rated torque", above=1.0, max=10.0)
    locked_torque_ratio: Value = quantity("1", "locked-rotor torque over rated torque", above=0.0, max=10.0)
    locked_current_ratio: Value = quantity(
        "1", "locked-rotor current over rated current", above=1.0, max=20.0
    )
    J: Value = quantity("kg.m2", "inertia of the rotor", above=0.0)
    locked_time: Value = quantity("s", "time for which the rotor of a warm motor may be locked", above=0.0)

    @property
    def synchronous(self) -> float:
        """Synchronous speed [rad/s]."""
        return float(2.0 * _TURN * self.frequency / self.poles)

    @property
    def slip(self) -> float:
        """Rated slip."""
        return float(1.0 - self.speed / self.synchronous)

    @property
    def torque(self) -> float:
        """Rated torque [N m]."""
        return float(self.power / self.speed)

    @property
    def rated_current(self) -> float:
        """Rated current [A] of the nameplate, or else the one that follows from its other values."""
        return float(self.current or self.implied_current)

    @property
    def implied_current(self) -> float:
        """Rated current [A] that follows from power, efficiency, power factor and voltage."""
        apparent = self.power / (self.efficiency * self.power_factor)
        return float(apparent / (math.sqrt(3.0) * self.voltage))

    @property
    def apparent_power(self) -> float:
        """Rated apparent power [VA]."""
        return math.sqrt(3.0) * float(self.voltage) * self.rated_current


@declaration
class Assumptions:
    """Values that no nameplate has."""

    friction: Value = quantity(
        "1",
        "friction and windage at rated speed as a share of the rated power",
        default=0.01,
        min=0.0,
        max=0.1,
    )
    rise: Value = quantity(
        "K", "rise of the winding temperature in rated running", default=80.0, min=1.0, max=200.0
    )
    time_constant: Value = quantity(
        "s", "thermal time constant of a motor of 1 kW", default=1200.0, above=0.0, max=1e5
    )
    growth: Value = quantity(
        "1",
        "exponent by which the thermal time constant grows with the rated power",
        default=0.2,
        min=0.0,
        max=1.0,
    )


TYPICAL = Assumptions()
"""Assumptions for standard motors: temperature rise of class B, totally enclosed and fan-cooled."""

LAYOUT = Layout(Nameplate)
LARGEST_RESIDUAL = 0.1
"""Relative deviation above which a nameplate is refused, if no circuit meets it better."""

LARGEST_SLIP = 0.2
"""Largest rated slip; above it the speed belongs to another number of poles."""


# IEC 60034-1 allows 10 to 25 % for breakdown and locked rotor; the power factor takes the error from the iron losses
_WEIGHTS = {
    "power": 3.0,
    "current": 3.0,
    "power_factor": 1.0,
    "breakdown_ratio": 1.0,
    "locked_torque_ratio": 1.0,
    "locked_current_ratio": 1.0,
}

# shifts of the logarithms in `_Fit`: where the torque hardly falls below breakdown speed there are several minima
_STARTS = (
    (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    (-0.5, 0.0, 0.3, 0.0, 0.0, -0.3),
    (-0.5, -0.3, 0.6, 0.0, 0.5, -0.8),
)


@dataclass(frozen=True)
class Identification:
    """A motor with the parameters that meet its nameplate best.

    `residuals` has the relative deviation of the circuit from each value of the nameplate, by name; `power` and
    `efficiency` are those at rated speed. `rated`, `breakdown` and `locked` are the circuit at its three points.
    """

    nameplate: Nameplate
    parameters: Parameters
    residuals: Mapping[str, float]
    rated: Steady
    breakdown: Steady
    locked: Steady

    @property
    def worst(self) -> tuple[str, float]:
        """The name and the value of the largest residual."""
        return max(self.residuals.items(), key=lambda item: abs(item[1]))


def check(nameplate: Nameplate, assumptions: Assumptions = TYPICAL) -> None:
    """Refuse values out of bounds, and values that contradict each other.

    Raises
    ------
    InputError
        with a line for each: the quantity, its value, the allowed range.
    """
    faults = Faults()
    pairs = zip(LAYOUT.variables, LAYOUT.values(nameplate), strict=True)
    faults.add(InputError(complaint(v, x), v.name) for v, x in pairs if not v.quantity.admits(x))
    faults.add(map(InputError, violations(Layout(Assumptions), assumptions)))
    faults.refuse()
    contradictions = _contradictions(nameplate, assumptions)
    faults.add(InputError(f"{column} = {message}", column) for column, message in contradictions)
    faults.refuse()


def _contradictions(n: Nameplate, assumptions: Assumptions) -> Iterator[tuple[str, str]]:
    """Each value that contradicts others: its name, and its value with the reason."""
    low, high = ((1.0 + sign * LARGEST_RESIDUAL) * n.implied_current for sign in (-1.0, 1.0))
    if n.current and not low < n.current < high:
        yield (
            "current",
            f"{n.current:g} A: power, voltage, efficiency and power factor make it {n.implied_current:.4g} "
            f"A; must be > {low:.4g} and < {high:.4g} A, or be left out",
        )
    if n.poles % 2.0:
        yield "poles", f"{n.poles:g}: must be an even number (number of poles)"
        return
    low, high = (1.0 - LARGEST_SLIP) * n.synchronous, n.synchronous
    if not low < n.speed < high:
        rev = [x * 60.0 / _TURN for x in (n.speed, low, high)]
        yield (
            "speed",
            f"{n.speed:g} rad/s ({rev[0]:g} rev/min): with poles = {n.poles:g} at {n.frequency:g} Hz it "
            f"must be > {low:g} and < {high:g} rad/s, the synchronous speed ({rev[1]:g} and {rev[2]:g} rev/min)",
        )
        return
    # the efficiency with no losses but slip and friction
    most = (1.0 - n.slip) / (1.0 + assumptions.friction)
    real = n.power / (n.apparent_power * n.power_factor)
    if not max(real, n.efficiency) < most:
        yield (
            "efficiency",
            f"{max(real, n.efficiency):.4g}: a slip of {n.slip:.3g} and friction of "
            f"{assumptions.friction:g} of the power leave at most {most:.4g}; must be < {most:.4g}",
        )
    most = n.locked_current_ratio * n.apparent_power / (n.torque * n.synchronous)
    if not n.locked_torque_ratio < most:
        yield (
            "locked_torque_ratio",
            f"{n.locked_torque_ratio:g}: takes more than the whole power of the locked-rotor "
            f"current; must be < {most:.3g}",
        )


@lru_cache(maxsize=1024)
def identify(
    nameplate: Nameplate, assumptions: Assumptions = TYPICAL, tolerance: float = LARGEST_RESIDUAL
) -> Identification:
    """The parameters whose circuit meets the nameplate best, and the residuals.

    It is a least-squares fit of the relative deviations with bounds, in the logarithms of the parameters. The fit is
    deterministic, starts from the circuit in closed form, and uses exact derivatives. Residuals remain only where a
    parameter is at its bound: mostly for a motor whose locked-rotor values no skin effect can explain.

    Raises
    ------
    InputError
        in one line, for a nameplate that contradicts itself (see `check`), or that no circuit meets within the
        relative `tolerance`.
    """
    from scipy.optimize import least_squares

    check(nameplate, assumptions)
    fit = _Fit(nameplate, assumptions)
    low, high = fit.bounds
    margin = 1e-6 * (high - low)
    best: Any = None
    for shift in _STARTS:
        start = np.clip(fit.start() + np.array(shift), low + margin, high - margin)
        solution = least_squares(
            fit.deviations, start, fit.jacobian, (low, high), xtol=1e-12, ftol=1e-15, gtol=1e-14, max_nfev=100
        )
        if best is None or solution.cost < best.cost:
            best = solution
        if best.cost < 1e-18:
            break
    identification = fit.identification(best.x)
    name, worst = identification.worst
    if not abs(worst) <= tolerance:
        plate = nameplate.rated_current if name == "current" else getattr(nameplate, name)
        raise InputError(
            f"{name} = {plate:g}: no circuit meets it together with the rest of the nameplate; the one that comes "
            f"closest has {plate * (1.0 + worst):.4g}; must be within {tolerance:.0%} of that"
        )
    return identification


class _Fit:
    """The deviations of the circuit from the nameplate, in the logarithms of six parameters: `stator.R`, `cage.R`,
    `cage.L`, `main.L`, 1 + `cage.skin_R` and 1 - `cage.skin_L`."""

    def __init__(self, nameplate: Nameplate, assumptions: Assumptions) -> None:
        self.n, self.assumptions = nameplate, assumptions
        self.warm = T_RATED + assumptions.rise
        n = nameplate
        self.base = n.voltage * n.voltage / n.apparent_power
        layout, w_s = InductionMotor.parameter_layout, _TURN * n.frequency
        self.constants = layout.by_name(Parameters()) | {
            "pole_pairs": 0.5 * n.poles,
            "supply.V": n.voltage,
            "supply.f": n.frequency,
            "main.beta": 0.0,
            "rotor.J": n.J,
            "rotor.d": assumptions.friction * n.power / (n.speed * n.speed),
        }
        # limits in parts of the rated impedance
        resistance, leakage, main = (1e-4, 1.0), (0.02, 1.0), (0.1, 100.0)
        most = {v.name: v.quantity.high for v in layout.variables}
        limits = [
            *([self.base * x for x in resistance] for _ in range(2)),
            *([self.base / w_s * x for x in between] for between in (leakage, main)),
            [1.0, 1.0 + most["cage.skin_R"]],
            [1.0 - most["cage.skin_L"], 1.0],
        ]
        self.bounds = np.log(np.array(limits)).T
        self._last: tuple[bytes, Any] | None = None

    def parameters(self, six: Any) -> Parameters:
        """The motor with these six values."""
        R_s, R_r, L_l, L_m, skin_R, skin_L = six
        values = {
            "stator.R": R_s,
            "cage.R": R_r,
            "cage.L": L_l,
            "main.L": L_m,
            "cage.skin_R": skin_R - 1.0,
            "cage.skin_L": 1.0 - skin_L,
        }
        return InductionMotor.parameter_layout.instance([*(self.constants | values).values()])

    def start(self) -> Any:
        """The circuit to start from, in closed form, shape (6,): the logarithms of the resistances of stator and
        rotor when cold [Ohm], of the leakage and the main inductance [H], and of the factors of the rotor's
        resistance and of the leakage with locked rotor. Resistance and power at rated load give the stator and, with
        the breakdown torque, rotor and leakage, in rounds; current and torque at rest give the factors. There is no
        skin effect in rated running and at breakdown."""
        n = self.n
        w_s, phase_v, phase_i = _TURN * n.frequency, n.voltage / math.sqrt(3.0), n.rated_current
        air_gap = n.power * (1.0 + self.assumptions.friction) / (1.0 - n.slip)
        R_s = (n.apparent_power * n.power_factor - air_gap) / (3.0 * phase_i * phase_i)
        i = phase_i * complex(n.power_factor, -math.sqrt(1.0 - n.power_factor**2))
        # admittance behind the stator's resistance, per flux: main path and rotor
        y = i * 1j * w_s / (phase_v - R_s * i)
        w_r, b = n.slip * w_s, max(y.imag, 1e-9 * abs(y))
        most = n.breakdown_ratio * n.torque * n.synchronous
        R_r, L_l, main = w_r / b, 0.2 / abs(y), 0.5 * abs(y)
        for _ in range(4):
            # the rotor sees a source behind stator and main path
            share = 1j * w_s / (1j * w_s + R_s * main)
            behind, source = R_s * share, phase_v * abs(share)
            sum_ = 1.5 * source * source / most
            reactance = (
                math.sqrt(max(sum_ * sum_ - 2.0 * sum_ * behind.real, (0.1 * sum_) ** 2)) - behind.imag
            )
            L_l = min(max(reactance, 0.1 * sum_) / w_s, 0.5 / b)
            R_r = 0.5 * w_r / b * (1.0 + math.sqrt(1.0 - (2.0 * b * L_l) ** 2))
            g = w_r * w_r * L_l / (R_r * R_r + (w_r * L_l) ** 2)
            main = max(y.real - g, 0.05 * abs(y))
        locked_i = n.locked_current_ratio * phase_i
        locked_R = n.locked_torque_ratio * n.torque * n.synchronous / (3.0 * locked_i * locked_i)
        locked_X = math.sqrt(max((phase_v / locked_i) ** 2 - (R_s + locked_R) ** 2, (0.1 * w_s * L_l) ** 2))
        hot = 1.0 + Parameters().stator.alpha * self.assumptions.rise
        return np.log([R_s / hot, R_r / hot, L_l, 1.0 / main, hot * locked_R / R_r, locked_X / (w_s * L_l)])

    def points(self, xp: Any, p: Any, at_breakdown: float) -> tuple[Steady, Steady, Steady]:
        """The circuit in rated running, at breakdown at the speed `at_breakdown` [rad/s], and with the rotor
        locked."""
        return (
            steady(xp, p, self.n.speed, T=self.warm),
            steady(xp, p, at_breakdown, T=self.warm),
            steady(xp, p, 0.0),
        )

    def relative(self, points: tuple[Steady, Steady, Steady]) -> dict[str, Any]:
        """Relative deviations of the circuit from the nameplate."""
        n, (rated, most, locked) = self.n, points
        current, torque = n.rated_current, n.torque
        return {
            "power": rated.tau / torque - 1.0,
            "current": rated.i / current - 1.0,
            "power_factor": rated.power_factor / n.power_factor - 1.0,
            "breakdown_ratio": most.tau / (n.breakdown_ratio * torque) - 1.0,
            "locked_torque_ratio": locked.tau / (n.locked_torque_ratio * torque) - 1.0,
            "locked_current_ratio": locked.i / (n.locked_current_ratio * current) - 1.0,
        }

    def _speed_at_breakdown(self, p: Parameters) -> float:
        return (1.0 - float(breakdown(p, T=self.warm).slip)) * self.n.synchronous

    def _at(self, x: Any) -> Any:
        """Weighted deviations with their slopes. The slopes leave the speed at breakdown constant: the torque is flat
        there."""
        if self._last is None or self._last[0] != x.tobytes():
            six = [math.exp(v) for v in x]
            seeds = [Dual(v, v * row) for v, row in zip(six, np.eye(6), strict=True)]
            speed = self._speed_at_breakdown(self.parameters(six))
            points = self.points(dual(MATH), self.parameters(seeds), speed)
            self._last = x.tobytes(), [_WEIGHTS[k] * r for k, r in self.relative(points).items()]
        return self._last[1]

    def deviations(self, x: Any) -> Any:
        """The weighted deviations, whose squares the fit minimises."""
        return np.array([value(r) for r in self._at(x)])

    def jacobian(self, x: Any) -> Any:
        """Slopes of `deviations`."""
        return np.array([slope(r) for r in self._at(x)])

    def identification(self, x: Any) -> Identification:
        """The motor with these logarithms, and with the thermal resistance for its temperature rise."""
        n, bare = self.n, self.parameters([math.exp(v) for v in x])
        rated, most, locked = points = self.points(MATH, bare, self._speed_at_breakdown(bare))
        residuals = self.relative(points)
        residuals["efficiency"] = rated.tau * n.speed / rated.supply_power / n.efficiency - 1.0
        R_th = self.assumptions.rise * InductionMotor.cooling(MATH, bare, n.speed) / rated.heat
        time_constant = self.assumptions.time_constant * (n.power / 1000.0) ** self.assumptions.growth
        thermal = {"stator.R_th": R_th, "stator.C": time_constant / R_th}
        p = InductionMotor.parameter_layout.from_names(thermal, bare)
        InductionMotor.check(p)
        return Identification(n, p, MappingProxyType(residuals), rated, most, locked)
