"""The parts to order beside the motor as data: the gear, the torque limiter with the ways to another, the relay."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from ...core.descriptions import of_driver
from ...core.quantities import quantity
from ...drives.belt import belt_drive
from ...drives.gear_ratios import belt_before_gear
from ...reading.results import GIVEN, InUnit, part, result
from ...reading.text import aside, number
from ...study.inverter import inverter_need
from ...study.record import StudyRecord, StudyRuns
from ...study.relay import HEAVIEST, MORE_CURRENT, class_words, locked_rotor, protects, tolerant_class
from ...study.starts import StartFindings, transient_words, weak_in_star
from ...study.verdict import STEADY
from .candidate import Candidate, TrialResult
from .coupling_words import coupling_sentence, way_words, why_none
from .gear_order import GearOrder, gear_order
from .parts import PartsList
from .protection import Alternative, CouplingEffect, Obstacle, Setting, WayNumbers
from .table import SizingPlan


@result
class OrderedGear:
    """The gear to order."""

    rated_torque: InUnit = part("rated output torque that the gear needs")
    loads: Mapping[str, InUnit] = part(
        "largest torque on the output of the gear, by kind of duty", inline=True
    )
    service_factor: InUnit = part("service factor fB")
    transient: InUnit | None = part(
        "largest torque of a start with the electromagnetic transient", optional=True
    )
    decided_by: str = part("the load that decides")


def ordered_gear(
    study: StudyRecord, setting: Setting | None, plan: SizingPlan, inertia_factor: float
) -> OrderedGear | None:
    """The gear to order by this `plan`, and the load that decides; None where there is no drive to order. For
    `inertia_factor` see `chainunit.drives.service_factor`."""
    margin, service = float(plan.demands.margin), plan.gear_factor(inertia_factor)
    if "gear.torque_limit" in study.setup.config.drive.given and study.setup.drive.gear.rating is None:
        # a limit that the user gives is checked without the factor of a catalogue
        service = 1.0
    order = gear_order(study, setting, margin, service)
    if order is None or not study.setup.drive.is_geared:
        return None
    reason = _deciding_load(study.runs, order)
    free = number(margin, "1", "percent", full=False)
    title = (
        f"gear, rated output torque at least, with the margin of {free} above running; decided by {reason}"
    )
    loads = {}
    for name, load in order.loads.items():
        size = "largest torque by load and acceleration" if name == "start" else "largest torque"
        loads[name] = _torque(load.torque, f"{size} of {load.words} on the output of the gear")
    service_title = f"service factor fB of the gear: {plan.service_words(inertia_factor)}"
    transient = None
    if order.transient is not None:
        transient = _torque(order.transient, transient_words(study.setup))
    return OrderedGear(
        rated_torque=InUnit(order.rated, "N.m", title=title),
        loads=loads,
        service_factor=InUnit(service, "1", title=service_title),
        transient=transient,
        decided_by=reason,
    )


def _deciding_load(runs: StudyRuns, order: GearOrder) -> str:
    """The load that decides the order of a gear in words, with its torque, and the runs that are left out."""
    decides = order.decides
    text = f"{decides.words}: {number(decides.torque, 'N.m')}{decides.rule}, rounded up"
    if order.without > order.rated:
        text += f"; without the torque limiter {number(order.without, 'N.m')}"
    if order.left_out:
        names = ", ".join(map(runs.title_of, order.left_out))
        text += (
            f"; a lower bound, as the energy balance is not kept ({names}): shorten run.step before you order"
        )
    return text


def _torque(value: float, title: str) -> InUnit:
    return InUnit(value, "N.m", title=title)


@result
class OrderedInverter:
    """The inverter to order."""

    rated_current: InUnit = part("least rated current")
    decided_by: str = part("the case that decides")


def ordered_inverter(study: StudyRecord) -> OrderedInverter | None:
    """The inverter to order; None on the line, and for an insufficient motor."""
    need = None if study.setup.insufficient else inverter_need(study)
    if need is None:
        return None
    title = f"inverter, rated current at least, decided by {need.case}"
    return OrderedInverter(InUnit(need.current, "A", title=title), need.case)


@result
class OrderedBelt:
    """The V-belt to order."""

    design_power: InUnit = part("design power")
    service_factor: InUnit = part("service factor")
    speed: InUnit = part("belt speed")
    ratio: InUnit = part("ratio of the belt")
    small_pulley: InUnit = part("pitch diameter of the pulley of the motor")
    large_pulley: InUnit = part("pitch diameter of the other pulley")
    section: str = part("the section")


def ordered_belt(study: StudyRecord, plan: SizingPlan, trial: TrialResult) -> OrderedBelt | None:
    """The belt to order by this `plan`, with the results of the chosen motor's `trial`; None where there is none."""
    if study.setup.insufficient or "belt" not in study.setup.drive.transmission or study.setup.plate is None:
        return None
    plate, ratio = study.setup.plate.nameplate, study.setup.drive.ratio
    if study.setup.drive.is_geared and (split := belt_before_gear(ratio)) is not None:
        ratio = split[0]
    is_on_line = study.setup.config.drive.start == "direct" or weak_in_star(study.findings)
    factor = plan.belt_factor(trial.inertia_factor, is_on_line)
    belt = belt_drive(plate.power, trial.speed or plate.speed, ratio, factor)
    power = number(plate.power, "W")
    power_title = "V-belt, design power, for which its maker gives number and tension of the belts: "
    power_title += f"rated {power} of the motor times the service factor"
    factor_title = f"service factor of the belt: {plan.belt_words(trial.inertia_factor, is_on_line)}"
    ratio_title = f"ratio of the belt with these pulleys; in the runs {ratio:.4g}"
    return OrderedBelt(
        design_power=InUnit(belt.design_power, "W", title=power_title),
        service_factor=InUnit(factor, "1", title=factor_title),
        speed=InUnit(belt.speed, "m/s", title="belt speed"),
        ratio=InUnit(belt.large / belt.small, "1", title=ratio_title),
        small_pulley=InUnit(belt.small, "m", "millimetres", title="pulley of the motor, pitch diameter"),
        large_pulley=InUnit(belt.large, "m", "millimetres", title="other pulley, pitch diameter"),
        section=f"{belt.section}, narrow V-belts",
    )


