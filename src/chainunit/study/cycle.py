"""Crank turns at constant speed: the torque that the machine needs, by inverse dynamics, in each of its load
cases."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..core.quantities import Layout
from ..machines.across import PLACES, middle_of
from ..machines.chain_unit import Feed, SideName, other
from ..machines.machine import Machine
from .arrays import above_noise, peak


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
    return above_noise(float(np.ptp(excess)), 2.0 * math.pi * peak(torque))


def needed_inertia(swing: float, speed: float, fluctuation: float, there: float = 0.0) -> float:
    """Inertia [kg m2] that has to be added to the inertia `there` [kg m2] of a shaft, so that (largest -
    least)/mean of its `speed` [rad/s] is `fluctuation`; 0 where none is needed.

    The drive gives a constant torque, and the masses store the energy dE = `swing` [J], see `energy_swing`: J
    = dE/(fluctuation w^2).
    """
    return max(0.0, swing / (fluctuation * speed * speed) - there)


def all_on_one(side: SideName, feed: Feed) -> Feed:
    """The feed with which the organ of `side` has the load of both organs."""
    organ, opposite = getattr(feed, side), getattr(feed, other(side))
    whole = {load: getattr(organ, load) + getattr(opposite, load) for load in PLACES}
    for load, place in PLACES.items() if hasattr(organ, "across") else ():
        whole[place] = middle_of(*((getattr(x, load), getattr(x, place)) for x in (organ, opposite)))
    return without(other(side), replace(feed, **{side: replace(organ, **whole)}))


def without(side: SideName, feed: Feed) -> Feed:
    """The feed with the organ of that side empty."""
    return replace(feed, **{side: replace(getattr(feed, side), **dict.fromkeys(PLACES, 0.0))})


def one_sided_feeds(feed: Feed) -> dict[str, Feed]:
    """The feed of both sides and the one-sided feeds, by the name of the case."""
    return {
        "both sides": feed,
        "right side empty": without("right", feed),
        "left side empty": without("left", feed),
        "all feed on the left": all_on_one("left", feed),
        "all feed on the right": all_on_one("right", feed),
    }


def no_feed(feed: Any) -> Any:
    """A feed of the same kind without material; a quantity that cannot be zero has its start value."""
    layout = Layout(type(feed))
    return layout.instance([0.0 if v.quantity.admits(0.0) else v.quantity.start for v in layout.variables])


def turns_by_load(machine: Machine, crank_speed: float, feed: Any) -> dict[str, Cycle]:
    """The turns of a machine at that speed of its crank [rad/s], by load case: normal running with this `feed`, and
    the one-sided cases, or that without feed."""
    sided = bool(machine.model.sides)
    feeds = one_sided_feeds(feed) if sided else {"normal running": feed, "without feed": no_feed(feed)}
    return {name: cycle(machine, crank_speed, load) for name, load in feeds.items()}
