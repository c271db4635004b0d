"""The largest torques on the parts between motor and machine in the events of a study and in its normal duty."""

from __future__ import annotations

from .event import Role
from .record import StudyRecord
from .torques import PeakOf, on_coupling


def peaks_in_events(study: StudyRecord, *roles: Role, of: PeakOf = on_coupling) -> dict[str, float]:
    """Peak torque in each event with one of these `roles`, or in every event without `roles` [N m]."""
    events = study.config.events
    return {
        name: of(study.drive, study.runs[name].sel(time=slice(begin, None)))
        for name, begin in study.event.items()
        if name in study.runs and (not roles or events[name].role in roles)
    }


def running_torque(study: StudyRecord, of: PeakOf = on_coupling) -> float:
    """Largest torque of normal duty without the starts [N m]: steady running, and events that may last."""
    events = study.config.events
    lasting = peaks_in_events(study, Role.DUTY, of=of).items()
    return max(
        of(study.drive, study.steady),
        *(torque for name, torque in lasting if not events[name].from_rest),
        0.0 if study.sizing is None or study.insufficient else study.sizing.best.duty_torque,
    )
