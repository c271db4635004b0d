"""The reader of the table [watch], as a `WatchPlan`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...reading.lists import Entry
from ...reading.tables import given_values, instance
from ...recordings.table import read_heads, read_span
from .table import WatchTable

_NUMBERS = ("ambient", "learning", "feed_deviation", "noise", "gain")


@dataclass(frozen=True)
class WatchPlan:
    """A recording that is watched: its `file`, the heads of its `columns` by quantity, the speed of the crank
    [rad/s], the part that counts [s], the temperature of the surroundings [K]; the time of its begin in which is
    learned [s], the standard deviation of the feed as a share, the noise of the sensors in parts of the RMS of their
    columns, the standard deviation of their gains, and the result of an identification, if there is one."""

    file: Path
    columns: Mapping[str, str]
    crank_speed: float
    begin: float
    end: float
    ambient: float
    learning: float
    feed_deviation: float
    noise: float
    gain: float
    identification: Path | None

    @property
    def turn(self) -> float:
        """Time of a turn of the crank [s]."""
        return 2.0 * math.pi / self.crank_speed


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
    given, usual = given_values(form), instance(WatchTable, {})
    entry = Entry("watch", given)
    if not given.get("file"):
        entry.fault("file", "must be given, the recording")
    begin, end = read_span(entry)
    columns = read_heads(entry)
    entry.refuse()
    folder, identification = Path(source).parent, given.get("identification")
    numbers = {name: float(given.get(name, getattr(usual, name))) for name in _NUMBERS}
    return WatchPlan(
        file=folder / given["file"],
        columns=columns,
        crank_speed=float(given.get("crank_speed", crank_speed)),
        begin=begin,
        end=end,
        identification=folder / identification if identification else None,
        **numbers,
    )
