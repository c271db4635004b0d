"""`Study.watch`, and its result."""

from __future__ import annotations

from pathlib import Path

from ...report.capability import AnyStudy
from ...report.reported_result import ReportedResult
from ...study.config import Config
from ...work.progress import TaskProgress
from .page import TASK
from .watch import Alarm, WatchedRecording


class WatchResult(ReportedResult[Config, WatchedRecording]):
    """A watched recording. Its `repr` shows the alarms; `watched` has the outputs of the observer at all rows."""

    _task = TASK

    @property
    def watched(self) -> WatchedRecording:
        """The alarms and the outputs of the observer at all rows."""
        return self._outcome

    @property
    def alarms(self) -> tuple[Alarm, ...]:
        """The alarms in order: side, begin, end and ground of each."""
        return self.watched.alarms


def watch(
    study: AnyStudy, folder: str | Path | None = None, progress: TaskProgress | None = None
) -> WatchResult:
    """Run the load observer over the recording of the table [watch].

    Parameters
    ----------
    folder : the folder to which the files of ``chainunit watch -o`` are written
    progress : as of `chainunit.Study.run`

    Raises
    ------
    InputError
        for a study without the table [watch], and with a line for each fault of the recording.
    WriteError
        for a file that cannot be written; the others are written.
    """
    return WatchResult.made(study.config, folder, progress)


METHOD, RESULT = watch, WatchResult
