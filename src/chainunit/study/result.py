"""All results of a study as data: the content of result.json."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from .. import __version__
from ..core.quantities import variables
from ..drives.catalogue import CatalogueMotor
from ..reading.results import as_data
from ..reading.text import entries, entry, number, shown_in, turning
from .coupling import coupling_sentence, way_words, why_none
from .gear_order import gear_order
from .given import given_sections
from .judgement import motor_verdict
from .measures import measures_of
from .protection import CouplingEffect, Obstacle
from .record import StudyRecord
from .relay import class_words
from .window import Phase


def _motor(study: StudyRecord) -> dict[str, Any]:
    kind = study.drive.graph.components["motor"].title
    plate = study.sizing.best.motor if study.sizing else study.config.plate
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
        "chainunit": __version__,
        "title": config.title,
        "source": config.source,
        "report": dict(config.labels),
        "status": f"failed: {study.failure}" if study.failure else "complete",
        "failure": str(study.failure) if study.failure else None,
        "verdict": {"model": _on_model(study), "motor": motor_verdict(study)},
        "warnings": as_data(study.warnings),
        "notes": as_data(study.notes),
        "slips": as_data(config.unusual),
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
    origins = {name: origin for name in names if (origin := study.origin(name)) != "declared"}
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
        "control": as_data(study.tuning)
        if study.tuning
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
        "ripple_without_feed_forward": entry(study.ripple_without, "1", "percent"),
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
    config = study.config
    parts = as_data(study.findings)
    if study.sizing:
        parts["sizing"] = study.sizing.as_dict() | {"gear": _gear(study), "protection": _protection(study)}
    if study.statics.torsion is not None:
        parts |= _driveline(study)
    if config.chain:
        parts["chain"] = study.chain.as_dict() if study.chain else {}
    return parts


def _gear(study: StudyRecord) -> dict[str, Any]:
    """The gear to order, and the load that decides; empty where there is no drive to order."""
    order = gear_order(study)
    if order is None:
        return {}
    assert study.config.sizing is not None
    decides, margin = order.decides, study.config.sizing.margin
    reason = decides.words
    if decides.times != 1.0:
        reason += f", in which it may carry {decides.times:g} times that"
    if order.left_out:
        names = ", ".join(map(study.title_of, order.left_out))
        reason += f"; left out, as the energy balance is not kept: {names}"
    free = number(margin, "1", "percent", full=False)
    return {
        "rated_torque": entry(order.rated, "N.m")
        | {"title": f"gear, rated output torque at least, with the margin of {free}; decided by {reason}"},
        **{
            name: entry(load.torque, "N.m")
            | {"title": f"largest torque of {load.words} on the output of the gear"}
            for name, load in order.loads.items()
        },
        "decided_by": reason,
    }


_UNTRIED = "not judged: this study has no overload; add [[event]]"


def _protection(study: StudyRecord) -> dict[str, Any]:
    """Settings of the protection of the drive that sizing chose; empty where the motor is insufficient."""
    assert study.sizing is not None
    if study.insufficient:
        return {}
    current = study.sizing.best.motor.nameplate.rated_current
    relay = _relay(study, current)
    setting = study.setting
    if setting is None:
        return relay

    def torque(value: float | None, title: str) -> dict[str, Any]:
        return entry(value, "N.m") | {"title": title}

    return {
        "trip_torque": torque(setting.torque, "safety coupling, trip torque at the crank"),
        "trip_torque_at_motor": torque(
            setting.torque and setting.torque / study.drive.ratio,
            "safety coupling, trip torque at the motor's shaft",
        ),
        **relay,
        "coupling": coupling_sentence(study),
        "obstacle": setting.obstacle,
        "why_none": why_none(study)
        if setting.overloads or setting.obstacle is not Obstacle.OVERLOADS
        else _UNTRIED,
        "normal_torque": torque(
            setting.normal, "largest torque of normal duty on the coupling, at the crank"
        ),
        "running_torque": torque(setting.running, "largest torque of running on the coupling"),
        "start_torque": torque(setting.start, "largest torque of a start on the coupling"),
        "breakdown_torque": torque(setting.motor, "most that the motor gives at the crank"),
        "effects": _effects(study, setting.effects),
        "overloads": {
            name: torque(
                peak, f"{study.title_of(name)}: {'opens it' if name in setting.opens else 'leaves it shut'}"
            )
            for name, peak in setting.overloads.items()
        },
        "disturbances": {
            name: torque(
                peak,
                f"{study.title_of(name)}: {'a nuisance trip' if name in setting.nuisances else 'leaves it shut'}",
            )
            for name, peak in setting.disturbances.items()
        },
        "alternatives": [
            {
                "way": each.way,
                "words": way_words(study, each),
                **entries(each.numbers, with_titles=True),
                "opens": {name: entry(peak, "N.m") for name, peak in each.opens.items()},
                "effects": _effects(study, each.effects),
            }
            for each in study.alternatives
        ],
    }


def _effects(study: StudyRecord, effects: Mapping[str, CouplingEffect]) -> dict[str, Any]:
    """The effects of a safety coupling as it was tried, by overload."""
    titles = {"without": "without a coupling", "with_coupling": "with it"}
    return {
        name: {
            key: entry(getattr(effect, key), "N.m")
            | {"title": f"{study.title_of(name)}: peak at the output of the gear, {words}"}
            for key, words in titles.items()
        }
        for name, effect in effects.items()
    }


def _relay(study: StudyRecord, rated: float) -> dict[str, Any]:
    """The device that protects the motor from heat, its setting, and its trip class, which that of an inverter does
    not need."""
    if study.drive.follows:
        device = "electronic motor protection of the inverter"
        return {"relay_current": entry(rated, "A") | {"title": f"{device}, setting"}, "device": device}
    words = class_words(study.relay_class)
    return {
        "relay_current": entry(rated, "A") | {"title": "thermal relay, setting"},
        "relay_class": {"value": words, "unit": "1", "title": "thermal relay, trip class of IEC 60947-4-1"},
        "device": "relay",
    }


def _driveline(study: StudyRecord) -> dict[str, Any]:
    units = {"from": "N.m", "to": "N.m", "count": "1"}
    largest = max(answers.range_largest for answers in study.shaft.values()) if study.shaft else 0.0
    return {
        "driveline": {
            "damping_ratio": entry(study.config.damping_ratio, "1"),
            **entries(study.drive.line),
            **entries(study.statics.torsion),
        },
        "shaft": {name: entries(answers) for name, answers in study.shaft.items()},
        "torque_cycles": {
            name: [{k: entry(x, units[k]) for k, x in row.items()} for row in cycles.classes(largest)]
            for name, cycles in study.cycles_of.items()
        },
    }
