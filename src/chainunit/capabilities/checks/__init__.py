"""Checks by clause: each with its formula, its value beside the limit, and the place of its number."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from ...report.capability import Capability, Contents
from ...report.lines import Line
from ...study.analysis import Analysis
from ...study.file_reading import FileReading
from ...study.file_section import of_named
from ...study.record import StudyRecord
from ...study.rules import MACHINE_FMU, Rule
from .plan import CheckPlan, read_plan
from .tables import BEARINGS


class CheckCapability(Capability):
    """The capability, with the tables [bearing.NAME]."""

    name = "checks"
    tables = {"bearing": of_named(BEARINGS)}  # noqa: RUF012

    def rules(self) -> Iterable[Rule]:
        """Bearings are those of a machine whose pins are known."""
        yield Rule("bearing", MACHINE_FMU, "needs the pins of the machine, which is an FMU; leave it out")

    def plan(self, reading: FileReading) -> CheckPlan:
        """The plan, also of a file without these tables: it says what is not checked."""
        return read_plan(reading)

    def analyses(self) -> Iterable[type[Analysis]]:
        """The checks."""
        from .analysis import CheckAnalysis

        return (CheckAnalysis,)

    def contents(self) -> Mapping[str, Contents]:
        """The table of the checks, and the list of all that was not checked."""
        from . import page

        return {
            "checks": Contents("Checks by clause", page.blocks),
            "not_checked": Contents("What was not checked", page.missing, analysis="checks"),
        }

    def on_sheet(self) -> tuple[str, ...]:
        """The table of the checks."""
        return ("checks",)

    def unchecked(self, study: StudyRecord) -> Iterator[Line]:
        """What was not checked, and why."""
        from .analysis import CheckFindings

        found = CheckFindings.found_in(study)
        if found is None:
            yield "bearings, shaft sections, gear and couplings: the study ended before"
            return
        yield from (f"{each.what}: {each.why}" for each in found.not_checked)


CAPABILITY = CheckCapability()
