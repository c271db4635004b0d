"""Checks by clause: each with its formula, its value beside the limit, and the place of its number."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from ...machines.machine import Machine
from ...report.capability import Capability, Contents
from ...report.lines import Line
from ...study.analysis import Analysis
from ...study.config import FileReading
from ...study.record import StudyRecord
from ...study.rules import MACHINE_FMU, MOTOR_FMU, Rule
from .plan import CheckPlan, read_plan
from .tables import OF_ROW, TABLES


class CheckCapability(Capability):
    """The capability, with a table for each kind of part that is checked."""

    name = "checks"
    order = 100
    tables = TABLES

    def rules(self) -> Iterable[Rule]:
        """Bearings are those of a machine whose pins are known, a relay sees the current of a motor that is known."""
        for table in ("bearing", "section"):
            yield Rule(table, MACHINE_FMU, "needs the pins of the machine, which is an FMU; leave it out")
        for table in ("relay", "starting", "gear_rating", "motor_shaft", "flexible_coupling"):
            yield Rule(table, MOTOR_FMU, "needs a model of the motor, which is an FMU; leave it out")

    def plan(self, reading: FileReading) -> CheckPlan:
        """The plan, also of a file without these tables: it says what is not checked."""
        return read_plan(reading)

    def unused_values(self, machine: Machine, plan: CheckPlan) -> Iterable[str]:
        """Values of a flexible coupling in whose place those of a catalogue stand."""
        return [f"flexible_coupling.{name}" for name in OF_ROW] if plan.couplings else ()

    def analyses(self) -> Iterable[type[Analysis]]:
        """The checks."""
        from .analysis import CheckAnalysis

        return (CheckAnalysis,)

    def contents(self) -> Mapping[str, Contents]:
        """The table of the checks, and the list of all that was not checked."""
        from . import page

        return {
            "checks": Contents("Checks by clause", page.blocks, on_sheet=True),
            "relay_classes": Contents("Classes of the thermal relay", page.relay, analysis="checks"),
            "not_checked": Contents("Parts that were not checked", page.missing, analysis="checks"),
        }

    def unchecked(self, study: StudyRecord) -> Iterator[Line]:
        """What was not checked, and why."""
        from .analysis import CheckFindings

        findings = CheckFindings.found_in(study.findings)
        if findings is None:
            yield "bearings, shaft sections, gear and couplings: the study ended before"
            return
        without_data = [f"{x.what} ([{x.table}])" for x in findings.not_checked if x.table]
        if without_data:
            yield f"parts without data in the file: {'; '.join(without_data)}"
        reasons: dict[str, list[str]] = {}
        for omission in findings.not_checked:
            if not omission.table:
                reasons.setdefault(omission.why, []).append(omission.what)
        yield from (f"{'; '.join(parts)}: {why}" for why, parts in reasons.items())


CAPABILITY = CheckCapability()
