"""The gear to order for the drive that sizing chose: the torques that it has to carry, and the one that decides."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from ...drives.gearing import ordered_torque
from ...reading.text import number
from ...study.event import Role
from ...study.judgement import wrong_runs
from ...study.record import StudyRecord, StudySetup
from ...study.starts import StartFindings
from ...study.torques import at_gear, gear_peaks, running_peak, running_words
from ...study.verdict import STEADY
from .protection import Setting


@dataclass(frozen=True)
class GearLoad:
    """The largest torque on the output of the gear in one kind of duty [N m], its case in `words`, how many times
    its rated torque a gear may carry in it, and the `rule` for that in words, to follow the case."""

    torque: float
    words: str
    times: float = 1.0
    rule: str = ""

    @property
    def rated(self) -> float:
        """The rated torque that a gear needs for it [N m]."""
        return self.torque / self.times


@dataclass(frozen=True)
class GearOrder:
    """The rated output torque to order [N m]; the loads by name ("running" and "service", and "start" and "overload"
    where there are); the overloads that were `left_out`, as their energy balance is not kept; the rated torque
    `without` the torque limiter [N m]; and the largest torque of a start with the electromagnetic transient [N m],
    None without starts."""

    rated: float
    loads: dict[str, GearLoad]
    left_out: tuple[str, ...]
    without: float
    transient: float | None = None

    @property
    def decides(self) -> GearLoad:
        """The load that asks for the largest rated torque."""
        return max(self.loads.values(), key=lambda load: load.rated)


def gear_order(
    study: StudyRecord, setting: Setting | None, margin: float, service: float
) -> GearOrder | None:
    """The gear to order, with a coupling of that `setting`; None without steady running, and for an insufficient
    motor.

    Running and overloads leave the `margin` free. The rated torque of the motor counts times the `service` factor. A
    start counts by load and acceleration, times the service factor; a start and an overload may put
    `gear.start_factor` times the rated torque on the gear."""
    if study.setup.insufficient or STEADY not in study.runs.answers:
        return None
    setup, wrong, peaks = study.setup, wrong_runs(study.runs), gear_peaks(study.runs)
    findings = StartFindings.found_in(study.findings)
    starts, overloads = _starts(setup, findings, peaks), _overloads(setup, setting, peaks)
    left_out = tuple(name for name in wrong if name in overloads)
    starts = {name: torque for name, torque in starts.items() if name not in wrong}
    overloads = {name: torque for name, torque in overloads.items() if name not in wrong}
    loads = dict(_loads(study, setting, margin, service, starts, overloads))
    least, bare = max(load.rated for load in loads.values()), _overloads(setup, None, peaks)
    permitted = setup.config.drive.gear.start_factor * (1.0 - margin)
    without = max([least, *(bare[name] / permitted for name in overloads)])
    transient = None if findings is None else findings.transient
    return GearOrder(ordered_torque(least), loads, left_out, ordered_torque(without), transient)


def _loads(
    study: StudyRecord,
    setting: Setting | None,
    margin: float,
    service: float,
    starts: Mapping[str, float],
    overloads: Mapping[str, float],
) -> Iterator[tuple[str, GearLoad]]:
    """The loads of a gear by name: running, the motor at its rating, and the hardest of the `starts` and of the
    `overloads`, torques by name [N m]. For the parts of the rated torque that they may take see `gear_order`."""
    gear, usable_share = study.setup.config.drive.gear, 1.0 - margin
    running, factor = running_peak(study, at_gear), gear.start_factor
    free = f", {number(margin, '1', 'percent', full=False)} of the rated torque left free" if margin else ""
    yield "running", GearLoad(running.torque, running_words(study.runs, running.run), usable_share, free)
    times = f" times the service factor {service:g}"
    if study.setup.plate is not None:
        rated = study.setup.plate.nameplate.torque * study.setup.drive.ratio * gear.efficiency
        yield "service", GearLoad(rated, "the motor at its rating", 1.0 / service, times)
    if starts:
        name = max(starts, key=lambda name: starts[name])
        title = f"a start ({study.runs.title_of(name)})" if name else "a start"
        rule = f", permitted {factor:g} x rated,{times}"
        yield "start", GearLoad(starts[name], title, factor / service, rule)
    if overloads:
        name = max(overloads, key=lambda name: overloads[name])
        with_coupling = setting is not None and setting.torque and name in setting.effects
        title = f"an overload ({study.runs.title_of(name)}{', with the limiter' if with_coupling else ''})"
        rule = f", permitted {factor:g} x rated{free}"
        yield "overload", GearLoad(overloads[name], title, factor * usable_share, rule)


def _starts(
    setup: StudySetup, findings: StartFindings | None, peaks: Mapping[str, float]
) -> dict[str, float]:
    """Peak torque of starts at the output of the gear by load and acceleration [N m], of the `peaks` by the name of
    their event; that of the starts from all angles has no name."""
    events = setup.config.events
    starts = {name: peak for name, peak in peaks.items() if name in events and events[name].from_rest}
    return starts if findings is None else {"": findings.worst.quasi_static} | starts


def _overloads(setup: StudySetup, setting: Setting | None, peaks: Mapping[str, float]) -> dict[str, float]:
    """Peak torque at the output of the gear in each shock and disturbance [N m], of the `peaks` by name: that which
    passes the coupling where one is recommended."""
    events, roles = setup.config.events, (Role.SHOCK, Role.DISTURBANCE)
    overloads = {name: peak for name, peak in peaks.items() if name in events and events[name].role in roles}
    if setting is not None and setting.torque is not None:
        overloads |= {name: effect.with_coupling for name, effect in setting.effects.items()}
    return overloads
