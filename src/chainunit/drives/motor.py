"""The common parts of all electric motors."""

from __future__ import annotations

import math
from collections.abc import Callable, Container, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from ..core.engines import MATH
from ..core.model import UNSTATED, Model
from ..core.ports import LoadState, Start, flanges, load_terminal
from ..core.quantities import Value, declaration, group, quantity
from .gearing import geared_motion

if TYPE_CHECKING:
    from .speed_control import Loop, Tuning

T_RATED = 293.15
"""Temperature at which resistances are given [K]."""


@declaration
class Ambient:
    """The surroundings."""

    T: Value = quantity(
        "K", "temperature, also the winding's at the start", default=T_RATED, min=200.0, max=500.0
    )


@declaration
class Rotor:
    """The rotor as a body."""

    J: Value = quantity("kg.m2", "inertia", default=0.0035, above=0.0)
    d: Value = quantity("N.m.s/rad", "viscous friction and windage", default=0.001, min=0.0, tunable=True)


@declaration
class GearOfMotor:
    """The gear between the rotor and its load."""

    loss: Value = quantity(
        "1",
        "loss by load, as a share of the torque that it passes on: 1/efficiency - 1",
        default=0.0,
        min=0.0,
        max=20.0,
    )


@declaration
class MotorParameters(Start):
    """Parameters of every motor."""

    rotor: Rotor = group(Rotor, "rotor", default=Rotor())
    gear: GearOfMotor = group(GearOfMotor, "gear", default=GearOfMotor())
    ambient: Ambient = group(Ambient, "surroundings", default=Ambient())


@declaration
class ShaftStates(LoadState):
    """States of the shaft, before those of each kind of motor."""

    phi: Value = quantity("rad", "rotor angle")
    w: Value = quantity("rad/s", "rotor speed", nominal=100.0)


@declaration
class MotorOutputs:
    """The common outputs of motors besides their states."""

    a: Value = quantity("rad/s2", "rotor acceleration", nominal=100.0)
    tau: Value = quantity("N.m", "torque given to the load at the shaft, after the loss of a gear")
    air_gap_tau: Value = quantity("N.m", "electromagnetic torque")
    supply_power: Value = quantity("W", "electric power taken", nominal=100.0)
    heat: Value = quantity("W", "copper losses", nominal=100.0)


class MotorPoint:
    """A motor at one state: each kind of motor computes the air-gap torque, which moves the shaft."""

    __slots__ = ("a", "air_gap", "tau")
    air_gap: Any
    heat: Any

    def turn(self, xp: Any, p: Any, u: Any, x: Any) -> None:
        """Compute the acceleration, and the torque given to the load."""
        driving = self.air_gap - p.rotor.d * x.w
        self.a, self.tau = geared_motion(xp, u.load, x.phi, x.w, p.rotor.J, driving, p.gear.loss)

    def warming(self, p: Any, winding: Any, T: Any, cooling: Any = 1.0) -> Any:
        """Rise of the temperature `T` [K] of a winding with the heat capacity `C` and the resistance `R_th` [K/s];
        see `Motor.cooling`."""
        return (self.heat - cooling * (T - p.ambient.T) / winding.R_th) / winding.C

    def outputs(self) -> dict[str, Any]:
        """The fields of `MotorOutputs` that follow from the motion of the shaft."""
        return {"a": self.a, "tau": self.tau, "air_gap_tau": self.air_gap}

    def rates(self, xp: Any, p: Any, u: Any, x: Any) -> list[Any]:
        """Time derivatives of the states after the derivatives of the shaft's states."""
        raise NotImplementedError


TERMINALS = (*flanges("outflow"), load_terminal("load."))
"""The terminals of every motor."""


def _follows(p: Any) -> bool:
    return True


def _current_limit(p: Any) -> float | None:
    return None


def _speed_loop(p: Any, inertia: float) -> Loop | None:
    return None


def _cooling(xp: Any, p: Any, w: Any) -> Any:
    return 1.0


def _tune(p: Any, inertia: float, fixed: Container[str] = ()) -> tuple[Any, Tuning | None]:
    return p, None


