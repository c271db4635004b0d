"""The FMU LoadObserver: ``pythonfmu build -f fmu/LoadObserver.py``, see README.md beside this file."""

from chainunit.fmu.slave import ModelSlave
from chainunit.machines import load_observer


class LoadObserver(ModelSlave):
    model = load_observer.LoadObserver