@result
class MotorProtection:
    """The device that protects the motor from heat; that of an inverter needs no trip class."""

    relay_current: InUnit = part("setting of the device")
    line_current: InUnit | None = part(
        "setting of the relay of a star-delta starter in the supply line", optional=True
    )
    relay_class: Mapping[str, str] | None = part("trip class of IEC 60947-4-1", unit=GIVEN, optional=True)
    device: str = part("the device")
    tolerance: str | None = part(
        "what a relay of this class does not protect, or does not hold", default=None, optional=True
    )

    @property
    def class_words(self) -> str:
        """The trip class, to follow the setting; empty for the motor protection of an inverter."""
        if self.relay_class is None:
            return ""
        return f", {self.relay_class['value']}{aside(self.tolerance)}"

    @property
    def setting_words(self) -> str:
        """The device, its setting and its class."""
        line = "" if self.line_current is None else f"in the supply line {_in_unit(self.line_current)}"
        return f"{self.device} at {_in_unit(self.relay_current)}{aside(line)}{self.class_words}"


def _in_unit(size: InUnit) -> str:
    return number(size.value, size.unit, size.kind)


@result
class TriedWay:
    """A way to a torque limiter that was tried."""

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

    trip_torque: float | None = quantity("N.m", "torque limiter, trip torque at the {driver}")
    trip_torque_at_motor: float | None = quantity("N.m", "torque limiter, trip torque at the motor's shaft")
    relay: MotorProtection = part(inline=True)
    coupling: str = part("a sentence on the recommended torque limiter")
    obstacle: Obstacle | None = part("why no torque limiter is recommended")
    why_none: str = part("a few words on it")
    normal_torque: float = quantity("N.m", "largest torque of normal duty on the coupling, at the {driver}")
    running_torque: float = quantity("N.m", "largest torque of running on the coupling")
    start_torque: float = quantity(
        "N.m", "largest torque of a start of the cold motor on the coupling by load and acceleration"
    )
    breakdown_torque: float = quantity(
        "N.m",
        "pull-out torque of the motor as warm as in running, or torque at which the line slips, at the {driver}",
    )
    effects: Mapping[str, Mapping[str, InUnit]] = part("peak at the output of the gear, by overload")
    overloads: Mapping[str, InUnit] = part("peak of each overload on the coupling")
    disturbances: Mapping[str, InUnit] = part("peak of each disturbance on the coupling")
    alternatives: list[TriedWay] = part("ways to a coupling that a start does not open")


