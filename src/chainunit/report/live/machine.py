"""Live machines: a page whose reader changes numbers and sees at once what follows.

The page holds the equations of the machine and its drive in JavaScript, and computes with them alone: results over a
turn, the machine in motion, and runs with events.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from ...core.printing.javascript import program
from ...core.quantities import plain_variable
from ...machines.machine import Machine
from ...reading.text import DEFAULT_UNITS, Units
from ..blocks import LiveMachine
from .quantities import LiveQuantity, of_machine, speed_of_crank
from .runs import LiveRuns
from .turn import LiveTurn, live_turn


def assembled(
    turn: LiveTurn,
    runs: LiveRuns | None,
    why: str,
    quantities: Iterable[LiveQuantity],
    copied: dict[str, Any] | None,
    units: Units,
) -> LiveMachine:
    """The live machine with this turn and these `runs`, or the reason `why` it has none; `copied` are the tables of
    the study file that its page gives, ready for JSON, or None where it gives none."""
    equations = {"turn": turn.equations} | ({"runs": runs.equations} if runs else {})
    data = {
        "turn": turn.data,
        "runs": runs.data if runs else None,
        "without_runs": why,
        "quantities": [quantity.data(units, turn.data["driver"]) for quantity in quantities],
        "file": copied,
    }
    return LiveMachine(data, program(equations))


def of_linkage(machine: Machine, speed: float, file: str) -> LiveMachine:
    """The live machine of a linkage at the `speed` of its driver [rad/s, m/s]; `file` is the name of its file."""
    model = machine.model
    speed_quantity = speed_of_crank(speed)
    if model.slides:
        bounds = {"low": 0.0, "high": 1e3, "open_low": True}
        variable = plain_variable("crank_speed", "m/s", "speed of the driver", **bounds)
        speed_quantity = replace(speed_quantity, variable=variable)
    chosen = [*of_machine("feed", model.Feed()), speed_quantity, *of_machine("machine", machine.p)]
    copied = None
    if model.turns and not model.slides:
        copied = {
            "title": model.description,
            "system": {"machine": file},
            "run": {"crank_speed": float(speed)},
        }
    return assembled(live_turn(machine, speed, DEFAULT_UNITS), None, "", chosen, copied, DEFAULT_UNITS)
