"""The fluctuation of the speed that a drive with feed-forward would have without it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..reading.results import part, result
from .analysis import Analysis, Findings, Work
from .drive import Drive
from .measures import read_measure
from .record import StudyRecord
from .remark import note
from .verdict import STEADY
from .window import Phase, whole_turns


@result
class RippleWithout(Findings):
    """The fluctuation of the speed in steady running without feed-forward; None where the crank makes no turn."""

    ripple: float | None = part(
        "ripple of the speed in steady running", unit="1", kind="percent", inline=True
    )

    def remark(self, study: StudyRecord) -> None:
        """The fluctuation with feed-forward beside it."""
        if self.ripple is not None:
            study.say(_RIPPLE, STEADY, without=self.ripple, speed_ripple=study.answers[STEADY].speed_ripple)


_RIPPLE = note(
    "feed-forward",
    "Feed-forward of the machine's torque brings the ripple of the speed from {without} to {speed_ripple}.",
    sizes={("1", "percent"): "without speed_ripple"},
)


class FeedForwardAnalysis(Analysis):
    """Start-up and steady running once more, without feed-forward."""

    name = "ripple_without_feed_forward"
    needs_runs = True

    @staticmethod
    def applies(drive: Drive, plans: Mapping[str, Any]) -> bool:
        """Whether the control has feed-forward."""
        return drive.feed_forward

    @staticmethod
    def find(study: StudyRecord, work: Work) -> RippleWithout:
        """The fluctuation over the steady turns."""
        with work.rig.plain.from_rest() as simulation:
            run = simulation.run(work.steady, work.rig.step).sel(time=slice(study.steady_begin, None))
        turns = whole_turns(study.drive, run, study.config.run.turns)
        return RippleWithout(read_measure("speed_ripple", study.window(Phase.STEADY, turns)))
