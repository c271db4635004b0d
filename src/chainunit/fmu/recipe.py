"""Data of a model that only its FMU needs: the default experiment, the icon, and the outputs that are read often.

These data follow from the declarations and terminals, so that a new model need not state them. A value that does not
follow from them stands in the model's script in `fmu/` (see `chainunit.fmu.script.Script`).
"""

from __future__ import annotations

import runpy
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path

from ..core.model import Model, Sketch
from ..core.ports import LOAD
from . import pictures
from .script import Names, Script


@dataclass(frozen=True)
class Experiment:
    """The default run of a tool: to `stop` [s], in steps of `step` [s], with a relative `tolerance`. With this step
    the error of the explicit Euler method, over one second of the reference inputs, is less than a fifth of the size
    of each state."""

    step: float = 1e-3
    stop: float = 10.0
    tolerance: float = 1e-6


def recipes() -> Path:
    """The project's folder `fmu`: a script for each Python FMU, and in `native` the C layer. In an installed package
    the folder stands beside this file."""
    here = Path(__file__).parent
    return inside if (inside := here / "recipes").exists() else here.parents[2] / "fmu"


def script_of(model: type[Model]) -> type[Script]:
    """The class of the model's script; `Script` itself for a model without a script. A system of models has the
    shortest step and stop of its components, and their sizes."""
    file = script_file(model)
    if file or not model.components:
        return _script(file) if file else Script
    own = {name: script_of(component) for name, component in model.components.items()}
    experiment: dict[str, float] = {}
    for script in own.values():
        experiment = {k: min(x, experiment.get(k, x)) for k, x in (experiment | script.experiment).items()}
    inputs = set(model.input_layout.names)
    sizes = {f"{name}.{k}": x for name, script in own.items() for k, x in script.sizes.items()}
    experiment |= model.fmu_data.experiment
    members = {"experiment": experiment, "sizes": {full: x for full, x in sizes.items() if full in inputs}}
    return type("SystemScript", (Script,), members)


def script_with_names(model: type[Model], names: Names) -> type[Script]:
    """The class of the model's script, with these names of the FMU's variables."""
    script = script_of(model)
    return script if script.names == names else type(script.__name__, (script,), {"names": names})


def script_file(model: type[Model]) -> Path | None:
    """The model's script; None where there is none, or where the script of its name is that of another model."""
    file = recipes() / f"{model.name}.py"
    return file if file.is_file() and _script(file).model.__module__ == model.__module__ else None


@cache
def _script(file: Path) -> type[Script]:
    own: type[Script] = runpy.run_path(str(file))[file.stem]
    return own


def icon(model: type[Model], kind: str, sketch: Sketch | None) -> bytes:
    """The icon of a model, "svg" or "png": for a user's machine its `sketch`; else the file in `data/icons` with the
    model's name, else the general icon of a motor (the model takes a load port), of a line (it takes one and gives
    one), or of a machine."""
    if sketch and model.fmu_data.about is not None:
        return pictures.icon_svg(sketch) if kind == "svg" else pictures.icon_png(sketch)
    folder = resources.files("chainunit") / "data" / "icons"
    takes = {t.members["tau_bias"] in model.input_layout.names for t in model.terminals if t.kind == LOAD}
    general = {frozenset({True}): "motor", frozenset({True, False}): "line"}.get(frozenset(takes), "machine")
    own = folder / f"{model.name}.{kind}"
    return (own if own.is_file() else folder / f"{general}.{kind}").read_bytes()
