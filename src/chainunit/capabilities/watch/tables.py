"""The tables [watch] and [observer] of a study file, and the plan of a recording that is watched."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...core.quantities import Value, declaration, percentage, quantity
from ...reading.lists import Entry
from ...reading.tables import file_key, given_values
from ...recordings.table import (
    COLUMNS,
    FILE,
    PlannedRecording,
    RecordingTable,
    read_span,
    recording_values,
)
from ...study.config import FileReading


@declaration
class ObserverTable:
    """A load observer beside the motor."""

    signal_noise: Value = percentage(
        "noise of the measured current or power: standard deviation in parts of the RMS torque of normal running",
        default=0.01,
        min=1e-5,
        max=1.0,
    )
    speed_noise: Value = percentage(
        "noise of the measured speed: standard deviation in parts of the speed of normal running",
        default=0.01,
        min=1e-5,
        max=1.0,
    )
    rate: Value = quantity("Hz", "rate of independent samples", default=1000.0, min=1.0, max=1e6)
    fluctuation: Value = percentage(
        "natural fluctuation of the feed of a side: standard deviation as a share",
        default=0.03,
        min=0.0,
        max=1.0,
    )
    fluctuation_time: Value = quantity(
        "s", "correlation time of this fluctuation", default=10.0, min=0.01, max=1e6
    )
    change: Value = percentage(
        "change of the feed that is followed: standard deviation in a second, in parts of the feed of a side; larger "
        "finds a shift earlier, smaller finds a smaller shift",
        default=0.1,
        min=1e-4,
        max=10.0,
    )
    false_alarms: Value = quantity(
        "1", "permitted false alarms in a million turns", default=1.0, min=1e-6, max=1e5
    )
    overload: Value = percentage(
        "share of the feed of a side that, moved to the other side, overloads that side",
        default=0.2,
        min=1e-3,
        max=1.0,
    )
    force_overload: Value = quantity(
        "N",
        "processing force on one side that overloads it, and the size of a jam",
        default=1000.0,
        above=0.0,
    )
    uncertainty: Value = quantity(
        "kg",
        "false imbalance of the feed by errors of the machine's parameters: standard deviation",
        default=0.0,
        min=0.0,
        max=1e6,
    )
    force_uncertainty: Value = quantity(
        "N",
        "false imbalance of the processing forces by errors of the machine's parameters: standard deviation",
        default=0.0,
        min=0.0,
        max=1e9,
    )


@declaration
class WatchTable(RecordingTable):
    """The recording that is watched."""

    learning: Value = quantity(
        "s",
        "time from its begin in which the angle of the crank, the zero of the signal and the forces are learned",
        default=20.0,
        above=0.0,
        max=1e5,
    )
    feed_deviation: Value = percentage(
        "standard deviation of the study's feed from that at the begin, as a share",
        default=0.05,
        above=0.0,
        max=1.0,
    )
    noise: Value = percentage(
        "standard deviation of the noise of a sensor, in parts of the RMS of its column",
        default=0.01,
        min=1e-6,
        max=1.0,
    )
    gain: Value = percentage("standard deviation of the gain of a sensor", default=0.01, min=0.0, max=1.0)


KEYS: Mapping[str, Any] = {
    "file": FILE,
    "columns": COLUMNS,
    "identification": file_key(
        str,
        "",
        "result.json of chainunit identify, whose covariance widens the thresholds; relative to the "
        "study file",
    ),
}
"""Keys of the table that are no quantities."""


@dataclass(frozen=True)
class WatchPlan(PlannedRecording):
    """A recording that is watched, the values of its `table`, and the result of an identification, if any."""

    table: WatchTable
    identification: Path | None


def read_watch(reading: FileReading) -> WatchPlan:
    """The plan of a study with the table [watch].

    Raises
    ------
    InputError
        with a line for each fault.
    """
    entry = Entry("watch", given_values(reading.form.watch))
    if not entry.given.get("file"):
        entry.fault("file", "must be given, the recording")
    read_span(entry)
    values = recording_values(entry, reading.values["run"].crank_speed, reading.source)
    file = entry.given.get("identification")
    identification = Path(reading.source).parent / file if file else None
    return WatchPlan(**values, table=reading.values["watch"], identification=identification)
