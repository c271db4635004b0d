"""The FMU DcMotor: ``pythonfmu build -f fmu/DcMotor.py``, see README.md beside this file."""

from chainunit.drives import dc_motor
from chainunit.fmu.slave import ModelSlave


class DcMotor(ModelSlave):
    model = dc_motor.DcMotor
