"""Thermal overload relays by IEC 60947-4-1: the class that a start needs, and the time at which a relay trips.

The relay of a star-delta starter usually sits in the phases of the delta, behind the main contactor, and is set to
1/sqrt(3) = 0.58 of the rated current: it carries the current of a winding, in star as in delta. In the supply line it
is set to the rated current and hardly notices an overload in star. The class of a start is that for the former place
(`StarStart.winding_current`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..drives.nameplate import Nameplate
from .arrays import rms


@dataclass(frozen=True)
class TripClass:
    """A trip class of IEC 60947-4-1: a cold relay trips between these times [s] at `MULTIPLE` times its setting."""

    name: str
    shortest: float
    longest: float


MULTIPLE = 7.2
CLASSES = (
    TripClass("5", 0.5, 5.0),
    TripClass("10A", 2.0, 10.0),
    TripClass("10", 4.0, 10.0),
    TripClass("20", 6.0, 20.0),
    TripClass("30", 9.0, 30.0),
)
"""The classes in common use, the fastest first. Class 10A trips as surely as class 10, and may trip earlier: no start
is recommended for it, nor for class 5."""
_NAMED = {candidate.name: candidate for candidate in CLASSES}
QUICK, LIGHT, HEAVIEST = 5, 10, 30
"""The class for a motor that may not stand long, the usual class, and the heaviest."""
HEAVIER = 40
"""The class of a start during which a relay of class 30 may trip."""
HOLDS_AT, TRIPS_AT = 1.05, 1.2
"""Multiples of its setting: at the first a relay must not trip within two hours, at the second it must."""
_LASTING = 5
MORE_CURRENT = 1.2
"""Locked-rotor current of a cage motor by the tolerance of IEC 60034-1, over that of its catalogue."""


def class_holding(seconds: float, least: int = LIGHT) -> int:
    """The least trip class, from the class `least` on, whose cold relay surely holds in a start of so many `seconds`,
    see `start_seconds`."""
    usual = [candidate for candidate in CLASSES if candidate.name.isdigit() and int(candidate.name) >= least]
    return next((int(candidate.name) for candidate in usual if seconds <= candidate.shortest), HEAVIER)


def tolerant_class(seconds: float, least: int = LIGHT) -> int:
    """The trip class of `class_holding` for a motor that takes `MORE_CURRENT` in its start."""
    return class_holding(MORE_CURRENT**2 * seconds, least)


def start_seconds(time: Any, current: Any, setting: float) -> float:
    """The time [s] for which `MULTIPLE` times the `setting` [A] heats a relay as much as the `current` [A] over
    `time` [s], both of shape (n,), without its cooling: a cold relay surely holds up to the shortest time of its
    class."""
    share = np.square(np.asarray(current) / (MULTIPLE * setting))
    return float(np.trapezoid(share, np.asarray(time)))


def protecting_class(
    least: int, seconds: float, setting: float, before: float, stall_current: float, stall_time: float
) -> int:
    """The trip class of the relay of a motor whose starts need the class `least`: the least that lets each start
    through even if the motor takes `MORE_CURRENT`, unless it trips too late with the rotor locked and the class
    `least` does not; or `QUICK` in place of the usual class, if that trips too late. The hardest start heats a relay
    as `start_seconds` says. Other arguments as of `stall_trip`; the rotor of a warm motor may be locked for the
    `stall_time` [s]."""

    def protecting(number: int) -> bool:
        return protects(number, setting, before, stall_current, stall_time)

    tolerant = tolerant_class(seconds, least)
    if tolerant <= HEAVIEST and protecting(tolerant):
        return tolerant
    is_quick = least == LIGHT and seconds <= _NAMED[str(QUICK)].shortest
    if is_quick and not protecting(LIGHT) and protecting(QUICK):
        return QUICK
    # if neither protects a locked rotor, other means have to, and the relay shall let each start through
    return tolerant if tolerant <= HEAVIEST and not protecting(least) else least


def protects(number: int, setting: float, before: float, stall_current: float, stall_time: float) -> bool:
    """Whether the slowest relay of the class of that `number` trips before the locked rotor of a warm motor is too
    hot, see `protecting_class`."""
    trip = stall_trip(_NAMED[str(number)], setting, before, stall_current)
    return trip is not None and trip <= stall_time


def locked_rotor(plate: Nameplate, before: float) -> tuple[float, float, float, float]:
    """The last four arguments of `protecting_class` and `protects`, for a relay that is set to the rated current of a
    motor, which had the RMS current `before` [A]."""
    return plate.rated_current, before, plate.rated_current * plate.locked_current_ratio, plate.locked_time


def stall_trip(trip_class: TripClass, setting: float, before: float, current: float) -> float | None:
    """Time [s] after which the slowest relay of a class trips at a steady `current` [A], warm from the RMS current
    `before` [A]; None where it never does, and where it does not let the motor run, either."""
    if before >= TRIPS_AT * setting:
        return None
    # a record without a row of the stall: all of it is the current that flows on
    return relay_trip([0.0], [current], setting, before, current, trip_class.longest)


def lasting_current(current: Any, after: float | None = None) -> float:
    """The current that flows on after a record of the `current` [A], shape (n,): the one `after` an overload that
    passes, else the RMS of the last fifth of the record."""
    if after is not None:
        return after
    return rms(current[-max(1, len(current) // _LASTING) :])


def class_words(trip_class: int) -> str:
    """The class of a relay in words."""
    return f"class {trip_class}" if trip_class <= HEAVIEST else f"heavier than class {HEAVIEST}"


def relay_trip(
    time: Any, current: Any, setting: float, before: float, holds: float, seconds: float
) -> float | None:
    """Time at which the slowest relay of its class trips [s], also after the run; None where it never trips.

    Its thermal image is of first order in the square of the current. It trips at 1: from cold after so many `seconds`
    at `MULTIPLE` times the setting, the end of its class, and after a long time at `TRIPS_AT` times the setting.

    Parameters
    ----------
    time, current : times [s] and current [A] there, shape (n,)
    setting, before : current to which it is set, and RMS current before the run [A]
    holds : current that lasts after the run [A]
    """
    pick_up, whole = setting * TRIPS_AT, MULTIPLE**2
    tau = seconds / math.log(whole / (whole - TRIPS_AT**2))
    heating = (np.asarray(current) / pick_up) ** 2
    image = np.empty(len(heating))
    image[0] = (before / pick_up) ** 2
    decay = np.exp(-np.diff(np.asarray(time)) / tau)
    middle = 0.5 * (heating[1:] + heating[:-1])
    for k in range(len(decay)):
        image[k + 1] = middle[k] + (image[k] - middle[k]) * decay[k]
    over = np.flatnonzero(image >= 1.0)
    if over.size:
        return float(time[over[0]])
    final = (holds / pick_up) ** 2
    if final <= 1.0:
        return None
    return float(time[-1]) + tau * math.log((final - image[-1]) / (final - 1.0))
