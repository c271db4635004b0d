"""Kinds of plans of capabilities, which a study or another capability asks for."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .config import Config
    from .cycle import Cycle
    from .drive import Drive


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
