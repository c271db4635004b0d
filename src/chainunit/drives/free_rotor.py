"""A motor that is switched off: its rotor turns with the machine, without current and torque in the air gap."""

from __future__ import annotations

from typing import Any

from ..core.model import Part
from ..core.ports import LoadInput
from ..core.quantities import declaration
from .motor import Motor, MotorOutputs, MotorParameters, MotorPoint, ShaftStates, friction_time


@declaration
class Parameters(MotorParameters):
    """Parameters of the rotor."""


@declaration
class Inputs(LoadInput):
    """The load."""


@declaration
class States(ShaftStates):
    """States of the shaft."""


@declaration
class Outputs(MotorOutputs):
    """The motion; electric quantities are zero."""


class FreeRotorPoint(MotorPoint):
    """The rotor at one state."""

    __slots__ = ("heat",)

    def __init__(self, xp: Any, p: Any, u: Any, x: Any) -> None:
        self.air_gap, self.heat = 0.0, 0.0
        self.turn(xp, p, u, x)

    def rates(self, xp: Any, p: Any, u: Any, x: Any) -> list[Any]:
        """None beside the states of the shaft."""
        return []


def _outputs(xp: Any, p: Any, u: Any, x: Any, s: FreeRotorPoint) -> Outputs:
    return Outputs(**s.outputs(), supply_power=0.0, heat=0.0)


def _follows(p: Any) -> bool:
    """It follows no reference."""
    return False


def _internal_step(xp: Any, p: Any) -> Any:
    """As long as the rotor with its friction alone permits, at most 2 ms."""
    return xp.minimum(2e-3, friction_time(xp, p.rotor))


def _initial_states(xp: Any, p: Any) -> Any:
    """The start angle and speed."""
    return States(phi=p.phi_start, w=p.w_start, load_energy=0.0)


FreeRotor = Motor(
    name="FreeRotor",
    text="The rotor of a motor without supply, which owns the shaft and takes the machine's load port.",
    description="Rotor of a motor that is switched off; takes a load port",
    Parameters=Parameters,
    Inputs=Inputs,
    States=States,
    Point=FreeRotorPoint,
    current="",
    temperature="",
    parts=(Part(Outputs, _outputs),),
    follows=_follows,
    internal_step=_internal_step,
    initial_states=_initial_states,
)
