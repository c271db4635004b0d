"""`Study.identify`, and its result."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from ...report.capability import AnyStudy
from ...report.reported_result import ReportedResult
from ...study.config import Config
from ...work.progress import TaskProgress
from .identification import IdentifiedMachine
from .page import TASK

if TYPE_CHECKING:
    import pandas as pd


class IdentificationResult(ReportedResult[Config, IdentifiedMachine]):
    """An identified machine. Its `repr` shows the numbers and the limits of the recordings; `found` is all that the
    fit found."""

    _task = TASK

    @property
    def found(self) -> IdentifiedMachine:
        """All results of the fit, as the report reads them."""
        return self._outcome

    @property
    def is_described(self) -> bool:
        """Whether the model describes the recordings: the residuals may be noise."""
        return self.found.is_described

    @cached_property
    def answers(self) -> pd.DataFrame:
        """The sought numbers by name: unit, value in the best fit as ``identified.toml`` has it, standard deviation,
        interval of 95 % (low, high), and whether the recordings determine the number; the value of one that they do
        not determine is no number. If the model does not describe the recordings, deviation and interval are the ones
        before the recordings."""
        import pandas as pd

        rows = {
            name: {
                "unit": estimate.unknown.unit,
                "value": estimate.fitted if estimate.is_determined else float("nan"),
                "deviation": estimate.deviation,
                "low": estimate.low,
                "high": estimate.high,
                "is_determined": estimate.is_determined,
            }
            for name, estimate in self.found.estimates.items()
        }
        return pd.DataFrame.from_dict(rows, orient="index")


def identify(
    study: AnyStudy, folder: str | Path | None = None, progress: TaskProgress | None = None
) -> IdentificationResult:
    """Identify the machine from recordings, as the table [identify] asks: two of a minute take some ten seconds.

    Parameters
    ----------
    folder : the folder to which the files of ``chainunit identify -o`` are written
    progress : as of `run`

    Raises
    ------
    InputError
        for a study without the table [identify], and with a line for each fault of the recordings.
    RunError
        if the machine does not run with the start values, and if the search for suspects is interrupted; its
        `partial` is then the result of the fit.
    WriteError
        for a file that cannot be written; the others are written.
    """
    return IdentificationResult.made(study.config, folder, progress)


METHOD, RESULT = identify, IdentificationResult
