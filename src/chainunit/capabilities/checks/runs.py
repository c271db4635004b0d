"""The runs of a study whose largest loads are checked."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from ...study.arrays import peak
from ...study.record import StudyRecord
from ...study.torques import from_event_on

if TYPE_CHECKING:
    import xarray as xr


def largest(study: StudyRecord, quantity: Callable[[xr.Dataset], Any]) -> tuple[float, str]:
    """The largest size of a `quantity` in the start-up and in each other run from its event on, and that run."""
    runs = {"start_up": study.runs["start_up"]}
    runs |= {name: from_event_on(study, name) for name in study.event if name in study.runs}
    return max((peak(quantity(run)), name) for name, run in runs.items())
