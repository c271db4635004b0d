"""Energy: electric power by place, energy and cost of a year, and a second motor over the life of the drive."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from ...core.errors import InputError, refusal_prefix
from ...report.capability import Capability, Contents
from ...report.lines import Line
from ...study.analysis import Analysis
from ...study.config import Config, FileReading
from ...study.file_section import FileSection, TableLists
from ...study.record import StudyRecord
from ...study.rules import MOTOR_FMU, Rule
from .table import FIELDS, LOADS, Usage, UsagePlan, read_usage


class EnergyCapability(Capability):
    """The capability, with the table [usage]."""

    name = "energy"
    order = 40
    tables = {  # noqa: RUF012
        "usage": FileSection(
            Usage,
            optional=True,
            keys=FIELDS,
            title="Use of the machine",
            lists=TableLists({"load": LOADS}),
            follows={
                "load": "the feed of the study all the time",
                "other": "the same motor in the next efficiency class",
                "inverter_losses": "the losses at the limit of class IE2",
            },
        )
    }

    def rules(self) -> Iterable[Rule]:
        """Its losses need a model of the motor."""
        yield Rule("usage", MOTOR_FMU, "needs a model of the motor, which is an FMU; leave it out")

    def plan(self, reading: FileReading) -> UsagePlan | None:
        """The plan of the table."""
        if "usage" not in reading.data:
            return None
        return read_usage(reading.values["usage"], reading.form.usage)

    def faults(self, config: Config) -> Iterable[InputError]:
        """Refuse another motor that no catalogue has, and a factor that takes the feed beyond its bounds."""
        plan: UsagePlan | None = config.plans[self.name]
        if plan is None:
            return
        from .running import scale_faults

        for name, load in plan.loads.items():
            for reason in scale_faults(config.feed, float(load.factor)):
                yield InputError(f"usage.load.factor = {load.factor:g} ({name}): {reason}", "usage.load")
        if not plan.other:
            return
        from ...drives.catalogue import motor_of_catalogue

        try:
            with refusal_prefix("usage.other = ", "usage.other"):
                motor_of_catalogue(plan.other, config.file.catalogues)
        except InputError as error:
            yield error

    def analyses(self) -> Iterable[type[Analysis]]:
        """The class of the motor, and the energy."""
        from .analysis import EnergyAnalysis
        from .motor_class import MotorClassAnalysis

        return (MotorClassAnalysis, EnergyAnalysis)

    def contents(self) -> Mapping[str, Contents]:
        """Losses, a year, and a life."""
        from . import page

        return {"energy": Contents("Energy", page.blocks, (page.PICTURE,), on_sheet=True)}

    def unchecked(self, study: StudyRecord) -> Iterator[Line]:
        """The energy of a study without the table."""
        if study.setup.config.plans[self.name] is None:
            yield "energy of a year: the study file has no table [usage]"


CAPABILITY = EnergyCapability()
