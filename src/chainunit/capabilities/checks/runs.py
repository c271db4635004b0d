"""The runs of a study whose largest loads are checked."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from ...study.arrays import peak
from ...study.record import StudyRuns

if TYPE_CHECKING:
    import xarray as xr


def largest(runs: StudyRuns, quantity: Callable[[xr.Dataset], Any]) -> tuple[float, str]:
    """The largest size of a `quantity` in the start-up and in each other run from its event on, and that run."""
    series = {"start_up": runs.series["start_up"], **runs.event_parts}
    return max((peak(quantity(run)), name) for name, run in series.items())
