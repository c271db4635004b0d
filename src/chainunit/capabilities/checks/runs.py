"""The runs of a study whose largest loads are checked."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ...study.arrays import Dataset, peak
from ...study.record import StudyRuns


def largest(runs: StudyRuns, quantity: Callable[[Dataset], Any]) -> tuple[float, str]:
    """The largest size of a `quantity` in the start-up and in each other run from its event on, and that run."""
    series = {"start_up": runs.series["start_up"], **runs.event_parts}
    return max((peak(quantity(run)), name) for name, run in series.items())
