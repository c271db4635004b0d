"""`SweepResult`: the results of a sweep over parameters of a study, in Python."""

from __future__ import annotations

from functools import cached_property
from numbers import Integral
from pathlib import Path
from typing import TYPE_CHECKING

from ..core.errors import InputError, WriteError, shown
from ..core.files import claim, write_all
from ..core.temporary_folders import in_temporary_folder
from ..report import sweep as contents
from ..report.blocks import Report
from ..study.config import Config
from ..study.sweep_summary import SweepSummary
from ..work.progress import Report as Progress
from .results import ReportedResult

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr


class SweepResult(ReportedResult):
    """The results of a sweep. Its `repr` shows the size of the sweep, the best points and the extremes."""

    def __init__(self, summary: SweepSummary) -> None:
        self.summary = summary
        """Extremes, best points, influences and spread, as the report reads them."""

    @property
    def dataset(self) -> xr.Dataset:
        """All results by their names in the study, with units: over the parameters of a grid, else over ``point``,
        with the parameters as coordinates. ``reason`` is 0 where a point has results; its attribute ``reasons`` has
        the texts. Values of points that are no grid are read when they are used."""
        return self.summary.findings.dataset

    @cached_property
    def table(self) -> pd.DataFrame:
        """A row for each point: its parameters, its results, and ``reason``, a text, empty where there is none."""
        points = self.summary.findings.points.load()
        table = points.to_dataframe()
        reasons = ["", *map(str, self.summary.findings.task.reasons[1:])]
        table["reason"] = [reasons[code] for code in points["reason"].values]
        return table[[*self.summary.variables, "reason"]]

    @property
    def file(self) -> Path:
        """The store of all points (Zarr), a folder."""
        return self.summary.findings.outcome.file

    @cached_property
    def _report(self) -> Report:
        return contents.report(self.summary)


def make_sweep(
    config: Config,
    folder: Path | None,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Progress | None = None,
) -> SweepResult:
    """Run the sweep of a study, see `chainunit.Study.sweep`."""
    if workers is not None and (
        isinstance(workers, bool) or not isinstance(workers, Integral) or workers < 1
    ):
        raise InputError(f"workers = {shown(workers)}: must be a whole number >= 1")

    def quiet(what: str, complete: float, total: float) -> None:
        pass

    def result_in(place: Path) -> SweepResult:
        return SweepResult(contents.compute(config, place, progress or quiet, workers, scheduler))

    if folder is None:
        return in_temporary_folder(result_in)
    with claim(folder, "sweep") as place:
        result = result_in(place)
        _, failure = write_all(contents.writers(result.summary, contents.report(result.summary), place))
        if failure is not None:
            raise WriteError(str(failure)) from failure
    return result
