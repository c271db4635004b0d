"""An inertia as a disc of steel, by whose dimensions people name it."""

from __future__ import annotations

import math
from dataclasses import dataclass

DENSITY = 7850.0
"""Density of steel [kg/m3]."""
WIDTH = 0.1
"""Width of the disc, as a share of its diameter."""


@dataclass(frozen=True)
class Disc:
    """A solid disc of steel."""

    mass: float
    """[kg]"""
    diameter: float
    """[m]"""

    @property
    def width(self) -> float:
        """[m]"""
        return WIDTH * self.diameter

    def rim_speed(self, w: float) -> float:
        """Speed of the rim [m/s] at the speed `w` [rad/s]."""
        return 0.5 * self.diameter * w


def steel_disc(J: float) -> Disc:
    """The disc of the inertia `J` [kg m2] whose width is `WIDTH` of its diameter d: J = m d^2/8 with
    m = pi d^2/4 WIDTH d DENSITY."""
    d = (32.0 * J / (math.pi * WIDTH * DENSITY)) ** 0.2
    return Disc(0.25 * math.pi * d**3 * WIDTH * DENSITY, d)
