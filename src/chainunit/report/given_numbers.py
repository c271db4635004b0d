"""Given values of a study as a report cites them in several sections."""

from __future__ import annotations

from typing import Any

from ..drives.catalogue import CatalogueMotor
from ..study.record import StudySetup
from ..study.result import MotorRating
from ..study.sections import Run
from .cited import cited, exact
from .lines import Number


def run_settings(setup: StudySetup) -> Run:
    """The cited values of the table [run]."""
    return cited(setup.config.run, "given.run")


def asked_speed(setup: StudySetup) -> Number:
    """The speed of the driver that the study asks for."""
    return exact(run_settings(setup).crank_speed, 4)


def ratio(setup: StudySetup) -> Any:
    """The cited ratio between motor and driver."""
    return cited(setup.drive.machine.p, "given.machine").ratio


def rating(plate: CatalogueMotor) -> MotorRating:
    """The cited rating of the motor of a study with this nameplate."""
    return cited(MotorRating.of(plate), "given.motor")


def motor_title(setup: StudySetup) -> str:
    """The cited title of the motor."""
    return cited(setup.motor_title, "given.motor.title")
