"""The FMU LoadObserver: ``pythonfmu build -f fmu/LoadObserver.py``, see README.md beside this file."""

from chainunit.fmu.slave import ModelSlave, hold
from chainunit.machines import load_observer


@hold(globals())
class LoadObserver(ModelSlave):
    model = load_observer.LoadObserver
    # the torque that holds the machine nearly at rest: in the reference results no load jumps
    sizes = {"w": 0.05, "current": 0.1}
