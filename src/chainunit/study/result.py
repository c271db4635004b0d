"""All results of a study as data: the content of result.json."""

from __future__ import annotations

from typing import Any

from ..core.quantities import variables
from ..drives.catalogue import CatalogueMotor
from ..reading.results import as_data
from ..reading.text import entries, entry, shown_in, turning
from .given import given_sections
from .heading import Heading
from .judgement import motor_verdict
from .line.shaft import driveline_of
from .line.shaft_runs import shaft_findings
from .measures import measures_of
from .origins import origin_of
from .record import StudyRecord
from .window import Phase


def _motor(study: StudyRecord) -> dict[str, Any]:
    kind = study.drive.graph.components["motor"].title
    plate = study.plate
    titles = {"kind": kind, "title": plate.designation if plate else kind}
    # the parameters of a foreign motor are not known
    return titles | _rating(plate) | ({} if study.motor is None else entries(study.motor))


def _rating(motor: CatalogueMotor | None) -> dict[str, Any]:
    """The rating of a motor of the catalogue."""
    if motor is None:
        return {}
    plate = motor.nameplate
    return {
        "rated_power": entry(plate.power, "W"),
        "rated_speed": entry(plate.speed, "rad/s", "speed"),
        "rated_torque": entry(plate.torque, "N.m"),
        "rated_current": entry(plate.rated_current, "A"),
        "rated_voltage": entry(plate.voltage, "V"),
        "rated_frequency": entry(plate.frequency, "Hz"),
        "poles": entry(plate.poles, "1"),
    }


def as_dict(study: StudyRecord) -> dict[str, Any]:
    """All results except the time series, ready for JSON, each number with its unit."""
    with shown_in(study.config.units):
        return _as_dict(study)


def _as_dict(study: StudyRecord) -> dict[str, Any]:
    config = study.config
    return {
        **as_data(Heading.of(config.title, config.file)),
        "status": f"failed: {study.failure}" if study.failure else "complete",
        "failure": str(study.failure) if study.failure else None,
        "verdict": {"model": _on_model(study), "motor": motor_verdict(study)},
        "warnings": as_data(study.warnings),
        "notes": as_data(study.notes),
        "slips": as_data(config.file.unusual),
        **(given := _given_values(study)),
        **_statics(study),
        **_runs(study),
        **{name: given.get(name, {}) | part for name, part in _parts(study).items()},
        "fmus": {name: str(origin) for name, origin in study.fmus.items()},
    }


def _on_model(study: StudyRecord) -> dict[str, Any] | None:
    if study.verdict is None:
        return None
    verdict = as_data(study.verdict)
    return verdict | {"text": turning(verdict["text"], study.turning)}


def _given_values(study: StudyRecord) -> dict[str, Any]:
    """The given values of the study; `origins` gives the origin of each value that is not its declared start
    value."""
    sections = given_sections(study)
    names = [name for section in sections for name in section.names]
    values: dict[str, Any] = {"event": {}, "motor": _motor(study)}
    for section in sections:
        if section.name != "motor":
            _put(values, section.place, section.data)
    origins = {name: origin for name in names if (origin := origin_of(study, name)) != "declared"}
    return {"origins": origins} | values


def _put(tree: dict[str, Any], place: str, values: dict[str, Any]) -> None:
    """Add values at the dotted `place` of a tree."""
    for key in filter(None, place.split(".")):
        tree = tree.setdefault(key, {})
    tree |= values


def _statics(study: StudyRecord) -> dict[str, Any]:
    """The results that need no co-simulation."""
    statics = study.statics
    return {
        "speed_loop": as_data(statics.loops),
        "control": as_data(study.drive.tuning)
        if study.drive.tuning
        else study.drive.motor.control
        if study.drive.follows
        else "none: the motor takes the speed that its supply and the load give",
    }


def _runs(study: StudyRecord) -> dict[str, Any]:
    """The results of the runs, by the names of the runs."""
    begins = {"start_up": (Phase.START_UP, study.start), "settling": (Phase.SETTLING, study.settling)}
    return {
        "events": {
            name: {
                "type": event.kind,
                "side": event.side or None,
                "title": event.title,
                "begin": entry(study.event.get(name), "s"),
            }
            for name, event in study.config.events.items()
        },
        "answers": {name: entries(answers) for name, answers in study.answers.items()},
        **{
            name: answers
            and {v.name: entry(getattr(answers, v.name), v.unit, v.kind) for v in measures_of(phase)}
            for name, (phase, answers) in begins.items()
        },
        "pins": {
            run: {pin: {k: entry(v, "N") for k, v in sizes.items()} for pin, sizes in table.items()}
            for run, table in study.pins.items()
        },
        "certificate": {
            name: {of: entry(share, "1") for of, share in shares.items()}
            for name, shares in study.certificate.items()
        },
        "block_peaks": {name: _spread(study, name) for name in study.spreads},
        "ripple_without_feed_forward": entry(None, "1", "percent"),
    }


def _spread(study: StudyRecord, name: str) -> dict[str, Any]:
    """The range of the assumed quantities of an event, and the peaks over it."""
    spread, units = (
        study.spreads[name],
        {v.name: v.unit for v in variables(study.config.events[name].Parameters)},
    )
    ranges = [(each, ends, units[each], "assumed") for each, ends in spread.ranges.items()]
    ranges += [(each, ends, "N.m", "") for each, ends in spread.peaks.items()]
    return {
        f"{each}_{end}": entry(x, unit, kind)
        for each, ends, unit, kind in ranges
        for end, x in zip(("low", "high"), ends, strict=True)
    }


def _parts(study: StudyRecord) -> dict[str, Any]:
    """The parts of the result that only some studies have."""
    parts = {name: found.data(study) for name, found in study.findings.items()}
    if study.statics.modes is not None:
        parts |= _driveline(study)
    return parts


def _driveline(study: StudyRecord) -> dict[str, Any]:
    units = {"from": "N.m", "to": "N.m", "count": "1"}
    shaft = shaft_findings(study)
    largest = max((answers.range_largest for answers in shaft.answers.values()), default=0.0)
    return {
        "driveline": {
            "damping_ratio": entry(study.config.plans["driveline"].damping_ratio, "1"),
            **entries(driveline_of(study.drive)),
            **entries(study.statics.modes),
        },
        "shaft": as_data(shaft),
        "torque_cycles": {
            name: [{k: entry(x, units[k]) for k, x in row.items()} for row in cycles.classes(largest)]
            for name, cycles in shaft.cycles.items()
        },
    }
