"""The cutting edge of a knife drive in motion."""

from __future__ import annotations

from typing import Any

from ..mechanism.machine import MachineState
from ..study.study import Study
from .supplement import Details, Supplement

_ENDS = ("first end of the edge", "last end of the edge")


class EdgeMotion(Supplement):
    """The edge is drawn as long as the knife's pins lie apart."""

    def __init__(self, study: Study) -> None:
        super().__init__(study, links={"edge": _ENDS}, names=dict.fromkeys(_ENDS, ""))

    def details(self, part: Any, state: MachineState) -> Details:
        """Where the edge ends."""
        knife = self.study.drive.machine.p.knife
        ends = min(knife.d.x, knife.e.x), max(knife.d.x, knife.e.x)
        points = (state.m.links["knife"].beside(x, knife.blade.y).p for x in ends)
        return Details({name: (point.x, point.y) for name, point in zip(_ENDS, points, strict=True)})
