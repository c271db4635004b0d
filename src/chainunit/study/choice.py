"""The drive of a study: the tuned motor of the file, the motor that a capability chooses, or the foreign FMU that
the file names."""

from __future__ import annotations

from collections.abc import Container, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import InputError, refusal_prefix
from ..drives.catalogue import check_own
from ..drives.motor import Motor
from ..fmu.backends import Backend
from ..machines.machine import Machine
from ..system import foreign_component
from ..work.progress import Report
from .catalogue_drive import as_chosen, catalogue_drive, with_inertia
from .config import Config
from .cycle import Cycle, cycle
from .drive import Drive
from .drive_tables import DriveTables
from .operation import Operation
from .proposal import DriveProposal
from .registry import parts_of_line, registered


@dataclass(frozen=True)
class Choice:
    """The drive of a study, with the proposal by which it was chosen."""

    drive: Drive
    tables: DriveTables
    """the tables of the study, with the values that follow from the motor of the catalogue"""
    turn: Cycle
    """the machine over a turn at constant speed, with the feed of normal running"""
    proposal: DriveProposal | None = None


def choose(config: Config, folder: Path, report: Report, backend: Backend | None = None) -> Choice:
    """The drive of a study. A capability that chooses it writes its FMUs to `folder`."""
    tables, machine, plans = config.drive, config.machine, config.plans
    turn = cycle(machine, config.run.crank_speed, config.feed)
    if tables.foreign is not None:
        return Choice(_with_foreign(tables, machine, plans), tables, turn)
    for part in registered():
        proposal = part.drive(config, folder, report, backend)
        if proposal is not None:
            drive = _with_line(proposal.drive, plans, turn)
            return Choice(drive, as_chosen(tables, drive, proposal.gear), turn, proposal)
    if tables.plate is None:
        motor, p = tables.motor_type, tables.motor
        drive = Drive(motor, p, machine, motor.follows(p))
    else:
        drive = catalogue_drive(tables, machine, turn, tables.plate)
        tables = as_chosen(tables, drive)
    added = sum(part.shaft_inertia(plans[part.name]) for part in registered())
    drive = with_inertia(tables, replace(drive, feed_forward=tables.feed_forward), added)
    return Choice(tune(_with_line(drive, plans, turn), turn, tables.given_gains), tables, turn)


def with_parts_beside(choice: Choice, plans: Mapping[str, Any], operation: Operation) -> Drive:
    """The drive with the parts that capabilities add to its system, by their `plans`."""
    drive = choice.drive
    for part in registered():
        drive = part.beside(plans[part.name], drive, operation, choice.turn)
    return drive


def check_files(
    tables: DriveTables, catalogue: Path | None, machine: Machine, plans: Mapping[str, Any]
) -> None:
    """Refuse a file that a study names but cannot use: the `catalogue` of own motors, or a foreign motor.

    Raises
    ------
    InputError
        see `chainunit.drives.catalogue.check_own` and `chainunit.system.foreign_component`; also where the study asks
        for a quantity that only a motor of this package has.
    """
    if tables.is_chosen:
        with refusal_prefix("catalogue = ", "catalogue"):
            check_own(catalogue)
    if tables.foreign is not None:
        _with_foreign(tables, machine, plans)


def _with_foreign(tables: DriveTables, machine: Machine, plans: Mapping[str, Any]) -> Drive:
    """The machine with the foreign motor that the tables name, if the motor has all that the study needs."""
    assert tables.foreign is not None
    file = tables.foreign.file
    with refusal_prefix("system.motor: ", "system.motor"):
        motor = foreign_component(file, "motor", tables.foreign.names)
        for part in registered():
            if words := part.not_with_foreign_motor(plans[part.name]):
                raise InputError(f"{file}: {words}")
        if tables.feed_forward and "tau_ff" not in motor.connectors:
            raise InputError(f"{file}: has no input tau_ff in N.m; leave feed_forward out")
    follows = "w_ref" in motor.connectors
    return Drive(Motor, None, machine, follows, feed_forward=tables.feed_forward, foreign=motor)


def _with_line(drive: Drive, plans: Mapping[str, Any], turn: Cycle) -> Drive:
    """The drive with the parts of the line, by their `plans`."""
    for part in parts_of_line():
        placed = part.placed(plans[part.name], drive, turn)
        drive = drive if placed is None else replace(drive, line=drive.line.behind(placed))
    return drive


def tune(drive: Drive, turn: Cycle, given_gains: Container[str]) -> Drive:
    """The drive with controller gains that are tuned to its inertia in a `turn` of the machine; the `given_gains`
    stay as they are."""
    inertia = drive.rotor_inertia + float(np.mean(turn.inertia_at(drive.ratio)))
    parameters, tuning = drive.motor.tune(drive.parameters, inertia, given_gains)
    return replace(drive, parameters=parameters, tuning=tuning)
