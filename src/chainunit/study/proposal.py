"""A proposed drive: the motor of a catalogue that a capability chooses for a study, with its gear."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..drives.catalogue import CatalogueMotor
from ..fmu.backends import Backend
from ..machines.machine import Machine
from ..work.progress import TaskProgress
from .drive import Drive
from .event import Event
from .operation import DriveTables, OperatingConditions


@dataclass(frozen=True)
class DriveRequest:
    """A machine in its operation that needs a motor, and the tables of the study file on its drive."""

    machine: Machine
    organs: Any
    """the model of its organs, a `chainunit.study.organs.OrganModel`"""
    operation: OperatingConditions
    events: Mapping[str, Event]
    tables: DriveTables
    values: Mapping[str, Any]
    """values of the tables of the capabilities, by table"""
    catalogues: Sequence[Path]


class MotorChoice(ABC):
    """The choice of the motor of a study: the plan of the capability that makes it."""

    @property
    @abstractmethod
    def permitted_temperature(self) -> tuple[str, float]:
        """Permitted temperature of the winding [K], after its name in the study file."""

    @abstractmethod
    def proposal(
        self, request: DriveRequest, folder: Path, progress: TaskProgress, backend: Backend | None
    ) -> DriveProposal:
        """The drive. The FMUs that its search needs are written to `folder`.

        Raises
        ------
        InputError
            for a catalogue from which no motor can be chosen.
        """


def motor_choice(plans: Mapping[str, Any]) -> MotorChoice | None:
    """The choice among the `plans` of a study; None for a file that gives its motor."""
    return next((plan for plan in plans.values() if isinstance(plan, MotorChoice)), None)


@dataclass(frozen=True)
class DutyPeak:
    """The largest torque of normal duty without the starts, at the crank [N m], and the run in which it is."""

    torque: float
    run: str


@dataclass(frozen=True)
class DriveProposal:
    """The drive that a capability chose: the best one that fits, or the nearest where none does."""

    name: str
    """name of the findings of the choice, and origin of the values that follow from it"""
    findings: Any
    """the `Findings` of the choice; their remarks come before those on the runs"""
    drive: Drive
    motor: CatalogueMotor
    tables: DriveTables
    """the tables of the study, with the values that follow from the drive"""
    question: str
    """the question that it answers, with slots for the machine and for its speed"""
    reason: str
    """the choice and its reason, in words"""
    sentence: Callable[[Any], str]
    """the sentence on the drive of a study by its `StudyRecord`"""
    currents_until_trip: Callable[[Any], Mapping[str, float]]
    """by overload of a `StudyRecord`, the largest current of the motor [A] until the recommended limiter opens"""
    insufficient: str = ""
    """the sentence on a study in which no drive fits, so that all is run with the nearest; empty where one fits"""
    keys: Mapping[str, str] = field(default_factory=dict)
    """by parameter of the motor, the key of the study file that gives it"""
    start_class: int = 0
    """trip class of the relay that holds in each start; 0 for an inverter"""
    duty: DutyPeak | None = None
    """the largest torque at the crank in normal duty beside that of the study; None for a drive that does not fit"""
    permitted_starts: float = math.inf
    """starts an hour that the criteria of the choice permit"""
    inverter_current: float | None = None
    """least rated current of the inverter to be ordered [A]"""
