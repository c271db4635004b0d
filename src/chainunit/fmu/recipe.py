"""Data that only an FMU needs, and that a new model need not state: the default experiment and the icon."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from ..core.model import Model, Sketch
from ..core.ports import LOAD
from . import pictures


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


def icon(model: Model, kind: str, sketch: Sketch | None) -> bytes:
    """The icon of a model, "svg" or "png": for a user's machine its `sketch`; else the file in `data/icons` with the
    model's name, else the general icon of a motor (the model takes a load port), of a line (it takes one and gives
    one), or of a machine."""
    if sketch and model.fmu_data.about is not None:
        return pictures.icon_svg(sketch) if kind == "svg" else pictures.icon_png(sketch)
    folder = resources.files("chainunit") / "data" / "icons"
    takes = {t.members["tau_bias"] in model.input_layout.names for t in model.terminals if t.kind == LOAD}
    general = {frozenset({True}): "motor", frozenset({True, False}): "line"}.get(frozenset(takes), "machine")
    picture = folder / f"{model.name}.{kind}"
    return (picture if picture.is_file() else folder / f"{general}.{kind}").read_bytes()
