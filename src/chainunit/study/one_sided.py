"""Feed and organs of a chain unit on one side alone."""

from __future__ import annotations

from ..machines.api import EMPTY, ChainUnit
from ..machines.chain_unit import Feed, SideLoads, SideName, other
from .cycle import Cycle, cycle


def all_on_one(side: SideName, feed: Feed) -> Feed:
    """The feed where the organ of `side` has the load of both."""
    left, right = feed.left, feed.right
    whole = SideLoads(
        material_mass=left.material_mass + right.material_mass,
        processing_force=left.processing_force + right.processing_force,
    )
    return Feed(left=whole, right=EMPTY) if side == "left" else Feed(left=EMPTY, right=whole)


def without(side: SideName, feed: Feed) -> Feed:
    """The feed with the organ of that side empty."""
    return Feed(left=feed.left, right=EMPTY) if side == "right" else Feed(left=EMPTY, right=feed.right)


def alone(machine: ChainUnit, side: SideName) -> ChainUnit:
    """The machine with its organ of that side alone: the papers' one-sided loading."""
    gone = other(side)
    return machine.replace({f"{gone}.wall_mass": 0.0, f"{gone}.web_mass": 0.0})


def organ_cycles(machine: ChainUnit, crank_speed: float, feed: Feed) -> dict[str, Cycle]:
    """Turns at constant speed, by how the organs are loaded."""
    loads = {
        "both sides": feed,
        "right side empty": without("right", feed),
        "left side empty": without("left", feed),
        "all feed on the left": all_on_one("left", feed),
        "all feed on the right": all_on_one("right", feed),
    }
    return {name: cycle(machine, crank_speed, each) for name, each in loads.items()}
