"""The record of a study: what was given and chosen, what ran, and what was found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, Self

from ..core.brief import briefly_shown
from ..core.errors import RunError
from ..drives.catalogue import CatalogueMotor
from ..fmu.backends import Origin
from ..machines.chain_unit import RodName
from ..reading.results import as_data
from . import verdict
from .arrays import Dataset
from .config import Config
from .drive import Drive
from .event import Event
from .limits import reaches
from .measures import Answers, not_known
from .operation import OperatingConditions
from .organ_limits import LeastPull
from .proposal import DriveProposal
from .relay import LIGHT
from .remark import Remark, RemarkCode, Value
from .start_up import StartUp
from .statics import DriveStatics
from .verdict import STEADY, Verdict
from .window import Phase, Trip, Window, whole_turns

LOAD_CYCLE = "load_cycle.csv"
"""Name of the file with torque and speed of the motor's shaft in the steady turns."""


@dataclass
class Spread:
    """The assumed quantities of an event, and the peaks over the range of the assumption: from and to, by
    quantity."""

    ranges: dict[str, tuple[float, float]]
    """range of each assumed quantity, in the declared units of the event"""
    peaks: dict[str, tuple[float, float]]
    """range of the peaks crank_torque, motor_torque and rocker_torque [N m]"""


@briefly_shown
@dataclass(frozen=True)
class StudySetup:
    """What a study runs: its configuration, and the drive that its file states or a capability chose."""

    config: Config
    drive: Drive
    statics: DriveStatics
    proposal: DriveProposal | None = None
    """the drive, where a capability chose it"""

    @property
    def noun(self) -> str:
        """The common noun for the machine."""
        return self.drive.machine.model.noun

    @property
    def driver_noun(self) -> str:
        """See `Drive.driver_noun`."""
        return self.drive.driver_noun

    @property
    def plate(self) -> CatalogueMotor | None:
        """The motor of the catalogue that the file names or that was chosen, if it is one."""
        return self.config.plate if self.proposal is None else self.proposal.motor

    @property
    def motor_title(self) -> str:
        """The designation of the motor of a catalogue, else the kind of the motor."""
        plate = self.plate
        return self.drive.graph.components["motor"].title if plate is None else plate.designation

    @property
    def insufficient(self) -> str:
        """The sentence on a drive of which none fits, so that all is run with the nearest; empty where one fits."""
        return "" if self.proposal is None else self.proposal.insufficient


@briefly_shown
@dataclass
class StudyRuns:
    """The runs of a drive in its operation, with the numbers read from them. The mappings are by the names of the
    runs: ``start_up``, ``steady`` (the last turns of it), and one for each of the `events`."""

    drive: Drive
    operation: OperatingConditions
    events: Mapping[str, Event]
    fmus: dict[str, Origin] = field(default_factory=dict)
    """the origin of each FMU"""
    series: dict[str, Dataset] = field(default_factory=dict)
    """the time series of each run"""
    started: StartUp | None = None
    """the start-up and steady running, once it is made"""
    event_times: dict[str, float] = field(default_factory=dict)
    """time at which each event began [s]"""
    answers: dict[str, Answers] = field(default_factory=dict)
    start: Answers | None = None
    """answers of the start-up, once the machine ran steadily"""
    settling: Answers | None = None
    """answers of a machine that starts empty, from the coming of its feed until it runs steadily"""
    pins: dict[str, dict[str, dict[str, float | None]]] = field(default_factory=dict)
    """by run and pin: peak, RMS and equivalent (ISO 281) load [N]"""
    pulls: dict[str, dict[RodName, LeastPull]] = field(default_factory=dict)
    """by run and kind of rod, the least pulls of two bars"""
    certificate: dict[str, dict[str, float]] = field(default_factory=dict)
    spreads: dict[str, Spread] = field(default_factory=dict)
    """the spread of each event that rests on an assumption"""
    relay_class: int = LIGHT
    """trip class of the thermal relay of a motor of the catalogue on the line, see `protecting_class`"""

    @property
    def titles(self) -> dict[str, str]:
        """By run, its title for use in sentences."""
        titles = {STEADY: "steady running", verdict.START: "start-up"}
        titles |= {verdict.SETTLING: "settling under the feed"}
        return titles | {name: event.title for name, event in self.events.items()}

    def title_of(self, run: str) -> str:
        """The title of a run for use in sentences."""
        return self.titles.get(run, run.replace("_", " "))

    @property
    def reaches(self) -> bool:
        """Whether the crank turns at the requested speed; True while that is not known."""
        steady = self.answers.get(STEADY)
        return steady is None or reaches(steady.speed_mean, self.operation.crank_speed)

    @property
    def returns(self) -> bool:
        """Whether there is a band of steady running to which the speed could return: a motor that follows the
        requested speed has to reach that speed."""
        return STEADY in self.answers and (not self.drive.follows or self.reaches)

    @property
    def overloads(self) -> list[str]:
        """The names of the events with answers."""
        return [name for name in self.answers if name in self.events]

    @property
    def steady_begin(self) -> float:
        """Time from which running counts as steady [s]."""
        return self.operation.steady_begin if self.started is None else self.started.steady_from

    @property
    def start_end(self) -> float | None:
        """Time at which the start ends for the relay [s]: at speed, and in delta; None where it does not end."""
        time = None if self.start is None else self.start.start_time
        return None if time is None else max(time, self.drive.star.end)

    @property
    def not_known(self) -> frozenset[str]:
        """Names of the measures of steady running that need a variable which the foreign FMU of the motor lacks."""
        if self.drive.foreign is None or STEADY not in self.answers:
            return frozenset()
        lacking_parts = not_known(self.window(Phase.STEADY, self.steady))
        return frozenset(measure for measure, part in lacking_parts.items() if part == "motor")

    @property
    def steady(self) -> Dataset:
        """The steady turns that are evaluated, both ends included; where the crank does not make whole turns,
        the whole run from the time at which it should be steady."""
        run = self.series["start_up"]
        if self.started is not None and self.started.run is run:
            return self.started.turns
        return whole_turns(self.drive, run.sel(time=slice(self.steady_begin, None)), self.operation.run.turns)

    @property
    def rise(self) -> Dataset:
        """The start-up until it counts as steady."""
        return self.series["start_up"].sel(time=slice(None, self.steady_begin))

    @property
    def event_parts(self) -> dict[str, Dataset]:
        """By event, the part of its run from its begin on."""
        begins = {name: begin for name, begin in self.event_times.items() if name in self.series}
        return {name: self.series[name].sel(time=slice(begin, None)) for name, begin in begins.items()}

    def window(
        self,
        phase: Phase,
        run: Dataset,
        begin: float = 0.0,
        trip: Trip | None = None,
        event: Event | None = None,
    ) -> Window:
        """The window of a run from which measures are read; of an overload with its `event`."""
        sides = self.drive.machine.loaded_sides(self.operation.feed)
        requested = self.operation.crank_speed
        steady = None
        if phase in (Phase.START_UP, Phase.EVENT, Phase.LOADED_START):
            steady = Window(Phase.STEADY, self.steady, self.drive, sides, requested)
        passes = event is not None and event.passes
        return Window(phase, run, self.drive, sides, requested, begin, steady, trip, self.relay_class, passes)


