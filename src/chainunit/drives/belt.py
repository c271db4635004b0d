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
"""Most a small pulley is larger than the usual one, so that a standard one fits its ratio."""
_FINE = 0.315
"""Largest small pulley of the finer series [m]."""
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
    section, least, _ = next(row for row in _SECTIONS if torque <= row[2])
    wanted = max(least, _DIAMETER * torque ** (1.0 / 3.0))
    small_sizes, large_sizes = (
        [float(f"{10.0**decade * numeral:.4g}") for decade in (-2, -1, 0) for numeral in SERIES[name]]
        for name in ("R40", "R20")
    )
    pairs = [
        (small, nearest(small * ratio, large_sizes))
        for small in small_sizes
        if wanted * (1.0 - 1e-9) <= small <= max(min(_LARGER * wanted, _FINE), wanted * 1.13)
    ]
    small, large = min(pairs, key=lambda pair: (max(_NEAR, abs(pair[1] / pair[0] / ratio - 1.0)), pair[0]))
    return BeltDrive(design, section, small, large, 0.5 * small * w)
