"""The results of a study in a folder. The command and Python run a study and write its files by these functions."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

from ..core.files import clear
from ..fmu.backends import Backend
from ..models import MODELS
from ..reading.tables import in_file
from ..study.choice import check_files
from ..study.config import Config
from ..study.record import LOAD_CYCLE, StudyRecord
from ..study.registry import registered
from ..study.run import run_study
from ..work.progress import Report as Progress
from . import files, series
from . import study as contents
from .blocks import Report

NAME = "result"


def file_names() -> tuple[str, ...]:
    """The names of all files that a study may write into its folder, apart from FMUs and random overloads."""
    return (*files.names(NAME, contents.pictures()), series.SERIES, LOAD_CYCLE)


def names(config: Config) -> tuple[str, ...]:
    """The names of all files that this study may write, with the FMUs."""
    models = dict.fromkeys((*MODELS, config.machine.model.name))
    return (*file_names(), *(f"fmu/{name}.fmu" for name in models))


def compute(
    config: Config,
    folder: Path,
    progress: Progress | None = None,
    *,
    check: bool = False,
    backend: Backend | None = None,
    scheduler: str | None = None,
) -> StudyRecord:
    """Run a study in a folder that belongs to this process alone (see `files.claim`). The files of an earlier run
    in it are removed. Arguments and errors are those of `run_study`; a refusal begins with the name of the study
    file, if there is one."""

    def file_context() -> AbstractContextManager[None]:
        return in_file(config.source, lambda: config.lines) if config.lines else nullcontext()

    with file_context():
        # before the files of an earlier run are removed, and before any progress is reported
        check_files(config)
    if scheduler is not None:
        for part in registered():
            part.check_scheduler(config, scheduler)
    clear(folder, *file_names())
    if progress is not None:
        progress("the machine at constant speed", 0.0, 1.0)
    with file_context():
        return run_study(config, folder, progress, check=check, backend=backend, scheduler=scheduler)


def writers(record: StudyRecord, report: Report, folder: Path) -> list[Callable[[], list[Path]]]:
    """The functions that write the numbers, the series, the pictures, the text and the page of a study, in this
    order; each function returns the files that it wrote."""
    numbers, *others = files.writers(report, folder, NAME)
    return [numbers, lambda: series.write(record, folder), *others]
