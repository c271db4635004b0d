"""The runs of a study whose largest loads are checked."""

from __future__ import annotations

from collections.abc import Iterator

import xarray as xr

from ...study.event_torques import from_event_on
from ...study.record import StudyRecord


def runs_from_events(study: StudyRecord) -> Iterator[tuple[str, xr.Dataset]]:
    """The start-up, and each other run from its event on, with their names."""
    yield "start_up", study.runs["start_up"]
    for name in study.event:
        if name in study.runs:
            yield name, from_event_on(study, name)
