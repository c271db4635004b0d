"""Starts per hour of a motor on the line, beside the number that `chainunit.study.permitted_starts` gives."""

from __future__ import annotations

import math

from ...drives.nameplate import Nameplate
from ...reading.text import number
from ...study.permitted_starts import PermittedStarts, permitted_starts, standard_inertia, starting_data
from ...study.record import StudyRecord
from ...study.verdict import STEADY
from .plan import CheckPlan
from .row import CheckRule, Checks

_STARTS = CheckRule(
    "starts per hour", "per_hour",
    "Rule of makers of motors, Z = Z0 KJ KM KP (SEW-Eurodrive, Project planning for AC motors)",
    "Z <= Z0 (1 - ML/MH) (1 - (I/IN)^2)/FI, FI = J/JM{choice}",
    "Z0 = bare; ML = counter_torque; MH = motor_torque; I = current; IN = rated_current; FI = inertia_factor",
)  # fmt: skip


def find(study: StudyRecord, plan: CheckPlan, checks: Checks) -> PermittedStarts | None:
    """The starts of a study, and their `checks`."""
    setup, runs = study.setup, study.runs
    if setup.drive.follows and setup.drive.foreign is None:
        # the line on the relay names the starts, too
        return None
    if why := _why_none(study, plan):
        checks.lack("starts per hour by the rule of makers of motors", why)
        return None
    assert setup.plate is not None
    assert runs.start is not None
    plate = setup.plate.nameplate
    rise = runs.series["start_up"].sel(time=slice(None, runs.start.start_time))
    current, bare = runs.answers[STEADY].current_rms, plan.starting.permitted or plate.starts
    per_hour = plan.starts_per_hour
    data = starting_data(setup.drive, plate, rise, runs.steady, per_hour=per_hour, bare=bare, current=current)
    starts = permitted_starts(data, setup.proposal.permitted_starts if setup.proposal else math.inf)
    check_starts(checks, starts, is_chosen=setup.proposal is not None)
    return starts


def check_starts(checks: Checks, starts: PermittedStarts, is_chosen: bool = False) -> None:
    """Check the starts; those of a motor that `is_chosen` are limited by the criteria of the choice, too."""
    choice = "; at most as many as the choice of the motor permits, by the heat of its winding"
    checks.check(
        _STARTS, "motor", "checks.starting", starts, starts.permitted, choice=choice if is_chosen else ""
    )


def _why_none(study: StudyRecord, plan: CheckPlan) -> str:
    """The reason why the starts are not checked; empty where they are."""
    if study.setup.drive.foreign is not None:
        return "the motor is an FMU, whose starts are not known"
    if study.setup.plate is None:
        return "the motor has no nameplate; take one of a catalogue (system.motor)"
    if not plan.starts_per_hour:
        return "the file does not say how many; add [starting] with per_hour"
    if not plan.starting.permitted and not study.setup.plate.nameplate.starts:
        why = "the catalogue gives no permitted starts of the bare rotor; add [starting] with permitted"
        return why + _by_standard(study, study.setup.plate.nameplate)
    if study.runs.start is None or study.runs.start.start_time is None:
        return "the motor does not come to its speed"
    return ""


def _by_standard(study: StudyRecord, plate: Nameplate) -> str:
    """The inertia at the motor's shaft beside the one of the standard, in words, see `standard_inertia`; empty for
    another start or frequency."""
    limit = standard_inertia(study.setup.drive, plate, study.runs.steady, study.setup.config.drive.start)
    if limit is None:
        return ""
    inertia, most = limit
    verdict = "within it" if inertia <= most else "more: ask the maker of the motor"
    return (
        f". IEC 60034-12 demands of a motor of design N that it brings {number(most, 'kg.m2')} beside its rotor up "
        f"to speed, twice from cold or once from hot; the machine has {number(inertia, 'kg.m2')}, {verdict}"
    )
