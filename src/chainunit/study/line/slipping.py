"""Parts of the line that slip, as a study knows them: their table, their place, and their load in each run."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ...core.quantities import Layout
from ..analysis import Analysis
from ..arrays import Dataset
from ..conditions import given
from ..config import FileReading
from ..record import StudyRuns
from ..rules import Rule
from ..verdict import START, STEADY
from .part import PartOfLine
from .placed import PlacedPart
from .slip_plan import SlipPlan

_RIGID = ("driveline", "observer", "watch", "identify")
"""Tables whose models have no slip between them and the motor."""


class SlippingPart(PartOfLine):
    """A part that slips, with one table of its name. It is placed with the motor, as the ratio of the drive follows
    from its slip, and some of its values from the motor."""

    plan_type: ClassVar[type[SlipPlan]]
    analysis: ClassVar[type[Analysis]]

    def rules(self) -> Iterable[Rule]:
        """What takes the line for rigid, or for the shafts of the driveline alone."""
        for key in _RIGID:
            yield Rule(
                key,
                given(self.name),
                f"takes what is before it for rigid, and [{self.name}] slips; leave out one",
            )

    def plan(self, reading: FileReading) -> SlipPlan | None:
        """The plan of the table."""
        if self.name not in reading.data:
            return None
        keys = frozenset(reading.data[self.name]) & self.tables[self.name].follows.keys()
        return self.plan_type(reading.values[self.name], keys)

    def settled(self, tables: Mapping[str, Any], placed: PlacedPart) -> dict[str, Any]:
        """The values that follow from the motor and the ratio, written down."""
        values = Layout(type(placed.table)).by_name(placed.table)
        return {**tables, self.name: {**values, **tables[self.name]}}

    def analyses(self) -> Iterable[type[Analysis]]:
        """Its load in each run."""
        return (self.analysis,)


@dataclass(frozen=True)
class SlipRun:
    """A part of a run: its time [s], the speed of the shaft before the part and of the one behind it, both at the
    former [rad/s], the power that it turns into heat without that of a gear [W], and the other variables, all of
    shape (time,)."""

    time: Any
    speed: Any
    driven: Any
    heat: Any
    variables: Mapping[str, Any]

    @classmethod
    def read(cls, placed: PlacedPart, run: Dataset) -> SlipRun:
        """The variables of the part in a run."""
        prefix = f"{placed.name}."
        x = {str(name).removeprefix(prefix): run[name].values for name in run if str(name).startswith(prefix)}
        driven = placed.ratio * x["driven.w"]
        heat = x["dissipated_power"] - x["gear_loss"]
        return cls(run["time"].values, driven + x["slip"], driven, heat, x)

    @property
    def slip(self) -> Any:
        """Slip over the speed before the part, 0 while this is at rest."""
        return (self.speed - self.driven) / np.maximum(np.abs(self.speed), 1e-3)

    def mean(self, x: Any) -> float:
        """The mean of a variable over the time."""
        return self.sum(x) / max(float(self.time[-1] - self.time[0]), 1e-12)

    def sum(self, x: Any) -> float:
        """The integral of a variable over the time."""
        return float(np.trapezoid(x, self.time))


def parts_of_runs(runs: StudyRuns, placed: PlacedPart) -> Iterator[tuple[str, SlipRun]]:
    """Steady running, the start-up, and each event from its begin on, with their names."""
    for name, run in {STEADY: runs.steady, START: runs.rise, **runs.event_parts}.items():
        yield name, SlipRun.read(placed, run)
