"""The crank speeds up to which two bars are a model of the organs of a machine, without a run."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

from ..machines.api import ChainUnitMachine
from ..machines.machine import Machine
from .verdict import SpeedLimit, speed_limits

_UNITS_OF_MOTION = ("1", "rad", "rad/s", "rad/s2", "m", "m/s", "m/s2")
"""Units of quantities of a turn that the loads of the organs do not change."""


@lru_cache(maxsize=16)
def slack_and_mode(machine: ChainUnitMachine, feed: Any) -> tuple[float, float]:
    """The crank speed at which a web first goes slack, and the lowest natural frequency of an organ as a chain
    [rad/s]; infinite where there is none."""
    modes = machine.chain_modes(feed.left, feed.right)
    slack = machine.slack_speed(feed.left, feed.right)
    return slack, math.inf if modes is None else float(modes.frequency[0])


def has_empty_side(feed: Any) -> bool:
    """Whether a side of a chain unit carries no material."""
    return 0.0 in (feed.left.material_mass, feed.right.material_mass)


def two_bar_limits(
    machine: ChainUnitMachine, feed: Any, *, empties: bool = False
) -> tuple[float, tuple[SpeedLimit, ...]]:
    """The lowest natural frequency of an organ as a chain [rad/s], infinite where there is none, and the limits of
    the crank speed for two bars. With `empties` a side is empty at times."""
    slack, mode = slack_and_mode(machine, feed)
    return mode, speed_limits(slack, mode, empties or has_empty_side(feed))


def limits_of_organs(
    machine: Machine, feed: Any, units: Sequence[str], *, empties: bool = False
) -> tuple[SpeedLimit, ...]:
    """The limits of the crank speed for quantities of these `units`; none for a machine without organs, and where no
    quantity depends on their loads. With `empties` a side is empty at times."""
    if not isinstance(machine, ChainUnitMachine) or not machine.model.sides:
        return ()
    if all(unit in _UNITS_OF_MOTION for unit in units):
        return ()
    return two_bar_limits(machine, feed, empties=empties)[1]
