"""The protection of a drive by thermal relay and safety coupling, and the stall from which they protect
it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import numpy as np

TRIP_CLASS = 10.0
"""Time in which a relay of this class trips at 7.2 times its setting, from cold [s] (IEC 60947-4-1)."""
_PICK_UP = 1.1  # middle of the range 1.05 .. 1.2 in which such a relay has to trip


def relay_time_constant(trip_class: float = TRIP_CLASS) -> float:
    """Time constant [s] of a thermal image that trips after `trip_class` seconds at 7.2 times the setting."""
    heating = 7.2**2
    return trip_class / math.log(heating / (heating - _PICK_UP**2))


def relay_image(time: Any, current: Any, setting: float, before: float) -> Any:
    """Thermal image of a relay, set to `setting` [A], over `time` [s] with `current` [A], shape (n,); it
    trips at 1.

    The image is of first order in the square of the current; `before` is the RMS current before the run [A].
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
    """Time at which the relay trips [s], also after the run, with the lasting current `holds` [A]; None where
    it never trips."""
    image = relay_image(time, current, setting, before)
    over = np.flatnonzero(image >= 1.0)
    if over.size:
        return float(time[over[0]])
    final = (holds / (setting * _PICK_UP)) ** 2
    if final <= 1.0:
        return None
    return float(time[-1]) + relay_time_constant() * math.log((final - image[-1]) / (final - 1.0))


MARGIN = 1.25
"""Ratio of the setting of a safety coupling to the largest torque of normal duty."""


class Obstacle(StrEnum):
    """Why no setting of a safety coupling protects a drive."""

    MOTOR = "the motor"
    """the motor cannot give the torque of the setting"""
    GEAR = "the gear"
    """the gear may not carry the torque of the setting"""
    OVERLOADS = "the overloads"
    """no overload reaches the torque of the setting"""


@dataclass(frozen=True)
class Setting:
    """A safety coupling between motor and gear, judged by the torques in a study; all at the crank [N m].

    The setting is `MARGIN` times the largest torque of `normal` duty. It has to be below the limit of the
    `gear`, and below the peak of at least one of the `overloads` (peaks by name), the shocks that a coupling
    is for. Otherwise `obstacle` says why there is no setting. The largest torque of the `motor` in steady
    running may be less than the setting, as rotor and flywheel also give torque in a shock; then a load that
    rises slowly stalls the motor. `disturbances` are the peaks, by name, in which the coupling should stay
    shut, such as a dip of the voltage.
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
        """The reason why there is no setting; None where there is one."""
        if self.least >= self.gear:
            return Obstacle.GEAR
        if self.opens:
            return None
        return Obstacle.MOTOR if self.least >= self.motor else Obstacle.OVERLOADS

    @property
    def torque(self) -> float | None:
        """The setting [N m]; None where there is none."""
        return self.least if self.obstacle is None else None

    @property
    def opens(self) -> dict[str, float]:
        """The overloads in which a coupling of the least setting opens, with their peaks."""
        return {name: peak for name, peak in self.overloads.items() if peak > self.least}

    @property
    def stalls(self) -> bool:
        """Whether the motor stalls before the coupling opens, if the load rises slowly."""
        return self.least >= self.motor

    @property
    def nuisances(self) -> dict[str, float]:
        """The disturbances in which the coupling opens, too, with their peaks; it protects nothing there."""
        return {name: peak for name, peak in self.disturbances.items() if peak > self.least}


def stall(time: Any, speed: Any, requested: float, share: float = 0.1) -> float | None:
    """Time [s] from which the speed stays below `share` of the `requested` speed until the end of the run;
    None where it does not, or only in the last tenth of the run."""
    below = np.abs(np.asarray(speed)) < share * requested
    if not below[-1]:
        return None
    moving = np.flatnonzero(~below)
    first = int(moving[-1]) + 1 if moving.size else 0
    return float(time[first]) if first < 0.9 * len(below) else None
