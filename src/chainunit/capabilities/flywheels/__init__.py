"""Flywheels: the one of the study beside others, and the least one that keeps a permitted fluctuation."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from ...report.capability import Capability, Contents
from ...study.analysis import Analysis
from ...study.file_reading import FileReading
from ...study.sections import FlywheelTable


@dataclass(frozen=True)
class FlywheelPlan:
    """The flywheel of the study with the permitted fluctuation, and the inertias that are compared [kg m2]."""

    table: FlywheelTable
    compared: tuple[float, ...]


class FlywheelCapability(Capability):
    """The capability; the table [flywheel] is one of the drive."""

    name = "flywheels"
    order = 80

    def plan(self, reading: FileReading) -> FlywheelPlan | None:
        """The plan of the table."""
        if "flywheel" not in reading.data:
            return None
        compared: list[float] = reading.form.flywheel.compare
        return FlywheelPlan(reading.values["flywheel"], tuple(sorted(set(compared))))

    def analyses(self) -> Iterable[type[Analysis]]:
        """The runs with each flywheel."""
        from .analysis import FlywheelAnalysis

        return (FlywheelAnalysis,)

    def contents(self) -> Mapping[str, Contents]:
        """Table and figure."""
        from . import page

        return {"flywheels": Contents("Flywheels", page.blocks, (page.PICTURE,))}


CAPABILITY = FlywheelCapability()
