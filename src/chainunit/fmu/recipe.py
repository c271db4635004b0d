"""What only an FMU needs of a model: its default experiment, its icon, and which outputs are often asked for.

All of it follows from the declarations and terminals, so that a new model states nothing of it. Where a value cannot
follow, the model's script in `fmu/` has it (see `chainunit.fmu.script.Script`).
"""

from __future__ import annotations

import runpy
from dataclasses import dataclass
from functools import cache
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path

from ..model import Model
from ..ports import LOAD
from .script import Script


@dataclass(frozen=True)
class Experiment:
    """A run for a tool that was told nothing else: to `stop` [s], in steps of `step` [s], at a relative `tolerance`.
    In a second of the reference inputs the explicit Euler method errs, at that step, by less than a fifth of any
    state's size."""

    step: float = 1e-3
    stop: float = 10.0
    tolerance: float = 1e-6


def recipes() -> Path:
    """The project's folder `fmu`: a script for each Python FMU, and in `native` the C layer. An installed package has
    it beside this file."""
    here = Path(__file__).parent
    return carried if (carried := here / "recipes").exists() else here.parents[2] / "fmu"


def script_of(model: type[Model]) -> type[Script]:
    """The class of the model's script; the plain one where it has none."""
    return _script(model.name)


@cache
def _script(name: str) -> type[Script]:
    file = recipes() / f"{name}.py"
    return runpy.run_path(str(file))[name] if file.is_file() else Script


def often(model: type[Model]) -> set[str]:
    """Outputs that a driver asks for at every step: those that connect."""
    return {name for terminal in model.terminals for name in terminal.members.values()}


def icon(model: type[Model], kind: str) -> Traversable:
    """Its icon, "svg" or "png": of its own where `data/icons` has one by the model's name, else that of a machine, of
    a motor, which takes a load port, or of a line, which takes one and shows one."""
    folder = resources.files("chainunit") / "data" / "icons"
    takes = {t.members["tau_bias"] in model.input_layout.names for t in model.terminals if t.kind == LOAD}
    general = {frozenset({True}): "motor", frozenset({True, False}): "line"}.get(frozenset(takes), "machine")
    own = folder / f"{model.name}.{kind}"
    return own if own.is_file() else folder / f"{general}.{kind}"
