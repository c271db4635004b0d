"""A cardan shaft with two Hooke joints between a motor and a machine: exact kinematics, torsional frequencies.

Shaft 2 -> joint (bend alpha1) -> middle shaft 0 with splines -> joint (bend alpha2) -> shaft 3, as in paper
002. `J1` is the rotor on shaft 2, `J4` the driven inertia on shaft 3, `c2`, `c3` the torsional stiffnesses of
the two shafts; the cardan itself has no mass. Angles of yokes are counted from the plane of the two shafts that
a joint connects: `phi2` is the paper's gamma1, and `gamma2` is that of the yoke on shaft 3, where alone the
paper's formula is right. `i23` is d phi3/d phi2: it varies twice a turn, its mean is 1.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from ..errors import InputError
from ..quantities import Layout, Value, declaration, quantity, violations

_RIGHT = 0.5 * math.pi


@declaration
class Cardan:
    """The shaft line of paper 002. The start values are ours: the paper prints no dimensions."""

    alpha1: Value = quantity("rad", "bend of the joint on shaft 2", default=0.3, min=0.0)
    alpha2: Value = quantity("rad", "bend of the joint on shaft 3", default=0.3, min=0.0)
    beta_planes: Value = quantity(
        "rad", "angle between the planes of the joints, about the middle shaft", default=0.0
    )
    delta_yokes: Value = quantity("rad", "angle between the two yokes of the middle shaft", default=0.0)
    J1: Value = quantity("kg.m2", "inertia of the rotor", default=0.4, above=0.0)
    J4: Value = quantity("kg.m2", "driven inertia", default=40.0, above=0.0)
    c2: Value = quantity("N.m/rad", "torsional stiffness of shaft 2", default=8000.0, above=0.0)
    c3: Value = quantity("N.m/rad", "torsional stiffness of shaft 3", default=8000.0, above=0.0)


LAYOUT = Layout(Cardan)


def check(p: Cardan) -> None:
    """Refuse what cannot turn.

    Raises
    ------
    InputError
        in one line, for a bend of 90 degrees or more, an inertia or a stiffness that is not above zero.
    """
    for line in violations(LAYOUT, p):
        raise InputError(line)
    for name in ("alpha1", "alpha2"):
        bend = getattr(p, name)
        if not bend < _RIGHT:
            raise InputError(
                f"{name} = {bend:g} rad ({math.degrees(bend):g} deg): a Hooke joint turns only below 90 deg; must be "
                f"< {_RIGHT:.6g} rad"
            )


def hooke(xp: Any, bend: Any, angle: Any) -> tuple[Any, Any, Any]:
    """A Hooke joint: angle of the driven yoke [rad], ratio and its derivative by the driving angle.

    `angle` is that of the driving yoke's pin from the plane of the two shafts. tan(driven) = tan(angle)/cos(bend), on
    the branch that stays within half a right angle of `angle`; without a jump, whatever the angle.
    """
    s, c, k = xp.sin(angle), xp.cos(angle), xp.cos(bend)
    below = k + (1.0 - k) * s * s  # = s^2 + k c^2
    driven = angle + xp.atan2((1.0 - k) * s * c, below)
    # 1 - sin^2(bend) cos^2(angle), as a sum of what cannot cancel
    spread = s * s + k * k * c * c
    ratio = k / spread
    return driven, ratio, -2.0 * k * s * c * (1.0 - k * k) / (spread * spread)


def two_joints(xp: Any, p: Cardan, phi2: Any) -> tuple[Any, Any, Any]:
    """Angle of shaft 3 [rad], i23 and its derivative by `phi2`; the angle of shaft 3 is gamma2, up to half turns."""
    middle, first, first_slope = hooke(xp, p.alpha1, phi2)
    # seen from shaft 3 the second joint is one that is driven backwards: a right angle on, and inverse
    entering = middle + p.delta_yokes - p.beta_planes
    out, second, second_slope = hooke(xp, p.alpha2, entering - _RIGHT)
    return out + _RIGHT, first * second, first_slope * second + first * first * second_slope


def ratio_of_paper(xp: Any, p: Cardan, gamma1: Any, gamma2: Any) -> Any:
    """i23 as paper 002 prints it, with gamma2 at the driven yoke."""
    s1, s2, c1, c2 = xp.sin(p.alpha1), xp.sin(p.alpha2), xp.cos(gamma1), xp.cos(gamma2)
    return (xp.cos(p.alpha1) / xp.cos(p.alpha2)) * (1.0 - s2 * s2 * c2 * c2) / (1.0 - s1 * s1 * c1 * c1)


def frozen_frequency(xp: Any, p: Cardan, i: Any) -> Any:
    """Natural frequency k [rad/s] of small torsional vibration of the standing shaft with the ratio `i`.

    k^2 = c2 (i^2 + J1/J4)/(J1 (i^2 + c2/c3)), the formula of paper 002: the two springs in a row, seen from shaft 2,
    between J1 and i^2 J4.
    """
    return xp.sqrt(p.c2 * (i * i + p.J1 / p.J4) / (p.J1 * (i * i + p.c2 / p.c3)))


class Band(NamedTuple):
    """The frozen-angle frequency over a turn [rad/s], and what it could be at any ratio."""

    least: float
    largest: float
    at_zero: float
    """sqrt(c3/J4), at i23 = 0"""
    at_infinity: float
    """sqrt(c2/J1), at i23 = infinity"""
    rises: bool
    """whether it grows with i23: J1/J4 <= c2/c3, the condition that paper 002 leaves out"""


def frequency_band(p: Cardan, points: int = 3600) -> Band:
    """The range of the natural frequency over a turn.

    Raises
    ------
    InputError
        see `check`.
    """
    import numpy as np

    from ..engines import numpy_

    check(p)
    xp = numpy_()
    _, i, _ = two_joints(xp, p, np.linspace(0.0, math.pi, points))
    k = frozen_frequency(xp, p, i)
    return Band(
        float(np.min(k)),
        float(np.max(k)),
        math.sqrt(p.c3 / p.J4),
        math.sqrt(p.c2 / p.J1),
        bool(p.c2 / p.c3 >= p.J1 / p.J4),
    )


def sensitivity(p: Cardan, i: float = 1.0) -> dict[str, float]:
    """Relative change of the natural frequency per relative change of J1, J4, c2, c3, at the ratio `i`: exact, by
    dual numbers."""
    import dataclasses

    from ..engines import MATH, Dual, dual, slope, value

    found = {}
    for name in ("J1", "J4", "c2", "c3"):
        given = getattr(p, name)
        moved = dataclasses.replace(p, **{name: Dual(given, given)})
        k = frozen_frequency(dual(MATH), moved, i)
        found[name] = float(slope(k) / value(k))
    return found


_NEWTON = 8


def middle_angle(xp: Any, p: Cardan, phi1: Any, phi4: Any) -> Any:
    """The angle phi2 [rad] at which the massless cardan is in balance, c2 (phi1 - phi2) = i23 c3 (phi3 - phi4).

    Newton's method from phi1, a fixed number of steps: twists are small against the turn over which i23 changes.
    """
    phi2 = phi1
    for _ in range(_NEWTON):
        phi3, i, di = two_joints(xp, p, phi2)
        twist = phi3 - phi4
        wrong = p.c2 * (phi1 - phi2) - i * p.c3 * twist
        phi2 = phi2 + wrong / (p.c2 + p.c3 * (i * i + di * twist))
    return phi2


def torques(xp: Any, p: Cardan, phi1: Any, phi4: Any) -> tuple[Any, Any, Any]:
    """Torque in shaft 2 and in shaft 3 [N m], and the energy of both springs [J], without damping."""
    phi2 = middle_angle(xp, p, phi1, phi4)
    phi3, _, _ = two_joints(xp, p, phi2)
    twist2, twist3 = phi1 - phi2, phi3 - phi4
    return p.c2 * twist2, p.c3 * twist3, 0.5 * (p.c2 * twist2 * twist2 + p.c3 * twist3 * twist3)


# -- stiffness of shafts: torsion constants [m4]; c = G I_t/length


def stiffness(torsion_constant: float, length: float, shear_modulus: float = 8.0e10) -> float:
    """Torsional stiffness [N m/rad] of a shaft of the `length` [m]; steel by default."""
    return shear_modulus * torsion_constant / length


def hollow(outer: float, inner: float = 0.0) -> float:
    """Torsion constant of a round shaft with diameters `outer` and `inner` [m]; solid without the latter.

    Raises
    ------
    InputError
        where the wall is not there.
    """
    if not 0.0 <= inner < outer:
        raise InputError(f"inner = {inner:g} m: must be >= 0 and < the outer diameter, {outer:g} m")
    return math.pi / 32.0 * (outer**4 - inner**4)


def rectangle(a: float, b: float, terms: int = 12) -> float:
    """Torsion constant of a rectangular shaft with the sides `a`, `b` [m], by Saint-Venant's series.

    Raises
    ------
    InputError
        for a side that is not above zero.
    """
    if not (a > 0.0 and b > 0.0):
        raise InputError(f"sides {a:g} m and {b:g} m: must be > 0 m")
    long, short = max(a, b), min(a, b)
    series = sum(math.tanh(0.5 * n * math.pi * long / short) / n**5 for n in range(1, 2 * terms, 2))
    return long * short**3 / 3.0 * (1.0 - 192.0 / math.pi**5 * short / long * series)


def box(a: float, b: float, wall: float) -> float:
    """Torsion constant of a thin-walled box with outer sides `a`, `b` and the `wall` thickness [m], by Bredt's second
    formula on the middle line.

    Raises
    ------
    InputError
        where the wall leaves no hollow.
    """
    if not 0.0 < wall < 0.5 * min(a, b):
        raise InputError(f"wall = {wall:g} m: must be > 0 and < {0.5 * min(a, b):g} m, half the shorter side")
    width, height = a - wall, b - wall
    return 2.0 * wall * (width * height) ** 2 / (width + height)
