"""A sweep: quantities of a turn and measures of runs over parameters of the study, at many points."""

from __future__ import annotations

from collections.abc import Iterable

from ...report.capability import Capability
from ...study.conditions import given, has_entries, has_entry, is_one_of
from ...study.config import FileReading
from ...study.file_section import FileSection, TableForm, TableLists
from ...study.organs import finer_models
from ...study.rules import MACHINE_FMU, MOTOR_FMU, NEEDS_MODEL, Rule, motor_is_chosen
from .plan import SweepPlan
from .table import FIELDS, MEASURES_OF_SWEEP, MOST_RESULTS, MOST_VALUES, SWEPT, SweepTable, read_plan


class SweepCapability(Capability):
    """The capability, with the table [sweep]."""

    name = "sweep"
    order = 140
    tables = {  # noqa: RUF012
        "sweep": FileSection(
            SweepTable,
            optional=True,
            keys=FIELDS,
            title="Sweep",
            is_used=lambda study: False,
            lists=TableLists(
                {"parameter": SWEPT},
                single_keys=("parameter", "quantities", "measures"),
                deciders={"points": "method"},
            ),
            follows={
                "quantities": "without measures peak(crank_torque) and rms(crank_torque)",
                "event": "the only one of the study, or that whose quantities are swept",
                "best": "the first one",
            },
            form=TableForm(
                texts={
                    "quantities": {"items": {"type": "string"}, "maxItems": MOST_RESULTS},
                    "measures": {
                        "items": {"enum": list(MEASURES_OF_SWEEP)},
                        "maxItems": len(MEASURES_OF_SWEEP),
                    },
                    "parameter.name": {"minLength": 1},
                    "parameter.values": {
                        "items": {"type": ["number", "string"]},
                        "minItems": 1,
                        "maxItems": MOST_VALUES,
                    },
                }
            ),
        )
    }

    def rules(self) -> Iterable[Rule]:
        """It varies one drive, of which the models are known."""
        yield Rule("sweep", MACHINE_FMU, NEEDS_MODEL)
        yield Rule(
            "sweep", motor_is_chosen(), "varies one drive, and [sizing] tries many; leave out one of the two"
        )
        yield Rule(
            "sweep.points",
            is_one_of("sweep.method", "grid"),
            "a grid has the points of its parameters; leave it out, or give another method",
        )
        yield Rule(
            "sweep.measures",
            ~given("coupling"),
            "coupling_trip_time is of a torque limiter; add [coupling], or leave it out",
            has_entry("sweep.measures", "coupling_trip_time"),
        )
        reason = "need a model of the motor, which is an FMU; leave them out"
        yield Rule("sweep.measures", MOTOR_FMU, reason, has_entries("sweep.measures"))
        for organs in finer_models():
            reason = f"{organs.without_turn}, or give measures"
            yield Rule("sweep.quantities", organs.is_chosen, reason, has_entries("sweep.quantities"))

    def plan(self, reading: FileReading) -> SweepPlan | None:
        """The plan of the table; None for a machine that was refused."""
        return read_plan(reading) if "sweep" in reading.data and reading.machine is not None else None


CAPABILITY = SweepCapability()
