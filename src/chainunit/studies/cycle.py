"""One crank turn at constant speed: what the mechanism asks of the drive, by inverse dynamics."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from ..machines.api import EMPTY, ChainUnit
from ..machines.chain_unit import SideLoads
from ..quantities import Value, declaration, quantity


@dataclass(frozen=True)
class Cycle:
    """Outputs of the machine over `angle`, the crank angle [rad], shape (points,)."""

    angle: Any
    crank_torque: Any
    """[N m]"""
    outputs: Any
    """as `Outputs`; of chains the `tau` and `J` alone"""


def cycle(
    machine: ChainUnit, crank_speed: float, left: SideLoads, right: SideLoads, points: int = 720
) -> Cycle:
    """The machine over a crank turn at constant `crank_speed` [rad/s]."""
    angle = np.linspace(0.0, 2.0 * math.pi, points, endpoint=False)
    ratio = machine.p.ratio
    out = machine.forces(angle * ratio, crank_speed * ratio, 0.0, left, right)
    return Cycle(angle, out.tau * ratio, out)


def all_on_one(
    side: Literal["left", "right"], left: SideLoads, right: SideLoads
) -> tuple[SideLoads, SideLoads]:
    """Loads of the left and of the right organ where that of `side` has what both carry."""
    whole = SideLoads(
        material_mass=left.material_mass + right.material_mass,
        processing_force=left.processing_force + right.processing_force,
    )
    return (whole, EMPTY) if side == "left" else (EMPTY, whole)


def without_right(machine: ChainUnit) -> ChainUnit:
    """The machine with its left organ alone: the papers' one-sided loading."""
    return machine.replace({"right.wall_mass": 0.0, "right.web_mass": 0.0})


@declaration
class OverloadFactors:
    """How much more one side alone asks than both, three ways for three questions; see `overload_factors`. The first
    is the one that sizes the drive."""

    crank_torque: Value = quantity("1", "crank torque, ratio of cycle maxima")
    rocker_torque: Value = quantity("1", "rocker torque, ratio of cycle maxima")
    static_at_extreme: Value = quantity("1", "R_left/(R_left - R_right) at the right extreme, at rest")


FACTOR_FOR = {
    "crank_torque": "sizes the drive: gear, motor, crank pin",
    "rocker_torque": "strength of rocker, pivot, organ bearings",
    "static_at_extreme": "comparison with the papers; no design factor",
}
"""What each overload factor is for."""


def overload_factors(
    machine: ChainUnit, crank_speed: float, left: SideLoads, right: SideLoads
) -> OverloadFactors:
    """The overload factor of a one-sided machine.

    `static_at_extreme` is the papers' R_left/(R_left - R_right) at the right extreme of the rocker, at rest:
    it diverges as the swing shrinks, and its value at the extreme is its minimum, so that it is no design
    factor (docs/physics.md). The other two are ratios of cycle maxima at `crank_speed`, left organ alone to
    both, of the rocker torque and of the crank torque: gravity and inertia cancel or add up there, and above
    a certain speed both sides together are the heavier case.
    """
    (psi, _), _ = machine.rocker_extremes()
    static = machine.chamber(psi, 0.0, 0.0, left, right)
    both = cycle(machine, crank_speed, left, right)
    alone = cycle(without_right(machine), crank_speed, left, EMPTY)

    def ratio(x: Any, y: Any) -> float:
        whole = float(np.max(np.abs(y)))
        return float(np.max(np.abs(x))) / whole if whole > 0.0 else math.nan

    return OverloadFactors(
        crank_torque=ratio(alone.crank_torque, both.crank_torque),
        rocker_torque=ratio(alone.outputs.rocker.tau, both.outputs.rocker.tau),
        static_at_extreme=ratio(static.left.tangential_load, static.rocker.tangential_load),
    )


@dataclass(frozen=True)
class Sides:
    """Cycle maxima of the torques with both organs and with the left one alone over crank speed [rad/s], each of
    shape (speeds,), and where the two are alike."""

    speed: Any
    rocker_both: Any
    rocker_alone: Any
    crank_both: Any
    crank_alone: Any

    def crossings(self) -> dict[str, list[float]]:
        """Crank speeds at which one side alone and both ask the same [rad/s], linear between the points."""
        found = {}
        for name in ("rocker", "crank"):
            excess = getattr(self, f"{name}_alone") - getattr(self, f"{name}_both")
            at = np.flatnonzero(np.diff(np.sign(excess)) != 0)
            slope = np.diff(excess)[at]
            found[name] = [
                float(self.speed[k] - excess[k] * (self.speed[k + 1] - self.speed[k]) / d)
                for k, d in zip(at, slope, strict=True)
            ]
        return found

    def as_dict(self) -> dict[str, Any]:
        """Ready for JSON, with units."""
        torques = ("rocker_both", "rocker_alone", "crank_both", "crank_alone")
        return {
            "speed": {"value": self.speed.tolist(), "unit": "rad/s"},
            **{name: {"value": getattr(self, name).tolist(), "unit": "N.m"} for name in torques},
            "crossings": {n: {"value": v, "unit": "rad/s"} for n, v in self.crossings().items()},
        }


def sides_over_speed(
    machine: ChainUnit, left: SideLoads, right: SideLoads, highest: float = 15.0, points: int = 30
) -> Sides:
    """Two-sided against one-sided over crank speeds up to `highest` [rad/s]: at low speed one side alone is the
    heavier case, since nothing balances its weight; at high speed both are, since inertia adds up."""
    speed = np.linspace(highest / points, highest, points)
    alone_machine = without_right(machine)
    peaks: dict[str, list[float]] = {name: [] for name in ("rb", "ra", "cb", "ca")}
    for w in speed:
        both = cycle(machine, float(w), left, right, 360)
        alone = cycle(alone_machine, float(w), left, EMPTY, 360)
        for name, torque in (
            ("rb", both.outputs.rocker.tau),
            ("ra", alone.outputs.rocker.tau),
            ("cb", both.crank_torque),
            ("ca", alone.crank_torque),
        ):
            peaks[name].append(float(np.max(np.abs(torque))))
    return Sides(speed, *(np.array(peaks[name]) for name in ("rb", "ra", "cb", "ca")))
