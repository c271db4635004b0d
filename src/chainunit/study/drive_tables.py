"""The tables of a drive in a study file: its gear, its starter, and its control."""

from __future__ import annotations

from collections.abc import Set
from dataclasses import dataclass, field

from ..drives.gearing import Transmission
from .line.flywheel import FlywheelShaft
from .sections import FlywheelTable, Starter


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

    @property
    def given_gains(self) -> set[str]:
        """Names of the parameters of the motor that the file sets."""
        return {name.removeprefix("motor.") for name in self.given if name.startswith("motor.")}
