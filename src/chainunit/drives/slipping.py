"""Parts between motor and machine that slip: their driven shaft has a speed of its own, which the torque at the slip
drives. A law gives this torque by both speeds:

    tau, passed = law(xp, p, w, w_driven)
    J a_driven = passed - gear.d w_driven - load - gear.loss |load| sign(w_driven)

`tau` is taken from the motor's shaft, `passed` is given to the driven one; what is between both powers is heat. The
gear behind the part turns with the driven shaft, so that it takes nothing while this shaft stands.

The port has the inertia on the motor's side alone. Its slope by the angle is taken along the motion, as that of
`chainunit.drives.driveline`.
"""

from __future__ import annotations

from collections.abc import Callable
from types import MappingProxyType
from typing import Any

from ..core.engines import Dual, dual, slope
from ..core.model import Model, Part
from ..core.ports import PortSlopes, PortValues, ShaftInput, Start, line_terminals
from ..core.quantities import Value, declaration, group, quantity
from .driveline import W_SMALL, Driven, DrivenState, States
from .gearing import geared_motion, lost_torque
from .motor import GearOfMotor

Law = Callable[[Any, Any, Any, Any], tuple[Any, Any]]
"""Torques [N m] taken from the motor's shaft and given to the driven one, by (xp, p) and both speeds [rad/s]."""


@declaration
class GearBehind(GearOfMotor):
    """The gear that the driven shaft turns."""

    d: Value = quantity("N.m.s/rad", "drag of the gear, at the driven shaft", default=0.0, min=0.0)


@declaration
class Slipping(Start):
    """Parameters that every such part has beside those of its law."""

    gear: GearBehind = group(GearBehind, "gear behind it", default=GearBehind())


@declaration
class SlipOutputs(PortSlopes, PortValues):
    """The port at the motor, the driven shaft, and the heat."""

    tau: Value = quantity("N.m", "torque that the motor has to give", nominal=100.0)
    slip: Value = quantity(
        "rad/s", "speed of the motor less that of the driven shaft, at the motor", nominal=100.0
    )
    driven: Driven = group(Driven, "driven shaft")
    power: Value = quantity("W", "power that the motor gives", nominal=100.0)
    kinetic_energy: Value = quantity("J", "kinetic energy of both sides", nominal=100.0)
    potential_energy: Value = quantity("J", "potential energy, which is none")
    dissipated_power: Value = quantity("W", "power that turns into heat, with the gear's", nominal=100.0)
    gear_loss: Value = quantity("W", "power that the gear behind it loses", nominal=100.0)


def slipping(law: Law, ratio: Callable[[Any], Any], parameters: type, *parts: Part, **more: Any) -> Model:
    """The model of a part by its `law`.

    Parameters
    ----------
    ratio : turns of the motor's shaft per turn of the driven one, by the parameters
    parameters : declaration with `Slipping`, and with the inertias ``J_motor`` and ``J_driven`` of both sides [kg m2]
    parts : outputs beside `SlipOutputs`
    more : further fields of `Model`
    """

    class SlipPoint:
        """The part between a motor at ``u.w`` and the states."""

        __slots__ = ("a", "by_speed", "heat", "held", "load", "lost", "tau")

        def __init__(self, xp: Any, p: Any, u: Any, x: Any) -> None:
            w, driven = u.w, x.driven.w
            self.tau, passed = law(xp, p, w, driven)
            drag = p.gear.d * driven
            self.a, self.load = geared_motion(
                xp, u.load, x.driven.phi, driven, p.J_driven, passed - drag, p.gear.loss
            )
            self.lost = (lost_torque(xp, p.gear.loss, self.load, driven) + drag) * driven
            self.heat = self.tau * w - passed * driven + self.lost
            engine = dual(xp)
            self.by_speed = slope(law(engine, p, Dual(w, 1.0), driven)[0])
            self.held = slope(law(engine, p, w, Dual(driven, self.a))[0])

    def outputs(xp: Any, p: Any, u: Any, x: Any, s: SlipPoint) -> SlipOutputs:
        """The load port of the motor, the slip, the driven shaft, and the heat."""
        tau, w2 = s.tau + p.J_motor * u.a, u.w * u.w
        small2 = W_SMALL * W_SMALL
        return SlipOutputs(
            tau_bias=s.tau,
            J=p.J_motor + 0.0 * tau,
            dJ_dphi=0.0 * tau,
            phi0=u.phi,
            w0=u.w,
            tau_bias_dphi=s.held * u.w * w2 / (w2 * w2 + small2 * small2),
            tau_bias_dw=s.by_speed,
            tau=tau,
            slip=u.w - ratio(p) * x.driven.w,
            driven=Driven(a=s.a, tau=s.load),
            power=tau * u.w,
            kinetic_energy=0.5 * (p.J_motor * w2 + p.J_driven * x.driven.w * x.driven.w),
            potential_energy=0.0 * tau,
            dissipated_power=s.heat,
            gear_loss=s.lost,
        )

    def initial_states(xp: Any, p: Any) -> Any:
        """Both shafts without slip."""
        start = DrivenState(phi=p.phi_start / ratio(p), w=p.w_start / ratio(p))
        return States(driven=start, load_energy=0.0)

    def rates(xp: Any, p: Any, u: Any, x: Any) -> list[Any]:
        """Time derivatives of the states, in declared order."""
        s = SlipPoint(xp, p, u, x)
        return [s.load * x.driven.w, x.driven.w, s.a]

    return Model(
        Parameters=parameters,
        Inputs=ShaftInput,
        States=States,
        terminals=line_terminals(),
        input_rates=MappingProxyType({"phi": "w", "w": "a"}),
        parts=(Part(SlipOutputs, outputs), *parts),
        initial_states=initial_states,
        shared=SlipPoint,
        derivatives=rates,
        **more,
    )
