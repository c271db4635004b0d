"""Analyses of a study: each is made where the system has the parts that it needs, and adds its findings to
the study.

A new analysis is a module with a subclass of `Analysis` and a line in `chainunit.study.analyses`; its section
on the page
is a function of the same name in `chainunit.report.analyses`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any, ClassVar

from ..work.progress import Report

if TYPE_CHECKING:
    from .config import Config
    from .drive import Drive
    from .record import StudyRecord
    from .rig import Rig


class Findings(ABC):
    """What an analysis found."""

    @abstractmethod
    def as_dict(self) -> dict[str, Any]:
        """The findings ready for JSON, each number with its unit: the part of the result under the name of
        the analysis."""

    @abstractmethod
    def remark(self, study: StudyRecord) -> None:
        """Add to the study the remarks that the reader needs beside the numbers."""


class Analysis(ABC):
    """An analysis. Its `name` is the name of its part of result.json and of its section on the page."""

    name: ClassVar[str]
    needs_runs: ClassVar[bool] = False
    """whether it comes after the runs of the study and uses the FMUs; otherwise it comes before any FMU is
    made"""

    @staticmethod
    def applies(config: Config, drive: Drive) -> bool:
        """Whether the system has the parts that the analysis needs; by default every system has them."""
        return True

    @staticmethod
    @abstractmethod
    def find(study: StudyRecord, rig: Rig, report: Report) -> Findings | None:
        """Make the analysis; before the runs the rig has no FMUs.

        Raises
        ------
        InputError
            for values of the file with which the analysis cannot work, if it comes before the runs.
        RunError
            where a run of the analysis itself fails; the study keeps its other results.
        """
