"""Overloads at random crank angles and times, and the quantiles of their effects."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from pydantic import Field

from ...core.errors import InputError, printable, refusal_prefix
from ...core.quantities import variables
from ...report.blocks import Source, Text
from ...report.capability import Answer, Capability, Contents
from ...report.lines import Line
from ...study.analysis import Analysis
from ...study.conditions import given, is_above_zero
from ...study.event_table import RandomEvent, read_random_event
from ...study.file_reading import FileReading
from ...study.file_section import FileSection
from ...study.record import StudyRecord
from ...study.rig import Rig
from ...study.rules import MACHINE_FMU, NEEDS_MODEL, Rule, has_sides
from ...work.runner import check_scheduler
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
                "event": (
                    dict[str, Any],
                    Field(
                        {},
                        description="event that comes at random: keys of an [[event]], quantities may be ranges",
                    ),
                )
            },
            title="Overloads at random",
            is_used=lambda config: config.plans["random_overloads"].is_asked_for,
            apart=True,
            random_events=("event",),
        )
    }

    def rules(self) -> Iterable[Rule]:
        """They need a model of the machine, and an event of its own where it has no sides."""
        some = is_above_zero("monte_carlo.runs")
        yield Rule("monte_carlo.runs", MACHINE_FMU, NEEDS_MODEL, some)
        reason = "draws jams of two sides, and the machine is {machine}; give the event in monte_carlo.event"
        yield Rule("monte_carlo.runs", ~(has_sides() | MACHINE_FMU | given(_EVENT)), reason, some)

    def plan(self, reading: FileReading) -> RandomPlan:
        """The plan, also of a file without the table."""
        with refusal_prefix("", _EVENT):
            event = read_random_event(reading.form.monte_carlo.event, _EVENT)
        return RandomPlan(reading.values["monte_carlo"], event)

    def random_events(self, plan: RandomPlan) -> Mapping[str, RandomEvent]:
        """Their event."""
        return {_EVENT: plan.event}

    def longest_run(self, plan: RandomPlan) -> float:
        """The time that is followed after an event; 0 without runs."""
        return float(plan.table.duration) if plan.is_asked_for else 0.0

    def not_with_foreign_motor(self, plan: RandomPlan) -> str:
        """They read the motor's current and torque."""
        if not plan.is_asked_for:
            return ""
        return (
            "its current and torque are not known, of which random overloads tell the quantiles; leave "
            "monte_carlo.runs out"
        )

    def check_scheduler(self, plan: RandomPlan, scheduler: str) -> None:
        """The workers of a scheduler make these runs."""
        if not plan.is_asked_for:
            raise InputError(
                f"scheduler {printable(scheduler)}: is for random overloads, and this study has none "
                "(monte_carlo.runs); leave it out"
            )
        check_scheduler(scheduler)

    def check_runs(self, plan: RandomPlan, rig: Rig) -> None:
        """Refuse an event for which the drive has no inputs."""
        for event in plan.event.hardest() if plan.is_asked_for else ():
            if not rig.takes(event):
                raise InputError(f'monte_carlo.event.type = "{event.kind}": {event.without}')

    def words(self, driver: str) -> Mapping[str, str]:
        """Those of a run."""
        from .runs import Sample

        return {v.name: v.described(driver) for v in variables(Sample)}

    def analyses(self) -> Iterable[type[Analysis]]:
        """The runs."""
        from .analysis import RandomAnalysis

        return (RandomAnalysis,)

    def contents(self) -> Mapping[str, Contents]:
        """Quantiles."""
        from . import page

        return {"monte_carlo": Contents("Overloads at random", page.blocks)}

    def question(self, s: Source, study: StudyRecord) -> Line:
        """Their number and event."""
        if "monte_carlo" not in study.findings:
            return ()
        sentence = " Then come {=monte_carlo.runs} overloads at random, each by itself: {event}."
        return s.line(sentence, event=study.config.plans[self.name].event.title)

    def answer(self, s: Source, study: StudyRecord) -> Answer:
        """The largest quantile of the crank torque, and how often a run ends badly."""
        if "monte_carlo" not in study.findings:
            return Answer()
        from . import page

        return Answer(end=[Text(page.summary(s, study))])


CAPABILITY = RandomOverloads()
