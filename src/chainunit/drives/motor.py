"""What every electric motor shares."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

from ..engines import MATH
from ..model import Model
from ..quantities import Value, declaration, quantity

T_RATED = 293.15
"""Temperature at which resistances are given [K]."""


@declaration
class Ambient:
    """The surroundings."""

    T: Value = quantity(
        "K", "temperature, also the winding's at the start", default=T_RATED, min=200.0, max=500.0
    )


class Motor(Model):
    """A motor that owns the shaft: outputs `phi`, `w`, `a`, `tau`, `air_gap_tau`, `supply_power`, `heat`,
    `load_energy`, and the two that each kind calls its own."""

    current: ClassVar[str]
    """Output that is the current [A]."""
    temperature: ClassVar[str]
    """Output that is the temperature of the winding [K]."""
    winding: ClassVar[str]
    """Parameters that heat and cool the winding: among them `alpha` [1/K] and `R_th` [K/W]."""

    @staticmethod
    def cooling(xp: Any, p: Any, w: Any) -> Any:
        """Cooling at the speed `w` [rad/s], in parts of that for which `R_th` holds."""
        return 1.0

    @classmethod
    def settled_temperature(cls, p: Any, heat: float, ran_at: float, w: float) -> float:
        """Temperature [K] at which the winding comes to rest where a duty heats it for ever.

        `heat` [W] is the mean loss of the duty in a run with the winding at `ran_at` [K], `w` [rad/s] its mean speed.
        The currents stay as they are and the loss grows with the resistance,

            T = T_a + R_th/cooling heat (1 + alpha (T - T_0))/(1 + alpha (ran_at - T_0)).

        Infinite where the loss grows faster than the cooling.
        """
        winding = getattr(p, cls.winding)
        resistance = winding.R_th / cls.cooling(MATH, p, w)
        gain = resistance * heat / (1.0 + winding.alpha * (ran_at - T_RATED))
        if gain * winding.alpha >= 1.0:
            return math.inf
        return float((p.ambient.T + gain * (1.0 - winding.alpha * T_RATED)) / (1.0 - gain * winding.alpha))

    @staticmethod
    def limit(xp: Any, p: Any, w: Any) -> Any:
        """Largest air-gap torque at the speed `w` [rad/s] that the supply allows in steady running [N m]."""
        raise NotImplementedError

    limited_by: ClassVar[Mapping[str, float]]
    """Outputs that set the largest torque at an instant, each with its resolution in parts of its largest value."""

    @staticmethod
    def largest_torque(p: Any, T: float, *at: float) -> float:
        """Largest air-gap torque [N m] that the motor can give at an instant with the winding at `T` [K]; `at` are
        the values of `limited_by`. A speed among them is positive along the torque, negative where the torque brakes.
        Not positive where it can give none."""
        raise NotImplementedError

    @staticmethod
    def pull_out(p: Any, T: float, *at: float) -> float:
        """Largest torque at the shaft [N m] that a load meets which slows the motor down from there until it stalls;
        arguments as in `largest_torque`."""
        raise NotImplementedError


def braked(xp: Any, rotor: Any) -> Any:
    """The time constant of the rotor that its own friction `d` brakes, without any load [s]; at most a second."""
    return 1.0 / xp.maximum(rotor.d / rotor.J, 1.0)
