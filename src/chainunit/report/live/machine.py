"""Live machines: a page whose reader changes numbers and sees at once what follows.

The page holds the equations of the machine and its drive in JavaScript, and computes with them alone: results over a
turn, the machine in motion, and runs with events.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ...core.printing.javascript import program
from ...core.quantities import variable_of
from ...reading.text import Units
from ...study.sections import Run
from ..blocks import LiveMachine
from .quantities import LiveQuantity
from .runs import LiveRuns
from .turn import LiveTurn


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


def speed_of_crank(value: float) -> LiveQuantity:
    """The speed of the crank [rad/s]."""
    variable = variable_of(Run, "crank_speed")
    return LiveQuantity(("run", "crank_speed"), variable, value, "drive", role="speed")
