"""`Study.sweep`, and its result."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...report.capability import AnyStudy
from ...report.reported_result import ReportedResult
from ...study.config import Config
from ...work.progress import TaskProgress
from .page import TASK
from .summary import SweepSummary, SweptStudy

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr


class SweepResult(ReportedResult[Config, SweptStudy]):
    """The results of a sweep. Its `repr` shows the size of the sweep, the best points and the extremes."""

    _task = TASK

    @property
    def summary(self) -> SweepSummary:
        """Extremes, best points, influences and spread, as the report reads them."""
        return self._outcome.summary

    def _answer_rows(self) -> Mapping[str, Mapping[str, Any]]:
        """For each result the least and the largest value over all points, and the value of the study."""
        numbers = self._report.result
        return {
            name: {end: rows[end][name] for end in ("least", "largest") if rows.get(end)}
            | {"study": numbers["nominal"][name]}
            for name, rows in numbers["extremes"].items()
        }

    @property
    def dataset(self) -> xr.Dataset:
        """All results by their names in the study, with units: over the parameters of a grid, else over ``point``,
        with the parameters as coordinates. ``reason`` is 0 where a point has results; its attribute ``reasons`` has
        the texts. Values of points that are no grid are read when they are used."""
        return self._outcome.findings.dataset

    @cached_property
    def table(self) -> pd.DataFrame:
        """A row for each point: its parameters, its results, and ``reason``, a text, empty where there is none."""
        findings = self._outcome.findings
        points = findings.points.load()
        table = points.to_dataframe()
        reasons = ["", *map(str, findings.task.reasons[1:])]
        table["reason"] = [reasons[code] for code in points["reason"].values]
        return table[[*findings.variables, "reason"]]

    @property
    def file(self) -> Path:
        """The store of all points, a NetCDF file."""
        return self._outcome.findings.outcome.file


def sweep(
    study: AnyStudy,
    folder: str | Path | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    engine: str = "native",
    progress: TaskProgress | None = None,
) -> SweepResult:
    """Run the sweep of the study, its table ``sweep``, as ``chainunit sweep`` does.

    Parameters
    ----------
    folder : the folder with the store of all points and the report; a store that fits is continued. Without it
        the store is in a temporary folder, which lasts as long as the result
    workers : number of threads, or with measures of processes; by default one for each processor
    scheduler : address of a Dask scheduler whose workers make the points, such as ``tcp://10.0.0.5:8786``
    engine : engine of the quantities of a turn: "native", "numpy", or "cuda" (a GPU of NVIDIA)
    progress : as of `run`

    Raises
    ------
    InputError
        for a study without a sweep, and for a fault that only a run shows.
    RunError
        where a batch fails; earlier ones are in the store.
    WriteError
        for a file that cannot be written.
    """
    return SweepResult.made(
        study.config, folder, progress, workers=workers, scheduler=scheduler, engine=engine
    )


METHOD, RESULT = sweep, SweepResult
