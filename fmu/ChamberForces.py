"""The FMU ChamberForces: ``pythonfmu build -f fmu/ChamberForces.py``, see README.md beside this file."""

from chainunit.fmu.slave import ModelSlave, hold
from chainunit.machines import chain_unit


@hold(globals())
class ChamberForces(ModelSlave):
    model = chain_unit.ChamberForces
    sizes = {"stop.stiffness": 100.0, "stop.damping": 5.0}  # a stop that blocks nothing
