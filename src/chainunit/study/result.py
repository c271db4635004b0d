"""All results of a study as data: the content of result.json."""

from __future__ import annotations

from collections.abc import Mapping
from operator import attrgetter
from typing import Any

from ..core.quantities import quantity, variables
from ..drives.catalogue import CatalogueMotor
from ..drives.speed_control import Loop, Tuning
from ..reading.result_entries import ResultEntries
from ..reading.results import InUnit, as_data, part, result
from ..reading.tables import UnusualValue
from ..reading.text import entries, entry, shown_in
from .drive import Drive
from .given import given_sections, origin_of, place_of
from .judgement import MotorVerdict, motor_verdict
from .line.rigid_line import RigidLine
from .line.shaft import driveline_of
from .line.shaft_runs import shaft_findings
from .measures import Answers, measures_of
from .provenance import Heading
from .record import StudyRecord, StudyRuns, StudySetup
from .remark import Remark
from .verdict import Verdict
from .window import Phase


@result
class MotorRating:
    """The rating of a motor of the catalogue."""

    rated_power: float = quantity("W", "rated power")
    rated_speed: float = quantity("rad/s", "rated speed", kind="speed")
    rated_torque: float = quantity("N.m", "rated torque")
    rated_current: float = quantity("A", "rated current")
    rated_voltage: float = quantity("V", "rated voltage")
    rated_frequency: float = quantity("Hz", "rated frequency")
    poles: float = quantity("1", "number of poles")

    @classmethod
    def of(cls, motor: CatalogueMotor) -> MotorRating:
        """The rating of that motor."""
        names = ("power", "speed", "torque", "rated_current", "voltage", "frequency", "poles")
        return cls(*attrgetter(*names)(motor.nameplate))


@result
class EventData:
    """An event of the study."""

    type: str = part("type of the event")
    side: str | None = part("side that it comes on")
    title: str = part("the event in words")
    begin: float | None = quantity("s", "time at which it began")


@result
class Verdicts:
    """The verdicts on a study."""

    model: Verdict | None = part("verdict on the model of the machine")
    motor: MotorVerdict | None = part("verdict on the motor")


@result
class RunData:
    """The results of the runs, by the names of the runs."""

    events: Mapping[str, EventData] = part("the events")
    answers: Mapping[str, Answers] = part("the demands of each run on the drive")
    start_up: Mapping[str, InUnit] | None = part("the demands of the start-up on the drive")
    settling: Mapping[str, InUnit] | None = part("the demands of the settling under the feed on the drive")
    pins: Mapping[str, Mapping[str, Mapping[str, float | None]]] = part("forces in the bearings", unit="N")
    certificate: Mapping[str, Mapping[str, float]] = part("missing shares of the energy moved", unit="1")
    block_peaks: Mapping[str, Mapping[str, InUnit]] = part("assumptions of an event, and the peaks over them")
    ripple_without_feed_forward: float | None = part(
        "fluctuation of the speed without feed-forward", unit="1", kind="percent", default=None
    )
    fmus: Mapping[str, str] = part("origin of each FMU", default_factory=dict)


@result
class DriveFindings:
    """What follows from the drive alone."""

    speed_loop: Mapping[str, Loop] = part("the linearised speed loop, by inertia")
    rigid_line: RigidLine | None = part(
        "whether a rigid model of the drive holds; of a drive with an elastic line", optional=True
    )
    control: Tuning | str = part("the tuned gains of the speed control, or words on it")


@result
class StudyData:
    """The results of the base of a study, beside its given values and the findings of its analyses."""

    heading: Heading = part(inline=True)
    sentence: str | None = part("the sized drive in a sentence", optional=True)
    status: str = part("whether the study is complete")
    failure: str | None = part("the error that ended the study early")
    verdict: Verdicts = part("the verdicts")
    warnings: list[Remark] = part("faults, and demands that are not met")
    notes: list[Remark] = part("assumptions behind the numbers")
    slips: tuple[UnusualValue, ...] = part("given values without a unit that are of an unusual size")
    driver: str = part("the noun of the link that the motor turns")
    runs: RunData = part("the runs and the numbers read from them")
    findings: DriveFindings = part("what follows from the drive alone, beside the findings of each analysis")


def as_dict(study: StudyRecord) -> ResultEntries:
    """All results except the time series, ready for JSON, each number with its unit; given values, runs and findings
    are three parts."""
    with shown_in(study.setup.config.units):
        base, given_part = as_data(_data(study)), _given_values(study)
        runs, findings = base.pop("runs"), base.pop("findings") | _parts(study)
        return ResultEntries(base | {"given": given_part, "runs": runs, "findings": findings})


