"""A third type of motor, which is no part of the package: a servo motor whose current follows its reference at once.

i = the limit of kp (w_ref - w) + x        dx/dt = ki (w_ref - w), led back where the limit cuts
(J_rotor + J_load) a = k i - d w - tau_load
C dT/dt = R(T) i^2 - (T - T_ambient)/R_th
"""

from __future__ import annotations

from chainunit.core.model import Part
from chainunit.core.ports import LoadInput
from chainunit.core.quantities import Value, declaration, group, quantity
from chainunit.drives.motor import (
    T_RATED,
    Motor,
    MotorOutputs,
    MotorParameters,
    MotorPoint,
    ShaftStates,
    friction_time,
)
from chainunit.drives.speed_control import Tuning


@declaration
class Coil:
    R: Value = quantity("Ohm", "resistance at 20 degC", default=2.0, above=0.0)
    k: Value = quantity("N.m/A", "torque constant", default=1.0, above=0.0)
    alpha: Value = quantity("1/K", "rise of resistance with temperature", default=0.00393, min=0.0)
    C: Value = quantity("J/K", "heat capacity", default=2000.0, above=0.0)
    R_th: Value = quantity("K/W", "thermal resistance to the surroundings", default=0.5, above=0.0)


@declaration
class ServoControl:
    kp: Value = quantity("A.s/rad", "proportional gain", default=0.1, above=0.0)
    ki: Value = quantity("A/rad", "integral gain", default=0.5, above=0.0)
    i: Value = quantity("A", "largest current", default=12.0, above=0.0)


@declaration
class Parameters(MotorParameters):
    coil: Coil = group(Coil, "winding", default=Coil())
    control: ServoControl = group(ServoControl, "control", default=ServoControl())


@declaration
class Inputs(LoadInput):
    w_ref: Value = quantity("rad/s", "speed reference", default=0.0)


@declaration
class States(ShaftStates):
    T: Value = quantity("K", "winding temperature", nominal=300.0)
    integral: Value = quantity("A", "integral part of the current")


@declaration
class Outputs(MotorOutputs):
    i: Value = quantity("A", "current")


class ServoPoint(MotorPoint):
    def __init__(self, xp, p, u, x):
        self.error = u.w_ref - x.w
        reference = p.control.kp * self.error + x.integral
        self.i = xp.maximum(xp.minimum(reference, p.control.i), -p.control.i)
        self.cut = self.i - reference
        self.heat = p.coil.R * (1.0 + p.coil.alpha * (x.T - T_RATED)) * self.i * self.i
        self.air_gap = p.coil.k * self.i
        self.turn(xp, p, u, x)

    def rates(self, xp, p, u, x):
        return [
            self.warming(p, p.coil, x.T),
            p.control.ki * (self.error + self.cut / p.control.kp),
        ]


def _outputs(xp, p, u, x, s):
    return Outputs(**s.outputs(), i=s.i, heat=s.heat, supply_power=s.heat + s.air_gap * x.w)


def _current_limit(p):
    return p.control.i


def _tune(p, inertia, fixed=()):
    kp = 20.0 * inertia / p.coil.k
    gains = {"control.kp": kp, "control.ki": 4.0 * kp}
    gains = {name: gain for name, gain in gains.items() if name not in fixed}
    tuned = ServoMotor.parameter_layout.from_names(gains, p)
    return tuned, Tuning(gains, 78.0, 20.0) if gains else None


def _torque_limit(xp, p, w):
    return p.coil.k * p.control.i + 0.0 * w


def _largest_torque(p, T, *at):
    return p.coil.k * p.control.i


def _internal_step(xp, p):
    return xp.minimum(2.5e-4, friction_time(xp, p.rotor))


def _initial_states(xp, p):
    return States(phi=p.phi_start, w=p.w_start, T=p.ambient.T, integral=0.0, load_energy=0.0)


ServoMotor = Motor(
    name="ServoMotor",
    text="A servo motor.",
    description=(
        "Servo motor with PI speed control, current limit and winding temperature; takes a load port"
    ),
    Parameters=Parameters,
    Inputs=Inputs,
    States=States,
    Point=ServoPoint,
    current="i",
    temperature="T",
    winding="coil",
    limited_by={"w": 1e-9},
    control="the gains of the servo drive are given",
    parts=(Part(Outputs, _outputs),),
    current_limit=_current_limit,
    tune=_tune,
    limit=_torque_limit,
    largest_torque=_largest_torque,
    pull_out=_largest_torque,
    internal_step=_internal_step,
    initial_states=_initial_states,
)
