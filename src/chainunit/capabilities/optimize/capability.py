"""The best machine: parameters that make one or two quantities of a turn least, within limits."""

from __future__ import annotations

from collections.abc import Iterable

from ...report.capability import Capability
from ...study.config import FileReading
from ...study.file_section import FileSection, TableForm, TableLists
from ...study.organs import finer_models
from ...study.rules import MACHINE_FMU, NEEDS_MODEL, Rule
from .table import FIELDS, read_wishes
from .wishes import Optimize, Wishes


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
        return read_wishes(reading) if "optimize" in reading.data else None


CAPABILITY = OptimizeCapability()