@result
class SizedDrive:
    """The drive of a study by sizing: a motor with its gear and flywheel, their protection, and what is ordered."""

    best: Candidate
    insufficient: bool
    """whether no motor fits, so that this is the nearest"""
    driver: str
    """the noun of the link that the motor turns"""
    caveat: str | None
    """the caveat of the verdict on the model of the machine, if it has one"""
    needs_empty_start: bool
    """whether the motor starts in star and delta, and the feed keeps it from its speed in star"""
    gear: OrderedGear | None = part("the gear to order", titled=True, optional=True, default=None)
    protection: DriveProtection | MotorProtection | None = part(
        "settings of the protection", titled=True, optional=True, default=None
    )
    belt: OrderedBelt | None = part("the belt to order", titled=True, optional=True, default=None)
    inverter: OrderedInverter | None = part("the inverter to order", titled=True, optional=True, default=None)
    parts: PartsList | None = part(
        "the parts to order from catalogues", titled=True, optional=True, default=None
    )

    @property
    def sentence(self) -> str:
        """The drive in a sentence."""
        best, protection = self.best, self.protection
        motor = "Insufficient motor" if self.insufficient else "Motor"
        ratio = number(best.ratio, "1", digits=4, full=False)
        shaft = best.drive.flywheel_shaft.words(self.driver)
        parts = [
            f"{motor}: {best.designation}, ratio {ratio}{aside(best.gear_words)}",
            f"flywheel on the {shaft} {best.flywheel_words}" if best.disc else f"no flywheel on the {shaft}",
        ]
        if isinstance(protection, MotorProtection):
            setting = protection.relay_current
            parts.append(f"{setting.title} {_in_unit(setting)}{protection.class_words}")
        elif protection is not None:
            torque = protection.trip_torque
            limiter = of_driver("torque limiter, trip torque at the {driver} ", self.driver)
            none = f"no torque limiter{aside(protection.why_none)}"
            parts += [limiter + number(torque, "N.m") if torque else none, protection.relay.setting_words]
        if self.needs_empty_start:
            parts.append(
                "the machine has to start empty: set empty_start = true and run again before ordering"
            )
        return f"{'; '.join(parts)}{aside(self.caveat)}."


_UNTRIED = "not judged: this study has no overload; add [[event]]"


def drive_protection(
    study: StudyRecord, setting: Setting | None, alternatives: Sequence[Alternative], rated: float
) -> DriveProtection | MotorProtection | None:
    """Settings of the protection of the drive, whose motor has the `rated` current [A]; without a `setting` those of
    the motor alone, and None where the motor is insufficient."""
    if study.setup.insufficient:
        return None
    relay = _relay(study, rated)
    if setting is None:
        return relay
    judged = setting.overloads or setting.obstacle is not Obstacle.OVERLOADS
    return DriveProtection(
        trip_torque=setting.torque,
        trip_torque_at_motor=setting.torque and study.setup.drive.at_motor_shaft(setting.torque),
        relay=relay,
        coupling=coupling_sentence(study, setting, alternatives),
        obstacle=setting.obstacle,
        why_none=why_none(setting) if judged else _UNTRIED,
        normal_torque=setting.normal,
        running_torque=setting.running,
        start_torque=setting.start,
        breakdown_torque=setting.motor,
        effects=_effects(study.runs, setting.effects),
        overloads=_peaks(study.runs, setting.overloads, "opens it", setting.opens),
        disturbances=_peaks(study.runs, setting.disturbances, "a nuisance trip", setting.nuisances),
        alternatives=[
            TriedWay(x.way, way_words(study, x, setting), x.numbers, x.opens, _effects(study.runs, x.effects))
            for x in alternatives
        ],
    )


