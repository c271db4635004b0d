"""A separately excited DC motor with cascaded PI control.

`i` armature current, `v` armature voltage, `k` torque constant (N m/A, the same number in V s/rad), `R`
and `L` armature resistance and inductance, `w` rotor speed, `T` winding temperature.

    L di/dt = v - R(T) i - k w          R(T) = R (1 + alpha (T - 293.15 K))
    (J_rotor + J_load) a = k i - d w - tau_load
    C dT/dt = R(T) i^2 - (T - T_ambient)/R_th

`tau_ff` is a feed-forward torque, such as the load at the machine's angle from a model in the controller.

The load is the linearised load of the port (see `chainunit.core.ports`): the motor solves for the acceleration. The
speed controller gives a current reference, limited to the current limit. The current controller gives a voltage,
limited to that of the supply. Back-calculation keeps the integrators from winding up at a limit.
"""

from __future__ import annotations

import math
from collections.abc import Container, Iterator
from typing import TYPE_CHECKING, Any

from ..core.engines import MATH
from ..core.model import Part, Requirement
from ..core.ports import LoadInput, measured_terminal
from ..core.quantities import Value, declaration, group, quantity
from .motor import (
    T_RATED,
    TERMINALS,
    Motor,
    MotorOutputs,
    MotorParameters,
    MotorPoint,
    ShaftStates,
    friction_time,
)

if TYPE_CHECKING:
    from .speed_control import Loop, Tuning


@declaration
class Armature:
    """The winding."""

    R: Value = quantity("Ohm", "resistance at 20 degC", default=9.5, above=0.0, tunable=True)
    L: Value = quantity("H", "inductance", default=0.11, above=0.0)
    k: Value = quantity(
        "N.m/A", "torque constant, also the back-EMF constant in V.s/rad", default=1.27, above=0.0
    )
    alpha: Value = quantity(
        "1/K", "rise of the resistance with temperature", default=0.00393, min=0.0, tunable=True
    )
    C: Value = quantity("J/K", "heat capacity", default=2000.0, above=0.0)
    R_th: Value = quantity(
        "K/W", "thermal resistance to the surroundings", default=0.9, above=0.0, tunable=True
    )


@declaration
class Limit:
    """The limits of the converter."""

    i: Value = quantity("A", "largest armature current", default=4.4, above=0.0, tunable=True)
    v: Value = quantity("V", "largest armature voltage", default=240.0, above=0.0, tunable=True)


@declaration
class SpeedControl:
    """Speed to current reference."""

    kp: Value = quantity("A.s/rad", "proportional gain", default=0.1017, above=0.0, tunable=True)
    ki: Value = quantity("A/rad", "integral gain", default=0.6102, min=0.0, tunable=True)


@declaration
class CurrentControl:
    """Current to voltage, in addition to the feed-forward of the back-EMF."""

    kp: Value = quantity("Ohm", "proportional gain", default=33.0, above=0.0, tunable=True)
    ki: Value = quantity("Ohm/s", "integral gain", default=2850.0, min=0.0, tunable=True)


@declaration
class Parameters(MotorParameters):
    """Parameters of the motor. The start values are a typical 0.37 kW, 1500 rev/min, 220 V machine."""

    armature: Armature = group(Armature, "armature", default=Armature())
    limit: Limit = group(Limit, "limit", default=Limit())
    speed_control: SpeedControl = group(SpeedControl, "speed control", default=SpeedControl())
    current_control: CurrentControl = group(CurrentControl, "current control", default=CurrentControl())


@declaration
class Inputs(LoadInput):
    """The load and the references of the motor."""

    w_ref: Value = quantity("rad/s", "speed reference", default=0.0)
    tau_ff: Value = quantity("N.m", "feed-forward torque of the speed control", default=0.0)


@declaration
class ArmatureState:
    """State of the winding."""

    i: Value = quantity("A", "armature current")
    T: Value = quantity("K", "winding temperature", nominal=300.0)


@declaration
class Integral:
    """An integrator of the control."""

    i: Value = quantity("A", "integral part of the current reference")
    v: Value = quantity("V", "integral part of the voltage", nominal=100.0)


@declaration
class States(ShaftStates):
    """States of the motor; each is an output, too."""

    armature: ArmatureState = group(ArmatureState, "armature")
    integral: Integral = group(Integral, "control")


@declaration
class Outputs(MotorOutputs):
    """Quantities that follow from the states."""

    i_ref: Value = quantity("A", "current reference after the limit")
    v: Value = quantity("V", "armature voltage", nominal=100.0)


