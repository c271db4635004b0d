"""The analyses of a study, in the order in which they are made: the base, then the capabilities.
Two short ones of the base stand here: the ripple without feed-forward, and the loss of the gear."""

from __future__ import annotations

from functools import cache

import numpy as np

from ..core.quantities import Value, declaration, percentage, quantity
from ..reading.results import part, result
from .analysis import Analysis, Findings, Work
from .measures import read_measure
from .readings import gear_drag, gear_loss, shaft_power
from .record import StudyRecord
from .registry import registered
from .remark import note
from .starts import StartAnalysis
from .turn import TurnAnalysis
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
            ripple = study.runs.answers[STEADY].speed_ripple
            study.findings.say(_RIPPLE, STEADY, without=self.ripple, speed_ripple=ripple)


_RIPPLE = note(
    "feed-forward",
    "Feed-forward of the machine's torque brings the ripple of the speed from {without} to {speed_ripple}.",
    sizes={("1", "percent"): "without speed_ripple"},
)


class FeedForwardAnalysis(Analysis):
    """Start-up and steady running once more, without feed-forward."""

    name = "ripple_without_feed_forward"
    needs_runs = True
    applies = staticmethod(lambda drive, plans: drive.feed_forward)

    @staticmethod
    def find(study: StudyRecord, work: Work) -> RippleWithout:
        """The fluctuation over the steady turns."""
        with work.rig.plain.from_rest() as simulation:
            run = simulation.run(work.steady, work.rig.step).sel(time=slice(study.runs.steady_begin, None))
        turns = whole_turns(study.setup.drive, run, study.setup.config.run.turns)
        return RippleWithout(read_measure("speed_ripple", study.runs.window(Phase.STEADY, turns)))


SWINGS = 1.5
"""Mean of |power| over the net power of the machine, above which the remark tells of the energy that swings."""


@declaration
class GearLoss:
    """The mean loss of the gear in steady running. The loss by load is that of its efficiency, taken of the power
    that passes in either direction; the loss without load is that of its drag `gear.d`. It is that of the warm motor
    if an analysis has run that, else that of the run of the study."""

    whole: Value = quantity("W", "whole loss")
    by_load: Value = quantity("W", "loss by load")
    without_load: Value = quantity("W", "loss without load")
    net_power: Value = quantity("W", "mean power that the machine takes")
    passed_power: Value = quantity("W", "mean of |power| that passes to and fro")
    share: Value = percentage("whole loss over the mean power that the machine takes")


@result
class GearFindings(Findings):
    """The loss of the gear, and its efficiency while the motor drives."""

    loss: GearLoss = part(inline=True)
    efficiency: float

    def remark(self, study: StudyRecord) -> None:
        """The loss beside the power of the machine, and its parts."""
        loss = self.loss
        noun = study.setup.drive.transmission
        study.findings.say(
            _LOSS,
            STEADY,
            gear=f"{noun} {'take' if ' and ' in noun else 'takes'}",
            total=loss.whole,
            share=loss.share,
            net_power=loss.net_power,
            by_load=loss.by_load,
            efficiency=self.efficiency,
            without_load=loss.without_load,
            passed_power=loss.passed_power if loss.passed_power > SWINGS * loss.net_power else None,
        )


_LOSS = note(
    "gear-loss",
    "The {gear} {total} in steady running. This is {share} of the {net_power} that the machine takes in the mean. "
    "The machine swings energy to and fro, {passed_power} in the mean of both ways, and each way costs its share.",
    sizes={
        "W": "total net_power passed_power",
        ("1", "percent"): "share",
        ("W", "", 3, "loss by load"): "by_load",
        ("1", "percent", 3, "efficiency under load"): "efficiency",
        ("W", "", 3, "loss without load (gear.d)"): "without_load",
    },
)


class GearAnalysis(Analysis):
    """The loss of the gear, where the study knows one."""

    name = "gear_loss"
    needs_runs, at_end = True, True
    applies = staticmethod(lambda drive, plans: drive.gear.d > 0.0 or drive.gear.loss > 0.0)

    @staticmethod
    def find(study: StudyRecord, work: Work) -> GearFindings | None:
        """The loss in the steady turns; None without them, and where no mean power of them stands for running
        that lasts."""
        if STEADY not in study.runs.answers:
            return None
        window = study.runs.window(Phase.STEADY, study.runs.steady)
        losses = (findings.gear_loss for findings in study.findings.by_analysis.values())
        warm = [loss for loss in losses if loss is not None]
        total, net = warm[0] if warm else window.mean(gear_loss), study.runs.answers[STEADY].power_mean
        if net is None:
            return None
        without_load = min(total, window.mean(gear_drag))
        return GearFindings(
            GearLoss(
                whole=total,
                by_load=total - without_load,
                without_load=without_load,
                net_power=net,
                passed_power=window.mean(lambda drive, run: np.abs(shaft_power(drive, run))),
                share=total / net if net > 0.0 else None,
            ),
            1.0 / (1.0 + study.setup.drive.gear.loss),
        )


ANALYSES: tuple[type[Analysis], ...] = (TurnAnalysis, GearAnalysis, FeedForwardAnalysis, StartAnalysis)


@cache
def all_analyses() -> tuple[type[Analysis], ...]:
    """The analyses of the base and of all capabilities."""
    return (*ANALYSES, *(analysis for part in registered() for analysis in part.analyses()))
