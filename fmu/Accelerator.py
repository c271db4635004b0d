"""The FMU Accelerator: ``pythonfmu build -f fmu/Accelerator.py``, see README.md beside this file."""

from chainunit.fmu.slave import ModelSlave, hold
from chainunit.machines import accelerator


@hold(globals())
class Accelerator(ModelSlave):
    model = accelerator.Accelerator
