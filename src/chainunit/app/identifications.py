"""`IdentificationResult` and `WatchResult`: an identified machine, and a watched recording, from Python."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from ..report import identification as contents
from ..report import watch as watching
from ..report.blocks import Report
from ..study.config import Config
from ..study.identification.identification import IdentifiedMachine, identify
from ..study.identification.watch import Alarm, WatchedRecording
from ..study.identification.watch import watch as watched_by
from ..work.progress import Report as Progress
from .results import WrittenResult

if TYPE_CHECKING:
    import pandas as pd


class IdentificationResult(WrittenResult):
    """An identified machine. Its `repr` shows the numbers and the limits of the recordings; `found` is all that the
    fit found."""

    _command = "identify"
    _names = (contents.FILE,)

    def __init__(self, found: IdentifiedMachine) -> None:
        self.found = found

    @cached_property
    def _report(self) -> Report:
        return contents.identification_report(self.found)

    @property
    def is_described(self) -> bool:
        """Whether the model describes the recordings: the residuals may be noise."""
        return self.found.is_described

    @property
    def numbers(self) -> pd.DataFrame:
        """The sought numbers by name: value, standard deviation, interval of 95 % (low, high), unit, and whether the
        recordings tell the number; the value of one that they do not tell is no number."""
        import pandas as pd

        rows = {
            name: {
                "value": each.value if each.is_told else float("nan"),
                "deviation": each.deviation,
                "low": each.low,
                "high": each.high,
                "unit": each.unknown.unit,
                "is_told": each.is_told,
            }
            for name, each in self.found.estimates.items()
        }
        return pd.DataFrame.from_dict(rows, orient="index")

    def _clear(self, folder: Path) -> None:
        contents.prepare(folder)

    def _writers(self, folder: Path) -> list[Callable[[], list[Path]]]:
        return contents.writers(self.found, self._report, folder)


def make_identification(
    config: Config, folder: str | Path | None, progress: Progress | None = None
) -> IdentificationResult:
    """Identify the machine of a study, see `chainunit.Study.identify`."""
    report = progress or (lambda *_: None)
    return IdentificationResult._made(lambda: IdentificationResult(identify(config, report)), folder)


class WatchResult(WrittenResult):
    """A watched recording. Its `repr` shows the alarms; `watched` has the outputs of the observer at all rows."""

    _command = "watch"
    _names = watching.PICTURES

    def __init__(self, watched: WatchedRecording) -> None:
        self.watched = watched

    @cached_property
    def _report(self) -> Report:
        return watching.watch_report(self.watched)

    @property
    def alarms(self) -> tuple[Alarm, ...]:
        """The alarms in order: side, begin, end and ground of each."""
        return self.watched.alarms

    def _clear(self, folder: Path) -> None:
        watching.prepare(folder)

    def _writers(self, folder: Path) -> list[Callable[[], list[Path]]]:
        return watching.writers(self._report, folder)


def make_watch(config: Config, folder: str | Path | None, progress: Progress | None = None) -> WatchResult:
    """Watch the recording of a study, see `chainunit.Study.watch`."""
    report = progress or (lambda *_: None)
    return WatchResult._made(lambda: WatchResult(watched_by(config, report)), folder)
