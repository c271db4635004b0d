"""The task of ``chainunit pin-life``: start-up and steady running of a study, and the life of its pin."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from chainunit.core.errors import InputError
from chainunit.reading.text import shown_in
from chainunit.report import blocks as b
from chainunit.report import study_task
from chainunit.report.cited import cited, source_line
from chainunit.report.task import Task
from chainunit.study.config import Config
from chainunit.study.provenance import Heading
from chainunit.study.record import StudyRecord
from chainunit.study.result import as_dict
from chainunit.work.progress import TaskProgress

from . import page
from .analysis import PinLife

_HEAD = ("chainunit", "title", "source", "status", "pin_life")


def _report(study: StudyRecord) -> b.Report:
    result = as_dict(study)
    result = {name: result[name] for name in _HEAD if name in result} | {
        "warnings": [each for each in result["warnings"] if each["code"] == "pin-life"],
    }
    warnings = [warning for warning in study.findings.warnings if warning.code == "pin-life"]
    heading = cited(Heading.of(study.setup.config.title, study.setup.config.file))
    life = PinLife.found_in(study.findings)
    with shown_in(study.setup.config.units):
        found = () if life is None else (page.life_table(life, "pin_life"),)
        return b.Report(
            study.setup.config.title,
            "Rating life of a pin",
            result,
            (*found, *(b.Judgement("warning", warning.text) for warning in cited(warnings, "warnings"))),
            (),
            source=source_line(heading),
            units=study.setup.config.units,
            opening_title="The answer",
        )


def _accept(config: Config, **options: Any) -> None:
    if config.plans["pin_life"] is None:
        raise InputError(f"{config.file.source}: has no table [pin_life], which names the pin and its rating")


def _compute(config: Config, folder: Path, progress: TaskProgress, **options: Any) -> StudyRecord:
    """Start-up and steady running, without the events of the study."""
    return study_task.TASK.compute(replace(config, events={}), folder, progress, **options)


def _shortfall(study: StudyRecord) -> str | None:
    return (
        ""
        if "pin_life" in study.findings.by_analysis and study.findings.by_analysis["pin_life"].is_short
        else None
    )


TASK: Task[Config, StudyRecord] = Task(
    "pin-life",
    _compute,
    _report,
    accept=_accept,
    replaced=study_task.TASK.replaced,
    kept=study_task.TASK.kept,
    failure=study_task.TASK.failure,
    shortfall=_shortfall,
)
