"""Capabilities, as a study knows them: each is one question that the program answers beside the base of a study.

A capability is one folder with an entry point of the group ``chainunit.capabilities``, in this package or in another;
nothing outside of the folder imports from it. It brings tables of the study file with their rules, parts of the
drive, and analyses with their findings. Its section of the report and its commands are those of
`chainunit.report.capability.Capability`.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from ..core.errors import InputError
from ..machines.machine import Machine
from .analysis import Analysis
from .config import Config, FileReading
from .cycle import Cycle
from .drive import Drive
from .file_section import FileSection
from .rules import Rule


class PartBeside(ABC):
    """A part of the system beside the line."""

    @abstractmethod
    def beside(self, drive: Drive, feed: Any, turn: Cycle) -> Drive:
        """The drive with the part; the machine has this `feed` and `turn` in normal running."""


@dataclass(frozen=True)
class Estimates:
    """Estimated numbers of a study: their `values` by full name, the `covariance` of their errors in this order,
    shape (numbers, numbers), and the name of the `file` that holds both, beside the study file."""

    values: Mapping[str, float]
    covariance: Any
    file: str


class EstimateUser(ABC):
    """A use of numbers that are estimated."""

    @abstractmethod
    def take_estimates(self, config: Config, estimates: Estimates, tables: dict[str, Any]) -> None:
        """Write into the `tables` of the study file with the estimated numbers what follows from their errors."""


@dataclass(frozen=True)
class FileReference:
    """The name of a file in a study file: its full `key`, and the `table` or list in which it stands by `name` or
    number."""

    key: str
    table: Any
    name: str | int
    is_recording: bool = True
    """whether it is a recording, which has to be there"""


class StudyCapability:
    """A capability; each method has a default for a capability that has no such thing. The argument `plan` is what
    its method `plan` gave for the study."""

    name: ClassVar[str]
    """name of its entry point, and of its plan in `Config.plans`"""

    order: ClassVar[float] = math.inf
    """its place among the others: tables, results and sections come in ascending order, parts of the line from the
    motor to the machine"""

    tables: ClassVar[Mapping[str, FileSection]] = {}
    """its tables of the study file, by name"""

    def rules(self) -> Iterable[Rule]:
        """The rules of its keys that do not go together with others."""
        return ()

    def plan(self, reading: FileReading) -> Any:
        """The plan that its tables state; None where the file asks for nothing.

        Raises
        ------
        InputError
            for values that do not fit together.
        """
        return None

    def files(self, data: Mapping[str, Any]) -> Iterable[FileReference]:
        """The files that its tables of a study file name."""
        return ()

    def faults(self, config: Config) -> Iterable[InputError]:
        """Refusals of a plan that does not fit the rest of the study."""
        return ()

    def unused_values(self, machine: Machine, plan: Any) -> Iterable[str]:
        """Names of the values of its tables that have no meaning for that machine and plan."""
        return ()

    def not_with_foreign_motor(self, plan: Any) -> str:
        """The reason and the remedy where its plan needs a motor of this package; empty where it does not."""
        return ""

    def analyses(self) -> Iterable[type[Analysis]]:
        """Its analyses of a study."""
        return ()
