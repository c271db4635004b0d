"""The gear to order for the drive that sizing chose: the torques that it has to carry, and the one that decides."""

from __future__ import annotations

from dataclasses import dataclass

from ...drives.gearing import ordered_torque
from ...study.event import Role
from ...study.event_torques import peaks_in_events, running_peak, running_words
from ...study.judgement import wrong_runs
from ...study.record import StudyRecord
from ...study.starts import StartFindings
from ...study.torques import at_gear
from ...study.verdict import STEADY
from .protection import Setting


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


def gear_order(study: StudyRecord, setting: Setting | None, margin: float) -> GearOrder | None:
    """The gear to order, which leaves the `margin` free, with a coupling of that `setting`; None without steady
    running, and for an insufficient motor. A start and an overload may put `gear.start_factor` times the rated torque
    on it."""
    if study.insufficient or STEADY not in study.answers:
        return None
    running, factor = running_peak(study, at_gear), study.config.drive.gear.start_factor
    loads = {"running": GearLoad(running.torque, running_words(study, running.run))}
    if starts := StartFindings.found_in(study):
        loads["start"] = GearLoad(starts.worst.gear_torque, "a start", factor)
    peaks, wrong = _overloads(study, setting), wrong_runs(study)
    if kept := {name: peak for name, peak in peaks.items() if name not in wrong}:
        name = max(kept, key=lambda each: kept[each])
        with_coupling = setting is not None and setting.torque and name in setting.effects
        words = f"an overload ({study.title_of(name)}{', with the coupling' if with_coupling else ''})"
        loads["overload"] = GearLoad(kept[name], words, factor)
    least = max(load.rated for load in loads.values())
    left_out = tuple(name for name in wrong if name in peaks)
    return GearOrder(ordered_torque(least, margin), loads, left_out)


def _overloads(study: StudyRecord, setting: Setting | None) -> dict[str, float]:
    """Peak torque at the output of the gear in each shock and disturbance [N m], by name: that which passes the
    coupling where one is recommended."""
    peaks = peaks_in_events(study, Role.SHOCK, Role.DISTURBANCE, of=at_gear)
    if setting is not None and setting.torque is not None:
        peaks |= {name: effect.with_coupling for name, effect in setting.effects.items()}
    return peaks
