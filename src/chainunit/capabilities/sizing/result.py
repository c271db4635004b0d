"""The parts to order beside the motor as data: the gear, the safety coupling with the ways to another, the relay."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ...reading.text import entries, entry, number
from ...study.record import StudyRecord
from ...study.relay import class_words
from .coupling_words import coupling_sentence, way_words, why_none
from .gear_order import gear_order
from .protection import Alternative, CouplingEffect, Obstacle, Setting


def gear_data(study: StudyRecord, setting: Setting | None, margin: float) -> dict[str, Any]:
    """The gear to order with this share as `margin`, and the load that decides, ready for JSON; empty where there is
    no drive to order."""
    order = gear_order(study, setting, margin)
    if order is None:
        return {}
    decides = order.decides
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


def protection_data(
    study: StudyRecord, setting: Setting | None, alternatives: Sequence[Alternative], rated: float
) -> dict[str, Any]:
    """Settings of the protection of the drive, whose motor has the `rated` current [A], ready for JSON; empty where
    the motor is insufficient."""
    if study.insufficient:
        return {}
    relay = _relay(study, rated)
    if setting is None:
        return relay

    def torque(value: float | None, title: str) -> dict[str, Any]:
        return entry(value, "N.m") | {"title": title}

    return {
        "trip_torque": torque(setting.torque, f"safety coupling, trip torque at the {study.driver_noun}"),
        "trip_torque_at_motor": torque(
            setting.torque and setting.torque / study.drive.ratio,
            "safety coupling, trip torque at the motor's shaft",
        ),
        **relay,
        "coupling": coupling_sentence(study, setting, alternatives),
        "obstacle": setting.obstacle,
        "why_none": why_none(setting)
        if setting.overloads or setting.obstacle is not Obstacle.OVERLOADS
        else _UNTRIED,
        "normal_torque": torque(
            setting.normal, f"largest torque of normal duty on the coupling, at the {study.driver_noun}"
        ),
        "running_torque": torque(setting.running, "largest torque of running on the coupling"),
        "start_torque": torque(setting.start, "largest torque of a start on the coupling"),
        "breakdown_torque": torque(setting.motor, f"most that the motor gives at the {study.driver_noun}"),
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
                "words": way_words(study, each, setting),
                **entries(each.numbers, with_titles=True),
                "opens": {name: entry(peak, "N.m") for name, peak in each.opens.items()},
                "effects": _effects(study, each.effects),
            }
            for each in alternatives
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
