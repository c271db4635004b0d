"""The gear to order for the drive that sizing chose: the torques that it has to carry, and the one that decides."""

from __future__ import annotations

from dataclasses import dataclass

from ..drives.gearing import ordered_torque
from .event import Role
from .event_torques import peaks_in_events, running_peak, running_words
from .judgement import wrong_runs
from .record import StudyRecord
from .starts import StartAnalysis
from .torques import at_gear
from .verdict import STEADY


@dataclass(frozen=True)
class GearLoad:
    """The largest torque on the output of the gear in one kind of duty [N m], its case in `words`, and how many times
    its rated torque a gear may carry in it."""

    torque: float
    words: str
    times: float = 1.0

    @property
    def rated(self) -> float:
        """The rated torque that a gear needs for it [N m]."""
        return self.torque / self.times


@dataclass(frozen=True)
class GearOrder:
    """The rated output torque to order [N m]; the loads by name ("running", and "start" and "overload" where there
    are); and the overloads that were `left_out`, as their energy balance is not kept."""

    rated: float
    loads: dict[str, GearLoad]
    left_out: tuple[str, ...]

    @property
    def decides(self) -> GearLoad:
        """The load that asks for the largest rated torque."""
        return max(self.loads.values(), key=lambda load: load.rated)


def gear_order(study: StudyRecord) -> GearOrder | None:
    """The gear to order; None without steady running, and for an insufficient motor. A start and an overload may put
    `gear.start_factor` times the rated torque on it."""
    assert study.config.sizing is not None
    if study.insufficient or STEADY not in study.answers:
        return None
    running, factor = running_peak(study, at_gear), study.config.gear.start_factor
    loads = {"running": GearLoad(running.torque, running_words(study, running.run))}
    if starts := study.findings.get(StartAnalysis.name):
        loads["start"] = GearLoad(starts.worst.gear_torque, "a start", factor)
    peaks, wrong = _overloads(study), wrong_runs(study)
    if kept := {name: peak for name, peak in peaks.items() if name not in wrong}:
        name = max(kept, key=lambda each: kept[each])
        with_coupling = study.setting is not None and study.setting.torque and name in study.setting.effects
        words = f"an overload ({study.title_of(name)}{', with the coupling' if with_coupling else ''})"
        loads["overload"] = GearLoad(kept[name], words, factor)
    least = max(load.rated for load in loads.values())
    left_out = tuple(name for name in wrong if name in peaks)
    return GearOrder(ordered_torque(least, study.config.sizing.margin), loads, left_out)


def _overloads(study: StudyRecord) -> dict[str, float]:
    """Peak torque at the output of the gear in each shock and disturbance [N m], by name: that which passes the
    coupling where one is recommended."""
    peaks = peaks_in_events(study, Role.SHOCK, Role.DISTURBANCE, of=at_gear)
    if study.setting is not None and study.setting.torque is not None:
        peaks |= {name: effect.with_coupling for name, effect in study.setting.effects.items()}
    return peaks
