"""The largest torques on the parts between motor and machine in the events of a study and in its normal duty."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .event import Role
from .record import StudyRecord
from .torques import DutyPeak, PeakOf, at_gear, duty_peak, on_coupling, quasi_static_peak
from .verdict import START, STEADY

if TYPE_CHECKING:
    import xarray as xr


def from_event_on(study: StudyRecord, name: str) -> xr.Dataset:
    """The part of a run from the begin of its event on."""
    return study.runs[name].sel(time=slice(study.event[name], None))


def peaks_in_events(study: StudyRecord, *roles: Role, peak_of: PeakOf = on_coupling) -> dict[str, float]:
    """Peak torque in each event with one of these `roles`, or in every event without `roles` [N m]."""
    events = study.config.events
    return {
        name: peak_of(study.drive, from_event_on(study, name))
        for name in study.event
        if name in study.runs and (not roles or events[name].role in roles)
    }


def gear_peaks(study: StudyRecord) -> dict[str, float]:
    """Peak torque at the output of the gear in steady running, in the start-up and in each event [N m], by the name
    of the run. If the supply is switched, in starts and in disturbances, it is that by load and acceleration."""
    events, rise = study.config.events, study.runs["start_up"].sel(time=slice(None, study.steady_begin))
    peaks = {
        STEADY: at_gear(study.drive, study.steady),
        START: quasi_static_peak(study.drive, rise),
    }
    for name in study.event:
        if name in study.runs:
            is_switched = events[name].from_rest or events[name].role is Role.DISTURBANCE
            peak_of = quasi_static_peak if is_switched else at_gear
            peaks[name] = peak_of(study.drive, from_event_on(study, name))
    return peaks


def running_peak(study: StudyRecord, peak_of: PeakOf = on_coupling) -> DutyPeak:
    """The largest torque of normal duty without the starts: of steady running, of events that may last, and of the
    runs from which a drive was chosen."""
    events = study.config.events
    lasting = [
        (name, from_event_on(study, name))
        for name in study.event
        if name in study.runs and events[name].role is Role.DUTY and not events[name].from_rest
    ]
    peaks = [duty_peak(study.drive, [(STEADY, study.steady), *lasting], peak_of)]
    if study.proposal is not None and study.proposal.duty is not None:
        peaks.append(study.proposal.duty)
    return max(peaks, key=lambda peak: peak.torque)


def running_words(study: StudyRecord, run: str) -> str:
    """The case of normal duty of a run, in words."""
    title = study.title_of(run)
    return title if run == STEADY else f"running ({title})"
