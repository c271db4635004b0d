"""Capabilities, as a report knows them: a question, its section, and its answer."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Protocol, Self

from ..study.capability import StudyCapability
from ..study.config import Config
from ..study.record import StudyRecord
from ..study.registry import capabilities as registered
from ..work.progress import TaskProgress
from .blocks import Block
from .lines import Line
from .reported_result import ReportedResult
from .supplement import Supplement


@dataclass(frozen=True)
class Contents:
    """The contents of a section: its heading, its blocks (tables, text, figures), the files of its figures, and its
    place."""

    heading: str
    blocks: Callable[[StudyRecord], Iterator[Block]]
    pictures: tuple[str, ...] = ()
    analysis: str = ""
    """name of its analysis, if the section has another name"""
    before: str = ""
    """section of the base before which it stands; empty for one behind the turn at constant speed"""


@dataclass(frozen=True)
class AnswerBlocks:
    """The part of a capability in the answer of a study: its blocks, by their place."""

    head: Iterable[Block] = ()
    """before the verdicts on model and motor"""
    judgements: Iterable[Block] = ()
    """after these verdicts"""
    end: Iterable[Block] = ()
    """after the numbers of the drive"""
    warnings: Iterable[Block] = ()
    """beside the warnings of the study"""
    validity: Iterable[Block] = ()
    """on the sheet, at the head of basis and validity"""


class AnyStudy(Protocol):
    """A study from Python, `chainunit.Study`, as a capability knows it."""

    config: Config

    def run(self, *, progress: TaskProgress | None = None) -> ReportedResult[Any, Any]:
        """The result of the study."""

    def of_tables(self, tables: dict[str, Any], source: str) -> Self:
        """A study of the same kind with other `tables` of a study file; paths in them are relative to `source`."""


class Capability(StudyCapability):
    """A capability with what it shows: the base of the one that each folder of `chainunit.capabilities` has by the
    name ``CAPABILITY``."""

    def contents(self) -> Mapping[str, Contents]:
        """The sections of a study's report on its findings, by name: that of the analysis."""
        return {}

    def answer(self, study: StudyRecord) -> AnswerBlocks:
        """Its part of the answer of a study."""
        return AnswerBlocks()

    def on_sheet(self) -> tuple[str, ...]:
        """Names of its sections that belong on the sheet of a study, not in the annex alone."""
        return ()

    def unchecked(self, study: StudyRecord) -> Iterator[Line]:
        """What the study could have checked by this capability and did not."""
        return iter(())

    def supplement(self, study: StudyRecord) -> Supplement | None:
        """Its additions to the machine in motion."""
        return None


def capabilities() -> tuple[Capability, ...]:
    """The registered capabilities."""
    return registered()
