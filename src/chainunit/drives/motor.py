"""What every electric motor shares."""

from __future__ import annotations

from typing import Any, ClassVar

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

    @staticmethod
    def limit(xp: Any, p: Any, w: Any) -> Any:
        """Largest air-gap torque at the speed `w` [rad/s] that the supply allows in steady running [N m]."""
        raise NotImplementedError

    @staticmethod
    def largest_torque(p: Any) -> float:
        """Largest steady air-gap torque at any speed [N m]."""
        raise NotImplementedError
