"""The FMU ChainUnit: ``pythonfmu build -f fmu/ChainUnit.py``, see README.md beside this file."""

from chainunit.fmu.slave import ModelSlave, hold
from chainunit.machines import chain_unit


@hold(globals())
class ChainUnit(ModelSlave):
    model = chain_unit.ChamberForces.direct()
    sizes = {"stop.stiffness": 100.0, "stop.damping": 5.0}  # a stop that blocks nothing
