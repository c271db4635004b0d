"""The FMU KnifeDrive: ``pythonfmu build -f fmu/KnifeDrive.py``, see README.md beside this file."""

from chainunit.fmu.slave import ModelSlave
from chainunit.machines import knife_drive


class KnifeDrive(ModelSlave):
    model = knife_drive.KnifeDrive
