"""The live machine of a linkage, at the speed of its driver."""

from __future__ import annotations

from dataclasses import replace

from ...core.quantities import Quantity, Variable
from ...machines.machine import Machine
from ...reading.text import DEFAULT_UNITS, Units
from ..blocks import LiveMachine
from .machine import assembled, speed_of_crank
from .quantities import of_machine
from .turn import live_turn


def of_linkage(machine: Machine, speed: float, file: str, units: Units = DEFAULT_UNITS) -> LiveMachine:
    """The live machine of a linkage at the `speed` of its driver [rad/s, m/s]; `file` is the name of its file."""
    model = machine.model
    speed_quantity = speed_of_crank(speed)
    if model.slides:
        q = Quantity("m/s", "speed of the driver", low=0.0, high=1e3, open_low=True)
        speed_quantity = replace(speed_quantity, variable=Variable("crank_speed", "speed of the driver", q))
    chosen = [*of_machine("feed", model.Feed()), speed_quantity, *of_machine("machine", machine.p)]
    copied = None
    if model.turns and not model.slides:
        copied = {
            "title": model.description,
            "system": {"machine": file},
            "run": {"crank_speed": float(speed)},
        }
    return assembled(live_turn(machine, speed, units), None, "", chosen, copied, units)
