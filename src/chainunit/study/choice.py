"""The drive of a study: the tuned motor of the file, the motor that a capability chooses, or the foreign FMU that
the file names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ..core.errors import refusal_prefix
from ..core.files import scratch
from ..drives.catalogue import check_own
from ..fmu.backends import Backend
from ..work.progress import TaskProgress, quiet
from .capability import PartBeside
from .config import Config
from .cycle import Cycle, cycle
from .drive import Drive
from .motor_sources import MotorSource
from .operation import DriveTables
from .proposal import DriveProposal, motor_choice
from .registry import parts_of_line


@dataclass(frozen=True)
class Choice:
    """The drive of a study, with the proposal by which it was chosen."""

    drive: Drive
    tables: DriveTables
    """the tables of the study, with the values that follow from the motor of the catalogue"""
    proposal: DriveProposal | None = None


def choose(config: Config, folder: Path, progress: TaskProgress = quiet) -> Choice:
    """The drive of a study. A capability that chooses it writes its FMUs to `folder`."""
    turn = cycle(config.machine, config.run.crank_speed, config.feed)
    return choose_for(turn, config, folder, progress)


def drive_of(config: Config) -> Drive:
    """The drive of a study, without the FMUs of a choice."""
    with scratch() as folder:
        return choose(config, folder).drive


def choose_for(
    turn: Cycle, config: Config, folder: Path, progress: TaskProgress, backend: Backend | None = None
) -> Choice:
    """The drive of a study, as `choose`, whose machine makes this `turn` in normal running."""
    tables, plans, source = config.drive, config.plans, config.motor
    if source is None:
        chosen = motor_choice(plans)
        assert chosen is not None, "a file without a motor has a table that chooses one"
        proposal = chosen.proposal(config.drive_request, folder, progress, backend)
        return Choice(_with_line(proposal.drive, plans, turn), proposal.tables, proposal)
    source.check(tables, plans)
    drive = _with_line(source.drive(tables, config.machine, turn), plans, turn)
    return Choice(*source.completed(drive, tables, turn))


def check_motor(
    motor: MotorSource | None, tables: DriveTables, plans: Mapping[str, Any], catalogues: Sequence[Path]
) -> None:
    """Refuse files of a study that it cannot use: that of its motor or, where a capability chooses the motor, the
    catalogues of the user.

    Raises
    ------
    InputError
        see `MotorSource.check` and `chainunit.drives.catalogue.check_own`.
    """
    if motor is not None:
        motor.check(tables, plans)
        return
    with refusal_prefix("catalogue = ", "catalogue"):
        check_own(catalogues)


def _with_line(drive: Drive, plans: Mapping[str, Any], turn: Cycle) -> Drive:
    """The drive with the parts of the line, by their `plans`."""
    for part in parts_of_line():
        placed = part.placed(plans[part.name], drive, turn)
        drive = drive if placed is None else replace(drive, line=drive.line.behind(placed))
    return drive


def with_parts_beside(drive: Drive, plans: Mapping[str, Any], feed: Any, turn: Cycle) -> Drive:
    """The drive with the parts that capabilities add to its system, by their `plans`, for a machine with this
    `feed` and this `turn` in normal running."""
    for plan in plans.values():
        if isinstance(plan, PartBeside):
            drive = plan.beside(drive, feed, turn)
    return drive
