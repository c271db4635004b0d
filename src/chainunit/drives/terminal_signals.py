"""Signals at the terminals of a motor, from which the torque on its rotor follows."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from .dc_motor import DcMotor
from .induction_motor import InductionMotor
from .motor import T_RATED, Motor


@dataclass(frozen=True)
class TerminalSignals:
    """Outputs of a motor that are measured at its terminals, by `outputs`: "current" [A], "power" [W]. The torque on
    the rotor is `per_current` current + `per_power` (power - `resistance` current^2) [N m]."""

    outputs: Mapping[str, str]
    per_current: float = 0.0
    per_power: float = 0.0
    resistance: float = 0.0


def terminal_signals(
    motor: Motor, p: Any, w: float, torque: float, T: float | None = None
) -> TerminalSignals:
    """The signals of a motor with the parameters `p` in running at the reference `w` [rad/s] with the mean `torque`
    on its rotor [N m].

    The current of an armature is proportional to the torque. The active power of an induction motor, without the heat
    in the stator at the temperature `T` [K], by default that of the surroundings, is the torque times the synchronous
    speed; on an inverter this is the speed at the mean torque.

    Raises
    ------
    TypeError
        for another motor.
    """
    if motor is DcMotor:
        return TerminalSignals({"current": "armature.i"}, per_current=p.armature.k)
    if motor is InductionMotor:
        f = p.supply.f
        if motor.follows(p):
            f = p.pole_pairs * w / (2.0 * math.pi) + p.inverter.slip * torque
        warm = 1.0 + p.stator.alpha * ((p.ambient.T if T is None else T) - T_RATED)
        return TerminalSignals(
            {"current": "i", "power": "supply_power"},
            per_power=p.pole_pairs / (2.0 * math.pi * f),
            resistance=3.0 * p.stator.R * warm,
        )
    raise TypeError(f"{motor.name}: the torque on its rotor is not known from signals at its terminals")
