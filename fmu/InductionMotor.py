"""The FMU InductionMotor: ``pythonfmu build -f fmu/InductionMotor.py``, see README.md beside this file."""

from chainunit.drives import induction_motor
from chainunit.fmu.slave import ModelSlave, hold


@hold(globals())
class InductionMotor(ModelSlave):
    model = induction_motor.InductionMotor
    # the flux at switching on turns at the supply's frequency and hardly decays
    experiment = {"step": 5e-5, "stop": 2.0}
