"""Sizing: the motor of the catalogue that a machine needs, its gear, its flywheel, its protection."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

from ...core.errors import InputError
from ...machines.machine import Machine
from ...report.capability import AnswerBlocks, Capability, Contents
from ...report.lines import Line
from ...study.analysis import Analysis
from ...study.conditions import given, has_entries, is_one_of
from ...study.config import Config, FileReading
from ...study.file_section import FileSection
from ...study.record import StudyRecord
from ...study.rules import BESIDE_MOTOR, Rule, has_sides
from .choice import SizingChoice
from .table import SIZING_KEYS, Sizing, SizingPlan

_SUPPLY = (
    "the supply has the rated voltage of the motor, 400 V at 50 Hz and 460 V at 60 Hz (sizing.frequency); motors for "
    'another voltage stand in a catalogue of your own, catalogue = "FILE.csv"'
)


class SizingCapability(Capability):
    """The capability, with the table [sizing]."""

    name = "sizing"
    order = 20
    tables = {  # noqa: RUF012
        "sizing": FileSection(
            Sizing,
            # wishes that not every machine has; the ratio of inertias is a rule for servo drives: time, current and
            # heat of its start limit the inertia of an induction motor
            default=Sizing(fluctuation=math.inf, inertia_ratio=math.inf),
            optional=True,
            keys=SIZING_KEYS,
            before="gear",
            title="Demands on the motor",
            chooses_motor=True,
            apart=True,
            follows={
                "fluctuation": "none",
                "inertia_ratio": "none",
                "hours": "usage.hours, if the file has it, else 16",
                "load_class": "by the inertia of the machine over that of the motor",
            },
            places=dict.fromkeys(("voltage", "supply"), _SUPPLY),
            order=(("poles_least", ">=", "poles_most"), ("ambient", ">", "temperature")),
        )
    }

    def rules(self) -> Iterable[Rule]:
        """Keys of another motor, and those whose values it chooses."""
        is_sized = given("sizing")
        yield Rule("sizing.one_sided_share", ~has_sides(), "the {name} has no sides; leave it out")
        yield Rule("sizing", given("system.motor"), BESIDE_MOTOR)
        another = "is of the DC motor, and [sizing] picks another; leave out one of the two"
        yield Rule("motor", is_sized, another, has_entries("motor"))
        yield Rule("feed_forward", is_sized, another, is_one_of("feed_forward", True))
        yield Rule("run.winding_temperature", is_sized, "is sizing.temperature with [sizing]; leave it out")
        without_gear = is_one_of("sizing.gear_kind", "none")
        for key in ("gear", "sizing.ratios"):
            reason = 'is of a gear, and sizing.gear_kind = "none"; leave out one of the two'
            yield Rule(key, without_gear, reason, has_entries(key))
        yield Rule("machine.ratio", is_sized, "[sizing] finds it; to have it kept, give gear.ratio")

    def plan(self, reading: FileReading) -> SizingPlan | None:
        """The plan of the table."""
        if "sizing" not in reading.data:
            return None
        form, demands = reading.form.sizing, reading.values["sizing"]
        # the table of another capability, if the program has it
        if "hours" in reading.data.get("usage", {}) and "hours" not in reading.data["sizing"]:
            demands = replace(demands, hours=reading.values["usage"].hours)
        return SizingChoice(demands, **{key: getattr(form, key) for key in SIZING_KEYS})

    def faults(self, config: Config) -> Iterable[InputError]:
        """Refuse values of a gear beside gears of a catalogue, which have their own."""
        plan: SizingPlan | None = config.plans[self.name]
        if plan is None:
            return
        from ...drives.catalogue import offer
        from .gear_rows import gear_faults

        torque = float(plan.demands.gear_torque)
        if gears := offer(*config.file.catalogues).gears:
            if config.drive.line_ratio(3.0) != 1.0:
                why = "a gear of the catalogue is chosen by the whole ratio; leave out [belt], or these gears"
                yield InputError(f"belt: {why}", "belt")
            yield from gear_faults(gears, config.file.given, config.drive.gear.ratio, torque)

    def unused_values(self, machine: Machine, plan: SizingPlan | None) -> Iterable[str]:
        """A machine without sides has no one-sided feed."""
        return () if machine.model.sides else ("sizing.one_sided_share",)

    def analyses(self) -> Iterable[type[Analysis]]:
        """The protection of the drive."""
        from .findings import ProtectionAnalysis

        return (ProtectionAnalysis,)

    def contents(self) -> Mapping[str, Contents]:
        """Candidates and choice."""
        from . import page

        return {self.name: Contents("The drive", page.blocks, before="runs")}

    def answer(self, study: StudyRecord) -> AnswerBlocks:
        """The drive with the share that it takes of its limits, and the alarm if no motor fits."""
        from . import page

        return AnswerBlocks(head=page.answer(study), judgements=page.judgements(study.findings))

    def unchecked(self, study: StudyRecord) -> Iterator[Line]:
        """The choice of a drive, with order numbers, of a study whose file gives its motor."""
        if study.setup.config.plans[self.name] is None:
            yield (
                "whether another motor or gear serves better, and order numbers: the motor is that of the study "
                "file, which has no table [sizing]"
            )


CAPABILITY = SizingCapability()
