"""`Study.optimize`, and its result."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...core.errors import RunError
from ...machines.machine import Machine
from ...report.capability import AnyStudy
from ...report.reported_result import ReportedResult
from ...study.config import Config
from ...work.progress import TaskProgress
from .best import Best
from .page import TASK, OptimizedStudy


class BestResult(ReportedResult[Config, OptimizedStudy]):
    """The result of a search for the best machine. Its `repr` shows the answer, the parameters and what binds."""

    _task = TASK
    _asked: AnyStudy

    @property
    def config(self) -> Config:
        """The configuration of the study."""
        return self._question

    @property
    def best(self) -> Best:
        """All that the search found."""
        return self._outcome.best

    def _answer_rows(self) -> Mapping[str, Mapping[str, Any]]:
        """For each free parameter and each quantity its value today and of the best machine, and its limits."""
        numbers = self._report.result
        return {
            name: {column: entry[column] for column in ("today", "best", "min", "max")}
            for name, entry in (numbers["parameters"] | numbers["quantities"]).items()
        }

    @property
    def met(self) -> bool:
        """Whether a machine was found that meets all limits."""
        return self.best.met

    @property
    def machine(self) -> Machine | None:
        """The best machine; None where no machine meets all limits."""
        return self.best.machine

    @property
    def study(self) -> AnyStudy:
        """The study with the best machine.

        Raises
        ------
        RunError
            where no machine meets all limits.
        """
        if self.best.machine is None:
            raise RunError(f"no machine meets all limits: {self._outcome.conflict}")
        source, tables = self._outcome.as_file()
        return self._asked.of_tables(tables, str(source))


def optimize(
    study: AnyStudy,
    folder: str | Path | None = None,
    progress: TaskProgress | None = None,
) -> BestResult:
    """Search for the best machine, as the table [optimize] asks: 20 starts take some ten seconds.

    Parameters
    ----------
    folder : the folder to which the files of ``chainunit optimize -o`` are written
    progress : as of `run`

    Raises
    ------
    InputError
        for a study without the table [optimize].
    WriteError
        for a file that cannot be written; the others are written.
    """
    result = BestResult.made(study.config, folder, progress)
    result._asked = study
    return result


METHOD, RESULT = optimize, BestResult
