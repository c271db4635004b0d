"""`IdentificationResult` and `WatchResult`: an identified machine, and a watched recording, from Python."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..study.config import Config
from .results import ReportedResult

if TYPE_CHECKING:
    import pandas as pd

    from ..capabilities.identification.identification import IdentifiedMachine
    from ..capabilities.identification.watch import Alarm, WatchedRecording


class IdentificationResult(ReportedResult[Config, "IdentifiedMachine"]):
    """An identified machine. Its `repr` shows the numbers and the limits of the recordings; `found` is all that the
    fit found."""

    _command = "identify"

    @property
    def found(self) -> IdentifiedMachine:
        """All results of the fit, as the report reads them."""
        return self._outcome

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


class WatchResult(ReportedResult[Config, "WatchedRecording"]):
    """A watched recording. Its `repr` shows the alarms; `watched` has the outputs of the observer at all rows."""

    _command = "watch"

    @property
    def watched(self) -> WatchedRecording:
        """The alarms and the outputs of the observer at all rows."""
        return self._outcome

    @property
    def alarms(self) -> tuple[Alarm, ...]:
        """The alarms in order: side, begin, end and ground of each."""
        return self.watched.alarms
