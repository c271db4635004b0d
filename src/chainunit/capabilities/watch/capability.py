"""The load observer, which watches for one-sided overload beside the motor of a study, or over a recording."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from ...core.errors import InputError
from ...recordings.table import FROM_RECORDING, recording_rules
from ...report.capability import Capability, Contents
from ...study.analysis import Analysis
from ...study.capability import Estimates, EstimateUser, FileReference, PartBeside
from ...study.conditions import given
from ...study.config import Config, FileReading
from ...study.cycle import Cycle
from ...study.drive import Drive
from ...study.file_section import FileSection, TableForm
from ...study.rules import FLYWHEEL_BEHIND, MOTOR_FMU, Rule, has_sides
from .tables import KEYS, ObserverTable, WatchPlan, WatchTable, read_watch


@dataclass(frozen=True)
class WatchPlans(PartBeside, EstimateUser):
    """The plan of the table [watch], and the values of [observer]; None for one that is absent."""

    watch: WatchPlan | None
    observer: ObserverTable | None

    def beside(self, drive: Drive, feed: Any, turn: Cycle) -> Drive:
        """The drive with its load observer."""
        from .observation import with_observer

        return drive if self.observer is None else with_observer(drive, self.observer, feed, turn)

    def take_estimates(self, config: Config, estimates: Estimates, tables: dict[str, Any]) -> None:
        """Complete [watch] and [observer] of a study file with the estimated numbers, if it has these tables: the
        recording is watched with the errors of the estimates, and the observer knows the false imbalance that they
        make."""
        from ...study.choice import drive_of
        from .observation import false_imbalance_of

        if "watch" in tables:
            tables["watch"]["identification"] = estimates.file
        if "observer" in tables:
            imbalance = false_imbalance_of(drive_of(config), config.feed, config.run.crank_speed, estimates)
            tables["observer"] |= {name: float(f"{x:.4g}") for name, x in imbalance.items()}


class WatchCapability(Capability):
    """The capability, with the tables [watch] and [observer]."""

    name = "watch"
    order = 130
    tables = {  # noqa: RUF012
        "watch": FileSection(
            WatchTable,
            optional=True,
            keys=KEYS,
            title="Recording that is watched",
            is_used=lambda study: False,
            apart=True,
            form=TableForm(texts={"file": {"minLength": 1}}, required=("file",)),
            follows=FROM_RECORDING,
        ),
        "observer": FileSection(
            ObserverTable,
            optional=True,
            title="Load observer",
            is_used=lambda study: "observer" in study.findings.by_analysis,
            apart=True,
        ),
    }

    def rules(self) -> Iterable[Rule]:
        """Recordings need models of motor and machine, and the observer the two sides of a chain unit."""
        reason = (
            "is of the chain unit, and the machine is {machine}: the observer compares the feed and the force of two "
            "sides, which this machine does not have; leave it out. chainunit identify finds the loads of this "
            "machine from its recordings"
        )
        yield Rule("watch", ~has_sides(), reason)
        yield Rule(
            "observer", ~has_sides(), "knows the chain unit, and the machine is {machine}; leave it out"
        )
        yield from recording_rules("watch")
        yield Rule("observer", MOTOR_FMU, "needs a model of the motor, which is an FMU; leave it out")
        yield Rule(
            "observer",
            given("driveline"),
            "takes the shaft between motor and machine for rigid; leave out [driveline] or [observer]",
        )
        for table in ("observer", "watch"):
            yield Rule(
                table, given("machine.pins"), "has one law of all pins; leave out it or [machine.pins]"
            )
        yield Rule(
            "observer",
            FLYWHEEL_BEHIND,
            'has no flywheel behind the gear; set flywheel.place = "motor", or leave it out',
        )

    def plan(self, reading: FileReading) -> WatchPlans:
        """The plans of the tables."""
        watch = read_watch(reading) if "watch" in reading.data else None
        return WatchPlans(watch, reading.values["observer"] if "observer" in reading.data else None)

    def files(self, data: Mapping[str, Any]) -> Iterator[FileReference]:
        """The recording, and the result of an identification."""
        watch = data.get("watch")
        if isinstance(watch, dict):
            yield FileReference("watch.file", watch, "file")
            yield FileReference("watch.identification", watch, "identification", is_recording=False)

    def faults(self, config: Config) -> Iterator[InputError]:
        """The refusal of an observer of a feed that is zero."""
        plans: WatchPlans = config.plans[self.name]
        feed, asked = config.feed, {"observer": plans.observer, "watch": plans.watch}
        if not config.machine.model.sides or feed.left.material_mass + feed.right.material_mass > 0.0:
            return
        for table in (name for name, plan in asked.items() if plan is not None):
            yield InputError(
                f"{table}: watches for a feed that moves to one side, and feed.left.material_mass and "
                f"feed.right.material_mass are 0 kg; give the feed of normal running, or leave [{table}] out",
                key=table,
            )

    def analyses(self) -> Iterable[type[Analysis]]:
        """Who notices an event."""
        from .notices import ObserverAnalysis

        return (ObserverAnalysis,)

    def contents(self) -> Mapping[str, Contents]:
        """Who notices an event."""
        from . import notices_page as notices

        return {"observer": Contents("Who notices an overload", notices.blocks, notices.PICTURES.files)}


CAPABILITY = WatchCapability()
