"""The drive that the same search chooses for the machine with one inertia, and its trial in the machine."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from ...core.errors import InputError, InterruptedRunError, RunError
from ...core.quantities import quantity
from ...reading.results import part, result
from ...study.analysis import Work
from ...study.limits import Check
from ...study.proposal import DriveProposal
from ...study.record import StudyRecord
from .twin import twin

_ALIKE = 0.1
"""Relative difference of flywheels that count as equal: the search for one ends near a limit, to about a tenth."""


@result
class ChosenDrive:
    """A drive that was chosen."""

    motor: str = part("the motor")
    ratio: float = quantity("1", "ratio of the gear")
    flywheel: float = quantity("kg.m2", "flywheel on the motor shaft; 0: none")
    power: float = quantity("W", "rated power of the motor")
    insufficient: bool = part("whether no motor fits, so that this is the nearest")
    answer: str = part("the choice with its reason")


@result
class OtherChoice:
    """The drive that the same search chooses for the machine with one inertia, and its trial in the machine."""

    own: ChosenDrive = part("the drive of the study")
    static: ChosenDrive = part("the drive that is chosen with one inertia")
    differs: bool = part("whether it is another drive")
    checks: Mapping[str, Check] = part(
        "the other drive in the machine: the values of its runs beside their limits, by name",
        default_factory=dict,
    )
    missed: list[str] = part(
        "the checks that it does not keep with the margin, the worst first", default_factory=list
    )
    own_checks: Mapping[str, Check] = part(
        "the drive of the study with one inertia: the values of its runs beside their limits, by name",
        default_factory=dict,
    )
    own_missed: list[str] = part(
        "the checks that it does not keep there with the margin", default_factory=list
    )
    words: str = part("the result of its trial, in words", default="")
    margin: float = quantity(
        "1", "share of each limit that the chosen drive has to leave free", kind="percent", default=0.0
    )


def choose_other(study: StudyRecord, inertia: float, work: Work) -> tuple[OtherChoice | None, str]:
    """The choice with that `inertia` [kg m2], or why there is none."""
    proposal = study.proposal
    if proposal is None or proposal.chooser is None:
        return None, ""
    work.progress("the choice of the motor with one inertia", 0.0, 1.0)
    machine = study.config.machine
    try:
        static = proposal.chooser.choose(twin(machine, inertia))
        own, its = _drive(proposal), _drive(static)
        if not _is_other(own, its):
            return OtherChoice(own, its, differs=False), ""
        drive = replace(static.drive, machine=machine.replace(ratio=static.drive.ratio))
        judged = proposal.chooser.judge(drive, static.motor)
        with_one = replace(proposal.drive, machine=twin(proposal.drive.machine, inertia))
        seen = proposal.chooser.judge(with_one, proposal.motor)
    except InterruptedRunError:
        raise
    except (InputError, RunError) as error:
        return None, f"the search with one inertia failed: {error}"
    choice = OtherChoice(
        own,
        its,
        differs=True,
        checks=judged.checks,
        missed=[*judged.missed],
        own_checks=seen.checks,
        own_missed=[*seen.missed],
        words=judged.words,
        margin=judged.margin,
    )
    return choice, ""


def _drive(proposal: DriveProposal) -> ChosenDrive:
    return ChosenDrive(
        proposal.motor.designation,
        proposal.drive.ratio,
        proposal.drive.added_inertia,
        float(proposal.motor.nameplate.power),
        bool(proposal.insufficient),
        proposal.answer,
    )


def _is_other(own: ChosenDrive, other: ChosenDrive) -> bool:
    """Whether two drives differ in the motor, the ratio or the flywheel."""
    sizes = own.flywheel, other.flywheel
    flywheel = abs(sizes[0] - sizes[1]) > _ALIKE * max(sizes)
    return own.motor != other.motor or own.ratio != other.ratio or flywheel
