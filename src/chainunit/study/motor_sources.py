"""The motor that a study file states: parameters, a designation of the catalogue, or a foreign FMU."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import InputError, refusal_prefix
from ..drives.catalogue import CatalogueMotor
from ..drives.induction_motor import InductionMotor
from ..drives.motor import FOREIGN, Motor
from ..machines.machine import Machine
from ..reading.tables import given_values, read_table, schema
from ..system import FmuComponent, foreign_component
from .catalogue_drive import as_used, catalogue_drive, with_inertia, with_slipping_parts
from .cycle import Cycle
from .drive import Drive, TurningGear
from .foreign_machine import declared_parameters
from .operation import DriveTables
from .registry import registered


class MotorSource(ABC):
    """A motor as the study file states it."""

    kind: Motor
    """its model"""
    plate: CatalogueMotor | None
    """the motor of the catalogue, if it is one"""

    def check(self, tables: DriveTables, plans: Mapping[str, Any]) -> None:
        """Refuse a motor that lacks what the tables or the `plans` of the capabilities need.

        Raises
        ------
        InputError
            see `chainunit.system.foreign_component`.
        """
        return None

    @abstractmethod
    def drive(self, tables: DriveTables, machine: Machine, turn: Cycle) -> Drive:
        """The machine with this motor and the flywheel; `turn` is the turn of the machine in normal
        running."""

    @abstractmethod
    def completed(self, drive: Drive, tables: DriveTables, turn: Cycle) -> tuple[Drive, DriveTables]:
        """The drive with its line, and the tables, with the values that follow from the machine and the line."""


@dataclass(frozen=True)
class OwnMotor(MotorSource):
    """A motor whose `parameters` the file gives."""

    kind: Motor
    parameters: Any
    plate: None = None

    def drive(self, tables: DriveTables, machine: Machine, turn: Cycle) -> Drive:
        """See `MotorSource`."""
        follows, p = self.kind.follows(self.parameters), self.parameters
        drive = Drive(
            self.kind,
            p,
            machine,
            follows,
            feed_forward=tables.feed_forward,
            gear=TurningGear(loss=float(p.gear.loss)),
            added_inertia=tables.added_inertia,
            flywheel_shaft=tables.flywheel_shaft,
        )
        return with_slipping_parts(drive, tables)

    def completed(self, drive: Drive, tables: DriveTables, turn: Cycle) -> tuple[Drive, DriveTables]:
        """The gains of the control are tuned to the inertia; gains that the file gives stay as they are."""
        inertia = drive.rotor_inertia + float(np.mean(turn.inertia_at(drive.ratio)))
        own_gains = {name.removeprefix("motor.") for name in tables.given if name.startswith("motor.")}
        parameters, tuning = drive.motor.tune(drive.parameters, inertia, own_gains)
        return replace(drive, parameters=parameters, tuning=tuning), tables


@dataclass(frozen=True)
class NamedMotor(MotorSource):
    """A motor of the catalogue."""

    plate: CatalogueMotor
    kind: Motor = InductionMotor

    def drive(self, tables: DriveTables, machine: Machine, turn: Cycle) -> Drive:
        """See `MotorSource`."""
        drive = with_inertia(tables, catalogue_drive(tables, machine, turn, self.plate), tables.added_inertia)
        return replace(drive, feed_forward=tables.feed_forward)

    def completed(self, drive: Drive, tables: DriveTables, turn: Cycle) -> tuple[Drive, DriveTables]:
        """The tables are those of `chainunit.study.catalogue_drive.as_used`."""
        return drive, as_used(tables, drive)


@dataclass(frozen=True)
class ForeignMotor(MotorSource):
    """A motor that is a foreign FMU."""

    file: Path
    names: Mapping[str, str]
    """the FMU's names by ours, where they differ"""
    parameters: Mapping[str, Any] = field(default_factory=dict)
    """values of its parameters, as the file has them"""
    kind: Motor = FOREIGN
    plate: None = None

    @property
    def component(self) -> FmuComponent:
        """The FMU as it is now, as its file may change between two runs of a study; errors are those of
        `chainunit.system.foreign_component`."""
        with refusal_prefix("system.motor: ", "system.motor"):
            component = foreign_component(self.file, "motor", self.names)
        prefix = "system.motor_parameters."
        form = schema(declared_parameters(component), "motor_parameters", prefix)
        return replace(component, start=given_values(read_table(form, self.parameters, prefix)))

    def check(self, tables: DriveTables, plans: Mapping[str, Any]) -> None:
        """See `MotorSource`; also refused is a quantity that only a motor of this package has."""
        inputs = self.component.connectors
        with refusal_prefix("system.motor: ", "system.motor"):
            if tables.flywheel is not None and tables.flywheel_shaft.is_motor:
                raise InputError(
                    f"{self.file}: its rotor takes no flywheel; leave [flywheel] out, or set "
                    'flywheel.place = "machine"'
                )
            for part in registered():
                if refusal := part.not_with_foreign_motor(plans[part.name]):
                    raise InputError(f"{self.file}: {refusal}")
            if tables.feed_forward and "tau_ff" not in inputs:
                raise InputError(f"{self.file}: has no input tau_ff in N.m; leave feed_forward out")

    def drive(self, tables: DriveTables, machine: Machine, turn: Cycle) -> Drive:
        """See `MotorSource`; a study with a flywheel on its rotor is refused."""
        motor = self.component
        drive = Drive(
            FOREIGN,
            None,
            machine,
            "w_ref" in motor.connectors,
            feed_forward=tables.feed_forward,
            added_inertia=tables.added_inertia,
            flywheel_shaft=tables.flywheel_shaft,
            foreign=motor,
        )
        return with_slipping_parts(drive, tables)

    def completed(self, drive: Drive, tables: DriveTables, turn: Cycle) -> tuple[Drive, DriveTables]:
        """Nothing follows."""
        return drive, tables
