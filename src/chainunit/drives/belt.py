"""V-belts as they are ordered: by the design power, with the belt speed and the pulleys.

The sections of narrow V-belts follow the chart of DIN 7753-2, by the design torque on the small pulley. Its
diameter is usual for motors, 27 mm (T/Nm)^(1/3), or up to 1.6 times that. Both pulleys are standard ones (ISO 4183):
the small one of the series R40 up to 315 mm, the large one of R20. The number of belts and their tension are the
maker's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from .gear_ratios import SERIES, nearest

_SECTIONS = (("SPZ", 0.063, 72.0), ("SPA", 0.09, 260.0), ("SPB", 0.14, 1000.0), ("SPC", 0.224, math.inf))
"""Narrow V-belts: name, least diameter of a pulley [m], and the usual largest design torque [N m]."""
_DIAMETER = 0.027
"""Diameter of a small pulley over the third root of its design torque [m/(N m)^(1/3)]."""
_LARGER = 1.6
"""Largest small pulley over the usual one, so that a standard pair fits the ratio."""
_FINE = 0.315
"""Largest small pulley of the finer series [m]."""
_ONE_SIZE = 1.13
"""Largest small pulley over the usual one beyond `_FINE`: the range has a standard size in any case."""
_NEAR = 0.02
"""Deviation of the ratio that is near enough for the smaller of two pairs."""


@dataclass(frozen=True)
class BeltDrive:
    """A belt drive: its design power [W], its section, the pitch diameters of the pulleys [m], and the speed of the
    belt [m/s]."""

    design_power: float
    section: str
    small: float
    large: float
    speed: float


def belt_drive(power: float, w: float, ratio: float, factor: float) -> BeltDrive:
    """The belt on a motor of that rated `power` [W], which turns at `w` [rad/s], with its service `factor`, and the
    standard pulleys that are nearest to its `ratio`."""
    design = power * factor
    torque = design / w
    section, least = next((name, least) for name, least, most in _SECTIONS if torque <= most)
    usual = max(least, _DIAMETER * torque ** (1.0 / 3.0))
    largest = max(min(_LARGER * usual, _FINE), usual * _ONE_SIZE)
    # each with its deviation of the ratio first: of pairs that are near enough, the one with the smaller pulley
    pairs = []
    for small in _diameters("R40"):
        if usual * (1.0 - 1e-9) <= small <= largest:
            large = nearest(small * ratio, _diameters("R20"))
            pairs.append((max(_NEAR, abs(large / small / ratio - 1.0)), small, large))
    _, small, large = min(pairs)
    return BeltDrive(design, section, small, large, 0.5 * small * w)


def _diameters(series: str) -> list[float]:
    """The diameters of standard pulleys, 10 mm to 10 m [m]."""
    return [float(f"{10.0**decade * numeral:.4g}") for decade in (-2, -1, 0) for numeral in SERIES[series]]
