"""Parts of the line, as a study knows them: each has a table of the study file and a component of the system."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from ...core.model import Model
from ..capability import StudyCapability
from ..cycle import Cycle
from ..drive import Drive
from ..record import StudyRecord
from .placed import PlacedPart


class PartOfLine(StudyCapability):
    """A part between motor and machine: the base of the one that each module of `chainunit.study.line` has by the
    name ``PART``. Beside a component it may have what a capability has: rules, checks, analyses."""

    model: ClassVar[Model]
    """its model, which becomes an FMU; with the terminals `driven` and `machine` on the side of the machine"""

    def placed(self, plan: Any, drive: Drive, turn: Cycle) -> PlacedPart | None:
        """The part of a study behind the parts that the `drive` has already, by its `plan`; None where the study has
        none. `turn` is that of the machine in normal running."""
        return None

    def settled(self, tables: Mapping[str, Any], placed: PlacedPart) -> dict[str, Any]:
        """The tables of a study file with the numbers of the part that follow from the machine written down: with
        another machine the part stays as it is."""
        return dict(tables)

    def remark(self, study: StudyRecord) -> None:
        """Add to the study the remarks on the part."""
