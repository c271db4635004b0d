"""What the picture of one kind of machine has beside the links, pins and reactions of any linkage."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from ..mechanism.machine import MachineState
from ..study.record import StudyRecord
from .lines import Line
from .motion import Arrow


@dataclass(frozen=True)
class Details:
    """What a run has beside: places of joints [m], arrows, and by link how heavily it is loaded."""

    joints: Mapping[str, tuple[Any, Any]] = field(default_factory=dict)
    arrows: tuple[Arrow, ...] = ()
    loads: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Supplement:
    """What the pictures of all runs have beside; of most machines it is nothing."""

    study: StudyRecord
    caption: Line = ()
    links: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """joints of the links that are drawn otherwise, or beside those of the linkage"""
    looks: Mapping[str, str] = field(default_factory=dict)
    names: Mapping[str, str] = field(default_factory=dict)
    """names of joints, where they are not those of the linkage"""
    groups: Mapping[str, str] = field(default_factory=dict)
    """by output, the group of its reaction: each has a colour"""
    hidden: tuple[str, ...] = ()
    """outputs whose reactions would hide others"""

    def details(self, part: Any, state: MachineState) -> Details:
        """Of some instants of a run, and the machine at these."""
        return Details()
