"""What only an FMU needs of a model: its default experiment, its icon, which outputs are often asked for, and inputs
that move for its reference results.

All of it follows from the declarations and terminals, so that a new model states nothing of it. Where a value cannot
follow, the model's script in `fmu/` has it (see `chainunit.fmu.slave.ModelSlave`).
"""

from __future__ import annotations

import math
import runpy
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..engines import MATH
from ..model import Model
from ..ports import FLANGE, LOAD
from ..quantities import Quantity
from .slave import ModelSlave

if TYPE_CHECKING:
    from .description import Interface


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


def script(model: type[Model]) -> type[ModelSlave]:
    """The class of the model's script; the plain one where it has none."""
    return _script(model.name)


@cache
def _script(name: str) -> type[ModelSlave]:
    file = recipes() / f"{name}.py"
    return runpy.run_path(str(file))[name] if file.is_file() else ModelSlave


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


_SIZES = {"rad": 0.1, "rad/s": 50.0, "kg": 10.0, "N": 100.0}
"""of an input whose declaration shows none, by unit; others 1"""
_PUSH = 300.0
"""rad/s2: the torque of a load is what gives the shaft that takes it this acceleration"""
_RUN = 4.0
"""rad/s: mean speed of a shaft that runs from rest"""


def excitation(interface: Interface) -> Callable[[float], dict[str, float]]:
    """The inputs as functions of time [s], for the reference results: all move smoothly, within their bounds.

    A shaft runs from rest, unevenly. A load is of the size that suits the shaft that takes it. Everything else swings
    about its start value, or about its usual size where that is 0.
    """
    model = interface.model
    sizes = interface.script.sizes
    courses: dict[str, Callable[[float], float]] = {}
    for terminal in model.terminals:
        if terminal.kind == LOAD and terminal.members["tau_bias"] in model.input_layout.names:
            inertia = _inertia(interface, terminal.members["tau_bias"])
            moving = _load(sizes.get(terminal.members["tau_bias"], _PUSH * inertia), inertia)
        elif terminal.kind == FLANGE:
            moving = _SHAFT
        else:
            continue
        courses |= {terminal.members[member]: course for member, course in moving.items()}
    others = {
        s.name: _swing(s.variable.quantity, _size(s.variable.quantity, s.start, sizes.get(s.name)), k)
        for k, s in enumerate(interface.of("input"))
    }
    courses = others | {name: course for name, course in courses.items() if name in others}
    return lambda t: {name: course(t) for name, course in courses.items()}


_SHAFT: dict[str, Callable[[float], float]] = {
    "phi": lambda t: _RUN * (t - 0.5 * math.sin(2.0 * t)),
    "w": lambda t: _RUN * (1.0 - math.cos(2.0 * t)),
    "a": lambda t: 2.0 * _RUN * math.sin(2.0 * t),
}


def _load(tau: float, inertia: float) -> dict[str, Callable[[float], float]]:
    """A load of about this torque [N m] and inertia [kg m2]. The slopes are so small that the inertia stays positive,
    and the torque within twice its size, for a shaft that is 150 rad ahead of the load's point or behind it."""
    return {
        "tau_bias": lambda t: tau * (1.0 + 0.4 * math.sin(10.0 * t)),
        "tau_bias_dphi": lambda t: 0.01 * tau * math.cos(4.0 * t),
        "tau_bias_dw": lambda t: 0.002 * tau * (1.0 + 0.5 * math.sin(5.0 * t)),
        "J": lambda t: inertia * (1.0 + 0.3 * math.sin(6.0 * t)),
        "dJ_dphi": lambda t: 0.001 * inertia * math.cos(6.0 * t),
        "phi0": _SHAFT["phi"],
        "w0": _SHAFT["w"],
    }


def _inertia(interface: Interface, torque: str) -> float:
    """Of the shaft that the input `torque` slows down [kg m2], as the derivatives of the speeds by it say; 1 without
    any."""
    import casadi

    model, layout = interface.model, interface.model.state_layout
    if layout is None:
        return 1.0
    symbols, *_, derivatives = interface.traced
    speeds = [d for d, v in zip(derivatives, interface.states, strict=True) if v.unit == "rad/s"]
    by = casadi.jacobian(casadi.vertcat(*speeds), symbols[1][model.input_layout.names.index(torque)])
    p = model.prepared(MATH, model.parameter_layout.instance([s.start for s in interface.of("parameter")]))
    u = [s.start for s in interface.of("input")]
    x = layout.values(model.begin(p, model.input_layout.instance(u)))
    at: list[Any] = [model.parameter_layout.values(p), u, x, getattr(p, "derived", [])]
    slopes = casadi.Function("slopes", symbols, [casadi.densify(by)])(*at).full()
    return float(1.0 / (abs(slopes).max() or 1.0))


def _size(q: Quantity, start: float | None, own: float | None) -> float:
    return own or start or q.nominal or _SIZES.get(q.unit, 1.0)


def _swing(q: Quantity, size: float, k: int) -> Callable[[float], float]:
    """About `size` by 40 %, or as far as the bounds let it; the `k`-th input at a rate of its own."""
    near, far = sorted((0.6 * size, 1.4 * size))
    low, high = max(near, q.low), min(far, q.high)
    rate = 3.0 + 7.0 * (0.618 * k % 1.0)
    return lambda t: 0.5 * (low + high) + 0.5 * (high - low) * math.sin(rate * t)
