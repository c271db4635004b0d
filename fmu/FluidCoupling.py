"""The FMU FluidCoupling: ``pythonfmu build -f fmu/FluidCoupling.py``, see README.md beside this file."""

from chainunit.drives import fluid_coupling
from chainunit.fmu.slave import ModelSlave


class FluidCoupling(ModelSlave):
    model = fluid_coupling.FluidCoupling
