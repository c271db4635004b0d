"""The results of a study in a folder: how the command and Python run it there, and what both write."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

from ..files import clear
from ..fmu.backends import Backend
from ..progress import Report as Progress
from ..reading import in_file
from ..study.choice import check_files
from ..study.config import Config
from ..study.record import LOAD_CYCLE, StudyRecord
from ..study.run import run_study
from . import files, series
from . import study as contents
from .blocks import Report

NAME = "result"
FILES = (*files.names(NAME, contents.PICTURES), series.SERIES, LOAD_CYCLE)
"""All that a study may leave in its folder, apart from FMUs and random overloads."""


def compute(
    config: Config,
    folder: Path,
    progress: Progress | None = None,
    *,
    check: bool = False,
    backend: Backend | None = None,
) -> StudyRecord:
    """Run a study in a folder, which is this process's alone (see `files.claim`); what an earlier run left there
    is removed. Arguments and errors as of `run_study`; a refusal begins with the file of the study, if it has one."""

    def named() -> AbstractContextManager[None]:
        return in_file(config.source, lambda: config.lines) if config.lines else nullcontext()

    with named():
        # before anything of an earlier run is taken away, and before any progress
        check_files(config)
    clear(folder, *FILES)
    if progress is not None:
        progress("the machine at constant speed", 0.0, 1.0)
    with named():
        return run_study(config, folder, progress, check=check, backend=backend)


def writers(record: StudyRecord, report: Report, folder: Path) -> list[Callable[[], list[Path]]]:
    """What writes the numbers, the series, the pictures, the text and the page of a study, in this order; each
    returns its files."""
    numbers, *others = files.writers(report, folder, NAME)
    return [numbers, lambda: series.write(record, folder), *others]
