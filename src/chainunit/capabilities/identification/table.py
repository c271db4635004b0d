"""The table [identify] of a study file and its entries: declarations only."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

from ...core.quantities import Value, declaration, percentage, quantity, whole_number
from ...reading.lists import TableList
from ...reading.tables import file_key
from ...recordings.table import COLUMNS, FILE, FROM_RECORDING, RecordingTable
from ...study.file_section import entered, filled_text

FEEDS = ("same", "none")
"""The feed of a run: that of all loaded runs, or none."""
MOST_SPEEDS = 200


@declaration
class IdentifyTable:
    """The identification of a machine from recordings of its motor."""

    noise: Value = percentage(
        "standard deviation of the noise of a sensor, in parts of the RMS of its column; of sensors without a table",
        default=0.01,
        min=1e-6,
        max=1.0,
    )
    gain: Value = percentage(
        "standard deviation of the gain of a sensor; of sensors without a table",
        default=0.01,
        min=0.0,
        max=1.0,
    )
    starts: Value = whole_number(
        "number of starts of the fit, spread over the bounds", default=1, min=1, max=100
    )
    seed: Value = whole_number("seed of the starts", default=1, min=0, max=1_000_000_000)


@declaration
class RunTable(RecordingTable):
    """A recorded run."""

    switched_off: Value = quantity(
        "s", "time of the recording at which the motor is switched off", default=0.0, min=-1e9, max=1e9
    )


@declaration
class SensorTable:
    """The knowledge of a sensor."""

    noise: Value = percentage(
        "standard deviation of its noise, in parts of the RMS of its column", default=0.01, min=1e-6, max=1.0
    )
    gain: Value = percentage("standard deviation of its gain", default=0.01, min=0.0, max=1.0)


SOUGHT = TableList(
    "identify.parameter",
    title="Number that is sought",
    description="numbers that are sought",
    most=40,
    must_be="the full name of a number of the machine (machine.left.web_mass), of its feed (feed. ..), or of the "
    "motor (motor. ..)",
    example="machine.left.web_mass",
    least=1,
    conditions={
        "required": ["name"],
        "anyOf": [{"required": ["from", "to"]}, {"required": ["deviation"]}],
    },
    keys={
        "name": filled_text(
            'full name of a quantity, such as "machine.left.web_mass", "feed.left.material_mass", '
            '"motor.rotor.J"'
        ),
        "from": entered("least value"),
        "to": entered("largest value"),
        "deviation": entered(
            "standard deviation of the value of the study from the true one, as of a weighing or a "
            'drawing; a number in the unit of the quantity, or a share of the value, such as "5 %"'
        ),
    },
)
RUNS = TableList(
    "identify.run",
    title="Recorded run",
    description="recordings",
    most=12,
    declared=RunTable,
    is_twice="is the name of another run; give it another",
    least=1,
    conditions={"required": ["file"]},
    follows={**FROM_RECORDING, "name": "run_1, run_2, ..", "switched_off": "never"},
    keys={
        "name": filled_text("name of the run, in small letters, digits and _"),
        "file": FILE,
        "feed": file_key(
            Literal[FEEDS], "same", "feed of the machine: the one that is sought in all loaded runs, or none"
        ),
        "speeds": file_key(
            list[list[Any]],
            [],
            "smooth changes of the speed reference, each a list of its time in the recording, its "
            "duration, and the crank speed after it",
            max_length=MOST_SPEEDS,
        ),
        "columns": COLUMNS,
        "added": file_key(
            dict[str, Any],
            {},
            "what was added to a sought number for this run, by its full name: a known mass",
        ),
    },
)
SENSORS = TableList(
    "identify.sensor",
    title="Sensor of a recording",
    description="knowledge of sensors",
    most=12,
    declared=SensorTable,
    named_by="column",
    conditions={"required": ["column"]},
    follows={
        "noise": "identify.noise",
        "gain": "identify.gain",
        "offset": "5 % of the RMS of a current or torque, 0 of others",
        "resolution": "0",
    },
    keys={
        "column": filled_text('quantity that it measures, such as "motor.i"'),
        "offset": entered("standard deviation of its offset, in the unit of the quantity"),
        "resolution": entered("step of its converter, in the unit of the quantity"),
    },
)
FIELDS: Mapping[str, Any] = {"parameter": SOUGHT.field, "run": RUNS.field, "sensor": SENSORS.field}
"""Keys of the table that are no quantities, as pydantic fields."""