@briefly_shown
@dataclass
class StudyFindings:
    """What a study found: the findings of its analyses, its verdict on the model, and its remarks."""

    driver_noun: str
    by_analysis: dict[str, Findings] = field(default_factory=dict)
    """findings of each analysis, by its name"""
    verdict: Verdict | None = None
    """the verdict on the model, once there are runs"""
    remarks: list[Remark] = field(default_factory=list)
    failure: RunError | None = None
    """the error that stopped the study early"""

    @property
    def warnings(self) -> list[Remark]:
        """Remarks on faults and on limits that are passed, the gravest first."""
        return sorted(
            (remark for remark in self.remarks if remark.severity != "note"), key=lambda remark: remark.rank
        )

    @property
    def notes(self) -> list[Remark]:
        """Remarks on the assumptions behind the numbers."""
        return [remark for remark in self.remarks if remark.severity == "note"]

    def say(self, code: RemarkCode, *runs: str, **values: Value) -> None:
        """Add a remark with that code, see `RemarkCode.remark`."""
        self.remarks.append(code.remark(*runs, driver=self.driver_noun, **values))


@briefly_shown
@dataclass
class StudyRecord:
    """The record of a study in three, which `run_study` fills."""

    setup: StudySetup
    runs: StudyRuns
    findings: StudyFindings

    @property
    def currents_until_trip(self) -> Mapping[str, float]:
        """By overload that opens a recommended torque limiter, the largest current of the motor until then [A]."""
        proposal = self.setup.proposal
        return {} if proposal is None else proposal.currents_until_trip(self)


class Findings:
    """What an analysis found: a declared result (`chainunit.reading.results`), whose data are the part of result.json
    under the name of the analysis."""

    examines: ClassVar[str] = ""
    """name of the part of the line of which it says more than the base of a study"""

    @property
    def gear_loss(self) -> float | None:
        """The mean loss of the gear [W] in steady running with a warm winding, by an analysis that makes such runs;
        None for all others."""
        return None

    @classmethod
    def found_in(cls, findings: StudyFindings) -> Self | None:
        """The findings of this kind of a study; None where it has none."""
        return next((entry for entry in findings.by_analysis.values() if isinstance(entry, cls)), None)

    @classmethod
    def of_study(cls, findings: StudyFindings) -> Self:
        """The findings of this kind of a study that has them."""
        entry = cls.found_in(findings)
        assert entry is not None, cls.__name__
        return entry

    @property
    def store(self) -> Path | None:
        """The store of its runs, a folder beside the files of the study, if it has one."""
        return None

    def data(self, study: StudyRecord) -> dict[str, Any]:
        """Its part of result.json: its declared parts."""
        return as_data(self, driver=study.setup.driver_noun)

    def remark(self, study: StudyRecord) -> None:
        """Add to the study the remarks that the reader needs beside the numbers; by default they are enough."""
