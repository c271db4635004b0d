"""Additions of a kind of machine to the picture of a linkage, which has links, pins and reactions alone."""

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
    """Additions to a run: places of further joints [m], arrows, and the load on each link."""

    joints: Mapping[str, tuple[Any, Any]] = field(default_factory=dict)
    arrows: tuple[Arrow, ...] = ()
    loads: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Supplement:
    """Additions to the pictures of all runs; most machines have none."""

    study: StudyRecord
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
