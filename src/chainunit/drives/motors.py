"""The types of motor that a study may name. A new type is a module with its `Motor` class, and a line here."""

from __future__ import annotations

from .dc_motor import DcMotor
from .induction_motor import InductionMotor
from .motor import Motor

MOTORS: dict[str, type[Motor]] = {motor.name: motor for motor in (DcMotor, InductionMotor)}
