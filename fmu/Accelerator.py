"""The FMU Accelerator: ``pythonfmu build -f fmu/Accelerator.py``, see README.md beside this file."""

from chainunit.fmu.slave import ModelSlave
from chainunit.machines import accelerator


class Accelerator(ModelSlave):
    model = accelerator.Accelerator
