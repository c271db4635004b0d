"""The inverter to order: the least rated current that carries running, every start and every event."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ..reading.text import number
from .record import StudyRecord
from .starts import StartFindings
from .verdict import STEADY


@dataclass(frozen=True)
class InverterNeed:
    """The least rated current [A] of an inverter; the `case` that decides, in words; and the peaks of the current of
    the motor, by case [A]."""

    current: float
    case: str
    peaks: Mapping[str, float]


def inverter_need(study: StudyRecord) -> InverterNeed | None:
    """The inverter of a study; None on the line.

    It carries `starter.overload` times its rated current for up to 60 s: its rated current is at least that of the
    motor, the RMS current of running, the peak of each start, of running and of each event over that factor, and the
    current that a start exceeds for 60 s."""
    rated, overload = study.drive.rated_current, study.config.drive.starter.overload
    if rated is None or study.config.drive.start != "inverter":
        return None
    named = (("start_up", study.start), *study.answers.items())
    peaks = {study.title_of(name): a.current_peak for name, a in named if a and a.current_peak is not None}
    needs = {"the rated current of the motor": rated}
    if found := StartFindings.found_in(study):
        worst = max(found.starts, key=lambda start: start.current)
        peaks[f"a start from {number(worst.angle, 'rad')}"] = worst.current
        needs["a start of more than 60 s"] = max(start.long_current for start in found.starts)
    if (steady := study.answers.get(STEADY)) is not None and steady.current_rms is not None:
        needs["the RMS current of running"] = steady.current_rms
    if study.proposal is not None and study.proposal.inverter_current is not None:
        needs["the runs of the choice"] = study.proposal.inverter_current
    needs |= {case: peak / overload for case, peak in peaks.items()}
    case = max(needs, key=lambda case: needs[case])
    return InverterNeed(needs[case], case, peaks)
