"""One side against both: what the organs of a chain unit ask of its drive, and up to which speed two bars stand for
them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from ...report.capability import AnswerBlocks, Capability, Contents, Supplement
from ...study.analysis import Analysis
from ...study.drive import Drive
from ...study.record import StudyRecord


class SidesCapability(Capability):
    """The capability; it has no table, and comes with every machine that has organs on its sides."""

    name = "sides"
    order = 50

    def analyses(self) -> Iterable[type[Analysis]]:
        """Overload factors, and the torques over the speed."""
        from .analysis import OrganAnalysis

        return (OrganAnalysis,)

    def contents(self) -> Mapping[str, Contents]:
        """Factors, limits and figure."""
        from . import page

        return {"organs": Contents("One side against both", page.blocks, page.PICTURES.files)}

    def answer(self, study: StudyRecord) -> AnswerBlocks:
        """The crank speed up to which two bars stand for chains."""
        from . import page

        return AnswerBlocks(validity=page.up_to_speed(study.findings))

    def supplement(self, drive: Drive) -> Supplement | None:
        """The organs in motion."""
        from .motion import organ_motion

        return organ_motion(drive) if drive.machine.model.sides else None


CAPABILITY = SidesCapability()
