"""Flywheels: the one of the study beside others, and the least one that keeps a permitted fluctuation."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Set

from ...report.capability import Capability, Contents
from ...study.analysis import Analysis
from ...study.config import FileReading
from ...study.parts import motor_is_left


class FlywheelCapability(Capability):
    """The capability; the table [flywheel] is one of the drive."""

    name = "flywheels"
    order = 80

    def plan(self, reading: FileReading) -> Set[float] | None:
        """The inertias of the flywheels that are compared [kg m2]; None without the table, and if the drive is
        chosen with its flywheel."""
        is_given = "flywheel" in reading.data and not motor_is_left(reading.data)
        return frozenset(reading.form.flywheel.compare) if is_given else None

    def analyses(self) -> Iterable[type[Analysis]]:
        """The runs with each flywheel."""
        from .analysis import FlywheelAnalysis

        return (FlywheelAnalysis,)

    def contents(self) -> Mapping[str, Contents]:
        """Table and figure."""
        from . import page

        return {"flywheels": Contents("Flywheels", page.blocks, (page.PICTURE,))}


CAPABILITY = FlywheelCapability()
