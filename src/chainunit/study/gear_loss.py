"""The loss of the gear of a catalogue motor in steady running, beside the power that the machine takes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..core.quantities import Value, declaration, quantity
from ..reading.results import part, result
from .analysis import Analysis, Findings, Work
from .drive import Drive
from .readings import gear_loss, shaft_power
from .record import StudyRecord
from .remark import note
from .verdict import STEADY
from .window import Phase

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
    share: Value = quantity("1", "whole loss over the mean power that the machine takes", kind="percent")


@result
class GearFindings(Findings):
    """The loss of the gear, and its efficiency while the motor drives."""

    loss: GearLoss = part(inline=True)
    efficiency: float

    def remark(self, study: StudyRecord) -> None:
        """The loss beside the power of the machine, and its parts."""
        loss = self.loss
        noun = study.drive.transmission
        study.say(
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

    @staticmethod
    def applies(drive: Drive, plans: Mapping[str, Any]) -> bool:
        """Whether the drive has a gear with a loss."""
        return drive.gear_friction > 0.0 or drive.gear_loss > 0.0

    @staticmethod
    def find(study: StudyRecord, work: Work) -> GearFindings | None:
        """The loss in the steady turns; None without them, and where no mean power of them stands for running
        that lasts."""
        if STEADY not in study.answers:
            return None
        window = study.window(Phase.STEADY, study.steady)
        squared = window.mean(lambda drive, run: run[drive.motor_speed].values ** 2)
        warm = [findings.gear_loss for findings in study.findings.values() if findings.gear_loss is not None]
        total, net = warm[0] if warm else window.mean(gear_loss), study.answers[STEADY].power_mean
        if net is None:
            return None
        without_load = min(total, study.drive.gear_friction * squared)
        return GearFindings(
            GearLoss(
                whole=total,
                by_load=total - without_load,
                without_load=without_load,
                net_power=net,
                passed_power=window.mean(lambda drive, run: np.abs(shaft_power(drive, run))),
                share=total / net if net > 0.0 else None,
            ),
            1.0 / (1.0 + study.drive.gear_loss),
        )
