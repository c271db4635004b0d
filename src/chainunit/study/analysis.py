"""Analyses of a study: each is made where the system has the parts that it needs, and adds its findings to
the study.

An analysis of the base stands in `chainunit.study.analyses`, with its section of the page in
`chainunit.report.analyses`; all others belong to a capability.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from ..work.progress import TaskProgress
from .drive import Drive
from .record import Findings as Findings
from .record import StudyRecord
from .rig import Rig


def is_examined(part: str, findings: Mapping[str, Findings]) -> bool:
    """Whether one of the findings of a study examines that part of the line."""
    return any(entry.examines == part for entry in findings.values())


@dataclass(frozen=True)
class Work:
    """The means of an analysis: the rig, without FMUs before the runs; the function that reports progress; the folder
    of the study's files; the address of a Dask scheduler, if one is to make its runs; and the time of the steady
    state from which the events of the study branched [s]."""

    rig: Rig
    progress: TaskProgress
    folder: Path | None = None
    scheduler: str | None = None
    steady: float = 0.0


class Analysis(ABC):
    """An analysis. Its `name` is the name of its part of result.json and of its section on the page."""

    name: ClassVar[str]
    needs_runs: ClassVar[bool] = False
    """whether it comes after the runs of the study and uses the FMUs; otherwise it comes before any FMU is
    made"""
    at_end: ClassVar[bool] = False
    """whether it comes after all others, also where a run of the study has failed"""

    @staticmethod
    def applies(drive: Drive, plans: Mapping[str, Any]) -> bool:
        """Whether the system has the parts that the analysis needs, and the study asks for it by the `plans` of the
        capabilities; by default every study has it."""
        return True

    @staticmethod
    @abstractmethod
    def find(study: StudyRecord, work: Work) -> Findings | None:
        """Make the analysis.

        Raises
        ------
        InputError
            for values of the file with which the analysis cannot work, if it comes before the runs.
        RunError
            where a run of the analysis itself fails; the study keeps its other results.
        """
