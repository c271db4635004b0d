"""The blade of a knife drive: its path, and the work of a cut."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from ...report.capability import Capability, Contents, Supplement
from ...study.analysis import Analysis
from ...study.drive import Drive


class BladeCapability(Capability):
    """The capability; it has no table, and comes with every machine that cuts."""

    name = "blade"
    order = 60

    def analyses(self) -> Iterable[type[Analysis]]:
        """The turn with the cut."""
        from .analysis import BladeAnalysis

        return (BladeAnalysis,)

    def contents(self) -> Mapping[str, Contents]:
        """Numbers and path."""
        from . import page

        return {"blade": Contents("The blade", page.blocks, (page.PICTURE,))}

    def supplement(self, drive: Drive) -> Supplement | None:
        """The edge in motion."""
        from .motion import EdgeMotion

        return EdgeMotion(drive) if drive.machine.model.cuts else None


CAPABILITY = BladeCapability()
