"""Overloads at random crank angles and times, and the quantiles of their effects."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from ...core.errors import refusal_prefix
from ...reading.tables import file_key
from ...report.blocks import Text
from ...report.capability import AnswerBlocks, Capability, Contents
from ...study.analysis import Analysis
from ...study.conditions import given, is_above_zero
from ...study.config import FileReading
from ...study.event_table import read_random_event
from ...study.file_section import FileSection
from ...study.record import StudyRecord
from ...study.rules import MACHINE_FMU, NEEDS_MODEL, Rule, has_sides
from .table import MonteCarlo, RandomPlan

_EVENT = "monte_carlo.event"


class RandomOverloads(Capability):
    """The capability, with the table [monte_carlo]."""

    name = "random_overloads"
    order = 70
    tables = {  # noqa: RUF012
        "monte_carlo": FileSection(
            MonteCarlo,
            keys={
                "event": file_key(
                    dict[str, Any],
                    {},
                    "event that comes at random: keys of an [[event]], quantities may be ranges",
                )
            },
            title="Overloads at random",
            is_used=lambda study: study.setup.config.plans["random_overloads"].runs > 0,
            apart=True,
            random_events=("event",),
        )
    }

    def rules(self) -> Iterable[Rule]:
        """They need a model of the machine, and an event of its own where it has no sides."""
        has_runs = is_above_zero("monte_carlo.runs")
        yield Rule("monte_carlo.runs", MACHINE_FMU, NEEDS_MODEL, has_runs)
        reason = "draws jams of two sides, and the machine is {machine}; give the event in monte_carlo.event"
        yield Rule("monte_carlo.runs", ~(has_sides() | MACHINE_FMU | given(_EVENT)), reason, has_runs)

    def plan(self, reading: FileReading) -> RandomPlan:
        """The plan, also of a file without the table."""
        with refusal_prefix("", _EVENT):
            event = read_random_event(reading.form.monte_carlo.event, _EVENT)
        table: MonteCarlo = reading.values["monte_carlo"]
        return RandomPlan(_EVENT, event, int(table.runs), float(table.duration), int(table.seed))

    def not_with_foreign_motor(self, plan: RandomPlan) -> str:
        """The refusal of runs at random: they read the motor's current and torque."""
        if not plan.runs:
            return ""
        return (
            "its current and torque are not known, of which random overloads tell the quantiles; leave "
            "monte_carlo.runs out"
        )

    def analyses(self) -> Iterable[type[Analysis]]:
        """The runs."""
        from .runs import RandomAnalysis

        return (RandomAnalysis,)

    def contents(self) -> Mapping[str, Contents]:
        """Quantiles."""
        from . import page

        return {"monte_carlo": Contents("Overloads at random", page.blocks)}

    def answer(self, study: StudyRecord) -> AnswerBlocks:
        """The largest quantile of the crank torque, and how often a run ends badly."""
        if "monte_carlo" not in study.findings.by_analysis:
            return AnswerBlocks()
        from . import page

        return AnswerBlocks(end=[Text(page.summary(study))])


CAPABILITY = RandomOverloads()
