"""The range of one parameter in which a machine works, with all others as they are: the remedy where a length is
refused that another one spoils."""

from __future__ import annotations

import math
from collections.abc import Mapping

from ..core.errors import InputError
from ..core.messages import unit_behind
from ..mechanism.models import MachineModel

_ROUNDS = 24
_GROWTH = 1.25
_FARTHEST = 1e3
"""Ratio to the declared start value up to which a limit is sought."""


def holding_range(
    model: type[MachineModel], given: Mapping[str, float], name: str
) -> tuple[float, float] | None:
    """The range of the parameter `name` about its declared start value in which all requirements of the `model` hold,
    with the other `given` values; None where they do not hold at this start value. An end without a limit nearby is
    0, or infinite."""
    layout = model.parameter_layout
    start = layout.by_name(model.Parameters())
    inside = start[name]

    def holds(value: float) -> bool:
        try:
            model.check(layout.from_names({**given, name: value}, model.Parameters()))
        except InputError:
            return False
        return True

    if not holds(inside):
        return None
    ends = []
    for sense in (-1.0, 1.0):
        outside = given[name] if name in given and sense * (given[name] - inside) > 0.0 else None
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


def causes(model: type[MachineModel], given: Mapping[str, float]) -> dict[str, str]:
    """The given values each of which alone spoils the machine, by name, in words with the range in which all
    requirements hold. Whoever keeps to a range is not refused again."""
    start = model.parameter_layout.by_name(model.Parameters())
    units = {v.name: unit_behind(v.unit) for v in model.parameter_layout.variables}
    words = {}
    for name in given:
        if name not in start or given[name] == start[name]:
            continue
        found = holding_range(model, given, name)
        if found is None:
            continue
        low, high = (_inward(x, sense) for x, sense in zip(found, (1.0, -1.0), strict=True))
        unit = units[name]
        limits = [f">= {low}{unit}"] if found[0] not in (0.0, -math.inf) else []
        limits += [f"<= {high}{unit}"] if math.isfinite(found[1]) else []
        words[name] = f"{name} = {given[name]:g}{unit} must be {' and '.join(limits)}"
    return words


def _inward(x: float, sense: float) -> str:
    """A limit in four digits, rounded upward where `sense` is +1."""
    if not math.isfinite(x) or x == 0.0:
        return f"{x:g}"
    unit = 10.0 ** (math.floor(math.log10(abs(x))) - 3)
    rounded = (math.ceil if sense > 0.0 else math.floor)(x / unit) * unit
    return f"{rounded:.4g}"
