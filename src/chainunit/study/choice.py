"""The drive of a study: the tuned motor of the file, the motor that a capability chooses, or the foreign FMU that
the file names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..core.errors import InputError, refusal_prefix
from ..drives.catalogue import check_own
from ..drives.motor import Motor
from ..fmu.backends import Backend
from ..system import foreign_component
from ..work.progress import TaskProgress
from .catalogue_drive import catalogue_drive, gear_with, with_inertia
from .config import Config
from .cycle import cycle
from .drive import Drive
from .proposal import DriveProposal
from .registry import parts_of_line, registered


@dataclass(frozen=True)
class Choice:
    """The drive, with the proposal by which it was chosen."""

    drive: Drive
    proposal: DriveProposal | None = None


def choose(config: Config, folder: Path, progress: TaskProgress, backend: Backend | None = None) -> Choice:
    """The drive of a study. A capability that chooses it writes its FMUs to `folder`."""
    if config.foreign is not None:
        return Choice(_with_foreign(config))
    for part in registered():
        proposal = part.drive(config, folder, progress, backend)
        if proposal is not None:
            return Choice(with_line(config, proposal.drive), proposal=proposal)
    return Choice(tune(config, with_line(config, _drive_of_file(config))))


def _drive_of_file(config: Config) -> Drive:
    """The drive with the motor whose parameters the file gives, or with the motor of the catalogue that the
    file names."""
    if config.plate is not None:
        turn = cycle(config.machine, config.run.crank_speed, config.feed)
        drive = catalogue_drive(config, config.plate, turn.crank_torque)
    else:
        motor, p = config.motor_type, config.motor
        drive = Drive(motor, p, config.machine, motor.follows(p))
    added = sum(part.shaft_inertia(config) for part in registered())
    return with_inertia(config, replace(drive, feed_forward=config.feed_forward), added)


def as_chosen(config: Config, choice: Choice) -> Config:
    """The study with the values that follow from the drive with a motor of the catalogue: the efficiency of the gear
    by its stages, and boost and slip compensation of the inverter."""
    if not config.of_catalogue:
        return config
    drive, proposal, inverter = choice.drive, choice.proposal, config.starter.inverter
    if drive.follows:
        used = drive.parameters.inverter
        inverter = replace(inverter, boost=used.boost, slip=used.slip)
    gear = gear_with(config, drive.ratio) if proposal is None else proposal.gear
    return replace(
        config,
        gear=replace(config.gear, efficiency=gear.efficiency),
        starter=replace(config.starter, inverter=inverter),
    )


def with_parts_beside(config: Config, drive: Drive) -> Drive:
    """The drive with the parts that capabilities add to its system."""
    for part in registered():
        drive = part.beside(config, drive)
    return drive


def check_files(config: Config) -> None:
    """Refuse a file that the study names but cannot use.

    Raises
    ------
    InputError
        see `chainunit.drives.catalogue.check_own` and `with_motor`.
    """
    if config.chooses_motor:
        with refusal_prefix("catalogue = ", "catalogue"):
            check_own(config.file.catalogue)
    if config.foreign is not None:
        _with_foreign(config)


def _with_foreign(config: Config) -> Drive:
    """The drive of a study that names its motor."""
    assert config.foreign is not None
    with refusal_prefix("system.motor: ", "system.motor"):
        return with_motor(config, config.foreign.file, config.foreign.names)


def with_motor(config: Config, file: Path, names: Mapping[str, str] | None = None) -> Drive:
    """The machine of a study, driven by a foreign motor.

    Parameters
    ----------
    file : the FMU
    names : the FMU's names by ours, where they differ; see `chainunit.system.foreign_component`

    Raises
    ------
    InputError
        where the FMU does not fit, or the study asks for a quantity that only a motor of this package has.
    """
    motor = foreign_component(file, "motor", names)
    for part in registered():
        if words := part.not_with_foreign_motor(config):
            raise InputError(f"{file}: {words}")
    if config.feed_forward and "tau_ff" not in motor.connectors:
        raise InputError(f"{file}: has no input tau_ff in N.m; leave feed_forward out")
    follows = "w_ref" in motor.connectors
    return Drive(Motor, None, config.machine, follows, feed_forward=config.feed_forward, foreign=motor)


def with_line(config: Config, drive: Drive) -> Drive:
    """The drive with the parts of the study between motor and machine."""
    for part in parts_of_line():
        placed = part.placed(config, drive)
        drive = drive if placed is None else replace(drive, line=drive.line.behind(placed))
    return drive


def tune(config: Config, drive: Drive) -> Drive:
    """The drive with controller gains that are tuned to its inertia, unless the config gives them."""
    both = cycle(drive.machine, config.run.crank_speed, config.feed)
    given_gains = {name.removeprefix("motor.") for name in config.file.given if name.startswith("motor.")}
    inertia = drive.rotor_inertia + float(np.mean(both.outputs.J))
    parameters, tuning = drive.motor.tune(drive.parameters, inertia, given_gains)
    return replace(drive, parameters=parameters, tuning=tuning)
