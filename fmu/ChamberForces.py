"""The FMU ChamberForces: ``pythonfmu build -f fmu/ChamberForces.py``, see README.md beside this file."""

from chainunit.fmu.slave import ModelSlave
from chainunit.machines import chain_unit


class ChamberForces(ModelSlave):
    model = chain_unit.ChamberForces
