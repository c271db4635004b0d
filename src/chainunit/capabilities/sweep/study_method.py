"""`SweepResult`: the results of a sweep over parameters of a study, in Python."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from ..study.config import Config
from .results import ReportedResult

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from ..capabilities.sweep.summary import SweepSummary


class SweepResult(ReportedResult[Config, "SweepSummary"]):
    """The results of a sweep. Its `repr` shows the size of the sweep, the best points and the extremes."""

    _command = "sweep"

    @property
    def summary(self) -> SweepSummary:
        """Extremes, best points, influences and spread, as the report reads them."""
        return self._outcome

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
