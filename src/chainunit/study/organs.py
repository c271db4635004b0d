"""The organs of a chain unit without co-simulation: one side against both, and the limits of two bars as a
model."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..core.quantities import Value, declaration, quantity
from ..machines.api import ChainUnitMachine
from ..machines.chain_unit import SIDES, Feed, SideName, other
from ..reading.text import array_entry, entries, entry
from ..work.progress import Report
from .analysis import Analysis, Findings
from .arrays import peak
from .config import Config
from .cycle import Cycle, cycle
from .drive import Drive
from .one_sided import all_on_one, alone, without
from .organ_limits import slack_and_mode
from .record import StudyRecord
from .rig import Rig


def _cycle_alone(
    machine: ChainUnitMachine, side: SideName, crank_speed: float, feed: Feed, points: int = 720
) -> Cycle:
    """A turn with only the organ of that side, which keeps its load."""
    return cycle(alone(machine, side), crank_speed, without(other(side), feed), points)


@declaration
class OverloadFactors:
    """Five ratios of a load from one side to the load from both, each for another question; see
    `overload_factors`. The first one sizes the drive."""

    feed_crank_torque: Value = quantity("1", "crank torque, all feed on the side, ratio of cycle maxima")
    feed_rocker_torque: Value = quantity("1", "rocker torque, all feed on the side, ratio of cycle maxima")
    crank_torque: Value = quantity("1", "crank torque, organ alone, ratio of cycle maxima")
    rocker_torque: Value = quantity("1", "rocker torque, organ alone, ratio of cycle maxima")
    static_at_extreme: Value = quantity(
        "1", "static overload factor of the papers, at the extreme where it is least"
    )


def factors_for(factors: Mapping[SideName, OverloadFactors]) -> dict[str, str]:
    """The use of each overload factor, by its name; for the first one also the feed that sizes the drive."""
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
    machine: ChainUnitMachine, crank_speed: float, feed: Feed, side: SideName = "left"
) -> OverloadFactors:
    """The overload factors of the machine on its `side` against both.

    The first two factors are for one-sided feed: ratios of cycle maxima at `crank_speed` [rad/s], with all
    feed on that side over feed on both sides. Both organs are in place. The other factors are for a machine
    that has only the organ of `side`, as in the papers.

    `static_at_extreme` of the left organ is the papers' R_left/(R_left - R_right) at the right extreme of the
    rocker, at rest. For the right organ it is R_right/(R_right - R_left) at the left extreme, which is not as
    far out. The factor diverges as the swing shrinks, and its value at the extreme is its minimum; so it is
    no design factor (docs/physics.md). In the ratios of one organ alone to both, gravity and inertia cancel
    or add up, and above a certain speed both sides together are the heavier case.
    """
    extremes = machine.rocker_extremes()
    # each organ pulls hardest at the rocker where the rocker is farthest from it
    psi = extremes[0 if side == "left" else 1][0]
    static = machine.chamber(psi, 0.0, 0.0, feed.left, feed.right)
    both = cycle(machine, crank_speed, feed)
    one_sided = cycle(machine, crank_speed, all_on_one(side, feed))
    one = _cycle_alone(machine, side, crank_speed, feed)

    def ratio(x: Any, y: Any) -> float:
        whole = peak(y)
        return peak(x) / whole if whole > 0.0 else math.nan

    return OverloadFactors(
        feed_crank_torque=ratio(one_sided.crank_torque, both.crank_torque),
        feed_rocker_torque=ratio(one_sided.outputs.rocker.tau, both.outputs.rocker.tau),
        crank_torque=ratio(one.crank_torque, both.crank_torque),
        rocker_torque=ratio(one.outputs.rocker.tau, both.outputs.rocker.tau),
        static_at_extreme=ratio(getattr(static, side).tangential_load, static.rocker.tangential_load),
    )


@dataclass(frozen=True)
class Sides:
    """Cycle maxima of the torques [N m] over crank speed [rad/s], each of shape (speeds,), of rocker and
    crank, with both organs (`rocker_both`), only the left one, or only the right one."""

    speed: Any
    peaks: Mapping[str, Any]

    def crossings(self) -> dict[str, dict[SideName, list[float]]]:
        """Crank speeds at which the torque of one side alone equals that of both [rad/s], interpolated
        linearly, by torque ("rocker", "crank") and side."""
        speeds: dict[str, dict[SideName, list[float]]] = {}
        for torque in _TORQUES:
            speeds[torque] = {}
            for side in SIDES:
                excess = self.peaks[f"{torque}_{side}"] - self.peaks[f"{torque}_both"]
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
            "speed": array_entry(self.speed, "rad/s"),
            **{name: array_entry(x, "N.m") for name, x in self.peaks.items()},
            "crossings": {
                torque: {side: [entry(w, "rad/s", "speed") for w in speeds] for side, speeds in of.items()}
                for torque, of in self.crossings().items()
            },
        }


_TORQUES = ("rocker", "crank")


def sides_over_speed(machine: ChainUnitMachine, feed: Feed, highest: float = 15.0, points: int = 30) -> Sides:
    """Both organs against one alone, at crank speeds up to `highest` [rad/s]. At low speed one side alone is
    the heavier case, since nothing balances its weight; at high speed both sides are, since their inertia
    adds up."""
    speed = np.linspace(highest / points, highest, points)
    peaks: dict[str, list[float]] = {
        f"{torque}_{which}": [] for torque in _TORQUES for which in ("both", *SIDES)
    }
    for w in speed:
        turns = {"both": cycle(machine, float(w), feed, 360)} | {
            side: _cycle_alone(machine, side, float(w), feed, 360) for side in SIDES
        }
        for which, turn in turns.items():
            peaks[f"rocker_{which}"].append(peak(turn.outputs.rocker.tau))
            peaks[f"crank_{which}"].append(peak(turn.crank_torque))
    return Sides(speed, {name: np.array(sizes) for name, sizes in peaks.items()})


@declaration
class Limits:
    """The limits of two bars as a model."""

    slack_speed: Value = quantity(
        "rad/s", "crank speed at which a web first goes slack with this feed", kind="speed"
    )
    slack_speed_empty: Value = quantity(
        "rad/s", "crank speed at which a web first goes slack, empty", kind="speed"
    )
    chain_resonance: Value = quantity(
        "rad/s", "crank speed at the lowest natural frequency of an organ as a chain", kind="speed"
    )
    rocker_extreme_right: Value = quantity("rad", "right extreme of the rocker")
    rocker_extreme_left: Value = quantity("rad", "left extreme of the rocker")
    margin: Value = quantity("1", "least |sin| of the transmission angles over the turn")


@dataclass(frozen=True)
class OrganFindings(Findings):
    """The torques that the organs of a chain unit cause at constant speed: one side against both, also over
    the speed, and the limits of two bars."""

    factors: dict[SideName, OverloadFactors]
    """overload factors, by side"""
    sides: Sides
    limits: Limits

    def as_dict(self) -> dict[str, Any]:
        """Ready for JSON."""
        uses = factors_for(self.factors)
        return {
            "overload_factors": {
                side: {name: factor | {"for": uses[name]} for name, factor in entries(factors).items()}
                for side, factors in self.factors.items()
            },
            "limits": entries(self.limits),
            "sides_over_speed": self.sides.as_dict(),
        }

    def remark(self, study: StudyRecord) -> None:
        """No remarks: the numbers are enough."""


class OrganAnalysis(Analysis):
    """The organs of a chain unit with the feed of normal running."""

    name = "organs"

    @staticmethod
    def applies(config: Config, drive: Drive) -> bool:
        """Whether the machine has working organs on its sides."""
        return bool(drive.machine.model.sides)

    @staticmethod
    def find(study: StudyRecord, rig: Rig, report: Report) -> OrganFindings:
        """The findings for two bars, also where the organs are chains."""
        machine, feed, speed = study.drive.chain_unit, study.config.feed, study.config.run.crank_speed
        (right, _), (left, _) = machine.rocker_extremes()
        slack, mode = slack_and_mode(machine, feed)
        return OrganFindings(
            factors={side: overload_factors(machine, speed, feed, side) for side in SIDES},
            sides=sides_over_speed(machine, feed),
            limits=Limits(
                slack_speed=slack,
                slack_speed_empty=machine.slack_speed(),
                chain_resonance=mode,
                rocker_extreme_right=right,
                rocker_extreme_left=left,
                margin=float(np.min(study.statics.normal.outputs.margin)),
            ),
        )
