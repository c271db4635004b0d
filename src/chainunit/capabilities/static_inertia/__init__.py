"""What a static inertia gets wrong: the RMS torque over a turn, by a calculation with the inertia as one number."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from ...core.quantities import quantity
from ...mechanism.models import InverseMachine
from ...reading.results import result
from ...report.blocks import Text
from ...report.capability import AnswerBlocks, Capability
from ...report.cited import cited, number
from ...report.lines import filled
from ...study.analysis import Analysis, Findings, Work
from ...study.config import FileReading
from ...study.drive import Drive
from ...study.record import StudyRecord
from ...study.rules import motor_is_chosen

_ALIKE = 0.02
"""Relative deviation up to which the two are alike."""


@result
class StaticInertiaFindings(Findings):
    """RMS torque at the crank over a turn at constant speed."""

    machine: float = quantity("N.m", "RMS torque over a turn at constant speed")
    static: float = quantity("N.m", "the same with the inertia as one number")


class StaticInertiaAnalysis(Analysis):
    """Both torques, if the study chooses the motor of a machine whose inertia belongs to its angle."""

    name = "static_inertia"

    @staticmethod
    def applies(drive: Drive, plans: Mapping[str, Any]) -> bool:
        """Whether the motor is chosen, and the machine has turns and an inertia of its angle alone."""
        machine, model = drive.machine, drive.machine.model
        has_inertia = isinstance(model, InverseMachine) and model.States is None and model.turns
        is_whole = machine.simulated is machine and not drive.foreign_titles
        return bool(plans["static_inertia"]) and has_inertia and is_whole

    @staticmethod
    def find(study: StudyRecord, work: Work) -> StaticInertiaFindings:
        """The torque of the turn with and without the term J'(phi) w^2/2 of the inertia: at constant speed one number
        J has no part in the torque."""
        turn = study.setup.statics.normal
        speed = turn.crank_speed * turn.ratio
        inertial = 0.5 * turn.outputs.dJ_dphi * speed * speed * turn.ratio
        return StaticInertiaFindings(_rms(turn.crank_torque), _rms(turn.crank_torque - inertial))


def _rms(values: Any) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


class StaticInertiaCapability(Capability):
    """The capability; it comes with each choice of a motor."""

    name = "static_inertia"
    order = 30

    def plan(self, reading: FileReading) -> bool:
        """Whether the study chooses the motor."""
        return motor_is_chosen().holds(reading.data)

    def analyses(self) -> Iterable[type[Analysis]]:
        """Both torques."""
        return (StaticInertiaAnalysis,)

    def answer(self, study: StudyRecord) -> AnswerBlocks:
        """A line if they differ."""
        findings = StaticInertiaFindings.found_in(study.findings)
        if findings is None or abs(findings.static - findings.machine) <= _ALIKE * findings.machine:
            return AnswerBlocks()
        x = cited(findings, "findings.static_inertia")
        sentence = (
            f"A constant-inertia calculation takes RMS {{}} instead of {{}} at the {study.setup.driver_noun}."
        )
        return AnswerBlocks(end=[Text(filled(sentence, number(x.static), number(x.machine)))])


CAPABILITY = StaticInertiaCapability()
