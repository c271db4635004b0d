"""One crank turn at constant speed: the torque that the machine needs, by inverse dynamics."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..machines.machine import Machine


@dataclass(frozen=True)
class Cycle:
    """Outputs of the machine over `angle`, the crank angle [rad], shape (points,); those of chains have the shape
    (turns, points)."""

    angle: Any
    crank_torque: Any
    """[N m]"""
    outputs: Any
    """outputs as the machine declares them; only `tau` and `J` for chains"""
    crank_speed: float
    """[rad/s]"""
    ratio: float
    """turns of the shaft to which the outputs `tau` and `J` belong per turn of the crank"""

    def inertia_at(self, ratio: float) -> Any:
        """The inertia of the machine [kg m2] at a shaft that makes `ratio` turns per turn of the crank."""
        return self.outputs.J * (self.ratio / ratio) ** 2


def cycle(machine: Machine, crank_speed: float, feed: Any, points: int = 720) -> Cycle:
    """The machine over a crank turn at constant `crank_speed` [rad/s] with this `feed`."""
    angle = np.linspace(0.0, 2.0 * math.pi, points, endpoint=False)
    ratio = machine.ratio
    out = machine.outputs(angle * ratio, crank_speed * ratio, 0.0, feed)
    return Cycle(angle, out.tau * ratio, out, crank_speed, ratio)


def energy_swing(torque: Any) -> float:
    """Energy [J] that the moving masses have to store over a turn if the drive gives the mean torque: largest
    less least integral of the deviation from the mean (Wittenbauer's method with the torque at constant
    speed). The `torque` [N m] is evenly spaced in angle, shape (n,)."""
    torque = np.asarray(torque, dtype=float)
    excess = np.cumsum(torque - np.mean(torque)) * (2.0 * math.pi / len(torque))
    return float(np.ptp(excess))


def needed_inertia(swing: float, speed: float, fluctuation: float, there: float = 0.0) -> float:
    """Inertia [kg m2] that has to be added to the inertia `there` [kg m2] of a shaft, so that (largest -
    least)/mean of its `speed` [rad/s] is `fluctuation`; 0 where none is needed.

    The drive gives a constant torque, and the masses store the energy dE = `swing` [J], see `energy_swing`: J
    = dE/(fluctuation w^2).
    """
    return max(0.0, swing / (fluctuation * speed * speed) - there)
