"""Real machines: masses, friction and feed from recordings of the motor."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from ...reading.tables import named_table
from ...recordings.measurands import MEASURANDS
from ...recordings.table import recording_rules
from ...report.capability import Capability
from ...study.capability import FileReference
from ...study.config import FileReading
from ...study.file_section import FileSection, TableForm, TableLists
from ...study.rules import Rule
from .reading import IdentificationPlan, read_identification
from .table import FIELDS, MOST_SPEEDS, RUNS, SENSORS, SOUGHT, IdentifyTable

_VALUE = {"type": ["number", "string"]}


class IdentificationCapability(Capability):
    """The capability, with the table [identify]."""

    name = "identification"
    order = 120
    tables = {  # noqa: RUF012
        "identify": FileSection(
            IdentifyTable,
            optional=True,
            keys=FIELDS,
            title="Identification from recordings",
            is_used=lambda study: False,
            apart=True,
            lists=TableLists(
                {"parameter": SOUGHT, "run": RUNS, "sensor": SENSORS},
                single_keys=("parameter", "run", "sensor"),
            ),
            form=TableForm(
                required=("parameter", "run"),
                texts={
                    "parameter.name": {"minLength": 1},
                    "run.name": {"pattern": r"^[a-z][a-z0-9_]{0,19}$"},
                    "run.file": {"minLength": 1},
                    "run.speeds": {
                        "maxItems": MOST_SPEEDS,
                        "items": {"type": "array", "items": _VALUE, "minItems": 3, "maxItems": 3},
                    },
                    "sensor.column": {
                        "enum": [name for name, measurand in MEASURANDS.items() if measurand.analog]
                    },
                },
            ),
        ),
    }

    def rules(self) -> Iterable[Rule]:
        """Recordings need models of motor and machine."""
        return recording_rules("identify")

    def plan(self, reading: FileReading) -> IdentificationPlan | None:
        """The plan of the table; None for a machine that was refused."""
        return read_identification(reading) if "identify" in reading.data else None

    def files(self, data: Mapping[str, Any]) -> Iterator[FileReference]:
        """The recordings."""
        runs = named_table(data, "identify").get("run")
        for k, run in enumerate(runs if isinstance(runs, list) else [], 1):
            if isinstance(run, dict):
                yield FileReference(f"identify.run.{k}.file", run, "file")


CAPABILITY = IdentificationCapability()
