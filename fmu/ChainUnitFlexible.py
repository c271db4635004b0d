"""The FMU ChainUnitFlexible: ``pythonfmu build -f fmu/ChainUnitFlexible.py``, see README.md beside this file."""

from chainunit.fmu.slave import ModelSlave, hold
from chainunit.machines import flexible


@hold(globals())
class ChainUnitFlexible(ModelSlave):
    model = flexible.flexible(6, 2)  # rods of each wall, of each web
    sizes = {"stop.stiffness": 100.0, "stop.damping": 5.0}  # a stop that blocks nothing
