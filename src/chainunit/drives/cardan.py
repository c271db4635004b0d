"""A cardan shaft with two Hooke joints between a motor and a machine: exact kinematics, torsional frequencies.

Shaft 2 -> joint (bend alpha1) -> middle shaft 0 with splines -> joint (bend alpha2) -> shaft 3, as in paper
002. `J1` is the rotor on shaft 2, `J4` the driven inertia on shaft 3, `c2`, `c3` the torsional stiffnesses of
the two shafts; the cardan itself has no mass. Angles of yokes count from the plane of the two shafts that
a joint connects: `phi2` is the paper's gamma1. `gamma2` is the angle of the yoke on shaft 3; the paper's formula is
right only for this yoke. `i23` is d phi3/d phi2: it varies twice a turn, its mean is 1.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any, NamedTuple

import numpy as np

from ..core.engines import MATH, Dual, dual, numpy_, slope, value
from ..core.errors import InputError
from ..core.quantities import Layout, Value, declaration, quantity, violations

RIGHT = 0.5 * math.pi


@declaration
class ShaftLine:
    """Two shafts and the cardan between them. The start values are assumptions of this package: the paper prints no
    dimensions."""

    alpha1: Value = quantity("rad", "bend of the joint on shaft 2", default=0.3, min=0.0)
    alpha2: Value = quantity("rad", "bend of the joint on shaft 3", default=0.3, min=0.0)
    beta_planes: Value = quantity(
        "rad", "angle between the planes of the joints, about the middle shaft", default=0.0
    )
    delta_yokes: Value = quantity("rad", "angle between the two yokes of the middle shaft", default=0.0)
    c2: Value = quantity("N.m/rad", "torsional stiffness of shaft 2", default=8000.0, above=0.0)
    c3: Value = quantity("N.m/rad", "torsional stiffness of shaft 3", default=8000.0, above=0.0)
    d2: Value = quantity("N.m.s/rad", "damping of the twist of shaft 2", default=0.0, min=0.0)
    d3: Value = quantity("N.m.s/rad", "damping of the twist of shaft 3", default=0.0, min=0.0)


@declaration
class Cardan(ShaftLine):
    """The system of paper 002: the shaft line between two inertias."""

    J1: Value = quantity("kg.m2", "inertia of the rotor", default=0.4, above=0.0)
    J4: Value = quantity("kg.m2", "driven inertia", default=40.0, above=0.0)


LAYOUT = Layout(Cardan)


BENDS = ("alpha1", "alpha2")
ORDERS = (2, 4)
"""Orders of the excitation: i23 varies twice a turn, at large bends also four times a turn."""


def check(p: ShaftLine) -> None:
    """Refuse a line that cannot turn; `p` may declare more than a `Line`.

    Raises
    ------
    InputError
        in one line, for a bend of 90 degrees or more, an inertia or a stiffness that is not above zero.
    """
    for line in violations(Layout(type(p)), p):
        raise InputError(line)
    for name in BENDS:
        bend = getattr(p, name)
        if not bend < RIGHT:
            raise InputError(
                f"{name} = {bend:g} rad ({math.degrees(bend):g} deg): a Hooke joint turns only below 90 deg; must be "
                f"< {RIGHT:.6g} rad"
            )


def hooke(xp: Any, bend: Any, angle: Any) -> tuple[Any, Any, Any]:
    """A Hooke joint: angle of the driven yoke [rad], ratio and its derivative by the driving angle.

    `angle` is the angle of the driving yoke's pin from the plane of the two shafts. tan(driven angle) = tan(angle)/
    cos(bend), on the branch that stays within half a right angle of `angle`, without a jump at any angle.
    """
    s, c, k = xp.sin(angle), xp.cos(angle), xp.cos(bend)
    below = k + (1.0 - k) * s * s  # = s^2 + k c^2
    out = angle + xp.atan2((1.0 - k) * s * c, below)
    # 1 - sin^2(bend) cos^2(angle), as a sum of positive terms, which cannot cancel
    square = s * s + k * k * c * c
    ratio = k / square
    return out, ratio, -2.0 * k * s * c * (1.0 - k * k) / (square * square)


def two_joints(xp: Any, p: ShaftLine, phi2: Any) -> tuple[Any, Any, Any]:
    """Angle of shaft 3 [rad], i23 and its derivative by `phi2`; the angle of shaft 3 is gamma2, up to half turns."""
    middle, first, first_slope = hooke(xp, p.alpha1, phi2)
    # seen from shaft 3 the second joint turns backwards: it is the inverse joint, shifted by a right angle
    entering = middle + p.delta_yokes - p.beta_planes
    out, second, second_slope = hooke(xp, p.alpha2, entering - RIGHT)
    return out + RIGHT, first * second, first_slope * second + first * first * second_slope


def ratio_of_paper(xp: Any, p: ShaftLine, gamma1: Any, gamma2: Any) -> Any:
    """i23 by the formula of paper 002, with gamma2 at the driven yoke."""
    s1, s2, c1, c2 = xp.sin(p.alpha1), xp.sin(p.alpha2), xp.cos(gamma1), xp.cos(gamma2)
    return (xp.cos(p.alpha1) / xp.cos(p.alpha2)) * (1.0 - s2 * s2 * c2 * c2) / (1.0 - s1 * s1 * c1 * c1)


def frozen_frequency(xp: Any, p: Cardan, i: Any) -> Any:
    """Natural frequency k [rad/s] of small torsional vibration of the shaft at rest with the ratio `i`.

    k^2 = c2 (i^2 + J1/J4)/(J1 (i^2 + c2/c3)), the formula of paper 002: the two springs in series, reduced to shaft
    2, between J1 and i^2 J4.
    """
    return xp.sqrt(p.c2 * (i * i + p.J1 / p.J4) / (p.J1 * (i * i + p.c2 / p.c3)))


def largest_frequency(xp: Any, p: Cardan) -> Any:
    """An upper bound of the natural frequency over the turn [rad/s], from the bounds of i23 by the bends."""
    least = xp.cos(p.alpha1) * xp.cos(p.alpha2)
    return xp.maximum(frozen_frequency(xp, p, least), frozen_frequency(xp, p, 1.0 / least))


def with_damping_ratio(p: Cardan, ratio: float) -> Cardan:
    """The line with damping of both shafts in proportion to their stiffness, so that the torsional vibration at i23 =
    1 has the damping `ratio`. The shape of the vibration stays the same, and 2 ratio k = (d/c) k^2."""
    k = float(frozen_frequency(MATH, p, 1.0))
    return dataclasses.replace(p, d2=2.0 * ratio * p.c2 / k, d3=2.0 * ratio * p.c3 / k)


class FrequencyBand(NamedTuple):
    """The frozen-angle frequency over a turn [rad/s], and its limits at extreme ratios."""

    least: float
    largest: float
    at_zero: float
    """sqrt(c3/J4), at i23 = 0"""
    at_infinity: float
    """sqrt(c2/J1), at i23 = infinity"""
    rises: bool
    """whether the frequency grows with i23: J1/J4 <= c2/c3, a condition that paper 002 lacks"""


def frequency_band(p: Cardan, points: int = 3600) -> FrequencyBand:
    """The range of the natural frequency over a turn.

    Raises
    ------
    InputError
        see `check`.
    """

    check(p)
    xp = numpy_()
    _, i, _ = two_joints(xp, p, np.linspace(0.0, math.pi, points))
    k = frozen_frequency(xp, p, i)
    return FrequencyBand(
        float(np.min(k)),
        float(np.max(k)),
        math.sqrt(p.c3 / p.J4),
        math.sqrt(p.c2 / p.J1),
        bool(p.c2 / p.c3 >= p.J1 / p.J4),
    )


def sensitivity(p: Cardan, i: float = 1.0) -> dict[str, float]:
    """Relative change of the natural frequency per relative change of J1, J4, c2, c3 at the ratio `i`, exactly, by
    dual numbers."""
    shares = {}
    for name in ("J1", "J4", "c2", "c3"):
        size = getattr(p, name)
        k = frozen_frequency(dual(MATH), dataclasses.replace(p, **{name: Dual(size, size)}), i)
        shares[name] = float(slope(k) / value(k))
    return shares


_NEWTON = 6


def middle_angle(xp: Any, p: ShaftLine, phi1: Any, phi4: Any, near: Any = None, steps: int = _NEWTON) -> Any:
    """The angle phi2 [rad] at which the massless cardan is in balance, c2 (phi1 - phi2) = i23 c3 (phi3 - phi4).

    Newton's method from `near`, by default from phi1. A fixed number of steps suffices, as twists are small against
    the angle over which i23 changes.
    """
    phi2 = phi1 if near is None else near
    for _ in range(steps):
        phi3, i, di = two_joints(xp, p, phi2)
        twist = phi3 - phi4
        imbalance = p.c2 * (phi1 - phi2) - i * p.c3 * twist
        phi2 = phi2 + imbalance / (p.c2 + p.c3 * (i * i + di * twist))
    return phi2


class Twist:
    """The line at given angles and speeds of its two ends, `phi1, w1` and `phi4, w4`.

    The cardan has no mass: phi2 follows from the balance of the two springs, and w2 from the change of phi2. The
    dampers act on the twist speeds v2 = w1 - w2 and v3 = i23 w2 - w4. Their dissipation function
    (d2 v2^2 + d3 v3^2)/2 gives the torques at both ends, so that tau1 w1 - tau4 w4 is exactly the growth of `energy`
    plus the power `dissipated`. One effect is neglected: damping shifts the balance of the cardan. The effect
    vanishes where d2/c2 = d3/c3 and i23 is constant; otherwise it is of second order in d/c, (k d/c)^2 where the two
    ratios differ.
    """

    __slots__ = ("dissipated", "energy", "i", "phi2", "phi3", "tau1", "tau4", "twist2", "twist3")

    def __init__(
        self,
        xp: Any,
        p: ShaftLine,
        phi1: Any,
        w1: Any,
        phi4: Any,
        w4: Any,
        near: Any = None,
        steps: int = _NEWTON,
    ) -> None:
        self.phi2 = phi2 = middle_angle(xp, p, phi1, phi4, near, steps)
        self.phi3, self.i, di = two_joints(xp, p, phi2)
        i = self.i
        self.twist2, self.twist3 = phi1 - phi2, self.phi3 - phi4
        below = p.c2 + p.c3 * (i * i + di * self.twist3)
        by_1, by_4 = p.c2 / below, p.c3 * i / below  # derivatives of phi2 by phi1 and phi4
        w2 = by_1 * w1 + by_4 * w4
        v2, v3 = w1 - w2, i * w2 - w4
        damping2, damping3 = p.d2 * v2, p.d3 * v3
        self.tau1 = p.c2 * self.twist2 + damping2 * (1.0 - by_1) + damping3 * i * by_1
        self.tau4 = p.c3 * self.twist3 + damping2 * by_4 + damping3 * (1.0 - i * by_4)
        self.energy = 0.5 * (p.c2 * self.twist2 * self.twist2 + p.c3 * self.twist3 * self.twist3)
        self.dissipated = damping2 * v2 + damping3 * v3
