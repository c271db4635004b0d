"""The organs of a chain unit without co-simulation: one side against both, and the limits of two bars as a
model."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...core.quantities import Value, declaration, quantity
from ...machines.api import ChainUnitMachine
from ...machines.chain_unit import SIDES, Feed, SideName
from ...reading.results import InUnit, derived, part, result
from ...study.analysis import Analysis, Findings, Work
from ...study.arrays import peak
from ...study.cycle import cycle
from ...study.organ_limits import two_bar_limits
from ...study.record import StudyRecord
from .factors import OverloadFactors, cycle_alone, overload_factors


@result
class Factor:
    """An overload factor."""

    value: Any = part("the factor", unit="1", inline=True)
    use: str = part("the question that it answers", name="for")


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


@result
class Sides:
    """Both organs against one alone over the crank speed."""

    speed: Any = quantity("rad/s", "crank speeds")
    peaks: Mapping[str, Any] = part(
        "cycle maxima of the torques of rocker and crank, with both organs (`rocker_both`), only the left one, or "
        "only the right one",
        unit="N.m",
        inline=True,
    )

    @derived()
    def crossings(self) -> dict[str, dict[SideName, list[InUnit]]]:
        """Crank speeds at which the torque of one side alone equals that of both, interpolated linearly, by torque
        ("rocker", "crank") and side."""
        speeds: dict[str, dict[SideName, list[InUnit]]] = {}
        for torque in _TORQUES:
            speeds[torque] = {}
            for side in SIDES:
                excess = self.peaks[f"{torque}_{side}"] - self.peaks[f"{torque}_both"]
                places = np.flatnonzero(np.diff(np.sign(excess)) != 0)
                slope = np.diff(excess)[places]
                roots = (
                    self.speed[k] - excess[k] * (self.speed[k + 1] - self.speed[k]) / d
                    for k, d in zip(places, slope, strict=True)
                )
                speeds[torque][side] = [InUnit(float(w), "rad/s", "speed") for w in roots]
        return speeds


_TORQUES = ("rocker", "crank")


def sides_over_speed(machine: ChainUnitMachine, feed: Feed, highest: float = 15.0, points: int = 30) -> Sides:
    """Both organs against one alone, at crank speeds up to `highest` [rad/s]. At low speed one side alone is
    the heavier case, since nothing balances its weight; at high speed both sides are, since their inertia
    adds up."""
    speed = np.linspace(highest / points, highest, points)
    peaks: dict[str, list[float]] = {
        f"{torque}_{feed_case}": [] for torque in _TORQUES for feed_case in ("both", *SIDES)
    }
    for w in speed:
        turns = {"both": cycle(machine, float(w), feed, 360)} | {
            side: cycle_alone(machine, side, float(w), feed, 360) for side in SIDES
        }
        for feed_case, turn in turns.items():
            peaks[f"rocker_{feed_case}"].append(peak(turn.outputs.rocker.tau))
            peaks[f"crank_{feed_case}"].append(peak(turn.crank_torque))
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
    crank_torque_speed: Value = quantity(
        "rad/s", "crank speed up to which the crank torque of two bars is good to 10 %", kind="speed"
    )
    rocker_torque_speed: Value = quantity(
        "rad/s", "crank speed up to which the rocker torque of two bars is good to 10 %", kind="speed"
    )
    rocker_extreme_right: Value = quantity("rad", "right extreme of the rocker")
    rocker_extreme_left: Value = quantity("rad", "left extreme of the rocker")
    margin: Value = quantity("1", "least |sin| of the transmission angles over the turn")


@result
class OrganFindings(Findings):
    """The torques that the organs of a chain unit cause at constant speed: one side against both, also over
    the speed, and the limits of two bars."""

    factors: dict[SideName, OverloadFactors]
    """overload factors, by side"""
    sides: Sides = part("one side against both over the crank speed", name="sides_over_speed")
    limits: Limits = part("the limits of two bars as a model")

    @derived()
    def overload_factors(self) -> dict[SideName, dict[str, Factor]]:
        """Overload factors, by side, each with its use."""
        uses = factors_for(self.factors)
        return {
            side: {name: Factor(x, uses[name]) for name, x in vars(factors).items()}
            for side, factors in self.factors.items()
        }


class OrganAnalysis(Analysis):
    """The organs of a chain unit with the feed of normal running."""

    name = "organs"
    applies = staticmethod(lambda drive, plans: bool(drive.machine.model.sides))

    @staticmethod
    def find(study: StudyRecord, work: Work) -> OrganFindings:
        """The findings for two bars, also where the organs are chains."""
        setup = study.setup
        machine, feed, speed = setup.drive.chain_unit, setup.config.feed, setup.config.run.crank_speed
        (right, _), (left, _) = machine.rocker_extremes()
        empties = any(setup.config.events[name].empties for name in study.runs.overloads)
        mode, limits = two_bar_limits(machine, feed, empties=empties)
        good = {limit.topic: limit.speed for limit in limits}
        return OrganFindings(
            factors={side: overload_factors(machine, speed, feed, side) for side in SIDES},
            sides=sides_over_speed(machine, feed),
            limits=Limits(
                slack_speed=good["slack speed"],
                slack_speed_empty=machine.slack_speed(),
                chain_resonance=mode,
                crank_torque_speed=good["crank torque"],
                rocker_torque_speed=good["rocker torque"],
                rocker_extreme_right=right,
                rocker_extreme_left=left,
                margin=float(np.min(setup.statics.normal.outputs.margin)),
            ),
        )
