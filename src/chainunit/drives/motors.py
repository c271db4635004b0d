"""The types of motor that a study may name: a new one is a module with its `Motor` class, and a line here."""

from __future__ import annotations

from typing import Any

from .dc_motor import DcMotor
from .induction_motor import InductionMotor
from .motor import Motor

MOTORS: dict[str, type[Motor]] = {motor.name: motor for motor in (DcMotor, InductionMotor)}


def motor_of(parameters: Any) -> type[Motor]:
    """The type of motor to which the `parameters` belong."""
    return next(motor for motor in MOTORS.values() if isinstance(parameters, motor.Parameters))
