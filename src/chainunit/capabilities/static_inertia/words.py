"""The sentences on a duty with one inertia, and on the drive that would have been chosen by it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ...reading.text import number
from ...study.limits import Check
from ...study.record import StudyRecord
from .choice import ChosenDrive, OtherChoice

KIND = "static inertia"
_PROGRAM = (
    "A sizing program that takes the inertia of the machine as one number, {inertia} at the {driver}, and its torque "
    "without terms of inertia,"
)


def drive_words(drive: ChosenDrive) -> str:
    """A drive in words: motor, ratio, flywheel."""
    flywheel = f", flywheel {number(drive.flywheel, 'kg.m2')}" if drive.flywheel else ""
    return f"{drive.motor} (ratio {drive.ratio:.4g}{flywheel})"


def missed_words(checks: Mapping[str, Check], names: Sequence[str], margin: float) -> str:
    """The checks of these `names` that a drive does not keep with the `margin`, in words."""
    left = number(1.0 - margin, "1", "percent", full=False)

    def words(check: Check) -> str:
        if check.value is None:
            return f"{check.title}, as it does not come up to speed"
        if check.over:
            return check.excess
        used = number(check.utilisation, "1", "used")
        return f"{check.title}, which takes {used} of its limit, where the margin leaves {left}"

    return "; ".join(words(checks[name]) for name in names)


def trial_words(choice: OtherChoice) -> str:
    """The trial of the other drive in the machine, and the trial of the drive of the study with one inertia, in
    sentences."""
    said = []
    if choice.own_missed and not choice.own.insufficient:
        missed = missed_words(choice.own_checks, choice.own_missed, choice.margin)
        said.append(f"With one inertia {choice.own.motor} seems to miss: {missed}.")
    if choice.missed:
        missed = missed_words(choice.checks, choice.missed, choice.margin)
        said.append(f"In the machine {choice.static.motor} misses: {missed}.")
    elif not choice.checks:
        said.append(f"In the machine {choice.static.motor} fails: {choice.words}.")
    else:
        said.append(_kept(choice))
    return " ".join(said)


def _kept(choice: OtherChoice) -> str:
    """The sentence on another drive that keeps all limits in the machine."""
    larger = choice.static.power / choice.own.power
    kept = f"In the machine {choice.static.motor} keeps every limit"
    if larger > 1.0:
        return f"{kept}, and has {number(larger, '1', digits=3)} times the rated power of the drive that suffices."
    if choice.static.flywheel > choice.own.flywheel:
        return f"{kept}, with a heavier flywheel than it needs."
    return f"{kept}, too."


def choice_words(choice: OtherChoice) -> str:
    """Behind the words on the program: what it would have chosen."""
    own, its = choice.own, choice.static
    if its.insufficient and not own.insufficient:
        said = (
            f"would have found no motor that fits, where {drive_words(own)} does: nearest {drive_words(its)}"
        )
    elif own.insufficient and not its.insufficient:
        said = f"would have found {drive_words(its)} sufficient, where no motor fits the machine"
    elif own.insufficient:
        said = f"would have found {drive_words(its)} the nearest, not {drive_words(own)}; no motor fits either way"
    else:
        said = f"would have chosen {drive_words(its)} in place of {drive_words(own)}"
    return said


def remark_on(study: StudyRecord, inertia: float, choice: OtherChoice | None, no_choice: str) -> None:
    """Add the warning where another drive would have been chosen with that `inertia` [kg m2], or the reason why the
    choice is not known."""
    if no_choice:
        study.note(KIND, "The choice with one inertia is not known: {why}.", why=no_choice)
    if choice is not None and choice.differs:
        study.warn(
            KIND,
            _PROGRAM + " {choice}. {trial}",
            inertia=(inertia, "kg.m2"),
            choice=choice_words(choice),
            trial=trial_words(choice),
        )
