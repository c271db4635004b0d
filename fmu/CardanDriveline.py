"""The FMU CardanDriveline: ``pythonfmu build -f fmu/CardanDriveline.py``, see README.md beside this file."""

from chainunit.drives import driveline
from chainunit.fmu.slave import ModelSlave, hold


@hold(globals())
class CardanDriveline(ModelSlave):
    model = driveline.CardanDriveline
    # without damping the explicit Euler method raises any swing: this step by a tenth at most until the stop
    experiment = {"step": 2e-5, "stop": 1.0}
