"""The best machine: parameters that make one or two quantities of a turn least, within limits."""

from __future__ import annotations

from collections.abc import Iterable

from ...report.capability import Capability
from ...study.config import FileReading
from ...study.file_section import FileSection, TableForm, TableLists
from ...study.organs import finer_models
from ...study.parts import motor_is_left
from ...study.rules import MACHINE_FMU, NEEDS_MODEL, Rule
from .table import FIELDS, Optimize, read_wishes
from .wishes import Wishes


class OptimizeCapability(Capability):
    """The capability, with the table [optimize]."""

    name = "optimize"
    order = 110
    tables = {  # noqa: RUF012
        "optimize": FileSection(
            Optimize,
            optional=True,
            keys=FIELDS,
            title="Search for the best machine",
            is_used=lambda study: False,
            apart=True,
            form=TableForm(texts={"objectives": {"items": {"type": "string"}, "maxItems": 2}}),
            lists=TableLists(single_keys=("objectives", "free", "limits")),
        )
    }

    def rules(self) -> Iterable[Rule]:
        """It needs a model of the machine, with two bars."""
        yield Rule("optimize", MACHINE_FMU, NEEDS_MODEL)
        yield from (Rule("optimize", organs.is_chosen, organs.without_turn) for organs in finer_models())

    def plan(self, reading: FileReading) -> Wishes | None:
        """The wishes that the table states."""
        if "optimize" not in reading.data:
            return None
        loads, run = reading.values["feed"], reading.values["run"]
        by_motor = bool(reading.parts.designation or motor_is_left(reading.data))
        table, form = reading.values["optimize"], reading.form.optimize
        return read_wishes(
            table, form, reading.parts.machine, reading.machine, loads, run.crank_speed, by_motor
        )


CAPABILITY = OptimizeCapability()
