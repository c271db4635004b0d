"""The plan of a part of the line that slips: the values of its table, some of which follow from the motor and the
ratio of the drive."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Set
from dataclasses import dataclass, replace
from typing import Any, ClassVar

from ...core.errors import InputError, refusal_prefix
from ...core.model import Model
from ...core.quantities import Layout
from ...drives.nameplate import Nameplate
from .placed import PlacedPart


@dataclass(frozen=True)
class SlipPlan(ABC):
    """A part that slips."""

    table: Any
    """the values of its table"""
    keys: Set[str]
    """the keys that the file gives of those whose values follow from the drive"""

    name: ClassVar[str]
    """name of its table"""
    model: ClassVar[Model]
    decouples: ClassVar[bool] = False
    """see `PlacedPart`"""

    def share(self, ratio: float) -> float:
        """The part of the whole `ratio` of the drive that it has."""
        return 1.0

    def filled(self, table: Any, **values: float) -> Any:
        """The `table` with these `values` of the keys that the file leaves out."""
        return replace(table, **{key: x for key, x in values.items() if key not in self.keys})

    @abstractmethod
    def completed(self, table: Any, ratio: float) -> Any:
        """The `table` with its rated power and speed, and its `ratio`, with the other values that follow."""

    @abstractmethod
    def stall_torque(self, table: Any) -> float:
        """Largest torque that it takes from the motor's shaft while the machine stands [N m]."""

    def drag(self, table: Any) -> float:
        """Torque that it takes from the motor's shaft and does not pass on [N m]."""
        return 0.0

    def rated(self, plate: Nameplate | None) -> dict[str, float]:
        """Its rated power [W] and speed [rad/s]: from the file, or from the motor.

        Raises
        ------
        InputError
            where neither the file nor a nameplate gives one.
        """
        values = {}
        for key, unit in (("rated_power", "W"), ("rated_speed", "rad/s")):
            if key in self.keys:
                values[key] = getattr(self.table, key)
            elif plate is None:
                raise InputError(
                    f"{self.name}.{key}: is that of the motor's nameplate, and this one has none; give it in {unit}",
                    key=f"{self.name}.{key}",
                )
            else:
                values[key] = getattr(plate, key.removeprefix("rated_"))
        return values

    def slip_at(self, torque: float, plate: Nameplate | None) -> float:
        """The slip at a `torque` of the motor's shaft [N m], in proportion to it."""
        rated = self.rated(plate)
        return float(self.table.rated_slip * torque * rated["rated_speed"] / rated["rated_power"])

    def placed(self, plate: Nameplate | None, ratio: float) -> PlacedPart:
        """The part behind a motor with this nameplate, in a drive of this whole `ratio`.

        Raises
        ------
        InputError
            for values that do not fit together.
        """
        share = self.share(ratio)
        table = self.completed(replace(self.table, **self.rated(plate)), share)
        names = Layout(self.model.Parameters).names
        values = {name: x for name, x in Layout(type(table)).by_name(table).items() if name in names}
        p = self.model.parameter_layout.from_names(values)
        with refusal_prefix(f"{self.name}.", self.name):
            self.model.check(p)
        stall = self.stall_torque(table)
        return PlacedPart(
            self.name,
            self.model,
            p,
            share,
            p.J_driven,
            p.J_motor,
            table,
            slips=True,
            decouples=self.decouples,
            stall_torque=stall,
            drag=self.drag(table),
        )
