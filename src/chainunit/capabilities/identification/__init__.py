"""Real machines: masses, friction and feed from recordings, and the load observer, which watches for one-sided
overload beside the motor or over a recording."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from ...core.errors import Faults, InputError
from ...report.capability import Capability, Contents
from ...report.task import Task
from ...study.analysis import Analysis
from ...study.capability import FileReference
from ...study.conditions import given
from ...study.config import Config
from ...study.drive import Drive
from ...study.file_reading import FileReading
from ...study.file_section import FileSection
from ...study.parts import named_table
from ...study.rules import MACHINE_FMU, MOTOR_FMU, Rule, has_sides, other_models
from .measurands import MEASURANDS
from .observer_table import ObserverTable
from .reading import IdentificationPlan, WatchPlan, read_identification, read_watch
from .table import (
    FIELDS,
    FROM_RECORDING,
    MOST_SPEEDS,
    RUNS,
    SENSORS,
    SOUGHT,
    WATCH_KEYS,
    IdentifyTable,
    WatchTable,
)

_VALUE = {"type": ["number", "string"]}


@dataclass(frozen=True)
class RecordingPlans:
    """The plans of the tables [identify] and [watch], and the values of [observer]; None for one that is absent."""

    identify: IdentificationPlan | None
    watch: WatchPlan | None
    observer: ObserverTable | None


class IdentificationCapability(Capability):
    """The capability, with the tables [identify], [watch] and [observer]."""

    name = "identification"
    tables = {  # noqa: RUF012
        "identify": FileSection(
            IdentifyTable,
            optional=True,
            keys=FIELDS,
            title="Identification from recordings",
            is_used=lambda config: False,
            apart=True,
            required=("parameter", "run"),
            entries={"parameter": SOUGHT, "run": RUNS, "sensor": SENSORS},
            forms={
                "parameter.name": {"minLength": 1},
                "run.name": {"pattern": r"^[a-z][a-z0-9_]{0,19}$"},
                "run.file": {"minLength": 1},
                "run.speeds": {
                    "maxItems": MOST_SPEEDS,
                    "items": {"type": "array", "items": _VALUE, "minItems": 3, "maxItems": 3},
                },
                "sensor.column": {"enum": [name for name, each in MEASURANDS.items() if each.analog]},
            },
            single_keys=("parameter", "run", "sensor"),
        ),
        "watch": FileSection(
            WatchTable,
            optional=True,
            keys=WATCH_KEYS,
            title="Recording that is watched",
            is_used=lambda config: False,
            apart=True,
            required=("file",),
            follows=FROM_RECORDING,
            forms={"file": {"minLength": 1}},
        ),
        "observer": FileSection(
            ObserverTable, optional=True, title="Load observer", with_findings=True, apart=True
        ),
    }

    def rules(self) -> Iterable[Rule]:
        """Recordings need models of motor and machine, and the observer the two sides of a chain unit."""
        words = (
            "is of the chain unit, and the machine is {machine}: the observer compares the feed and the force of two "
            "sides, which this machine does not have; leave it out. chainunit identify finds the loads of this "
            "machine from its recordings"
        )
        yield Rule("watch", ~has_sides(), words)
        yield Rule(
            "observer", ~has_sides(), "knows the chain unit, and the machine is {machine}; leave it out"
        )
        unfit = (
            (MACHINE_FMU, "machine is an FMU"),
            (MOTOR_FMU, "motor is an FMU"),
            (given("sizing"), "motor is not known before it is chosen"),
            (given("driveline"), "driveline stands between motor and machine"),
            *((other.on, other.words) for other in other_models()),
        )
        for name in ("identify", "watch"):
            for condition, words in unfit:
                yield Rule(
                    name,
                    condition,
                    f"needs a motor and a machine of two-bar organs as models, and here the {words}",
                )
        yield Rule("observer", MOTOR_FMU, "needs a model of the motor, which is an FMU; leave it out")
        yield Rule(
            "observer",
            given("driveline"),
            "takes the shaft between motor and machine for rigid; leave out [driveline] or [observer]",
        )

    def plan(self, reading: FileReading) -> RecordingPlans:
        """The plans of the tables."""
        faults, data, speed = Faults(), reading.data, reading.values["run"].crank_speed
        identify = watch = None
        with faults.collected():
            identify = _identification(reading)
        with faults.collected():
            if "watch" in data:
                watch = read_watch(reading.form.watch, speed, reading.source)
        faults.refuse()
        return RecordingPlans(identify, watch, reading.values["observer"] if "observer" in data else None)

    def files(self, data: Mapping[str, Any]) -> Iterator[FileReference]:
        """The recordings, and the result of an identification."""
        runs, watch = named_table(data, "identify").get("run"), data.get("watch")
        for k, run in enumerate(runs if isinstance(runs, list) else [], 1):
            if isinstance(run, dict):
                yield FileReference(f"identify.run.{k}.file", run, "file")
        if isinstance(watch, dict):
            yield FileReference("watch.file", watch, "file")
            yield FileReference("watch.identification", watch, "identification", is_recording=False)

    def faults(self, config: Config) -> Iterator[InputError]:
        """The refusal of an observer of a feed that is zero."""
        plans: RecordingPlans = config.plans[self.name]
        tables = [name for name in ("observer", "watch") if getattr(plans, name) is not None]
        if tables and config.machine.model.sides:
            feed = config.feed
            if not feed.left.material_mass + feed.right.material_mass > 0.0:
                for table in tables:
                    yield InputError(
                        f"{table}: watches for a feed that moves to one side, and feed.left.material_mass and "
                        f"feed.right.material_mass are 0 kg; give the feed of normal running, or leave [{table}] out",
                        key=table,
                    )

    def beside(self, config: Config, drive: Drive) -> Drive:
        """The drive with its load observer."""
        from .observation import with_observer

        plans: RecordingPlans = config.plans[self.name]
        return drive if plans.observer is None else with_observer(config, plans.observer, drive)

    def analyses(self) -> Iterable[type[Analysis]]:
        """Who notices an event."""
        from .notices import ObserverAnalysis

        return (ObserverAnalysis,)

    def contents(self) -> Mapping[str, Contents]:
        """Who notices an event."""
        from . import notices_page as notices

        return {"observer": Contents("Who notices an overload", notices.blocks, notices.PICTURES.files)}

    def tasks(self) -> Mapping[str, Task[Any, Any]]:
        """Its commands."""
        from . import page, watch_page

        return {"identify": page.TASK, "watch": watch_page.TASK}


def _identification(reading: FileReading) -> IdentificationPlan | None:
    """The plan of the table [identify]; None without one, and for a machine that was refused."""
    if "identify" not in reading.data or reading.machine is None:
        return None
    values = reading.values
    declared = [(reading.machine.p, "machine"), (values["feed"], "feed")]
    if reading.parts.gives_motor:
        declared.append((values["motor"], "motor"))
    fixed = {"machine.ratio": "is needed to read the recordings; count the teeth"}
    speed = values["run"].crank_speed
    return read_identification(
        reading.form.identify, values["identify"], declared, speed, fixed, reading.source
    )


CAPABILITY = IdentificationCapability()
