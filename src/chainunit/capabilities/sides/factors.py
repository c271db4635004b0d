"""The factors of a load from one side of a chain unit over that from both, at constant speed."""

from __future__ import annotations

import math
from typing import Any

from ...core.quantities import Value, declaration, quantity
from ...machines.api import ChainUnitMachine
from ...machines.chain_unit import Feed, SideName, other
from ...study.arrays import peak
from ...study.cycle import Cycle, all_on_one, cycle, without


def alone(machine: ChainUnitMachine, side: SideName) -> ChainUnitMachine:
    """The machine with its organ of that side alone: the papers' one-sided loading."""
    gone = other(side)
    return machine.replace({f"{gone}.wall_mass": 0.0, f"{gone}.web_mass": 0.0})


def cycle_alone(
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
    normal = cycle(machine, crank_speed, feed)
    one_sided = cycle(machine, crank_speed, all_on_one(side, feed))
    alone = cycle_alone(machine, side, crank_speed, feed)

    def ratio(x: Any, y: Any) -> float:
        whole = peak(y)
        return peak(x) / whole if whole > 0.0 else math.nan

    return OverloadFactors(
        feed_crank_torque=ratio(one_sided.crank_torque, normal.crank_torque),
        feed_rocker_torque=ratio(one_sided.outputs.rocker.tau, normal.outputs.rocker.tau),
        crank_torque=ratio(alone.crank_torque, normal.crank_torque),
        rocker_torque=ratio(alone.outputs.rocker.tau, normal.outputs.rocker.tau),
        static_at_extreme=ratio(getattr(static, side).tangential_load, static.rocker.tangential_load),
    )
