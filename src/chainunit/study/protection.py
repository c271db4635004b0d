"""The protection of a drive: thermal relay and safety coupling; and the stall that they protect from."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import numpy as np

TRIP_CLASS = 10.0
"""Time in which a relay of this class trips at 7.2 times its setting, from cold [s] (IEC 60947-4-1)."""
_PICK_UP = 1.1  # mid of the 1.05 .. 1.2 in which such a relay must trip


def relay_time_constant(trip_class: float = TRIP_CLASS) -> float:
    """Time constant [s] of the thermal image that trips at 7.2 times the setting after `trip_class` seconds."""
    heating = 7.2**2
    return trip_class / math.log(heating / (heating - _PICK_UP**2))


def relay_image(time: Any, current: Any, setting: float, before: float) -> Any:
    """Thermal image of a relay set to `setting` [A] over `time` [s], both of shape (n,): 1 is where it trips.

    First order in the square of the current; `before` is the RMS current that ran until then [A].
    """
    tau = relay_time_constant()
    heating = (np.asarray(current) / (setting * _PICK_UP)) ** 2
    image = np.empty(len(heating))
    image[0] = (before / (setting * _PICK_UP)) ** 2
    step = np.diff(np.asarray(time))
    decay = np.exp(-step / tau)
    middle = 0.5 * (heating[1:] + heating[:-1])
    for k in range(len(step)):
        image[k + 1] = middle[k] + (image[k] - middle[k]) * decay[k]
    return image


def relay_trip(time: Any, current: Any, setting: float, before: float, holds: float) -> float | None:
    """Time at which the relay trips [s]; after the run, `holds` [A] flows on. None where it never does."""
    image = relay_image(time, current, setting, before)
    over = np.flatnonzero(image >= 1.0)
    if over.size:
        return float(time[over[0]])
    final = (holds / (setting * _PICK_UP)) ** 2
    if final <= 1.0:
        return None
    return float(time[-1]) + relay_time_constant() * math.log((final - image[-1]) / (final - 1.0))


MARGIN = 1.25
"""Setting of a safety coupling over the largest torque of normal duty."""


class Obstacle(StrEnum):
    """Why no setting of a safety coupling protects a drive."""

    MOTOR = "the motor"
    """it cannot give the setting"""
    GEAR = "the gear"
    """it may not carry the setting"""
    OVERLOADS = "the overloads"
    """none of them gives the setting"""


@dataclass(frozen=True)
class Setting:
    """A safety coupling between motor and gear, judged by the torques in a study; all at the crank [N m].

    The setting is `MARGIN` times the largest torque of `normal` duty: below the limit of the `gear`, and below the
    torque of at least one of the `overloads`, by name their peaks: the shocks that a coupling is for. Otherwise
    `obstacle` says why there is none. The largest torque of the `motor` in steady running may be less, as rotor and
    flywheel, too, give torque in a shock: then what brakes slowly stalls the motor. `disturbances` are the peaks that
    it has to ride out, by name, such as a dip of the voltage.
    """

    normal: float
    motor: float
    gear: float
    overloads: Mapping[str, float]
    disturbances: Mapping[str, float] = field(default_factory=dict)

    @property
    def least(self) -> float:
        """The least torque at which a coupling may open."""
        return MARGIN * self.normal

    @property
    def obstacle(self) -> Obstacle | None:
        """Why there is no setting."""
        if self.least >= self.gear:
            return Obstacle.GEAR
        if self.opens:
            return None
        return Obstacle.MOTOR if self.least >= self.motor else Obstacle.OVERLOADS

    @property
    def torque(self) -> float | None:
        """The setting, if there is one."""
        return self.least if self.obstacle is None else None

    @property
    def opens(self) -> dict[str, float]:
        """The overloads in which a coupling of the least setting opens, with their peaks."""
        return {name: peak for name, peak in self.overloads.items() if peak > self.least}

    @property
    def stalls(self) -> bool:
        """Whether the motor stalls before it opens, where the load rises slowly."""
        return self.least >= self.motor

    @property
    def nuisances(self) -> dict[str, float]:
        """The disturbances in which it opens, too, with their peaks: it protects nothing there."""
        return {name: peak for name, peak in self.disturbances.items() if peak > self.least}


def stall(time: Any, speed: Any, asked: float, share: float = 0.1) -> float | None:
    """Time from which the speed stays below `share` of the speed `asked` to the end of the run; None where it does
    not, or only in the last tenth of the run."""
    below = np.abs(np.asarray(speed)) < share * asked
    if not below[-1]:
        return None
    moving = np.flatnonzero(~below)
    first = int(moving[-1]) + 1 if moving.size else 0
    return float(time[first]) if first < 0.9 * len(below) else None
