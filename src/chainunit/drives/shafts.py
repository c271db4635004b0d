"""Torsional stiffness of shafts from their geometry: torsion constants I_t [m4], stiffness G I_t/length."""

from __future__ import annotations

import math

from ..errors import InputError


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
