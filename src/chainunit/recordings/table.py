"""The keys of a recording in a study file."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..core.errors import InputError, near_name
from ..core.quantities import Value, declaration, quantity
from ..drives.motor import Motor
from ..reading.lists import Entry, leaves
from ..reading.tables import file_key, instance
from ..study.conditions import given
from ..study.file_section import filled_text
from ..study.organs import finer_models
from ..study.rules import FLYWHEEL_BEHIND, MACHINE_FMU, MOTOR_FMU, Rule, motor_is_chosen
from .measurands import COLUMNS as READABLE
from .recording import Recording, read_signal, with_rms


@declaration
class RecordingTable:
    """A recording."""

    crank_speed: Value = quantity(
        "rad/s", "speed of the crank in this run", default=3.0, min=0.01, max=1000.0, kind="speed"
    )
    begin: Value = quantity("s", "time of the recording from which it counts", default=0.0, min=-1e9, max=1e9)
    end: Value = quantity("s", "time of the recording up to which it counts", default=0.0, min=-1e9, max=1e9)
    ambient: Value = quantity("K", "temperature of the surroundings", default=293.15, min=230.0, max=340.0)


FILE: Any = filled_text("recording (CSV, or CSV.gz), relative to the study file")
COLUMNS: Any = file_key(
    dict[str, Any], {}, "by quantity, the head of its column, where that is not the quantity's name"
)
FROM_RECORDING: Mapping[str, str] = {
    "crank_speed": "run.crank_speed",
    "begin": "the first row",
    "end": "the last row",
}
"""By key of a recording, the source of its value if the file leaves the key out."""


@dataclass(frozen=True)
class PlannedRecording:
    """A recording as a study file names it: its `file`, the heads of its `columns` by quantity, the speed of the
    crank [rad/s], the part that counts [s], and the temperature of the surroundings [K]."""

    file: Path
    columns: Mapping[str, str]
    crank_speed: float
    begin: float
    end: float
    ambient: float

    @property
    def turn(self) -> float:
        """Time of a turn of the crank [s]."""
        return 2.0 * math.pi / self.crank_speed

    def read(self, motor: Motor | None = None) -> Recording:
        """The part that counts, of a machine with this kind of `motor`; errors are those of
        `chainunit.recordings.recording.read_signal` and `with_rms`."""
        return with_rms(read_signal(self.file, self.columns, self.begin, self.end), self.turn, motor)


def recording_rules(table: str) -> Iterator[Rule]:
    """The rules of a `table` with recordings, which need models of motor and machine."""
    for condition, reason in (
        (MACHINE_FMU, "machine is an FMU"),
        (MOTOR_FMU, "motor is an FMU"),
        (motor_is_chosen(), "motor is not known before it is chosen"),
        (given("driveline"), "driveline stands between motor and machine"),
        (FLYWHEEL_BEHIND, 'flywheel is not on the motor\'s shaft (flywheel.place = "motor")'),
        *((model.is_chosen, model.phrase) for model in finer_models()),
    ):
        yield Rule(
            table,
            condition,
            f"needs a motor and a machine of two-bar organs as models, and here the {reason}",
        )


def read_span(entry: Entry) -> tuple[float, float]:
    """Begin and end of the part of a recording that counts [s]; a fault of the `entry` where the end comes first."""
    begin, end = entry.given.get("begin", -math.inf), entry.given.get("end", math.inf)
    if not begin < end:
        key = entry.key("end")
        entry.add([InputError(f"{key} = {end:g} s: must be > begin = {begin:g} s", key)])
    return begin, end


def recording_values(entry: Entry, crank_speed: float, source: str) -> dict[str, Any]:
    """The values of a `PlannedRecording` by name, whose file is named relative to the file `source`; `crank_speed` is
    the speed where the `entry` gives none [rad/s]. An InputError has a line for each fault of the entry."""
    columns = _read_heads(entry)
    entry.refuse()
    keys, (begin, end) = entry.given, read_span(entry)
    return {
        "file": Path(source).parent / keys["file"],
        "columns": columns,
        "crank_speed": float(keys.get("crank_speed", crank_speed)),
        "begin": begin,
        "end": end,
        "ambient": float(keys.get("ambient", instance(RecordingTable, {}).ambient)),
    }


def _read_heads(entry: Entry) -> dict[str, str]:
    """The heads of the columns of a recording by quantity; a fault of the `entry` for each unknown quantity."""
    columns: dict[str, str] = {}
    for quantity_name, head in leaves(entry.given.get("columns", {})):
        key = f"columns.{quantity_name}"
        if quantity_name not in READABLE:
            hint = near_name(quantity_name, READABLE) or f"; there are {', '.join(READABLE)}"
            entry.fault(key, f"no such quantity{hint}")
        elif not isinstance(head, str):
            entry.wrong(key, head, "must be the head of its column")
        else:
            columns[quantity_name] = head
    return columns
