"""Capabilities, as a report knows them: a question, its section, and its answer."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol, Self

from ..mechanism.machine import MachineState
from ..study.capability import StudyCapability
from ..study.config import Config
from ..study.drive import Drive
from ..study.record import StudyRecord
from ..study.registry import capabilities as registered
from ..work.progress import TaskProgress
from .blocks import Block
from .lines import Line
from .motion import Arrow
from .reported_result import ReportedResult


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
    on_sheet: bool = False
    """whether it belongs on the sheet of a study, not in the annex alone"""


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


@dataclass(frozen=True)
class Details:
    """Additions to a run: places of further joints [m], arrows, and the load on each link."""

    joints: Mapping[str, tuple[Any, Any]] = field(default_factory=dict)
    arrows: tuple[Arrow, ...] = ()
    loads: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Supplement:
    """Additions to the pictures of all runs; most machines have none."""

    drive: Drive
    caption: Line = ()
    links: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """the joints of links that are drawn otherwise, or in addition to the links of the linkage"""
    looks: Mapping[str, str] = field(default_factory=dict)
    names: Mapping[str, str] = field(default_factory=dict)
    """the labels of joints that differ from the names in the linkage"""
    groups: Mapping[str, str] = field(default_factory=dict)
    """the group of the reaction of each output; each group has a colour"""
    hidden: tuple[str, ...] = ()
    """outputs whose reactions are not drawn, as they would hide others"""

    def details(self, part: Any, state: MachineState) -> Details:
        """The additions to a run; `part` has the samples of the run that are drawn, `state` the machine at these."""
        return Details()


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

    def unchecked(self, study: StudyRecord) -> Iterator[Line]:
        """What the study could have checked by this capability and did not."""
        return iter(())

    def supplement(self, drive: Drive) -> Supplement | None:
        """Its additions to the machine in motion."""
        return None


def capabilities() -> tuple[Capability, ...]:
    """The registered capabilities."""
    return registered()
