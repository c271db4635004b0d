"""Torsion of a cardan line in rotation: natural frequencies, resonance, and stability."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Literal

from ...drives.line_table import Damping
from ...reading.tables import file_key
from ...report.capability import Capability, Contents
from ...study.analysis import Analysis
from ...study.conditions import given
from ...study.config import FileReading
from ...study.file_section import FileSection, numbers
from ...study.rules import Rule
from .table import JOINTS, TorsionPlan, TorsionTable


class TorsionCapability(Capability):
    """The capability, with the table [torsion]."""

    name = "torsion"
    order = 90
    tables = {  # noqa: RUF012
        "torsion": FileSection(
            TorsionTable,
            keys={
                "joint": file_key(Literal[*JOINTS], "alpha1", "bend that the map of stability varies"),
                "damping_ratios": file_key(
                    numbers(Damping, "damping_ratio", "torsion.damping_ratios", 4),
                    [],
                    "damping ratios of the map",
                ),
            },
            title="Torsion of the driveline",
            is_used=lambda study: "torsion" in study.findings.by_analysis,
            order=(("slowest", ">", "fastest"), ("bend_low", ">", "bend_high")),
        )
    }

    def rules(self) -> Iterable[Rule]:
        """It needs a line."""
        yield Rule("torsion", ~given("driveline"), "is of a driveline; add [driveline], or leave it out")

    def plan(self, reading: FileReading) -> TorsionPlan:
        """The plan, also of a file without the table."""
        form = reading.form.torsion
        ratios = tuple(sorted(set(form.damping_ratios)))
        return TorsionPlan(reading.values["torsion"], form.joint, ratios)

    def analyses(self) -> Iterable[type[Analysis]]:
        """The line in rotation."""
        from .analysis import TorsionAnalysis

        return (TorsionAnalysis,)

    def contents(self) -> Mapping[str, Contents]:
        """Tables and maps."""
        from . import page

        return {"torsion": Contents("Torsion of the driveline in rotation", page.blocks, page.PICTURES)}


CAPABILITY = TorsionCapability()
