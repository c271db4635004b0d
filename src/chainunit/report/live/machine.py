"""Live machines: a page whose reader changes numbers and sees at once what follows.

The page holds the equations of the machine and its drive as WebAssembly, and computes with them alone: results over a
turn, the machine in motion, and runs with events.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ...core.quantities import variable_of
from ...core.wasm.module import WasmModule
from ...reading.text import Units
from ...study.sections import Run
from ..live_block import LiveMachine
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
    modules = {"turn": turn.module} | ({"runs": runs.module} if runs else {})
    data = {
        "turn": turn.data,
        "runs": runs.data if runs else None,
        "without_runs": why,
        "quantities": [each.data(units, turn.data["driver"]) for each in quantities],
        "modules": {name: _memory(module) for name, module in modules.items()},
        "file": copied,
    }
    return LiveMachine(data, {name: module.content for name, module in modules.items()})


def _memory(module: WasmModule) -> dict[str, Any]:
    """The places in the memory of a module that the page uses."""
    d = module.description
    tables = ("parameters", "inputs", "states", "outputs")
    return {
        **{name: {"address": d[name]["address"], "names": d[name]["names"]} for name in tables},
        "derived": d["addresses"]["derived"],
        "pace": d["addresses"].get("pace"),
        "requirements": d["requirements"],
        "free": d["memory"]["free"],
    }


def speed_of_crank(value: float) -> LiveQuantity:
    """The speed of the crank [rad/s]."""
    variable = variable_of(Run, "crank_speed")
    return LiveQuantity(("run", "crank_speed"), variable, value, "drive", role="speed")
