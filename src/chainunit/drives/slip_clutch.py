"""A friction clutch between a motor and its load that slips at its setting and passes this torque on while it slips.

The torque of dry friction, setting * sign(slip), is smoothed:

    tau = setting * s/sqrt(s^2 + w_smooth^2),    s = w_motor - w_driven

Below the setting the clutch therefore creeps by about w_smooth tau/setting, where a real one sticks.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import Any

from ..core.model import Model, Part
from ..core.ports import (
    PortSlopes,
    PortValues,
    ShaftInput,
    Start,
    line_terminals,
    shaft_motion,
)
from ..core.quantities import Value, declaration, group, quantity
from .driveline import Driven, DrivenState, States


@declaration
class Parameters(Start):
    """Parameters of the clutch."""

    setting: Value = quantity("N.m", "torque at which it slips", default=10.0, above=0.0)
    w_smooth: Value = quantity(
        "rad/s", "slip below which the smoothed torque falls well below the setting", default=0.2, above=0.0
    )


@declaration
class Outputs(PortSlopes, PortValues):
    """The port at the motor, the driven shaft, and the heat of the slip."""

    tau: Value = quantity("N.m", "torque that the motor has to give", nominal=100.0)
    slip: Value = quantity("rad/s", "speed of the motor less that of the driven shaft", nominal=100.0)
    driven: Driven = group(Driven, "driven shaft")
    power: Value = quantity("W", "power that the motor gives", nominal=100.0)
    dissipated_power: Value = quantity("W", "power that the slip turns into heat", nominal=100.0)


class _Friction:
    """The clutch at one state."""

    __slots__ = ("a", "by_slip", "slip", "tau", "tau_load")

    def __init__(self, xp: Any, p: Any, u: Any, x: Any) -> None:
        self.slip = u.w - x.driven.w
        small2 = p.w_smooth * p.w_smooth
        size2 = self.slip * self.slip + small2
        self.tau = p.setting * self.slip / xp.sqrt(size2)
        self.by_slip = p.setting * small2 / (size2 * xp.sqrt(size2))
        self.a, self.tau_load = shaft_motion(u.load, x.driven.phi, x.driven.w, 0.0, self.tau)


def _outputs(xp: Any, p: Any, u: Any, x: Any, s: _Friction) -> Outputs:
    """The outputs at both ends: the load port of the motor without inertia, the slip, and the driven end."""
    none = 0.0 * s.tau
    return Outputs(
        tau_bias=s.tau,
        J=none,
        dJ_dphi=none,
        phi0=u.phi,
        w0=u.w,
        tau_bias_dphi=none,
        tau_bias_dw=s.by_slip,
        tau=s.tau,
        slip=s.slip,
        driven=Driven(a=s.a, tau=s.tau_load),
        power=s.tau * u.w,
        dissipated_power=s.tau * s.slip,
    )


def _internal_step(xp: Any, p: Any) -> Any:
    """A tenth of a millisecond: the inertia behind the clutch, which decides, is not known here."""
    return 1e-4


def _initial_states(xp: Any, p: Any) -> Any:
    """The driven shaft in the motion of the motor's shaft."""
    return States(driven=DrivenState(phi=p.phi_start, w=p.w_start), load_energy=0.0)


def _rates(xp: Any, p: Any, u: Any, x: Any) -> list[Any]:
    """Time derivatives of the states, in declared order."""
    s = _Friction(xp, p, u, x)
    return [s.tau_load * x.driven.w, x.driven.w, s.a]


SlipClutch = Model(
    name="SlipClutch",
    text="A friction clutch without inertia of its own between a motor and its load.",
    description=(
        "Friction clutch that slips at its setting: takes a load port and shows one, owns the driven shaft"
    ),
    Parameters=Parameters,
    Inputs=ShaftInput,
    States=States,
    terminals=line_terminals(),
    input_rates=MappingProxyType({"phi": "w", "w": "a"}),
    parts=(Part(Outputs, _outputs),),
    internal_step=_internal_step,
    initial_states=_initial_states,
    shared=_Friction,
    derivatives=_rates,
)
