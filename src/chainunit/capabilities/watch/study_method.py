"""`Study.watch`, and its result."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...reading.results import as_data
from ...report.capability import AnyStudy
from ...report.reported_result import ReportedResult
from ...study.config import Config
from ...work.progress import TaskProgress
from .page import TASK
from .result import WatchSummary
from .watch import Alarm, WatchedRecording, declared_outputs

if TYPE_CHECKING:
    import xarray as xr


class WatchResult(ReportedResult[Config, WatchSummary]):
    """A watched recording. Its `repr` shows the alarms; `watched` has the outputs of the observer at all rows."""

    _task = TASK

    @property
    def record(self) -> WatchedRecording:
        """All that the watch found, as the report reads it."""
        return self._outcome.watched

    @cached_property
    def watched(self) -> xr.Dataset:
        """The outputs of the observer at all rows of the recording, over ``time``, with units in ``attrs``."""
        import xarray as xr

        watched, declared = self.record, declared_outputs()
        time = ("time", watched.recording.time, {"units": "s", "long_name": "time of the recording"})
        outputs = {
            name: ("time", values, {"units": declared[name].unit, "long_name": declared[name].description})
            for name, values in watched.outputs.items()
        }
        return xr.Dataset(outputs, {"time": time}, {"title": watched.config.title})

    @property
    def alarms(self) -> tuple[Alarm, ...]:
        """The alarms in order: side, begin, end and ground of each."""
        return self.record.alarms

    def _answer_rows(self) -> Mapping[str, Mapping[str, Any]]:
        """The medians of the outputs after the time of learning and before the first alarm, with deviations and
        thresholds."""
        usual: Mapping[str, Mapping[str, Any]] = as_data(self._outcome.usual)
        return usual


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
