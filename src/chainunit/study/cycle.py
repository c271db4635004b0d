"""One crank turn at constant speed: the torque that the mechanism takes, by inverse dynamics."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..machines.api import EMPTY, ChainUnit
from ..machines.chain_unit import SIDES, SideLoads, SideName, other
from ..quantities import Value, declaration, quantity
from ..text import entry


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


def all_on_one(side: SideName, left: SideLoads, right: SideLoads) -> tuple[SideLoads, SideLoads]:
    """Loads of the left and of the right organ where that of `side` has the load of both."""
    whole = SideLoads(
        material_mass=left.material_mass + right.material_mass,
        processing_force=left.processing_force + right.processing_force,
    )
    return (whole, EMPTY) if side == "left" else (EMPTY, whole)


def alone(machine: ChainUnit, side: SideName) -> ChainUnit:
    """The machine with its organ of that side alone: the papers' one-sided loading."""
    gone = other(side)
    return machine.replace({f"{gone}.wall_mass": 0.0, f"{gone}.web_mass": 0.0})


def _cycle_alone(
    machine: ChainUnit,
    side: SideName,
    crank_speed: float,
    left: SideLoads,
    right: SideLoads,
    points: int = 720,
) -> Cycle:
    """A turn with the organ of that side alone, which keeps its load."""
    loads = (left, EMPTY) if side == "left" else (EMPTY, right)
    return cycle(alone(machine, side), crank_speed, *loads, points)


@declaration
class OverloadFactors:
    """How much more one side asks than both, five ways for as many questions; see `overload_factors`. The first is
    the one that sizes the drive."""

    feed_crank_torque: Value = quantity("1", "crank torque, all feed on the side, ratio of cycle maxima")
    feed_rocker_torque: Value = quantity("1", "rocker torque, all feed on the side, ratio of cycle maxima")
    crank_torque: Value = quantity("1", "crank torque, organ alone, ratio of cycle maxima")
    rocker_torque: Value = quantity("1", "rocker torque, organ alone, ratio of cycle maxima")
    static_at_extreme: Value = quantity(
        "1", "R/(R - R of the other organ), at rest at the extreme where it is least"
    )


def factors_for(factors: Mapping[SideName, OverloadFactors]) -> dict[str, str]:
    """The use of each overload factor, by its name; of the first, the feed that sizes the drive."""
    side = max(factors, key=lambda name: factors[name].feed_crank_torque)
    feed = f"all on the {side}" if factors[side].feed_crank_torque > 1.0 else "on both sides"
    return {
        "feed_crank_torque": f"feed {feed} sizes the drive: gear, motor, crank pin",
        "feed_rocker_torque": "strength of rocker, pivot, organ bearings",
        "crank_torque": "drive of a machine with one organ",
        "rocker_torque": "rocker of a machine with one organ",
        "static_at_extreme": "comparison with the papers; no design factor",
    }


def overload_factors(
    machine: ChainUnit, crank_speed: float, left: SideLoads, right: SideLoads, side: SideName = "left"
) -> OverloadFactors:
    """The overload factors of the machine on its `side` against both.

    The first two are for one-sided feed: ratios of cycle maxima at `crank_speed`, all feed on that side to feed
    on both, with both organs in place. The others are of a machine with its organ of `side` alone, as the papers'.

    `static_at_extreme` is, of the left organ, the papers' R_left/(R_left - R_right) at the right extreme of the
    rocker, at rest; of the right organ R_right/(R_right - R_left) at the left extreme, which is not as far out.
    It diverges as the swing shrinks, and its value at the extreme is its minimum, so that it is no design
    factor (docs/physics.md). In the ratios of one organ alone to both, gravity and inertia cancel or add up, and
    above a certain speed both sides together are the heavier case.
    """
    extremes = machine.rocker_extremes()
    # each organ pulls hardest at the rocker where this is farthest from it
    psi = extremes[0 if side == "left" else 1][0]
    static = machine.chamber(psi, 0.0, 0.0, left, right)
    both = cycle(machine, crank_speed, left, right)
    fed = cycle(machine, crank_speed, *all_on_one(side, left, right))
    one = _cycle_alone(machine, side, crank_speed, left, right)

    def ratio(x: Any, y: Any) -> float:
        whole = float(np.max(np.abs(y)))
        return float(np.max(np.abs(x))) / whole if whole > 0.0 else math.nan

    return OverloadFactors(
        feed_crank_torque=ratio(fed.crank_torque, both.crank_torque),
        feed_rocker_torque=ratio(fed.outputs.rocker.tau, both.outputs.rocker.tau),
        crank_torque=ratio(one.crank_torque, both.crank_torque),
        rocker_torque=ratio(one.outputs.rocker.tau, both.outputs.rocker.tau),
        static_at_extreme=ratio(getattr(static, side).tangential_load, static.rocker.tangential_load),
    )


@dataclass(frozen=True)
class Sides:
    """Cycle maxima of the torques [N m] over crank speed [rad/s], each of shape (speeds,): with both organs, with the
    left one alone, with the right one alone; and where one alone and both are alike."""

    speed: Any
    rocker_both: Any
    rocker_left: Any
    rocker_right: Any
    crank_both: Any
    crank_left: Any
    crank_right: Any

    def crossings(self) -> dict[str, dict[SideName, list[float]]]:
        """Crank speeds at which one side alone and both ask the same [rad/s], linear between the points, by torque
        ("rocker", "crank") and side."""
        speeds: dict[str, dict[SideName, list[float]]] = {}
        for torque in _TORQUES:
            speeds[torque] = {}
            for side in SIDES:
                excess = getattr(self, f"{torque}_{side}") - getattr(self, f"{torque}_both")
                at = np.flatnonzero(np.diff(np.sign(excess)) != 0)
                slope = np.diff(excess)[at]
                speeds[torque][side] = [
                    float(self.speed[k] - excess[k] * (self.speed[k + 1] - self.speed[k]) / d)
                    for k, d in zip(at, slope, strict=True)
                ]
        return speeds

    def as_dict(self) -> dict[str, Any]:
        """Ready for JSON, with units."""
        return {
            "speed": {"value": self.speed.tolist(), "unit": "rad/s"},
            **{name: {"value": getattr(self, name).tolist(), "unit": "N.m"} for name in _MAXIMA},
            "crossings": {
                torque: {side: [entry(w, "rad/s", "speed") for w in speeds] for side, speeds in of.items()}
                for torque, of in self.crossings().items()
            },
        }


_TORQUES = ("rocker", "crank")
_MAXIMA = tuple(f"{torque}_{which}" for torque in _TORQUES for which in ("both", *SIDES))


def sides_over_speed(
    machine: ChainUnit, left: SideLoads, right: SideLoads, highest: float = 15.0, points: int = 30
) -> Sides:
    """Two-sided against one-sided over crank speeds up to `highest` [rad/s]: at low speed one side alone is the
    heavier case, since nothing balances its weight; at high speed both are, since inertia adds up."""
    speed = np.linspace(highest / points, highest, points)
    peaks: dict[str, list[float]] = {name: [] for name in _MAXIMA}
    for w in speed:
        turns = {"both": cycle(machine, float(w), left, right, 360)} | {
            side: _cycle_alone(machine, side, float(w), left, right, 360) for side in SIDES
        }
        for which, turn in turns.items():
            peaks[f"rocker_{which}"].append(float(np.max(np.abs(turn.outputs.rocker.tau))))
            peaks[f"crank_{which}"].append(float(np.max(np.abs(turn.crank_torque))))
    return Sides(speed, **{name: np.array(found) for name, found in peaks.items()})
