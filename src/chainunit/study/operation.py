"""The operation of a machine in a study: its speed, its loads and the times of its run; and the tables of its
drive."""

from __future__ import annotations

import math
from collections.abc import Set
from dataclasses import dataclass, field
from typing import Any

from ..drives.gearing import Transmission
from .line.flywheel import FlywheelShaft
from .sections import Coupling, FlywheelTable, Run, Starter


@dataclass(frozen=True)
class OperatingConditions:
    """What the runs of a drive have in common."""

    run: Run
    feed: Any
    """loads in normal running, as the machine declares them"""
    empty_start: bool = False
    """whether the feed comes once the machine runs"""
    starter_time: float = 0.0
    """time after which a starter gives the motor the whole voltage [s]; 0 without one"""
    coupling: Coupling | None = None
    simulation: str = "cs"
    """one of `chainunit.study.sections.SIMULATIONS`"""

    @property
    def crank_speed(self) -> float:
        """Speed of the crank in normal running [rad/s]."""
        return float(self.run.crank_speed)

    @property
    def turn(self) -> float:
        """Time of a turn of the crank at the requested speed [s]."""
        return 2.0 * math.pi / self.crank_speed

    @property
    def ramp_end(self) -> float:
        """Time at which the ramp of the reference ends, or the work of a starter [s]."""
        return float(max(self.run.ramp, self.starter_time))

    @property
    def steady_begin(self) -> float:
        """Time from which running counts as steady [s]: `run.settle_turns` after the start, or later, after
        an empty machine is fed."""
        return float(self.ramp_end + self.run.settle_turns * self.turn)

    @property
    def stop(self) -> float:
        """End of the run of start-up and steady running [s], if the motor settles at once."""
        return float(self.steady_begin + (self.run.turns + 0.1) * self.turn)


@dataclass(frozen=True)
class DriveTables:
    """The tables and keys of a study file that state the drive beside its motor."""

    feed_forward: bool
    gear: Transmission
    start: str
    """one of `chainunit.study.sections.STARTS`"""
    starter: Starter
    flywheel: FlywheelTable | None
    flywheel_shaft: FlywheelShaft
    given: Set[str] = field(compare=False)
    """names of all values that the file sets, such as "gear.ratio\""""

    @property
    def added_inertia(self) -> float:
        """Inertia of the flywheel at its own shaft [kg m2]; 0 without one."""
        return 0.0 if self.flywheel is None else float(self.flywheel.J)

    @property
    def starter_time(self) -> float:
        """Time after which a starter gives the motor the whole voltage [s]; 0 without one."""
        if self.start == "star-delta":
            return float(self.starter.star_delta.time + self.starter.star_delta.pause)
        return float(self.starter.soft_start.time) if self.start == "soft" else 0.0
