"""Efficiency classes of motors by IEC 60034-30-1 at 50 Hz, and what the regulation EU 2019/1781 asks of a motor."""

from __future__ import annotations

import math

import numpy as np

from ...drives.nameplate import Nameplate

CLASSES = ("IE2", "IE3", "IE4")
"""Classes whose limits are known here, in order."""
_SIZES = (
    0.12, 0.18, 0.2, 0.25, 0.37, 0.4, 0.55, 0.75, 1.1, 1.5, 2.2, 3.0, 4.0, 5.5, 7.5, 11.0, 15.0, 18.5, 22.0, 30.0,
    37.0, 45.0, 55.0, 75.0, 90.0, 110.0, 132.0, 160.0, 200.0,
)  # fmt: skip
_LIMITS: dict[tuple[str, int], tuple[float, ...]] = {
    ("IE2", 2): (
        53.6, 60.4, 61.9, 64.8, 69.5, 70.4, 74.1, 77.4, 79.6, 81.3, 83.2, 84.6, 85.8, 87.0, 88.1, 89.4, 90.3, 90.9,
        91.3, 92.0, 92.5, 92.9, 93.2, 93.8, 94.1, 94.3, 94.6, 94.8, 95.0,
    ),
    ("IE2", 4): (
        59.1, 64.7, 65.9, 68.5, 72.7, 73.5, 77.1, 79.6, 81.4, 82.8, 84.3, 85.5, 86.6, 87.7, 88.7, 89.8, 90.6, 91.2,
        91.6, 92.3, 92.7, 93.1, 93.5, 94.0, 94.2, 94.5, 94.7, 94.9, 95.1,
    ),
    ("IE2", 6): (
        50.6, 56.6, 58.2, 61.6, 67.6, 68.8, 73.1, 75.9, 78.1, 79.8, 81.8, 83.3, 84.6, 86.0, 87.2, 88.7, 89.7, 90.4,
        90.9, 91.7, 92.2, 92.7, 93.1, 93.7, 94.0, 94.3, 94.6, 94.8, 95.0,
    ),
    ("IE3", 2): (
        60.8, 65.9, 67.2, 69.7, 73.8, 74.6, 77.8, 80.7, 82.7, 84.2, 85.9, 87.1, 88.1, 89.2, 90.1, 91.2, 91.9, 92.4,
        92.7, 93.3, 93.7, 94.0, 94.3, 94.7, 95.0, 95.2, 95.4, 95.6, 95.8,
    ),
    ("IE3", 4): (
        64.8, 69.9, 71.1, 73.5, 77.3, 78.0, 80.8, 82.5, 84.1, 85.3, 86.7, 87.7, 88.6, 89.6, 90.4, 91.4, 92.1, 92.6,
        93.0, 93.6, 93.9, 94.2, 94.6, 95.0, 95.2, 95.4, 95.6, 95.8, 96.0,
    ),
    ("IE3", 6): (
        57.7, 63.9, 65.4, 68.6, 73.5, 74.4, 77.2, 78.9, 81.0, 82.5, 84.3, 85.6, 86.8, 88.0, 89.1, 90.3, 91.2, 91.7,
        92.2, 92.9, 93.3, 93.7, 94.1, 94.6, 94.9, 95.1, 95.4, 95.6, 95.8,
    ),
    ("IE4", 2): (
        66.5, 70.8, 71.9, 74.3, 78.1, 78.9, 81.5, 83.5, 85.2, 86.5, 88.0, 89.1, 90.0, 90.9, 91.7, 92.6, 93.3, 93.7,
        94.0, 94.5, 94.8, 95.0, 95.3, 95.6, 95.8, 96.0, 96.2, 96.3, 96.5,
    ),
    ("IE4", 4): (
        69.8, 74.7, 75.8, 77.9, 81.1, 81.7, 83.9, 85.7, 87.2, 88.2, 89.5, 90.4, 91.1, 91.9, 92.6, 93.3, 93.9, 94.2,
        94.5, 94.9, 95.2, 95.4, 95.7, 96.0, 96.1, 96.3, 96.4, 96.6, 96.7,
    ),
    ("IE4", 6): (
        64.9, 70.1, 71.4, 74.1, 78.0, 78.7, 80.9, 82.7, 84.5, 85.9, 87.4, 88.6, 89.5, 90.5, 91.3, 92.3, 92.9, 93.4,
        93.7, 94.2, 94.5, 94.8, 95.1, 95.4, 95.6, 95.8, 96.0, 96.2, 96.3,
    ),
}  # fmt: skip
"""Least rated efficiency [%] by class and number of poles, for `_SIZES` [kW]; that of 200 kW holds up to 1000 kW."""
_ROUNDING = 5e-4
"""Nameplates print the efficiency to 0.1 %."""

