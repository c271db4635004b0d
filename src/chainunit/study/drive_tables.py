"""The tables of a drive in a study file: its gear, its starter, and its control."""

from __future__ import annotations

import math
from collections.abc import Set
from dataclasses import dataclass, field

from ..drives.gearing import Transmission
from ..drives.nameplate import Nameplate
from .line.slip_plan import SlipPlan
from .sections import FlywheelTable, Starter

NO_GEAR = 0.05
"""Relative difference of a ratio to 1 up to which the machine turns with the motor: nobody makes such a gear."""


@dataclass(frozen=True)
class DriveTables:
    """The tables and keys of a study file that state the drive beside its motor."""

    feed_forward: bool
    gear: Transmission
    start: str
    """one of `chainunit.study.sections.STARTS`"""
    starter: Starter
    flywheel: FlywheelTable | None
    given: Set[str] = field(compare=False)
    """names of all values that the file sets, such as "gear.ratio\""""
    line: tuple[SlipPlan, ...] = ()
    """the parts of the line that slip, from the motor on"""

    @property
    def added_inertia(self) -> float:
        """Inertia of the flywheel on the motor's shaft [kg m2]; 0 without one."""
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

    @property
    def given_gains(self) -> set[str]:
        """Names of the parameters of the motor that the file sets."""
        return {name.removeprefix("motor.") for name in self.given if name.startswith("motor.")}
