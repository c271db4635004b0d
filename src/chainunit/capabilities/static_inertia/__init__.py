"""What a static inertia gets wrong: the same duty with the inertia of the machine as one number."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Literal

from pydantic import Field

from ...report.blocks import Block, Source
from ...report.capability import Capability, Contents
from ...report.lines import Line
from ...study.analysis import Analysis
from ...study.conditions import is_one_of
from ...study.file_reading import FileReading
from ...study.record import StudyRecord
from ...study.rules import MACHINE_FMU, MOTOR_FMU, NEEDS_MODEL, Rule, motor_is_chosen, other_models

_NAME, _KEY = "static_inertia", "static_inertia_runs"


class StaticInertiaCapability(Capability):
    """The capability, with the key static_inertia_runs."""

    name = _NAME
    choices = {  # noqa: RUF012
        _KEY: (
            Literal["sizing", "always", "never"],
            Field(
                "sizing",
                description="when the machine is also run with one inertia, as sizing programs of drive makers take "
                "it: where sizing chooses the motor, always, or never",
            ),
        )
    }

    def rules(self) -> Iterable[Rule]:
        """It needs the inertia over the turn, and a model of the motor."""
        always = is_one_of(_KEY, "always")
        yield Rule(_KEY, MACHINE_FMU, NEEDS_MODEL, always)
        yield Rule(_KEY, MOTOR_FMU, "needs a model of the motor, which is an FMU; leave it out", always)
        for other in other_models():
            words = f"needs an inertia that belongs to the angle, and {other.words}; leave it out"
            yield Rule(_KEY, other.on, words, always)

    def plan(self, reading: FileReading) -> bool:
        """Whether the study asks for it."""
        when = reading.form.static_inertia_runs
        return when == "always" or (when == "sizing" and motor_is_chosen().holds(reading.data))

    def analyses(self) -> Iterable[type[Analysis]]:
        """The duty with one inertia."""
        from .analysis import StaticInertiaAnalysis

        return (StaticInertiaAnalysis,)

    def contents(self) -> Mapping[str, Contents]:
        """Both duties, the drive that a program would have chosen, and a turn."""
        from . import page

        return {self.name: Contents("What a static inertia gets wrong", page.blocks, (page.PICTURE,))}

    def answer(self, s: Source, study: StudyRecord) -> Iterator[Block]:
        """A line on it."""
        from . import page

        return page.answer(s, study)

    def unchecked(self, study: StudyRecord) -> Iterator[Line]:
        """Why a drive that was chosen has no comparison."""
        if study.proposal is not None and _NAME not in study.findings:
            from .runs import obstacle

            why = (
                obstacle(study.drive)
                if study.config.plans[_NAME]
                else 'the file has static_inertia_runs = "never"'
            )
            ended = "the study ended before" if study.failure else "its runs failed"
            yield f"the same duty with a static inertia: {why or ended}"


CAPABILITY = StaticInertiaCapability()
