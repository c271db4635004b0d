"""The drive as a study file asks for it: its motor, gear, starter and control."""

from __future__ import annotations

from collections.abc import Set
from dataclasses import dataclass, field
from typing import Any

from ..drives.catalogue import CatalogueMotor
from ..drives.gearing import Transmission
from ..drives.motor import Motor
from .sections import ForeignMotor, Starter


@dataclass(frozen=True)
class DriveTables:
    """The tables and keys of a study file that state its drive."""

    motor_type: type[Motor]
    """model of the motor; `Motor` itself if the motor is a foreign FMU"""
    motor: Any
    """parameters of the motor, where the file gives them"""
    plate: CatalogueMotor | None
    """the motor, where the file names one of the catalogue"""
    foreign: ForeignMotor | None
    """the motor, if it is a foreign FMU; `motor` then has no meaning"""
    feed_forward: bool
    gear: Transmission
    start: str
    """one of `chainunit.study.sections.STARTS`"""
    starter: Starter
    is_chosen: bool
    """whether a capability chooses the motor of the catalogue"""
    given: Set[str] = field(compare=False)
    """names of all values that the file sets, such as "gear.ratio" """

    @property
    def of_catalogue(self) -> bool:
        """Whether the motor is one of the catalogue."""
        return self.plate is not None or self.is_chosen

    @property
    def soft_time(self) -> float:
        """Time in which a soft starter raises the voltage [s]; 0 without one."""
        return float(self.starter.soft_start.time) if self.start == "soft" else 0.0

    @property
    def given_gains(self) -> set[str]:
        """Names of the parameters of the motor that the file sets."""
        return {name.removeprefix("motor.") for name in self.given if name.startswith("motor.")}
