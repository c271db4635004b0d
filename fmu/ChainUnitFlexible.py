"""The FMU ChainUnitFlexible: ``pythonfmu build -f fmu/ChainUnitFlexible.py``, see README.md beside this file."""

from chainunit.fmu.slave import ModelSlave
from chainunit.machines import flexible


class ChainUnitFlexible(ModelSlave):
    model = flexible.flexible(6, 2)  # rods of each wall, of each web
