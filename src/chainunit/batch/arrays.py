"""The operations of a batch on arrays, by numpy."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ..core.printing.operations import ARGUMENT, NUMBER, Operations

Entry = tuple[int, int]
BLOCK = 4096
"""Number of states that numpy computes at a time: all values of a block stay in the cache."""


_UNARY = "sqrt exp log sin cos tan sinh cosh tanh floor ceil sign".split()
_NAMES = {name.upper(): name for name in _UNARY} | {
    "ASIN": "arcsin", "ACOS": "arccos", "ATAN": "arctan", "ATAN2": "arctan2", "FABS": "abs", "FMIN": "minimum",
    "FMAX": "maximum", "POW": "power", "CONSTPOW": "power", "FMOD": "fmod", "COPYSIGN": "copysign",
}  # fmt: skip


def _truth(condition: Any) -> Any:
    return np.where(condition, 1.0, 0.0)


_FUNCTIONS: dict[str, Callable[..., Any]] = {kind: getattr(np, name) for kind, name in _NAMES.items()} | {
    "ADD": lambda x, y: x + y,
    "SUB": lambda x, y: x - y,
    "MUL": lambda x, y: x * y,
    "DIV": lambda x, y: x / y,
    "SQ": lambda x: x * x,
    "TWICE": lambda x: 2.0 * x,
    "INV": lambda x: 1.0 / x,
    "NEG": lambda x: -x,
    "ASSIGN": lambda x: x,
    "LT": lambda x, y: _truth(x < y),
    "LE": lambda x, y: _truth(x <= y),
    "EQ": lambda x, y: _truth(x == y),
    "NE": lambda x, y: _truth(x != y),
    "AND": lambda x, y: _truth((x != 0.0) & (y != 0.0)),
    "OR": lambda x, y: _truth((x != 0.0) | (y != 0.0)),
    "NOT": lambda x: _truth(x == 0.0),
    "IF_ELSE_ZERO": lambda x, y: np.where(x != 0.0, y, 0.0),
}
"""The operations by their kinds."""


def run(operations: Operations, arguments: Mapping[Entry, Any]) -> list[list[Any]]:
    """The results by group; `arguments` are arrays whose shapes broadcast, by entry. A value is forgotten after
    its last use."""
    last = {k: n for n, operation in enumerate(operations.items) for k in operation.operands}
    keep = {place for group in operations.results for place in group}
    values: dict[int, Any] = {}
    for n, operation in enumerate(operations.items):
        if operation.kind == NUMBER:
            values[n] = np.float64(operation.value)
        elif operation.kind == ARGUMENT:
            values[n] = arguments[operation.entry]
        else:
            values[n] = _FUNCTIONS[operation.kind](*(values[k] for k in operation.operands))
            for k in operation.operands:
                if last[k] == n and k not in keep:
                    values.pop(k, None)
    return [[values[place] for place in group] for group in operations.results]


def by_numpy(
    operations: Operations, arguments: Mapping[Entry, Any], out: Any, reason: Any, not_finite: int
) -> None:
    """Fill the arrays `out` and `reason`, each of shape (outer, inner), block by block; `arguments` have the shapes
    (1 or outer, 1 or inner)."""
    outer, inner = reason.shape
    width = min(inner, BLOCK)
    height = max(1, BLOCK // width)
    with np.errstate(all="ignore"):
        for o in range(0, outer, height):
            for i in range(0, inner, width):
                rows, columns = slice(o, o + height), slice(i, i + width)
                part = {
                    entry: x[
                        rows if x.shape[0] > 1 else slice(None), columns if x.shape[1] > 1 else slice(None)
                    ]
                    for entry, x in arguments.items()
                }
                results, (code,) = run(operations, part)
                for y, value in zip(out, results, strict=True):
                    y[rows, columns] = value
                reason[rows, columns] = code
                _mark([y[rows, columns] for y in out], reason[rows, columns], not_finite)


def _mark(out: Any, reason: Any, not_finite: int) -> None:
    """Write NaN into the results of states that have a reason, and the reason `not_finite` for states of which a
    result is not finite. `out` has an array for each result, of the shape of `reason`, which is 0 for a good
    state."""
    finite = np.ones(reason.shape, bool)
    for y in out:
        finite &= np.isfinite(y)
    reason[~finite & (reason == 0)] = not_finite
    bad = reason != 0
    if bad.any():
        for y in out:
            y[bad] = np.nan
