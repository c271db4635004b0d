"""The machine as sizing programs of drive makers take it: a torque over the turn, and one inertia.

Such a program knows no crank. It takes the inertia of the load as one number J, and the torque of the load as a
function of the angle, or of the time at constant speed. The twin of a machine does so. Its torque is

    tau = J a + T(phi, w),     T = V' + losses/w + J(phi)'/2 w_B^2,

while that of the machine is tau = J(phi) a + J(phi)'/2 w^2 + V' + losses/w (docs/physics.md, Torque, twice), with the
same weights, springs, processing and friction. The speed w_B is an input, 0 by default:

- with w_B = 0 the torque of the load is without terms of inertia, as one gets it from a hand calculation or from a
  machine that is turned slowly;
- with w_B at the speed of running it has the terms of inertia at constant speed, as one gets it from a calculation of
  the motion at constant speed.

Both are machines: a wheel of the inertia J in a field of forces whose potential is V + J(phi) w_B^2/2, so that the
energy balance closes as for any machine. The second one differs from the machine by the product of the changes of
inertia and speed alone: the derivative of (J(phi) - J)(w^2 - w_B^2)/2 by the angle.
"""

from __future__ import annotations

import copy
import dataclasses
from functools import cache
from typing import Any

from ...core.engines import slope
from ...core.model import Making, Part, keep
from ...core.ports import PortSlopes
from ...core.quantities import Value, declaration, declared_class, quantity
from ...groups.body import reflected_inertia
from ...machines.machine import Machine
from ...mechanism.machine import LiftedMechanism, MachineState, bodies_on
from ...mechanism.models import InverseMachine, slopes

INERTIA, SPEED = "fixed_inertia", "inertia_speed"
"""The parameter of a twin with its inertia, and its input with the speed of the terms of inertia."""


@declaration
class FixedInertia:
    """The inertia of a twin."""

    fixed_inertia: Value = quantity(
        "kg.m2", "inertia of the machine at the crank, one number", default=1.0, min=0.0
    )


@declaration
class InertiaSpeed:
    """The speed of the terms of inertia."""

    inertia_speed: Value = quantity(
        "rad/s",
        "speed of the crank to which the terms of inertia in the torque belong; 0: without them",
        default=0.0,
    )


def twin(machine: Machine, inertia: float) -> Machine:
    """The twin of a machine, with that `inertia` at the crank [kg m2]."""
    other = copy.copy(machine)
    other.model = twin_model(machine.model)
    layout = other.model.parameter_layout
    other.p = other.model.check(layout.from_names({**machine.by_name, INERTIA: inertia}))
    return other


@cache
def twin_model(machine: type[InverseMachine]) -> type[InverseMachine]:
    """The model of the twin of a machine, with its parameters, inputs and outputs, `FixedInertia` and
    `InertiaSpeed`."""

    def outputs(xp: Any, p: Any, u: Any, x: Any, s: MachineState) -> Any:
        out = machine.parts[0].equations(xp, p, u, x, s)
        i = p.ratio
        J = p.fixed_inertia / (i * i)
        bias = out.tau_bias + 0.5 * out.dJ_dphi * _squares(p, u)
        tau, of_turn = J * u.a + bias, u.inertia_speed * u.inertia_speed
        return dataclasses.replace(
            out,
            tau=tau,
            tau_bias=bias,
            J=J,
            dJ_dphi=0.0 * out.dJ_dphi,
            power=tau * u.w,
            kinetic_energy=0.5 * J * (u.w * u.w),
            potential_energy=out.potential_energy + 0.5 * s.J * of_turn,
        )

    def port_slopes(xp: Any, p: Any, u: Any, x: Any, s: MachineState) -> PortSlopes:
        out, i = slopes(xp, p, u, x, s), p.ratio
        second = _second(s) / (i * i * i * i)
        return dataclasses.replace(
            out,
            tau_bias_dphi=out.tau_bias_dphi + 0.5 * second * _squares(p, u),
            tau_bias_dw=out.tau_bias_dw - s.inertia_slope / (i * i * i) * u.w,
        )

    members = {
        "__doc__": f"The twin of {machine.__name__} with one inertia.",
        "__module__": __name__,
        "name": f"{machine.name}OneInertia",
        "description": f"{machine.name} with one inertia",
        "made": Making(twin_model, (machine,)),
        "Parameters": declared_class("Parameters", (machine.Parameters, FixedInertia)),
        "Inputs": declared_class("Inputs", (machine.Inputs, InertiaSpeed)),
        "Feed": machine.Feed,
        "parts": (
            Part(machine.Outputs, outputs),
            Part(machine.driver_port.slopes, port_slopes),
        ),
    }
    model: type[InverseMachine] = type(f"{machine.__name__}OneInertia", (machine,), members)
    keep(model, "Parameters", "Inputs")
    return model


def _squares(p: Any, u: Any) -> Any:
    """The square of the speed w_B less that of the motor's shaft [rad2/s2], both at that shaft."""
    at_motor = u.inertia_speed * p.ratio
    return at_motor * at_motor - u.w * u.w


def _second(s: MachineState) -> Any:
    """The second derivative of the inertia by the crank angle [kg m2/rad2]."""
    links, pins = s.m.third_derivatives()
    bodies = bodies_on(LiftedMechanism(s.m, links, pins).links, s.m.linkage)
    _, by_angle = reflected_inertia(bodies.values())
    return slope(by_angle)