class DcMotorPoint(MotorPoint):
    """The motor at one state: control, electric circuit, shaft."""

    __slots__ = ("R", "cut_i", "cut_v", "di", "error_i", "error_w", "heat", "i_ref", "v")

    def __init__(self, xp: Any, p: Any, u: Any, x: Any) -> None:
        arm, i, w = p.armature, x.armature.i, x.w
        self.error_w = u.w_ref - w
        wanted_i = p.speed_control.kp * self.error_w + x.integral.i + u.tau_ff / arm.k
        self.i_ref = xp.maximum(xp.minimum(wanted_i, p.limit.i), -p.limit.i)
        self.cut_i = self.i_ref - wanted_i
        self.error_i = self.i_ref - i
        wanted_v = p.current_control.kp * self.error_i + x.integral.v + arm.k * w
        self.v = xp.maximum(xp.minimum(wanted_v, p.limit.v), -p.limit.v)
        self.cut_v = self.v - wanted_v
        self.R = arm.R * (1.0 + arm.alpha * (x.armature.T - T_RATED))
        self.di = (self.v - self.R * i - arm.k * w) / arm.L
        self.heat = self.R * i * i
        self.air_gap = arm.k * i
        self.turn(xp, p, u, x)

    def rates(self, xp: Any, p: Any, u: Any, x: Any) -> list[Any]:
        """Time derivatives of the states after the derivatives of the shaft's states."""
        speed, current = p.speed_control, p.current_control
        return [
            self.di,
            self.warming(p, p.armature, x.armature.T),
            speed.ki * (self.error_w + self.cut_i / speed.kp),
            current.ki * (self.error_i + self.cut_v / current.kp),
        ]


def _outputs(xp: Any, p: Any, u: Any, x: Any, s: DcMotorPoint) -> Outputs:
    return Outputs(**s.outputs(), i_ref=s.i_ref, v=s.v, supply_power=s.v * x.armature.i, heat=s.heat)


def _current_limit(p: Any) -> float | None:
    """The current limit of the converter."""
    return float(p.limit.i)


def _tune(p: Any, inertia: float, fixed: Container[str] = ()) -> tuple[Any, Tuning | None]:
    """The parameters with tuned gains at a total `inertia` at the shaft [kg m2]; gains in `fixed` stay."""
    from .speed_control import tune

    tuning = tune(p.armature, inertia)
    gains = {name: gain for name, gain in tuning.parameters.items() if name not in fixed}
    return DcMotor.parameter_layout.from_names(gains, p), tuning if gains else None


def _speed_loop(p: Any, inertia: float) -> Loop | None:
    """The loop of the speed control at a total `inertia` at the shaft [kg m2]."""
    from .speed_control import loop

    return loop(p, inertia)


def _torque_limit(xp: Any, p: Any, w: Any, T: float = T_RATED) -> Any:
    """The torque at the current limit, or at the voltage limit with the winding at `T` [K], by default cold."""
    arm = p.armature
    R = arm.R * (1.0 + arm.alpha * (T - T_RATED))
    return arm.k * xp.minimum(p.limit.i, (p.limit.v - arm.k * w) / R)


def _largest_torque(p: Any, T: float, *point: float) -> float:
    """The torque at the current limit, or at the voltage limit at this speed."""
    (w,) = point
    return float(_torque_limit(MATH, p, w, T))


def _pull_out(p: Any, T: float, *point: float) -> float:
    """The torque at standstill, without friction and back-EMF."""
    return float(_torque_limit(MATH, p, 0.0, T))


def _limits(xp: Any, p: Any) -> Iterator[tuple[Any, Any, Any]]:
    """The limit of the inductance: no time constant of the armature below 1 microsecond."""
    yield p.armature.L, 1e-6 * (p.armature.R + p.current_control.kp), math.inf


def _internal_step(xp: Any, p: Any) -> Any:
    """The least of a quarter of the time constant of the closed current loop, which is usually the fastest part,
    the time constant of the rotor with its friction alone, and 0.25 ms. The Runge-Kutta method is stable up to
    2.8 time constants, which leaves a reserve for a winding that heats up."""
    by_current = 0.25 * p.armature.L / (p.armature.R + p.current_control.kp)
    return xp.minimum(xp.minimum(2.5e-4, by_current), friction_time(xp, p.rotor))


def _initial_states(xp: Any, p: Any) -> Any:
    """The states without current, at the start angle and speed, with the winding at ambient temperature."""
    return States(
        phi=p.phi_start,
        w=p.w_start,
        armature=ArmatureState(i=0.0, T=p.ambient.T),
        integral=Integral(i=0.0, v=0.0),
        load_energy=0.0,
    )


DcMotor = Motor(
    name="DcMotor",
    text="A DC motor under speed control that owns the shaft and takes the machine's load port.",
    description=(
        "DC motor with cascaded PI control, current limit and winding temperature; takes a load port"
    ),
    Parameters=Parameters,
    Inputs=Inputs,
    States=States,
    Point=DcMotorPoint,
    current="armature.i",
    temperature="armature.T",
    winding="armature",
    terminals=(*TERMINALS, measured_terminal(current="armature.i", power="supply_power")),
    limited_by={"w": 1e-9},
    required=(
        Requirement(
            "armature.L",
            "H",
            "the current changes faster than the internal integrator can follow",
            ("armature.R", "current_control.kp"),
        ),
    ),
    control="all gains are given",
    parts=(Part(Outputs, _outputs),),
    current_limit=_current_limit,
    tune=_tune,
    speed_loop=_speed_loop,
    limit=_torque_limit,
    largest_torque=_largest_torque,
    pull_out=_pull_out,
    requirements=_limits,
    internal_step=_internal_step,
    initial_states=_initial_states,
)
