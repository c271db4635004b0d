"""The cutting edge of a knife drive in motion."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ...core.planar import Link
from ...mechanism.machine import MachineState
from ...report.capability import Details, Supplement
from ...study.drive import Drive

ENDS = ("first end of the edge", "last end of the edge")


def edge(p: Any, links: Mapping[str, Link]) -> dict[str, tuple[Any, Any]]:
    """The places of the two ends of the edge [m]. The edge is drawn as long as the distance of the knife's pins."""
    ends = min(p.knife.d.x, p.knife.e.x), max(p.knife.d.x, p.knife.e.x)
    points = (links["knife"].beside(x, p.knife.blade.y).p for x in ends)
    return {name: (point.x, point.y) for name, point in zip(ENDS, points, strict=True)}


class EdgeMotion(Supplement):
    """Adds the cutting edge to the picture of a knife drive."""

    def __init__(self, drive: Drive) -> None:
        super().__init__(drive, links={"edge": ENDS}, names=dict.fromkeys(ENDS, ""))

    def details(self, part: Any, state: MachineState) -> Details:
        """The places of the ends of the edge."""
        return Details(edge(self.drive.machine.p, state.m.links))
