"""`Study.pin_life`, and its result."""

from __future__ import annotations

from pathlib import Path

from chainunit.report.capability import AnyStudy
from chainunit.report.reported_result import ReportedResult
from chainunit.study.config import Config
from chainunit.study.record import StudyRecord
from chainunit.work.progress import TaskProgress

from .analysis import PinLife
from .task import TASK


class PinLifeResult(ReportedResult[Config, StudyRecord]):
    """The rating life of a pin. Its `repr` shows the table of the life."""

    _task = TASK

    @property
    def found(self) -> PinLife:
        """Equivalent load, speed and life of the pin, and the load rating for the wanted life."""
        found: PinLife = self._outcome.findings.by_analysis["pin_life"]
        return found


def pin_life(
    study: AnyStudy, folder: str | Path | None = None, progress: TaskProgress | None = None
) -> PinLifeResult:
    """The rating life of the pin that the study names, as ``chainunit pin-life`` finds it; arguments and errors as of
    `run`."""
    return PinLifeResult.made(study.config, folder, progress)


METHOD, RESULT = pin_life, PinLifeResult
