"""Paper 002: the cardan drive of a crusher's accelerator as a system of two masses.

The paper prints formulas and conclusions, and no numbers except the special case. The numbers here follow from its
conclusions with equal shafts and J4 = 1000 J1, its own "several orders".
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial

from chainunit.core.engines import MATH, numpy_
from chainunit.drives.cardan import (
    RIGHT,
    Cardan,
    frequency_band,
    frozen_frequency,
    hooke,
    ratio_of_paper,
    two_joints,
)

from .table import PICK

HEAVY = Cardan(J1=1.0, J4=1000.0, c2=1e4, c3=1e4, alpha1=0.0, alpha2=0.0)


def squares(line: Cardan, i: float, constraint: str) -> Any:
    """k^2 of the free line with the ratio i23 [rad2/s2] by the paper's equations of motion, phi3 = i23 phi2, and its
    constraint of the torques with phi1 - phi2 ("right") or phi1 - phi3 ("printed", the second list)."""
    phi3 = Polynomial([1.0, -line.J4 / line.c3])  # at phi4 = 1, in k^2
    base = phi3 / i if constraint == "right" else phi3
    phi1 = base - line.c3 * i / line.c2 * (1.0 - phi3)
    motion = Polynomial([line.c2, -line.J1]) * phi1 - line.c2 * phi3 / i
    return np.sort(np.roots(motion.coef[::-1]).real)


def least_square(constraint: str) -> float:
    """Item 1: the least k^2 at i23 = 1/3; it is 0 as the free line can turn."""
    return float(squares(HEAVY, 1.0 / 3.0, constraint)[0])


def joint_ratio(by: str) -> float:
    """Item 7: i23 at bends of 20 and 40 deg and phi2 = 30 deg, of two joints in space ("right"), as i20/i03 with both
    indices read alike, or by the formula after it."""
    p = dataclasses.replace(HEAVY, alpha1=math.radians(20.0), alpha2=math.radians(40.0))
    gamma = math.radians(30.0)
    end, ratio, _ = two_joints(MATH, p, gamma)
    middle, i20, _ = hooke(MATH, p.alpha1, gamma)
    _, i03, _ = hooke(MATH, p.alpha2, middle - RIGHT)
    return float(
        {"right": ratio, "by index": i20 / i03, "by formula": ratio_of_paper(MATH, p, gamma, end)}[by]
    )


def special_case() -> float:
    """k^2 J/c in the special case i = 1/3."""
    i = 1.0 / 3.0
    line = Cardan(c2=1.0, c3=1.0 / i, J1=1.0, J4=1.0 / (i * i))
    return float(frozen_frequency(MATH, line, i)) ** 2


def bound(ratio: str) -> float:
    """Item 3: the natural frequency with i23 "at_zero" or "at_infinity", J1/J4 = 2 and c2 = c3 [rad/s]."""
    band = frequency_band(Cardan(J1=80.0, J4=40.0, c2=8000.0, c3=8000.0, alpha1=1.2, alpha2=0.2))
    return float(getattr(band, ratio))


def bent(alpha1: float, alpha2: float, gamma: float) -> float:
    """Item 4: the natural frequency [rad/s] with bends and both yokes at these angles [deg]."""
    p = dataclasses.replace(HEAVY, alpha1=math.radians(alpha1), alpha2=math.radians(alpha2))
    at = math.radians(gamma)
    return float(frozen_frequency(MATH, p, ratio_of_paper(MATH, p, at, at)))


def gain(name: str, value: float) -> float:
    """Item 5: the rise of the natural frequency with this value [%]."""
    line = dataclasses.replace(HEAVY, **{name: value})
    return 100.0 * float(frozen_frequency(MATH, line, 1.0) / frozen_frequency(MATH, HEAVY, 1.0) - 1.0)


def ratio_in_turn(pick: str) -> float:
    """Item 6: mean, least or largest i23 over a turn, both bends 30 deg, yokes at 90 deg."""
    bend = math.radians(30.0)
    p = dataclasses.replace(HEAVY, alpha1=bend, alpha2=bend, delta_yokes=0.5 * math.pi)
    _, ratio, _ = two_joints(numpy_(), p, np.linspace(0.0, 2.0 * math.pi, 7200, endpoint=False))
    return float(PICK[pick](ratio))
