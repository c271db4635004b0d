"""How far two bars are a model of the organs of a chain unit: the crank speeds up to which they are, without a run;
and the least pulls along the rods in a run."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from operator import itemgetter
from typing import Any

import numpy as np

from ..core.quantities import Layout
from ..machines.api import ChainUnitMachine
from ..machines.chain_unit import RODS, SIDES, RodName, SideLoads
from ..machines.machine import Machine
from ..reading.results import derived, part, result
from .arrays import Dataset
from .drive import Drive

ROCKER_GOOD, ROCKER_GOOD_EMPTY, CRANK_GOOD = 0.4, 0.2, 0.6
"""Crank speeds, relative to the lowest natural frequency of the organ, up to which two bars give the rocker
torque (loaded, with an empty side) and the crank torque to a tenth of the peak of chains; found on the
packaged machine, see docs/physics.md."""

_BEYOND = {
    "slack speed": "Crank speed at or above the speed at which a web goes slack",
    "crank torque": "Crank speed too high for the crank torque of two bars, which may be off by more than 10 %; the "
    "limit for the rocker torque is lower",
    "rocker torque": "Crank speed too high for the rocker torque of two bars, which may be off by more than 10 %",
}
"""By limit of the crank speed, the words on speeds beyond it."""
_UNITS_OF_MOTION = ("1", "rad", "rad/s", "rad/s2", "m", "m/s", "m/s2")
"""Units of quantities of a turn that the loads of the organs do not change."""


@result
class SpeedLimit:
    """A limit of the crank speed for two bars as a model of the organs."""

    topic: str = part("kind of limit, as of a reason")
    speed: float = part("crank speed", unit="rad/s", kind="speed", name="limit")
    grave: bool = False

    def passed(self, speed: Any) -> Any:
        """Whether each crank speed [rad/s] is beyond the limit, shape of `speed`."""
        return speed >= self.speed if self.topic == "slack speed" else speed > self.speed

    @derived(name="text")
    def words(self) -> str:
        """The begin of a sentence on speeds beyond it."""
        return _BEYOND[self.topic]


def speed_limits(slack_speed: float, mode: float, empty: bool = False) -> tuple[SpeedLimit, ...]:
    """The limits of the crank speed for two bars: that of slack webs, of the crank torque and of the rocker torque.

    Parameters
    ----------
    slack_speed, mode : see `two_bars`
    empty : whether a side carries no material
    """
    return (
        SpeedLimit("slack speed", slack_speed, grave=True),
        SpeedLimit("crank torque", CRANK_GOOD * mode, grave=True),
        SpeedLimit("rocker torque", (ROCKER_GOOD_EMPTY if empty else ROCKER_GOOD) * mode),
    )


def passed_limits(limits: Iterable[SpeedLimit], speed: float) -> list[SpeedLimit]:
    """The limits that a crank speed [rad/s] passes. Where the crank torque may be wrong, the rocker torque is not
    named beside it."""
    passed = [limit for limit in limits if limit.passed(speed)]
    whole = any(limit.topic == "crank torque" for limit in passed)
    return [limit for limit in passed if not (whole and limit.topic == "rocker torque")]


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


@dataclass(frozen=True)
class LeastPull:
    """The least pull in a kind of rod on either side in a run [N]: at an `end`, just inside this `pin`, and the least
    `mean` of a rod. A rod is slack where its mean pull is negative."""

    end: float
    pin: str
    mean: float


def least_pulls(drive: Drive, run: Dataset, sides: tuple[str, ...]) -> dict[RodName, LeastPull]:
    """The least pulls in webs and walls of the `sides`; empty where there is none, and where the organs of the run
    are not two bars."""
    machine = drive.simulated_machine
    if not sides or not isinstance(machine, ChainUnitMachine):
        return {}
    left_loads, right_loads = (
        SideLoads(**{load: run[f"machine.{side}.{load}"].values for load in Layout(SideLoads).names})
        for side in SIDES
    )
    psi, w, a = (run[f"machine.rocker.{name}"].values for name in ("psi", "w", "a"))
    pulls = machine.organ_pulls(psi, w, a, left_loads, right_loads)
    least: dict[RodName, LeastPull] = {}
    for rod in RODS:
        ends = [pulls[side][rod] for side in SIDES if side in sides]
        by_pin = ((float(np.min(pull)), pin) for pin_pulls in ends for pin, pull in pin_pulls.items())
        mean = min(float(np.min(sum(pin_pulls.values()))) / 2.0 for pin_pulls in ends)
        least[rod] = LeastPull(*min(by_pin, key=itemgetter(0)), mean)
    return least
