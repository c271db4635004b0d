"""Analyses of a study: each is made where the system has what it needs, and adds what it finds to the study.

A new one is a module with a subclass of `Analysis` and a line in `chainunit.study.analyses`; its section on the page
is a function of the same name in `chainunit.report.analyses`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any, ClassVar

from ..progress import Report

if TYPE_CHECKING:
    from .config import Config
    from .drive import Drive
    from .record import StudyRecord
    from .rig import Rig


class Findings(ABC):
    """What an analysis found."""

    @abstractmethod
    def as_dict(self) -> dict[str, Any]:
        """Ready for JSON, each number with its unit: the part of the result that has the name of the analysis."""

    @abstractmethod
    def remark(self, study: StudyRecord) -> None:
        """Add to the study what the reader has to know beside the numbers."""


class Analysis(ABC):
    """An analysis by its `name`: that of its part of result.json and of its section on the page."""

    name: ClassVar[str]
    needs_runs: ClassVar[bool] = False
    """whether it follows the runs of the study and has the FMUs; else it comes before all FMUs"""

    @staticmethod
    def applies(config: Config, drive: Drive) -> bool:
        """Whether the system has what it needs; every system does where an analysis does not say."""
        return True

    @staticmethod
    @abstractmethod
    def find(study: StudyRecord, rig: Rig, report: Report) -> Findings | None:
        """Make it; before the runs the rig has no FMUs.

        Raises
        ------
        InputError
            for values of the file that it cannot work with, where it comes before the runs.
        RunError
            where a run of its own fails: the study keeps what it has.
        """
