"""Results without co-simulation: turns at constant speed, overload factors, and where the model ends."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..drives.speed_control import Loop
from ..errors import InputError
from ..machines.api import EMPTY
from ..machines.chain_unit import SIDES, SideName
from ..quantities import Value, declaration, quantity
from .config import Config
from .cycle import Cycle, OverloadFactors, Sides, all_on_one, cycle, overload_factors, sides_over_speed
from .drive import Drive
from .shaft import Torsion, torsion


@declaration
class Limits:
    """Where the model ends."""

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
class DriveStatics:
    """Results on a machine and its drive before they run."""

    cycles: dict[str, Cycle]
    """turns at constant speed, by how the organs are loaded"""
    factors: dict[SideName, OverloadFactors]
    """of the organ of that side alone"""
    sides: Sides
    limits: Limits
    loops: dict[str, Loop] = field(default_factory=dict)
    """the linearised speed loop of a controlled motor, by which inertia"""
    torsion: Torsion | None = None
    """of the driveline, if there is one"""


def statics(config: Config, drive: Drive) -> DriveStatics:
    """Everything of a study that needs no co-simulation.

    Raises
    ------
    InputError
        where the communication step is too long for the driveline.
    """
    machine, feed, w = drive.machine, config.feed, config.run.crank_speed
    cycles = {
        "both sides": cycle(machine, w, feed.left, feed.right),
        "right side empty": cycle(machine, w, feed.left, EMPTY),
        "left side empty": cycle(machine, w, EMPTY, feed.right),
        "all feed on the left": cycle(machine, w, *all_on_one("left", feed.left, feed.right)),
        "all feed on the right": cycle(machine, w, *all_on_one("right", feed.left, feed.right)),
    }
    both = cycles["both sides"].outputs
    (right, _), (left, _) = machine.rocker_extremes()
    modes = machine.chain_modes(feed.left, feed.right)
    return DriveStatics(
        cycles=cycles,
        factors={side: overload_factors(machine, w, feed.left, feed.right, side) for side in SIDES},
        sides=sides_over_speed(machine, feed.left, feed.right),
        limits=Limits(
            slack_speed=machine.slack_speed(feed.left, feed.right),
            slack_speed_empty=machine.slack_speed(),
            chain_resonance=math.inf if modes is None else float(modes.frequency[0]),
            rocker_extreme_right=right,
            rocker_extreme_left=left,
            margin=float(np.min(both.margin)),
        ),
        loops={} if drive.foreign else _loops(drive, both.J),
        torsion=None if drive.line is None else _torsion(config, drive, both.J),
    )


def _loops(drive: Drive, inertia: Any) -> dict[str, Loop]:
    """The speed loop with the mean, the least and the largest inertia of the turn, where the motor has one."""
    sizes = {
        "mean inertia": np.mean(inertia),
        "least inertia": np.min(inertia),
        "largest inertia": np.max(inertia),
    }
    loops = {
        name: drive.motor.speed_loop(drive.parameters, drive.rotor_inertia + float(size))
        for name, size in sizes.items()
    }
    return {name: loop for name, loop in loops.items() if loop is not None}


def _torsion(config: Config, drive: Drive, inertia: Any) -> Torsion:
    """The line's natural frequencies, for which the communication step has to be short enough."""
    line = torsion(drive, inertia)
    if config.run.step > line.step_longest:
        raise InputError(
            f"run.step = {config.run.step:g} s: the driveline swings at {line.k_largest:.4g} rad/s; must be <= "
            f"{line.step_longest:.3g} s"
        )
    return line