def _breakdown_speed(p: Any, T: float, *point: float) -> float:
    return 0.0


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Motor(Model):
    """A motor that owns the shaft: it has the states of `ShaftStates`, the outputs of `MotorOutputs`, and further
    ones of each kind of motor. `FOREIGN` is the motor of which only the terminals are known."""

    Point: Any = UNSTATED
    """The `MotorPoint` of the kind, called with xp, p, u, x."""
    current: str = ""
    """Output that is the current [A]."""
    temperature: str = ""
    """Output that is the temperature of the winding [K]."""
    winding: str = ""
    """Parameters that heat and cool the winding: among them `alpha` [1/K], `C` [J/K] and `R_th` [K/W]."""
    cooling: Callable[[Any, Any, Any], Any] = _cooling
    """Cooling (xp, p, w) at the speed w [rad/s], as a share of the cooling for which `R_th` holds."""
    limit: Callable[..., Any] = UNSTATED
    """Largest air-gap torque (xp, p, w) at the speed w [rad/s] that the supply allows in steady running [N m]."""
    control: str = "its own, which follows the speed asked for"
    """A text on how the speed of the motor is controlled, for one that `follows` the reference."""
    follows: Callable[[Any], bool] = _follows
    """Whether the motor with the parameters p follows the speed reference `w_ref`; else its speed follows from supply
    and load."""
    current_limit: Callable[[Any], float | None] = _current_limit
    """Largest current (p) of the converter [A]; None without such a limit."""
    tune: Callable[..., tuple[Any, Tuning | None]] = _tune
    """The parameters with the gains of the speed control tuned (p, inertia, fixed) to the total inertia at the shaft
    [kg m2], except the gains with names in `fixed`; and the tuning, None if all gains are fixed. An InputError
    refuses a motor of which no gains make a loop that is stable enough."""
    speed_loop: Callable[[Any, float], Loop | None] = _speed_loop
    """The linearised speed loop (p, inertia) at the total inertia at the shaft [kg m2]; None for a motor without
    one."""
    limited_by: Mapping[str, float] = field(default_factory=dict)
    """Outputs on which the largest torque at an instant depends, each with its resolution as a share of its largest
    value."""
    largest_torque: Callable[..., float] = UNSTATED
    """Largest air-gap torque [N m] that the motor can give at an instant (p, T, *point) with the winding at T [K];
    `point` are the values of `limited_by`. A speed among them is positive in the direction of the torque, negative if
    the torque brakes. The result is zero or negative if the motor can give no torque."""
    pull_out: Callable[..., float] = UNSTATED
    """Largest torque at the shaft [N m] while a load slows the motor down, from this point until it stalls;
    arguments as in `largest_torque`."""
    breakdown_speed: Callable[..., float] = _breakdown_speed
    """Speed of the shaft [rad/s] below which the torque falls with the speed: a load that slows the motor down to
    it stalls the motor. 0 for a motor without such a speed; arguments as in `largest_torque`."""

    def __post_init__(self) -> None:
        self.follow(terminals=TERMINALS, shared=self.Point, derivatives=self._rates)
        super().__post_init__()

    def _rates(self, xp: Any, p: Any, u: Any, x: Any) -> list[Any]:
        """Time derivatives of the states, in declared order."""
        s = self.shared(xp, p, u, x)
        return [s.tau * x.w, x.w, s.a, *s.rates(xp, p, u, x)]

    def settled_temperature(self, p: Any, heat: float, ran_at: float, w: float) -> float:
        """Steady temperature of the winding under a permanent duty [K].

        `heat` [W] is the mean loss of the duty in a run with the winding at `ran_at` [K], `w` [rad/s] its mean speed.
        The currents stay the same, and the loss grows with the resistance,

            T = T_a + R_th/cooling heat (1 + alpha (T - T_0))/(1 + alpha (ran_at - T_0)).

        Infinite where the loss grows faster than the cooling.
        """
        winding = getattr(p, self.winding)
        resistance = winding.R_th / self.cooling(MATH, p, w)
        gain = resistance * heat / (1.0 + winding.alpha * (ran_at - T_RATED))
        if gain * winding.alpha >= 1.0:
            return math.inf
        return float((p.ambient.T + gain * (1.0 - winding.alpha * T_RATED)) / (1.0 - gain * winding.alpha))


FOREIGN = Motor(name="FOREIGN", home=__name__, Parameters=None, Inputs=None)
"""A motor that is a foreign FMU: its parameters are None, and it has neither a speed loop nor known limits."""


def friction_time(xp: Any, rotor: Any) -> Any:
    """The time constant of the rotor with its own friction `d`, without load [s]; at most one second."""
    return 1.0 / xp.maximum(rotor.d / rotor.J, 1.0)
