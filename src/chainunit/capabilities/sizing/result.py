"""The parts to order beside the motor as data: the gear, the safety coupling with the ways to another, the relay."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ...core.quantities import quantity
from ...reading.results import GIVEN, InUnit, part, result
from ...reading.text import number
from ...study.record import StudyRecord
from ...study.relay import class_words
from .coupling_words import coupling_sentence, way_words, why_none
from .gear_order import gear_order
from .protection import Alternative, CouplingEffect, Obstacle, Setting, WayNumbers


@result
class OrderedGear:
    """The gear to order."""

    rated_torque: InUnit = part("rated output torque that the gear needs")
    loads: Mapping[str, InUnit] = part(
        "largest torque on the output of the gear, by kind of duty", inline=True
    )
    decided_by: str = part("the load that decides")


def ordered_gear(study: StudyRecord, setting: Setting | None, margin: float) -> OrderedGear | None:
    """The gear to order with this share as `margin`, and the load that decides; None where there is no drive to
    order."""
    order = gear_order(study, setting, margin)
    if order is None:
        return None
    decides = order.decides
    reason = decides.words
    if decides.times != 1.0:
        reason += f", in which it may carry {decides.times:g} times that"
    if order.left_out:
        names = ", ".join(map(study.title_of, order.left_out))
        reason += (
            f"; a lower bound, as the energy balance is not kept ({names}): shorten run.step before you order"
        )
    free = number(margin, "1", "percent", full=False)
    title = f"gear, rated output torque at least, with the margin of {free}; decided by {reason}"
    return OrderedGear(
        InUnit(order.rated, "N.m", title=title),
        {
            name: _torque(load.torque, f"largest torque of {load.words} on the output of the gear")
            for name, load in order.loads.items()
        },
        reason,
    )


def _torque(value: float, title: str) -> InUnit:
    return InUnit(value, "N.m", title=title)


@result
class MotorProtection:
    """The device that protects the motor from heat; that of an inverter needs no trip class."""

    relay_current: InUnit = part("setting of the device")
    relay_class: Mapping[str, str] | None = part("trip class of IEC 60947-4-1", unit=GIVEN, optional=True)
    device: str = part("the device")


@result
class TriedWay:
    """A way to a safety coupling that was tried."""

    way: str = part("the way")
    words: str = part("a sentence on it")
    numbers: WayNumbers = part(inline=True)
    opens: Mapping[str, float] = part(
        "peak of each overload in which the coupling opens or slips", unit="N.m"
    )
    effects: Mapping[str, Mapping[str, InUnit]] = part("peak at the output of the gear, by overload")


@result
class DriveProtection:
    """Settings of the protection of the drive."""

    trip_torque: float | None = quantity("N.m", "safety coupling, trip torque at the {driver}")
    trip_torque_at_motor: float | None = quantity("N.m", "safety coupling, trip torque at the motor's shaft")
    relay: MotorProtection = part(inline=True)
    coupling: str = part("a sentence on the recommended safety coupling")
    obstacle: Obstacle | None = part("why no safety coupling is recommended")
    why_none: str = part("a few words on it")
    normal_torque: float = quantity("N.m", "largest torque of normal duty on the coupling, at the {driver}")
    running_torque: float = quantity("N.m", "largest torque of running on the coupling")
    start_torque: float = quantity("N.m", "largest torque of a start on the coupling")
    breakdown_torque: float = quantity("N.m", "most that the motor gives at the {driver}")
    effects: Mapping[str, Mapping[str, InUnit]] = part("peak at the output of the gear, by overload")
    overloads: Mapping[str, InUnit] = part("peak of each overload on the coupling")
    disturbances: Mapping[str, InUnit] = part("peak of each disturbance on the coupling")
    alternatives: list[TriedWay] = part("ways to a coupling that a start does not open")


_UNTRIED = "not judged: this study has no overload; add [[event]]"


def drive_protection(
    study: StudyRecord, setting: Setting | None, alternatives: Sequence[Alternative], rated: float
) -> DriveProtection | MotorProtection | None:
    """Settings of the protection of the drive, whose motor has the `rated` current [A]; without a `setting` those of
    the motor alone, and None where the motor is insufficient."""
    if study.insufficient:
        return None
    relay = _relay(study, rated)
    if setting is None:
        return relay
    judged = setting.overloads or setting.obstacle is not Obstacle.OVERLOADS
    return DriveProtection(
        trip_torque=setting.torque,
        trip_torque_at_motor=setting.torque and setting.torque / study.drive.ratio,
        relay=relay,
        coupling=coupling_sentence(study, setting, alternatives),
        obstacle=setting.obstacle,
        why_none=why_none(setting) if judged else _UNTRIED,
        normal_torque=setting.normal,
        running_torque=setting.running,
        start_torque=setting.start,
        breakdown_torque=setting.motor,
        effects=_effects(study, setting.effects),
        overloads=_peaks(study, setting.overloads, "opens it", setting.opens),
        disturbances=_peaks(study, setting.disturbances, "a nuisance trip", setting.nuisances),
        alternatives=[
            TriedWay(
                each.way,
                way_words(study, each, setting),
                each.numbers,
                each.opens,
                _effects(study, each.effects),
            )
            for each in alternatives
        ],
    )


def _peaks(
    study: StudyRecord, peaks: Mapping[str, float], words: str, opening: Mapping[str, float]
) -> dict[str, InUnit]:
    """The peaks on the coupling, by run, with the `words` on each run that is among those `opening` it."""
    return {
        name: _torque(peak, f"{study.title_of(name)}: {words if name in opening else 'leaves it shut'}")
        for name, peak in peaks.items()
    }


def _effects(study: StudyRecord, effects: Mapping[str, CouplingEffect]) -> dict[str, dict[str, InUnit]]:
    """The effects of a safety coupling as it was tried, by overload."""
    titles = {"without": "without a coupling", "with_coupling": "with it"}
    return {
        name: {
            key: _torque(
                getattr(effect, key), f"{study.title_of(name)}: peak at the output of the gear, {words}"
            )
            for key, words in titles.items()
        }
        for name, effect in effects.items()
    }


def _relay(study: StudyRecord, rated: float) -> MotorProtection:
    if study.drive.follows:
        device = "electronic motor protection of the inverter"
        return MotorProtection(InUnit(rated, "A", title=f"{device}, setting"), None, device)
    words = class_words(study.relay_class)
    trip_class = {"value": words, "unit": "1", "title": "thermal relay, trip class of IEC 60947-4-1"}
    return MotorProtection(InUnit(rated, "A", title="thermal relay, setting"), trip_class, "relay")
