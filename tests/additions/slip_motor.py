"""A motor on the line whose torque falls straight with the speed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from ..model import Part
from ..ports import LoadInput
from ..quantities import Value, declaration, group, quantity
from .motor import Motor, MotorOutputs, MotorParameters, MotorPoint, ShaftStates, friction_time


@declaration
class Slip:
    """The straight line of torque over speed, and the winding."""

    w: Value = quantity("rad/s", "speed without load", default=157.0, above=0.0)
    rise: Value = quantity("N.m.s/rad", "torque per speed that is lost", default=3.0, above=0.0)
    current_per_torque: Value = quantity("A/(N.m)", "current per torque", default=0.3, above=0.0)
    R: Value = quantity("Ohm", "resistance of the winding", default=2.0, above=0.0)
    alpha: Value = quantity("1/K", "rise of the resistance with temperature", default=0.0039, min=0.0)
    C: Value = quantity("J/K", "heat capacity", default=5000.0, above=0.0)
    R_th: Value = quantity("K/W", "thermal resistance to the surroundings", default=0.1, above=0.0)


@declaration
class Parameters(MotorParameters):
    """Parameters of the motor."""

    slip: Slip = group(Slip, "slip", default=Slip())


@declaration
class Inputs(LoadInput):
    """The load."""


@declaration
class States(ShaftStates):
    """Shaft and winding."""

    T: Value = quantity("K", "temperature of the winding", nominal=300.0)


@declaration
class Outputs(MotorOutputs):
    """Quantities that follow from the states."""

    i: Value = quantity("A", "current")


class _Point(MotorPoint):
    __slots__ = ("heat", "i")

    def __init__(self, xp: Any, p: Any, u: Any, x: Any) -> None:
        self.air_gap = p.slip.rise * (p.slip.w - x.w)
        self.i = p.slip.current_per_torque * self.air_gap
        self.heat = p.slip.R * self.i * self.i
        self.turn(p, u, x)

    def rates(self, xp: Any, p: Any, u: Any, x: Any) -> list[Any]:
        return [(self.heat - (x.T - p.ambient.T) / p.slip.R_th) / p.slip.C]


def _outputs(xp: Any, p: Any, u: Any, x: Any, s: _Point) -> Outputs:
    return Outputs(**s.outputs(), i=s.i, heat=s.heat, supply_power=s.air_gap * x.w + s.heat)


class SlipMotor(Motor):
    """A motor whose torque falls straight with the speed."""

    name = "SlipMotor"
    description = "Motor whose torque falls straight with the speed; takes a load port"
    Parameters = Parameters
    Inputs = Inputs
    States = States
    Point = _Point
    current, temperature, winding = "i", "T", "slip"
    limited_by: ClassVar[Mapping[str, float]] = {"w": 1e-6}
    parts = (Part(Outputs, _outputs),)

    @staticmethod
    def follows(p: Any) -> bool:
        """It takes the speed that the load gives."""
        return False

    @staticmethod
    def limit(xp: Any, p: Any, w: Any) -> Any:
        """The straight line."""
        return p.slip.rise * (p.slip.w - w)

    @staticmethod
    def largest_torque(p: Any, T: float, *at: float) -> float:
        """That of standstill."""
        return float(p.slip.rise * p.slip.w)

    @staticmethod
    def pull_out(p: Any, T: float, *at: float) -> float:
        """That of standstill."""
        return float(p.slip.rise * p.slip.w)

    @staticmethod
    def internal_step(xp: Any, p: Any) -> Any:
        """A quarter of the time constant of the rotor alone, at most a quarter of a millisecond."""
        return xp.minimum(xp.minimum(2.5e-4, 0.25 * p.rotor.J / p.slip.rise), friction_time(xp, p.rotor))

    @staticmethod
    def initial_states(xp: Any, p: Any) -> Any:
        """At the start angle and speed, cold."""
        return States(phi=p.phi_start, w=p.w_start, load_energy=0.0, T=p.ambient.T)