def _data(study: StudyRecord) -> StudyData:
    """The declared content of result.json, but for the parts of analyses and given values."""
    setup, findings, failure = study.setup, study.findings, study.findings.failure
    return StudyData(
        heading=Heading.of(setup.config.title, setup.config.file),
        sentence=None if setup.proposal is None else setup.proposal.sentence(study),
        status=f"failed: {failure}" if failure else "complete",
        failure=str(failure) if failure else None,
        verdict=Verdicts(findings.verdict, motor_verdict(study)),
        warnings=findings.warnings,
        notes=findings.notes,
        slips=setup.config.file.slips,
        driver=setup.driver_noun,
        runs=_runs(study.runs),
        findings=DriveFindings(setup.statics.loops, setup.statics.rigid_line, speed_control(setup.drive)),
    )


def speed_control(drive: Drive) -> Tuning | str:
    """The tuned gains of the speed control, or words on it."""
    if drive.tuning or drive.follows:
        return drive.tuning or drive.motor.control
    return "none: the motor takes the speed that its supply and the load give"


def _given_values(study: StudyRecord) -> dict[str, Any]:
    """The given values of the study; `origins` gives the origin of each value that is not its declared start
    value, `places` the file and the line of each value that a file gives."""
    sections = given_sections(study)
    names = [name for section in sections for name in section.names]
    values: dict[str, Any] = {"event": {}, "motor": _motor(study.setup)}
    for section in sections:
        if section.name != "motor":
            _put(values, section.place, section.data)
    origins = {name: origin for name in names if (origin := origin_of(study.setup, name)) != "declared"}
    places = {name: place for name in names if (place := place_of(study.setup, name))}
    return {"origins": origins, "places": places} | values


def _motor(setup: StudySetup) -> dict[str, Any]:
    """Kind, title, rating and parameters of the motor, as far as they are known."""
    kind, plate = setup.drive.graph.components["motor"].title, setup.plate
    titles = {"kind": kind, "title": setup.motor_title}
    rating = {} if plate is None else as_data(MotorRating.of(plate))
    # the parameters of a foreign motor are not known
    return titles | rating | ({} if setup.drive.parameters is None else entries(setup.drive.parameters))


def _put(tree: dict[str, Any], place: str, values: dict[str, Any]) -> None:
    """Add values at the dotted `place` of a tree."""
    for key in filter(None, place.split(".")):
        tree = tree.setdefault(key, {})
    tree |= values


def _runs(runs: StudyRuns) -> RunData:
    """The events, and the numbers of each run."""

    def begin(phase: Phase, answers: Answers | None) -> dict[str, InUnit] | None:
        """The measures of a part of the start."""
        if answers is None:
            return None
        return {v.name: InUnit(getattr(answers, v.name), v.unit, v.kind) for v in measures_of(phase)}

    return RunData(
        events={
            name: EventData(event.kind, event.side or None, event.title, runs.event_times.get(name))
            for name, event in runs.events.items()
        },
        answers=runs.answers,
        start_up=begin(Phase.START_UP, runs.start),
        settling=begin(Phase.SETTLING, runs.settling),
        pins=runs.pins,
        certificate=runs.certificate,
        block_peaks={name: assumed_ranges(runs, name) for name in runs.spreads},
        fmus={name: str(origin) for name, origin in runs.fmus.items()},
    )


def assumed_ranges(runs: StudyRuns, name: str) -> dict[str, InUnit]:
    """The range of the assumed quantities of an event, and the peaks over it."""
    spread = runs.spreads[name]
    units = {v.name: v.unit for v in variables(runs.events[name].Parameters)}
    data: dict[str, InUnit] = {}
    for key, (low, high) in spread.ranges.items():
        data |= {f"{key}_low": InUnit(low, units[key], "assumed")}
        data |= {f"{key}_high": InUnit(high, units[key], "assumed")}
    for key, (low, high) in spread.peaks.items():
        data |= {f"{key}_low": InUnit(low, "N.m"), f"{key}_high": InUnit(high, "N.m")}
    return data


def _parts(study: StudyRecord) -> dict[str, Any]:
    """The parts of the result that only some studies have."""
    parts = {name: findings.data(study) for name, findings in study.findings.by_analysis.items()}
    if study.setup.statics.modes is not None:
        parts |= _driveline(study)
    return parts


def _driveline(study: StudyRecord) -> dict[str, Any]:
    """The data of the shaft line with its torsion, of its shafts in the runs, and of their cycles of torque."""
    shaft = shaft_findings(study.findings)
    largest = max((answers.range_largest for answers in shaft.answers.values()), default=0.0)
    return {
        "driveline": {
            "damping_ratio": entry(study.setup.config.plans["driveline"].damping_ratio, "1"),
            **entries(driveline_of(study.setup.drive)),
            **entries(study.setup.statics.modes),
        },
        "shaft": as_data(shaft),
        "torque_cycles": {name: as_data(cycles.classes(largest)) for name, cycles in shaft.cycles.items()},
    }
