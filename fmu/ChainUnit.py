"""The FMU ChainUnit: ``pythonfmu build -f fmu/ChainUnit.py``, see README.md beside this file."""

from chainunit.fmu.slave import ModelSlave
from chainunit.machines import chain_unit


class ChainUnit(ModelSlave):
    model = chain_unit.ChamberForces.direct()
