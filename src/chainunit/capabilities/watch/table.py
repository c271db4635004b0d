"""The table [watch] of a study file: its declaration."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import Field

from ...core.quantities import Value, declaration, quantity
from ...recordings.table import COLUMNS, FILE, RecordingTable


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
    feed_deviation: Value = quantity(
        "1",
        "standard deviation of the study's feed from that at the begin, as a share",
        default=0.05,
        above=0.0,
        max=1.0,
        kind="percent",
    )
    noise: Value = quantity(
        "1",
        "standard deviation of the noise of a sensor, in parts of the RMS of its column",
        default=0.01,
        min=1e-6,
        max=1.0,
        kind="percent",
    )
    gain: Value = quantity(
        "1", "standard deviation of the gain of a sensor", default=0.01, min=0.0, max=1.0, kind="percent"
    )


KEYS: Mapping[str, Any] = {
    "file": FILE,
    "columns": COLUMNS,
    "identification": (
        str,
        Field(
            "",
            description="result.json of chainunit identify, whose covariance widens the thresholds; relative to the "
            "study file",
        ),
    ),
}
"""Keys of the table that are no quantities."""
