"""The task of sizing: the machine that needs a motor, and the demands on it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from ...drives.catalogue_couplings import CatalogueCoupling
from ...drives.catalogue_gears import CatalogueGear
from ...machines.machine import Machine
from ...study.event import Event
from ...study.operation import DriveTables, OperatingConditions
from .gear_tables import with_gear
from .table import SizingPlan


@dataclass(frozen=True)
class SizingTask:
    """A machine in its operation, and the demands on a drive; the `tables` have gear and starter."""

    plan: SizingPlan
    tables: DriveTables
    machine: Machine
    operation: OperatingConditions
    events: Mapping[str, Event]
    """the events of the study, of which events that bring all feed to one side count"""
    gears: Sequence[CatalogueGear] = ()
    """the gears of catalogues, of which one is chosen; without them any gear of the plan's kind"""
    couplings: Sequence[CatalogueCoupling] = ()
    """the torque limiters of catalogues"""

    def of_gear(self, gear: CatalogueGear | None) -> SizingTask:
        """The task with a drive that has this gear, whose values stand in the `tables`."""
        return self if gear is None else replace(self, tables=with_gear(self.tables, gear))
