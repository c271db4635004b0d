"""Models of the organs of a chain unit in the runs of a study: two bars each, or another model by its entry point of
the group ``chainunit.organs``. The key `organ` of a study file names one; turns without a run have two bars."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from ..fmu.backends import Backend
from ..machines.machine import Machine
from . import verdict
from .conditions import Condition, is_one_of
from .cycle import Cycle
from .organ_limits import has_empty_side, slack_and_mode
from .record import StudyRecord
from .registry import organ_models
from .verdict import Verdict

USUAL = "two-bar"


@dataclass(frozen=True)
class ConstantSpeed:
    """Turns of a machine at a `crank_speed` [rad/s] with each of the `feeds`, and the same turns with organs of two
    bars."""

    machine: Machine
    crank_speed: float
    feeds: Sequence[Any]
    two_bars: Sequence[Cycle]


class OrganModel(ABC):
    """A model of the organs."""

    name: ClassVar[str]
    """its name in a study file"""
    title: ClassVar[str]
    """what an organ is, for the reference of the key"""
    phrase: ClassVar[str]
    """what the organs are, in a sentence"""
    order: ClassVar[float] = math.inf

    @property
    def is_chosen(self) -> Condition:
        """Whether a study file names it."""
        return is_one_of("organ", self.name)

    @property
    def without_turn(self) -> str:
        """The reason why runs with it have no quantities of a turn, and the remedy."""
        return f'quantities of a turn are of organs with two bars; leave out organ = "{self.name}"'

    @abstractmethod
    def machine(self, machine: Machine, tables: Mapping[str, Any]) -> Machine:
        """The machine with these organs in its runs, by the values of the `tables` of the study file."""

    @abstractmethod
    def turns(
        self, turns: ConstantSpeed, tables: Mapping[str, Any], folder: Path, backend: Backend | None
    ) -> Sequence[Cycle]:
        """The turns with these organs, one for each feed. An FMU that has to be run for them is written to
        `folder`."""

    @abstractmethod
    def verdict(
        self, study: StudyRecord, speed: float, actual: float, residuals: Mapping[str, float]
    ) -> Verdict:
        """The verdict on the model; judged at a `speed` of the crank, which has the `actual` one in the runs
        [rad/s]; `residuals` are by run, over the energy moved."""

    @abstractmethod
    def remark(self, study: StudyRecord) -> None:
        """Add to the study the remarks on the organs."""


class TwoBars(OrganModel):
    """Two rigid bars each, the model of the papers."""

    name, title, phrase, order = USUAL, "two rigid bars each", "organs are two bars each", 0

    def machine(self, machine: Machine, tables: Mapping[str, Any]) -> Machine:
        """The machine as it is."""
        return machine

    def turns(
        self, turns: ConstantSpeed, tables: Mapping[str, Any], folder: Path, backend: Backend | None
    ) -> Sequence[Cycle]:
        """Those of two bars."""
        return turns.two_bars

    def verdict(
        self, study: StudyRecord, speed: float, actual: float, residuals: Mapping[str, float]
    ) -> Verdict:
        """See `chainunit.study.verdict.two_bars`."""
        config = study.setup.config
        empty = {name for name in study.runs.overloads if config.events[name].empties}
        slack_speed, resonance = slack_and_mode(study.setup.drive.chain_unit, config.feed)
        end = ", without machine.width" if config.machine.model.layers else ""
        return verdict.two_bars(
            speed,
            resonance,
            slack_speed,
            study.runs.pulls,
            residuals,
            empty={""} if has_empty_side(config.feed) else empty,
            actual=actual,
            finer="; ".join(f'take organ = "{other.name}"{end}' for other in finer_models()),
        )

    def remark(self, study: StudyRecord) -> None:
        """None beside the verdict."""


TWO_BARS = TwoBars()


def finer_models() -> list[OrganModel]:
    """The models beside two bars."""
    return [model for model in organ_models().values() if model.name != USUAL]
