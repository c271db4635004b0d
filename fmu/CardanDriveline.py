"""The FMU CardanDriveline: ``pythonfmu build -f fmu/CardanDriveline.py``, see README.md beside this file."""

from chainunit.drives import driveline
from chainunit.fmu.slave import ModelSlave


class CardanDriveline(ModelSlave):
    model = driveline.CardanDriveline
