"""Paper 002: the cardan drive of a crusher's accelerator as a system of two masses.

The paper prints formulas and conclusions, no numbers but the special case; the numbers here are what its conclusions come to
with J4 = 1000 J1, its own "several orders", and equal shafts.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from ...drives.cardan import Cardan, frequency_band, frozen_frequency, ratio_of_paper, two_joints
from ...engines import MATH, numpy_
from .row import Row

HEAVY = Cardan(J1=1.0, J4=1000.0, c2=1e4, c3=1e4, alpha1=0.0, alpha2=0.0)


def bent(alpha1: float, alpha2: float, gamma: float) -> float:
    """The natural frequency [rad/s] with bends and both yokes at these angles [deg]."""
    p = dataclasses.replace(HEAVY, alpha1=math.radians(alpha1), alpha2=math.radians(alpha2))
    at = math.radians(gamma)
    return float(frozen_frequency(MATH, p, ratio_of_paper(MATH, p, at, at)))


def gain(**values: float) -> float:
    """How much the natural frequency rises with these values [%]."""
    moved = dataclasses.replace(HEAVY, **values)
    return 100.0 * float(frozen_frequency(MATH, moved, 1.0) / frozen_frequency(MATH, HEAVY, 1.0) - 1.0)


def rows() -> list[Row]:
    """Every number that paper 002 prints, and what its conclusions come to."""
    i = 1.0 / 3.0
    special = Cardan(c2=1.0, c3=1.0 / i, J1=1.0, J4=1.0 / (i * i))
    condition = "holds only where J1/J4 <= c2/c3; otherwise the two bounds change places"
    reversed_ = frequency_band(Cardan(J1=80.0, J4=40.0, c2=8000.0, c3=8000.0, alpha1=1.2, alpha2=0.2))
    near = "a bend of shaft 2 near 90 deg brings i23 to 0, but at gamma1 = 0 to infinity; of shaft 3 the other way round"
    light = "for J4 much above J1 the rotor vibrates against the standing accelerator: k^2 is near c/J1, whatever J4"
    varies = "in rotation i23 varies twice a turn with the mean 1: the formula is that of a standing shaft"
    p = dataclasses.replace(
        HEAVY, alpha1=math.radians(30.0), alpha2=math.radians(30.0), delta_yokes=0.5 * math.pi
    )
    _, ratio, _ = two_joints(numpy_(), p, np.linspace(0.0, 2.0 * math.pi, 7200, endpoint=False))
    return [
        Row("002", "1", "k^2", "k^2 J/c in the special case i = 1/3", "0.5", float(frozen_frequency(MATH, special, i)) ** 2,
            "1", 4, "problem 14.70 of Kolesnikov's collection"),
        Row("002", "3", "range of k", "lower bound, J1/J4 = 2 and c2 = c3", "sqrt(c3/J4)", reversed_.at_infinity,
            "rad/s", 2, condition, reversed_.at_zero, agrees=False),
        Row("002", "3", "range of k", "upper bound, J1/J4 = 2 and c2 = c3", "sqrt(c2/J1)", reversed_.at_zero,
            "rad/s", 2, condition, reversed_.at_infinity, agrees=False),
        *(
            Row("002", "4", "conclusion", f"k at alpha1 = {a1:g}, alpha2 = {a2:g}, gamma = {g:g} deg", "very small",
                bent(a1, a2, g), "rad/s", 2, near, agrees=bent(a1, a2, g) < 10.0)
            for a1, a2 in ((89.0, 10.0), (10.0, 89.0))
            for g in (60.0, 0.0)
        ),
        Row("002", "5", "conclusion", "k with half of J4", "rises", gain(J4=500.0), "%", 2, light, agrees=False),
        Row("002", "5", "conclusion", "k with twice c3", "rises", gain(c3=2e4), "%", 1, light, agrees=True),
        Row("002", "5", "conclusion", "k with half of J1", None, gain(J1=0.5), "%", 0, light),
        Row("002", "6", "i23", "mean of i23 over a turn, both bends 30 deg, yokes at 90 deg", None, float(np.mean(ratio)), "1", 6, varies),
        Row("002", "6", "i23", "least i23 in that turn", None, float(np.min(ratio)), "1", 4, varies),
        Row("002", "6", "i23", "largest i23 in that turn", None, float(np.max(ratio)), "1", 4, varies),
    ]  # fmt: skip
