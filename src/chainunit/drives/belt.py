"""V-belts as they are ordered: by the design power, with the belt speed and the pulleys.

The sections of narrow V-belts follow the chart of DIN 7753-2, by the design torque on the small pulley. Its
diameter is usual for motors, 27 mm (T/Nm)^(1/3), and a preferred number of ISO 3. The number of belts and their
tension are the maker's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from .gear_ratios import SERIES

_SECTIONS = (("SPZ", 0.063, 72.0), ("SPA", 0.09, 260.0), ("SPB", 0.14, 1000.0), ("SPC", 0.224, math.inf))
"""Narrow V-belts: name, least diameter of a pulley [m], and the usual largest design torque [N m]."""
_DIAMETER = 0.027
"""Diameter of a small pulley over the third root of its design torque [m/(N m)^(1/3)]."""


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
    """The belt on a motor of that rated `power` [W], which turns at `w` [rad/s], with its `ratio` and service
    `factor`."""
    design = power * factor
    torque = design / w
    section, least, _ = next(each for each in _SECTIONS if torque <= each[2])
    wanted = max(least, _DIAMETER * torque ** (1.0 / 3.0))
    sizes = (10.0**decade * numeral for decade in (-2, -1, 0) for numeral in SERIES["R20"])
    small = next(size for size in sizes if size >= wanted * (1.0 - 1e-9))
    return BeltDrive(design, section, float(f"{small:.4g}"), small * ratio, 0.5 * small * w)
