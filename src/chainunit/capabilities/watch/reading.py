"""The reader of the table [watch], as a `WatchPlan`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...reading.lists import Entry
from ...reading.tables import given_values, instance
from ...recordings.table import PlannedRecording, read_span, recording_values
from .table import WatchTable

_NUMBERS = ("learning", "feed_deviation", "noise", "gain")


@dataclass(frozen=True)
class WatchPlan(PlannedRecording):
    """A recording that is watched: the time of its begin in which is learned [s], the standard deviation of the feed
    as a share, the noise of the sensors in parts of the RMS of their columns, the standard deviation of their gains,
    and the result of an identification, if there is one."""

    learning: float
    feed_deviation: float
    noise: float
    gain: float
    identification: Path | None


def read_watch(form: Any, crank_speed: float, source: str) -> WatchPlan:
    """The plan of a checked table [watch], its `form` with what the file gives.

    Parameters
    ----------
    crank_speed : the speed where the table does not give its own [rad/s]
    source : the study file; other files are named relative to it

    Raises
    ------
    InputError
        with a line for each fault.
    """
    content, usual = given_values(form), instance(WatchTable, {})
    entry = Entry("watch", content)
    if not content.get("file"):
        entry.fault("file", "must be given, the recording")
    read_span(entry)
    values = recording_values(entry, crank_speed, source)
    values |= {name: float(content.get(name, getattr(usual, name))) for name in _NUMBERS}
    file = content.get("identification")
    return WatchPlan(**values, identification=Path(source).parent / file if file else None)
