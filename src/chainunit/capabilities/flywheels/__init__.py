"""Flywheels: the one of the study beside others, and the least one that keeps a permitted fluctuation."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from pydantic import Field

from ...core.quantities import variable_of
from ...report.capability import Capability, Contents
from ...report.live.quantities import LiveQuantity
from ...study.analysis import Analysis
from ...study.conditions import has_entries
from ...study.drive import Drive
from ...study.entry_values import numbers
from ...study.file_reading import FileReading
from ...study.file_section import FileSection
from ...study.rules import Rule, motor_is_chosen
from .table import FlywheelTable


@dataclass(frozen=True)
class FlywheelPlan:
    """The flywheel of the study with the permitted fluctuation, and the inertias that are compared [kg m2]."""

    table: FlywheelTable
    compared: tuple[float, ...]


class FlywheelCapability(Capability):
    """The capability, with the table [flywheel]."""

    name = "flywheels"
    order = 80
    tables = {  # noqa: RUF012
        "flywheel": FileSection(
            FlywheelTable,
            optional=True,
            keys={
                "compare": (
                    numbers(FlywheelTable, "J", "flywheel.compare", 12),
                    Field([], description="flywheels that are compared [kg m2]"),
                )
            },
            title="Flywheel",
        )
    }

    def rules(self) -> Iterable[Rule]:
        """Sizing has flywheels of its own."""
        reason = "sizing finds its own; leave out one of the two"
        yield Rule("flywheel", motor_is_chosen(), reason, has_entries("flywheel"))

    def plan(self, reading: FileReading) -> FlywheelPlan | None:
        """The plan of the table."""
        if "flywheel" not in reading.data:
            return None
        compared: list[float] = reading.form.flywheel.compare
        return FlywheelPlan(reading.values["flywheel"], tuple(sorted(set(compared))))

    def shaft_inertia(self, plan: FlywheelPlan | None) -> float:
        """That of the study's flywheel."""
        return 0.0 if plan is None else float(plan.table.J)

    def live_quantities(self, plan: FlywheelPlan | None, drive: Drive) -> Iterable[LiveQuantity]:
        """The flywheel on the motor's shaft."""
        J = variable_of(FlywheelTable, "J")
        yield LiveQuantity(("flywheel", "J"), J, drive.added_inertia, "drive", role="added")

    def not_with_foreign_motor(self, plan: FlywheelPlan | None) -> str:
        """A flywheel is added to the rotor."""
        return "" if plan is None else "its rotor takes no flywheel; leave [flywheel] out"

    def analyses(self) -> Iterable[type[Analysis]]:
        """The runs with each flywheel."""
        from .analysis import FlywheelAnalysis

        return (FlywheelAnalysis,)

    def contents(self) -> Mapping[str, Contents]:
        """Table and figure."""
        from . import page

        return {"flywheels": Contents("Flywheels", page.blocks, (page.PICTURE,))}


CAPABILITY = FlywheelCapability()
