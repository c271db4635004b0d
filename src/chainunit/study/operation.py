"""The operation of a machine in a study: its speed, its loads and the times of its run; and the tables of its
drive."""

from __future__ import annotations

import math
from collections.abc import Set
from dataclasses import dataclass, field
from typing import Any

from ..drives.gearing import Transmission
from ..drives.nameplate import Nameplate
from .line.flywheel import FlywheelShaft
from .line.slip_plan import SlipPlan
from .sections import Coupling, FlywheelTable, Run, Starter

NO_GEAR = 0.05
"""Relative difference of a ratio to 1 up to which the machine turns with the motor: nobody makes such a gear."""


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
    line: tuple[SlipPlan, ...] = ()
    """the parts of the line that slip, from the motor on"""

    @property
    def added_inertia(self) -> float:
        """Inertia of the flywheel at its own shaft [kg m2]; 0 without one."""
        return 0.0 if self.flywheel is None else float(self.flywheel.J)

    def line_ratio(self, ratio: float) -> float:
        """The share of the parts of the line in a whole `ratio` of the drive."""
        return math.prod(plan.share(ratio) for plan in self.line)

    def ratio_behind(self, ratio: float) -> float:
        """The share of the gear behind the line in a whole `ratio` of the drive, 1 without a gear."""
        if not self.line:
            return ratio
        behind = ratio / self.line_ratio(ratio)
        return 1.0 if abs(behind - 1.0) <= NO_GEAR else behind

    def speed_behind(self, torque: float, plate: Nameplate) -> float:
        """Speed behind the line over that of a rigid one, with a mean `torque` at the motor's shaft [N m]."""
        return math.prod(1.0 - plan.slip_at(torque, plate) for plan in self.line)

    @property
    def starter_time(self) -> float:
        """Time after which a starter gives the motor the whole voltage [s]; 0 without one."""
        if self.start == "star-delta":
            return float(self.starter.star_delta.time + self.starter.star_delta.pause)
        return float(self.starter.soft_start.time) if self.start == "soft" else 0.0
