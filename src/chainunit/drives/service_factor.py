"""Service factors: how many times the rated torque of its motor a gear is ordered for, and how many times its rated
power a belt, by the class of the load, the hours of running a day and the starts an hour.

No standard defines the service factor fB of gears. Makers of geared motors publish factors of this size (class II,
16 h a day, 300 starts an hour: 1.5), but the numbers belong to none of them. These makers take the class of a load
from its inertia factor: the inertia of the machine over that of the motor, both at the motor's shaft. The
factors of V-belts are c2 of DIN 7753-2.
"""

from __future__ import annotations

from collections.abc import Mapping

LOAD_WORDS = {"uniform": "uniform load"} | {x: f"{x} shocks" for x in ("moderate", "heavy", "very heavy")}
LOAD_CLASSES = tuple(LOAD_WORDS)
"""The classes of loads I, II and III of gears, of light, medium and heavy drives by belts; crushers and calenders are
very heavy ones. A gear has no heavier class than III."""
INERTIA_FACTORS = (0.2, 3.0, 10.0)
"""Largest inertia factor of each class; above the last one makers of gears want to be asked."""

_STEPS = (8.0, 16.0, 24.0)
_GEAR: Mapping[str, tuple[float, ...]] = {
    "uniform": (1.0, 1.1, 1.2),
    "moderate": (1.2, 1.3, 1.4),
    "heavy": (1.4, 1.5, 1.6),
    "very heavy": (1.4, 1.5, 1.6),
}
_STARTS, _MORE = 300.0, 0.2
"""Starts an hour from which on the factor does not rise any more, and its rise up to there."""
_BELT_STEPS = (10.0, 16.0, 24.0)
_BELT: Mapping[str, tuple[float, ...]] = {
    "uniform": (1.1, 1.1, 1.2, 1.1, 1.2, 1.3),
    "moderate": (1.1, 1.2, 1.3, 1.2, 1.3, 1.4),
    "heavy": (1.2, 1.3, 1.4, 1.4, 1.5, 1.6),
    "very heavy": (1.3, 1.4, 1.5, 1.5, 1.6, 1.8),
}
"""Up to the hours of each step: with a gentle start, and with one direct on line."""


def load_class(inertia_factor: float) -> str:
    """The class of a load by its inertia factor."""
    steps = zip(INERTIA_FACTORS, LOAD_CLASSES, strict=False)
    return next((name for most, name in steps if inertia_factor <= most), "heavy")


def gear_factor(load: str, hours: float, starts: float) -> float:
    """Service factor fB of a gear for that class of `load`, one of `LOAD_CLASSES`, by `hours` a day and `starts` an
    hour, with the two decimals of makers."""
    return round(_in_hours(_GEAR[load], _STEPS, hours) + _MORE * min(1.0, starts / _STARTS), 2)


def belt_factor(load: str, hours: float, *, is_on_line: bool) -> float:
    """Service factor c2 of a V-belt for that class of `load` by `hours` a day; `is_on_line` tells of a motor that
    starts direct on line, with more than twice its rated torque."""
    return _in_hours(_BELT[load][3 * is_on_line :][:3], _BELT_STEPS, hours)


def _in_hours(factors: tuple[float, ...], steps: tuple[float, ...], hours: float) -> float:
    return next(factor for most, factor in zip(steps, factors, strict=True) if hours <= most)
