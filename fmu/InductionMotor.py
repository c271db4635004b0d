"""The FMU InductionMotor: ``pythonfmu build -f fmu/InductionMotor.py``, see README.md beside this file."""

from chainunit.drives import induction_motor
from chainunit.fmu.slave import ModelSlave


class InductionMotor(ModelSlave):
    model = induction_motor.InductionMotor
