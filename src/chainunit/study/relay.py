"""Thermal overload relays by IEC 60947-4-1: the class that a start needs, and the time at which a relay trips."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class TripClass:
    """A trip class of IEC 60947-4-1: a cold relay trips between these times [s] at `MULTIPLE` times its setting."""

    name: str
    shortest: float
    longest: float


MULTIPLE = 7.2
CLASSES = (
    TripClass("10A", 2.0, 10.0),
    TripClass("10", 4.0, 10.0),
    TripClass("20", 6.0, 20.0),
    TripClass("30", 9.0, 30.0),
)
"""The classes in common use, the fastest first. Class 10A trips as surely as class 10, and may trip earlier: none is
recommended for it."""
LIGHT, HEAVIEST = 10, 30
"""The usual class, and the heaviest."""
HEAVIER = 40
"""The class of a start during which a relay of class 30 may trip."""
_PICK_UP = 1.1  # middle of the range 1.05 .. 1.2 in which such a relay has to trip


def start_class(time: Any, current: Any, rated: float) -> int:
    """The least trip class, from `LIGHT` on, whose relay, cold and set to the `rated` current [A], surely holds
    during a start.

    The heat of the start is that of the square of the RMS `current` [A] over `time` [s], both of shape (n,). The
    relay's cooling is left out, which is on the safe side.
    """
    heat = float(np.trapezoid(np.square(np.asarray(current) / rated), np.asarray(time)))
    holding = (int(each.name) for each in CLASSES[1:] if heat <= each.shortest * MULTIPLE**2)
    return next(holding, HEAVIER)


def class_words(trip_class: int) -> str:
    """The class of a relay in words."""
    return f"class {trip_class}" if trip_class <= HEAVIEST else f"heavier than class {HEAVIEST}"


def time_constant(trip_class: int) -> float:
    """Time constant [s] of a thermal image that trips at the end of its class, after so many seconds at `MULTIPLE`
    times the setting, from cold."""
    heating = MULTIPLE**2
    return trip_class / math.log(heating / (heating - _PICK_UP**2))


def relay_image(time: Any, current: Any, setting: float, before: float, trip_class: int = LIGHT) -> Any:
    """Thermal image of a relay, set to `setting` [A], over `time` [s] with `current` [A], shape (n,); it
    trips at 1.

    The image is of first order in the square of the current; `before` is the RMS current before the run [A].
    """
    tau = time_constant(trip_class)
    heating = (np.asarray(current) / (setting * _PICK_UP)) ** 2
    image = np.empty(len(heating))
    image[0] = (before / (setting * _PICK_UP)) ** 2
    step = np.diff(np.asarray(time))
    decay = np.exp(-step / tau)
    middle = 0.5 * (heating[1:] + heating[:-1])
    for k in range(len(step)):
        image[k + 1] = middle[k] + (image[k] - middle[k]) * decay[k]
    return image


def relay_trip(
    time: Any, current: Any, setting: float, before: float, holds: float, trip_class: int = LIGHT
) -> float | None:
    """Time at which the relay trips [s], also after the run, with the lasting current `holds` [A]; None where
    it never trips. Other arguments as in `relay_image`."""
    image = relay_image(time, current, setting, before, trip_class)
    over = np.flatnonzero(image >= 1.0)
    if over.size:
        return float(time[over[0]])
    final = (holds / (setting * _PICK_UP)) ** 2
    if final <= 1.0:
        return None
    return float(time[-1]) + time_constant(trip_class) * math.log((final - image[-1]) / (final - 1.0))
