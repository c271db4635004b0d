"""Feed and organs of a chain unit on one side alone."""

from __future__ import annotations

from ..machines.api import EMPTY, ChainUnitMachine
from ..machines.chain_unit import Feed, SideLoads, SideName, other


def all_on_one(side: SideName, feed: Feed) -> Feed:
    """The feed with which the organ of `side` has the load of both organs."""
    left, right = feed.left, feed.right
    whole = SideLoads(
        material_mass=left.material_mass + right.material_mass,
        processing_force=left.processing_force + right.processing_force,
    )
    return Feed(left=whole, right=EMPTY) if side == "left" else Feed(left=EMPTY, right=whole)


def without(side: SideName, feed: Feed) -> Feed:
    """The feed with the organ of that side empty."""
    return Feed(left=feed.left, right=EMPTY) if side == "right" else Feed(left=EMPTY, right=feed.right)


def alone(machine: ChainUnitMachine, side: SideName) -> ChainUnitMachine:
    """The machine with its organ of that side alone: the papers' one-sided loading."""
    gone = other(side)
    return machine.replace({f"{gone}.wall_mass": 0.0, f"{gone}.web_mass": 0.0})


def one_sided_feeds(feed: Feed) -> dict[str, Feed]:
    """The feed of both sides and the one-sided feeds, by the name of the case."""
    return {
        "both sides": feed,
        "right side empty": without("right", feed),
        "left side empty": without("left", feed),
        "all feed on the left": all_on_one("left", feed),
        "all feed on the right": all_on_one("right", feed),
    }
