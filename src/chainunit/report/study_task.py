"""The task of ``chainunit study``: the runs of a study, their report, and their files."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from ..core.errors import InputError, shown
from ..core.files import atomic_file
from ..models import MODELS
from ..study.choice import check_motor
from ..study.config import Config
from ..study.event_table import random_runs
from ..study.record import LOAD_CYCLE, StudyRecord
from ..study.result import StudyData, as_dict
from ..study.run import run_study
from ..work.progress import TaskProgress
from ..work.runner import check_scheduler
from . import pdf, print_figures, series
from . import study as contents
from .blocks import Report
from .sheet import sheet
from .task import Task, Writer


def _accept(config: Config, *, scheduler: str | None = None, **options: Any) -> None:
    """Refuse options of the command that do not fit the study, before any run."""
    check_motor(config.motor, config.drive, config.plans, config.file.catalogues)
    if scheduler is not None:
        for runs in random_runs(config.plans):
            if not runs.runs:
                raise InputError(
                    f"scheduler = {shown(scheduler)}: is for random overloads, and this study has none "
                    f"({runs.table}.runs); leave it out"
                )
        check_scheduler(scheduler)


def _compute(config: Config, folder: Path, progress: TaskProgress, **options: Any) -> StudyRecord:
    """Run a study; options and errors are those of `run_study`."""
    progress("the machine at constant speed", 0.0, 1.0)
    return run_study(config, folder, progress, **options)


def _writers(record: StudyRecord, report: Report, folder: Path, of_report: list[Writer]) -> list[Writer]:
    numbers, *others = of_report
    return [numbers, lambda: series.write(record, folder), *others]


def _with_sheet(record: StudyRecord, report: Report, folder: Path, of_report: list[Writer]) -> list[Writer]:
    """The files of a study, and after its page the sheet, with its own pictures."""

    def sheet_file() -> list[Path]:
        """Write the sheet as PDF, with small pictures of the figures."""
        with TemporaryDirectory() as small, atomic_file(folder / pdf.NAME) as part:
            drawn = print_figures.write(report.figures, Path(small), report.units, are_small=True)
            pdf.write(sheet(record, report), {picture.name: picture for picture in drawn}, part)
        return [folder / pdf.NAME]

    return [*_writers(record, report, folder, of_report), sheet_file]


def _accept_sheet(question: Any, **options: Any) -> None:
    pdf.check_library()
    _accept(question, **options)


def _fmus(config: Config) -> tuple[str, ...]:
    return tuple(f"fmu/{name}.fmu" for name in dict.fromkeys((*MODELS, config.machine.model.name)))


def _kept(record: StudyRecord, folder: Path) -> Iterator[Path]:
    yield from (folder / "fmu").iterdir()
    yield from filter(None, (findings.store for findings in record.findings.by_analysis.values()))


def _shortfall(record: StudyRecord) -> str | None:
    too_slow = None if record.runs.reaches else "The motor does not keep the speed asked for."
    return record.setup.insufficient or too_slow


TASK: Task[Config, StudyRecord] = Task(
    "study",
    _compute,
    lambda record: contents.report(record, as_dict(record)),
    files=(*contents.pictures(), series.SERIES, LOAD_CYCLE, pdf.NAME),
    accept=_accept,
    writers=_writers,
    replaced=_fmus,
    kept=_kept,
    failure=lambda record: record.findings.failure,
    shortfall=_shortfall,
    tells_remarks=True,
    content=StudyData,
)

SHEET_TASK = replace(TASK, accept=_accept_sheet, writers=_with_sheet)
"""A study with its sheet as PDF."""
