"""The range of one parameter in which a machine works, with all others as they are: the remedy if a length is
refused that another one spoils."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from ..core.errors import InputError
from ..core.messages import unit_behind
from ..core.quantities import Layout
from ..mechanism.models import MachineModel

_ROUNDS = 24
_GROWTH = 1.25
_FARTHEST = 1e3
"""Ratio to the declared start value up to which a limit is sought."""


def admits(model: MachineModel) -> Callable[[Mapping[str, float]], bool]:
    """Whether a machine of the `model` works with these parameters, the others at their declared start values."""
    layout = model.parameter_layout

    def holds(values: Mapping[str, float]) -> bool:
        try:
            model.check(layout.from_names(dict(values), model.Parameters()))
        except InputError:
            return False
        return True

    return holds


def holding_range(
    admitted: Callable[[Mapping[str, float]], bool], values: Mapping[str, float], name: str, start: float
) -> tuple[float, float] | None:
    """The range of the value `name` about its `start` in which the machine works (`admitted`), with the other
    `values`; None if it does not work at the start. An end without a limit nearby is 0, or infinite."""
    inside = start

    def holds(value: float) -> bool:
        return admitted({**values, name: value})

    if not holds(inside):
        return None
    ends = []
    for sense in (-1.0, 1.0):
        outside = values[name] if name in values and sense * (values[name] - inside) > 0.0 else None
        held = inside
        if outside is None or holds(outside):
            outside = None
            for k in range(1, 1 + int(math.log(_FARTHEST) / math.log(_GROWTH))):
                trial = (
                    inside * _GROWTH ** (sense * k) if inside > 0.0 else inside + sense * 1e-3 * _GROWTH**k
                )
                if not holds(trial):
                    outside = trial
                    break
                held = trial
        if outside is None:
            ends.append(math.inf if sense > 0.0 else 0.0 if inside > 0.0 else -math.inf)
            continue
        for _ in range(_ROUNDS):
            middle = 0.5 * (held + outside)
            held, outside = (middle, outside) if holds(middle) else (held, middle)
        ends.append(held)
    return ends[0], ends[1]


def causes(
    admitted: Callable[[Mapping[str, float]], bool], values: Mapping[str, float], layout: Layout, start: Any
) -> dict[str, str]:
    """The given values each of which alone spoils the machine, by name, in words with the range in which it works.
    Whoever keeps to a range is not refused again. `start` are the values of the `layout` that are not given."""
    reasons = {}
    units = {variable.name: unit_behind(variable.unit) for variable in layout.variables}
    for name, usual in layout.by_name(start).items():
        if name not in values or values[name] == usual:
            continue
        span, unit = holding_range(admitted, values, name, usual), units[name]
        if span is None:
            continue
        # a bound of 0 has a tolerance, which the search finds
        ends = [0.0 if abs(x) < 1e-6 * abs(values[name]) else x for x in span]
        low, high = (f"{rounded_inward(x, sense):.4g}" for x, sense in zip(ends, (1.0, -1.0), strict=True))
        limits = [f">= {low}{unit}"] if span[0] not in (0.0, -math.inf) else []
        limits += [f"<= {high}{unit}"] if math.isfinite(span[1]) else []
        reasons[name] = f"{name} = {values[name]:g}{unit} must be {' and '.join(limits)}"
    return reasons


def rounded_inward(x: float, sense: float) -> float:
    """A limit in four digits, rounded upward if `sense` is +1, downward if it is -1."""
    if not math.isfinite(x) or x == 0.0:
        return x
    unit = 10.0 ** (math.floor(math.log10(abs(x))) - 3)
    return (math.ceil if sense > 0.0 else math.floor)(x / unit) * unit
