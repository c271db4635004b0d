"""The rating life of a pin as a capability."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from pydantic import Field

from chainunit.core.errors import InputError, near_name, shown
from chainunit.report.capability import Capability, Contents
from chainunit.study.analysis import Analysis
from chainunit.study.config import FileReading
from chainunit.study.file_section import FileSection, TableForm
from chainunit.study.rules import MACHINE_FMU, Rule

from .table import LifePlan, PinLifeTable


class PinLifeCapability(Capability):
    """The capability, with the table [pin_life]."""

    name = "pin_life"
    order = 145
    tables = {  # noqa: RUF012
        "pin_life": FileSection(
            PinLifeTable,
            optional=True,
            keys={"pin": (str, Field("", description="pin that gets a rolling bearing, by its title"))},
            title="Rolling bearing of a pin",
            apart=True,
            form=TableForm(required=("pin", "C")),
        )
    }

    def rules(self) -> Iterable[Rule]:
        """It needs a machine whose bearings are known."""
        yield Rule(
            "pin_life", MACHINE_FMU, "needs the bearings of the machine, which is an FMU; leave it out"
        )

    def plan(self, reading: FileReading) -> LifePlan | None:
        """The plan of the table; a pin has to be one of the machine's joints that turn."""
        if "pin_life" not in reading.data or reading.machine is None:
            return None
        pin, model = reading.form.pin_life.pin, reading.machine.model
        turning = [title for title, output in model.pins.items() if output in model.joints]
        if pin not in turning:
            hint = near_name(pin, turning) or f"; there are {', '.join(turning) or 'none'}"
            raise InputError(f"pin_life.pin = {shown(pin)}: is no turning pin{hint}", key="pin_life.pin")
        return LifePlan(pin, reading.values["pin_life"])

    def analyses(self) -> Iterable[type[Analysis]]:
        """The life in steady running."""
        from .analysis import PinLifeAnalysis

        return (PinLifeAnalysis,)

    def contents(self) -> Mapping[str, Contents]:
        """The table of the life."""
        from . import page

        return {"pin_life": Contents("Rating life of a pin", page.blocks)}


CAPABILITY = PinLifeCapability()
