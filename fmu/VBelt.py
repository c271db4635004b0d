"""The FMU VBelt: ``pythonfmu build -f fmu/VBelt.py``, see README.md beside this file."""

from chainunit.drives import v_belt
from chainunit.fmu.slave import ModelSlave


class VBelt(ModelSlave):
    model = v_belt.VBelt