def _peaks(
    runs: StudyRuns, peaks: Mapping[str, float], phrase: str, opening: Mapping[str, float]
) -> dict[str, InUnit]:
    """The peaks on the coupling, by run, with the `phrase` on each run that is among those `opening` it."""
    return {
        name: _torque(peak, f"{runs.title_of(name)}: {phrase if name in opening else 'leaves it shut'}")
        for name, peak in peaks.items()
    }


def _effects(runs: StudyRuns, effects: Mapping[str, CouplingEffect]) -> dict[str, dict[str, InUnit]]:
    """The effects of a torque limiter as it was tried, by overload."""
    titles = {"without": "without a coupling", "with_coupling": "with it"}
    data = {}
    for name, effect in effects.items():
        title = f"{runs.title_of(name)}: peak at the output of the gear"
        data[name] = {
            key: _torque(getattr(effect, key), f"{title}, {effect_title}")
            for key, effect_title in titles.items()
        }
    return data


def _relay(study: StudyRecord, rated: float) -> MotorProtection:
    """The protection of a motor with that `rated` current [A]: a relay with its setting and trip class, or the
    inverter's own."""
    if study.setup.drive.follows:
        device = "electronic motor protection of the inverter"
        return MotorProtection(InUnit(rated, "A", title=f"{device}, setting"), None, None, device)
    title, tolerance = class_words(study.runs.relay_class), _too_slow(study) or _tolerance(study)
    trip_class = {"value": title, "unit": "1", "title": "thermal relay, trip class of IEC 60947-4-1"}
    if not study.setup.drive.star:
        setting = InUnit(rated, "A", title="thermal relay, setting")
        return MotorProtection(setting, None, trip_class, "relay", tolerance)
    place = "in the phases of the delta, behind the main contactor, where it usually sits"
    in_phases = f"thermal relay {place}: 1/sqrt(3) of the rated current, setting"
    return MotorProtection(
        relay_current=InUnit(rated / math.sqrt(3.0), "A", title=in_phases),
        line_current=InUnit(rated, "A", title="thermal relay in the supply line in place of that, setting"),
        relay_class=trip_class,
        device="relay in the phases of the delta",
        tolerance=tolerance,
    )


def _too_slow(study: StudyRecord) -> str | None:
    """The means beside a relay that trips too late with the rotor locked, in words; None beside another one."""
    before = study.runs.answers[STEADY].current_rms if STEADY in study.runs.answers else None
    if study.setup.plate is None or before is None or study.runs.relay_class > HEAVIEST:
        return None
    if protects(study.runs.relay_class, *locked_rotor(study.setup.plate.nameplate, before)):
        return None
    return "trips too late with the rotor locked: order the motor with PTC thermistors, too"


def _tolerance(study: StudyRecord) -> str | None:
    """The class whose relay holds in each start of a motor at the tolerance of its current, with the reason why it is
    not ordered (`chainunit.study.relay.protecting_class`), in words; None if it is."""
    starts = StartFindings.found_in(study.findings)
    if starts is None or starts.stuck or study.runs.relay_class > HEAVIEST:
        return None
    holding = tolerant_class(starts.relay_seconds, study.runs.relay_class)
    phrase, late = f"one {class_words(holding)} holds", ""
    if holding <= HEAVIEST:
        phrase, late = f"one of {class_words(holding)} holds", ", but trips too late with the rotor locked"
    more = number(MORE_CURRENT - 1.0, "1", "percent", full=False)
    text = f"{more} more current, the tolerance of IEC 60034-1, may trip it in a start; {phrase}{late}"
    return None if holding == study.runs.relay_class else text
