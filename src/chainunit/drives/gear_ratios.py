"""Ratios that gears are made in: preferred numbers, and the largest ratio of one gear unit by its kind.

The limits are typical of standard units, and belong to no maker. A helical stage makes up to about 6.3, so that two
stages make up to 40 and three up to 250; two-stage units of makers end between 30 and 60, three-stage units between
200 and 350. A worm gear makes up to about 100, a V-belt up to about 6.3; few makers go up to 10 with a belt. Beyond
that the belt stands before a helical gear.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from .gearing import KINDS

_TENTHS = "100 112 125 140 160 180 200 224 250 280 315 355 400 450 500 560 630 710 800 900"
_BETWEEN_R20 = "106 118 132 150 170 190 212 236 265 300 335 375 425 475 530 600 670 750 850 950"
_BETWEEN_R40 = (
    "103 109 115 122 128 136 145 155 165 175 185 195 206 218 230 243 258 272 290 307 "
    "325 345 365 387 412 437 462 487 515 545 580 615 650 690 730 775 825 875 925 975"
)


def _numbers(*texts: str) -> tuple[float, ...]:
    return tuple(sorted(float(numeral) / 100.0 for text in texts for numeral in text.split()))


SERIES: Mapping[str, tuple[float, ...]] = MappingProxyType(
    {
        "R20": _numbers(_TENTHS),
        "R40": _numbers(_TENTHS, _BETWEEN_R20),
        "R80": _numbers(_TENTHS, _BETWEEN_R20, _BETWEEN_R40),
    }
)
"""Preferred numbers of ISO 3 in a decade, by series, the coarsest first."""


STAGE = 0.98
"""Typical efficiency of one stage of helical wheels, with its bearings and seals."""


@dataclass(frozen=True)
class GearUnit:
    """A gear in one housing, one belt, or a belt before one gear: the ratio up to which it is usual, the largest that
    a maker has, its typical efficiency, and its parts in a noun."""

    title: str
    largest: float
    made: float
    efficiency: float
    noun: str = "gear"


DIRECT = GearUnit("no gear: on the motor's shaft or a coupling", 1.0, 1.0, 1.0, "coupling")
"""A machine that turns with the motor."""


UNITS: Mapping[str, tuple[GearUnit, ...]] = MappingProxyType(
    {
        "helical": (
            GearUnit("one-stage helical gear", 6.3, 10.0, STAGE),
            GearUnit("two-stage helical gear", 40.0, 60.0, STAGE**2),
            GearUnit("three-stage helical gear", 250.0, 350.0, STAGE**3),
        ),
        "worm": (GearUnit("worm gear", 100.0, 100.0, KINDS["worm"].efficiency),),
        "belt": (GearUnit("V-belt", 6.3, 10.0, KINDS["belt"].efficiency, "belt"),),
        "none": (DIRECT,),
    }
)
"""The units of each kind of gear, by rising ratio; bevel-helical gears count as helical ones."""


def gear_unit(kind: str, ratio: float, is_given: bool = False) -> GearUnit | None:
    """The smallest unit of the `kind` that has the `ratio`; None where one unit does not suffice. A ratio that
    `is_given` may be one that only some makers have in one unit. Nobody takes a gear for a ratio of 1. Beyond its
    largest ratio a belt stands before a helical gear."""
    if ratio == 1.0 and kind != "belt":
        return DIRECT
    usual = (unit for unit in UNITS[kind] if ratio <= unit.largest)
    last = UNITS[kind][-1]
    unit = next(usual, last if is_given and ratio <= last.made else None)
    if unit is None and kind == "belt" and (split := belt_before_gear(ratio)) is not None:
        belt, gear, second = split
        title = f"V-belt of {belt:.3g} before a {second.title} of {gear:g}"
        return GearUnit(title, ratio, ratio, last.efficiency * second.efficiency, "belt and gear")
    return unit


def belt_before_gear(ratio: float) -> tuple[float, float, GearUnit] | None:
    """The split of a `ratio` over a V-belt and a helical gear behind it: both ratios, and the gear. It has as few
    stages as the belt permits and a preferred number of R20, and the belt is near to its usual ratio; None where one
    gear does not suffice."""
    belt = UNITS["belt"][0].largest
    for unit in UNITS["helical"]:
        gears = [
            10.0**decade * numeral
            for decade in range(3)
            for numeral in SERIES["R20"]
            if ratio / belt <= 10.0**decade * numeral <= unit.largest
        ]
        if gears:
            gear = float(f"{nearest(ratio / KINDS['belt'].ratio, gears):.4g}")
            return ratio / gear, gear, unit
    return None


def typical_efficiency(kind: str, ratio: float, is_given: bool = False) -> float:
    """Typical efficiency of the unit of that `kind` and `ratio`, or of as many units one behind the other as it
    takes; for `is_given` see `gear_unit`. A stage of helical wheels has `STAGE`, a V-belt 0.95. That of a worm gear
    falls from 0.9 at a ratio of 5 to 0.65 at 80; the number is that of 50."""
    if kind == "none":
        return 1.0
    efficiency, last = 1.0, UNITS[kind][-1]
    while (unit := gear_unit(kind, ratio, is_given)) is None:
        efficiency, ratio = efficiency * last.efficiency, ratio / last.largest
    return float(efficiency * unit.efficiency)


def next_ratio(ratio: float, ratios: Sequence[float]) -> float | None:
    """The ratio on offer above `ratio`: of the `ratios` of a catalogue of gears, or else of the finest series; None
    where there is none."""
    if ratios:
        return min((listed for listed in ratios if listed > ratio), default=None)
    decade = 10.0 ** math.floor(math.log10(ratio))
    decades = (decade * scale * numeral for scale in (1.0, 10.0) for numeral in SERIES["R80"])
    above = (standard for standard in decades if standard > ratio * (1.0 + 1e-6))
    return float(f"{next(above):.4g}")


def nearest(ratio: float, ratios: Iterable[float]) -> float:
    """The one of the `ratios` with which the speed differs least from that with the `ratio`."""
    return min(ratios, key=lambda candidate: abs(math.log(candidate / ratio)))


def preferred_ratio(ratio: float, tolerance: float) -> tuple[float, str]:
    """The nearest preferred number to a `ratio`, and its series: the coarsest that has one with which the speed
    differs by at most the `tolerance`, or the finest."""
    decade = 10.0 ** math.floor(math.log10(ratio))
    near = {name: decade * nearest(ratio / decade, (*numbers, 10.0)) for name, numbers in SERIES.items()}
    fine = [name for name, best in near.items() if abs(ratio / best - 1.0) <= tolerance]
    name = fine[0] if fine else "R80"
    return float(f"{near[name]:.4g}"), name


def ratio_on_offer(ratio: float, series: str, ratios: Sequence[float], tolerance: float) -> tuple[float, str]:
    """The ratio that a drive gets which needs a `ratio`, and the name of its source.

    Parameters
    ----------
    series : "preferred" or "exact"; of no meaning where there are `ratios`
    ratios : the ratios of a catalogue of gears
    tolerance : see `preferred_ratio`
    """
    if ratios:
        return nearest(ratio, ratios), "own list"
    return preferred_ratio(ratio, tolerance) if series == "preferred" else (ratio, "")