EXEMPTIONS = (
    "The regulation leaves out motors that are built into a machine and cannot be tested apart from it.",
    "It leaves out totally enclosed motors without a fan, and motors rated for other than continuous duty.",
    "IE4 is not asked of brake motors and explosion-proof motors, and of Ex eb motors only IE2.",
)
"""The exemptions that a drive of this kind meets, in words."""


def limit(class_name: str, power: float, poles: float) -> float | None:
    """Least rated efficiency of the class `class_name` for a motor of that power [W]; None for a size or a number of
    poles that the table has not. Between two sizes it is linear in the logarithm of the power."""
    values, kW = _LIMITS.get((class_name, round(poles))), 1e-3 * power
    if values is None or not _SIZES[0] <= kW * (1.0 + 1e-9) <= 1000.0 * (1.0 + 2e-9):
        return None
    return 0.01 * float(np.interp(math.log(kW), np.log(_SIZES), values))


def no_class(plate: Nameplate) -> str:
    """The reason why a motor has no class here, in words; empty for one that has."""
    if abs(plate.frequency - 50.0) > 0.5:
        return f"its limits here are those at 50 Hz, and the motor is one for {plate.frequency:g} Hz"
    if limit(CLASSES[0], plate.power, plate.poles) is None:
        return "its limits here are those for 2, 4 or 6 poles and 0.12 to 1000 kW"
    return ""


def class_of(plate: Nameplate) -> str:
    """The class of a motor by its rated efficiency: one of `CLASSES`, "IE1 or less", or empty for one that has no
    class here, see `no_class`."""
    if no_class(plate):
        return ""
    reached = "IE1 or less"
    for class_name in CLASSES:
        least = limit(class_name, plate.power, plate.poles)
        if least is not None and plate.efficiency >= least - _ROUNDING:
            reached = class_name
    return reached


def required(plate: Nameplate) -> str:
    """The class that EU 2019/1781 asks of a three-phase motor on the market since July 2023; empty outside of its
    scope: 50 or 60 Hz, 50 to 1000 V, 2 to 8 poles, 0.12 to 1000 kW."""
    kW, poles = 1e-3 * plate.power, round(plate.poles)
    in_scope = (
        round(plate.frequency) in (50, 60)
        and 50.0 < plate.voltage <= 1000.0
        and poles in (2, 4, 6, 8)
        and 0.12 <= kW <= 1000.0
    )
    if not in_scope:
        return ""
    if 75.0 <= kW <= 200.0 and poles in (2, 4, 6):
        return "IE4"
    return "IE3" if kW >= 0.75 else "IE2"


def falls_short(plate: Nameplate) -> bool:
    """Whether the class of a motor is known and below the one that EU 2019/1781 asks of it."""
    order = ("IE1 or less", *CLASSES)
    reached, demand = class_of(plate), required(plate)
    return bool(reached and demand) and order.index(reached) < order.index(demand)


def next_class(plate: Nameplate) -> tuple[str, float] | None:
    """The class above that of a motor, and its least efficiency; None for a motor of the highest class here, or
    without a class."""
    reached = class_of(plate)
    if not reached or reached == CLASSES[-1]:
        return None
    above = CLASSES[CLASSES.index(reached) + 1] if reached in CLASSES else CLASSES[0]
    least = limit(above, plate.power, plate.poles)
    return None if least is None else (above, least)
