"""Given values of a study as a report cites them in several sections."""

from __future__ import annotations

from typing import Any

from ..drives.catalogue import CatalogueMotor
from ..study.record import StudyRecord
from ..study.result import MotorRating
from ..study.sections import Run
from .cited import cited, exact
from .lines import Number


def run_settings(study: StudyRecord) -> Run:
    """The cited values of the table [run]."""
    return cited(study.config.run, "given.run")


def asked_speed(study: StudyRecord) -> Number:
    """The speed of the driver that the study asks for."""
    return exact(run_settings(study).crank_speed, 4)


def ratio(study: StudyRecord) -> Any:
    """The cited ratio between motor and driver."""
    return cited(study.drive.machine.p, "given.machine").ratio


def rating(plate: CatalogueMotor) -> MotorRating:
    """The cited rating of the motor of a study with this nameplate."""
    return cited(MotorRating.of(plate), "given.motor")


def motor_title(study: StudyRecord) -> str:
    """The cited title of the motor."""
    return cited(study.motor_title, "given.motor.title")
