"""The runs of a study whose largest loads are checked."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

from ...study.arrays import peak
from ...study.event_torques import from_event_on
from ...study.record import StudyRecord

if TYPE_CHECKING:
    import xarray as xr


def _runs_from_events(study: StudyRecord) -> Iterator[tuple[str, xr.Dataset]]:
    """The start-up, and each other run from its event on, with their names."""
    yield "start_up", study.runs["start_up"]
    for name in study.event:
        if name in study.runs:
            yield name, from_event_on(study, name)


def largest(study: StudyRecord, quantity: Callable[[xr.Dataset], Any]) -> tuple[float, str]:
    """The largest size of a `quantity` in all runs, and the run in which it is."""
    return max((peak(quantity(run)), name) for name, run in _runs_from_events(study))
