"""The task of sizing: the machine that needs a motor, and the demands on it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ...machines.machine import Machine
from ...study.drive_tables import DriveTables
from ...study.event import Event
from ...study.operation import OperatingConditions
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
