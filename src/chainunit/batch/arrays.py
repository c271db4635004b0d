"""The operations of a batch on arrays, by numpy or jax."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import numpy as np

from ..core.printing.operations import ARGUMENT, NUMBER, Operations

Entry = tuple[int, int]
BLOCK = 4096
"""Number of states that numpy computes at a time: all values of a block stay in the cache."""


def _functions(xp: Any) -> dict[str, Callable[..., Any]]:
    """The operations by their kinds; `xp` is numpy or jax.numpy."""
    unary = "sqrt exp log sin cos tan sinh cosh tanh floor ceil sign"
    names = {name.upper(): name for name in unary.split()}
    names |= {"ASIN": "arcsin", "ACOS": "arccos", "ATAN": "arctan", "ATAN2": "arctan2", "FABS": "abs"}
    names |= {"FMIN": "minimum", "FMAX": "maximum", "POW": "power", "CONSTPOW": "power", "FMOD": "fmod"}
    names |= {"COPYSIGN": "copysign"}
    functions: dict[str, Callable[..., Any]] = {kind: getattr(xp, name) for kind, name in names.items()}

    def truth(condition: Any) -> Any:
        return xp.where(condition, 1.0, 0.0)

    return functions | {
        "ADD": lambda x, y: x + y,
        "SUB": lambda x, y: x - y,
        "MUL": lambda x, y: x * y,
        "DIV": lambda x, y: x / y,
        "SQ": lambda x: x * x,
        "TWICE": lambda x: 2.0 * x,
        "INV": lambda x: 1.0 / x,
        "NEG": lambda x: -x,
        "ASSIGN": lambda x: x,
        "LT": lambda x, y: truth(x < y),
        "LE": lambda x, y: truth(x <= y),
        "EQ": lambda x, y: truth(x == y),
        "NE": lambda x, y: truth(x != y),
        "AND": lambda x, y: truth((x != 0.0) & (y != 0.0)),
        "OR": lambda x, y: truth((x != 0.0) | (y != 0.0)),
        "NOT": lambda x: truth(x == 0.0),
        "IF_ELSE_ZERO": lambda x, y: xp.where(x != 0.0, y, 0.0),
    }


def run(xp: Any, operations: Operations, arguments: Mapping[Entry, Any]) -> list[list[Any]]:
    """The results by group; `arguments` are arrays whose shapes broadcast, by entry. A value is forgotten after
    its last use."""
    functions = _functions(xp)
    last = {k: n for n, each in enumerate(operations.items) for k in each.operands}
    keep = {place for group in operations.results for place in group}
    values: dict[int, Any] = {}
    for n, each in enumerate(operations.items):
        if each.kind == NUMBER:
            values[n] = np.float64(each.value)
        elif each.kind == ARGUMENT:
            values[n] = arguments[each.entry]
        else:
            values[n] = functions[each.kind](*(values[k] for k in each.operands))
            for k in each.operands:
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
                results, (code,) = run(np, operations, part)
                for y, value in zip(out, results, strict=True):
                    y[rows, columns] = value
                reason[rows, columns] = code
                _mark([y[rows, columns] for y in out], reason[rows, columns], not_finite)


def _mark(out: Any, reason: Any, not_finite: int) -> None:
    """Results of states with a reason are NaN, and states with a result that is not finite have a reason."""
    finite = np.ones(reason.shape, bool)
    for y in out:
        finite &= np.isfinite(y)
    reason[~finite & (reason == 0)] = not_finite
    bad = reason != 0
    if bad.any():
        for y in out:
            y[bad] = np.nan


@cache
def _jitted(operations: Operations) -> Any:
    import jax
    import jax.numpy as jnp

    entries = tuple(dict.fromkeys(each.entry for each in operations.items if each.kind == ARGUMENT))

    def call(*values: Any) -> Any:
        shape = jnp.broadcast_shapes(*(x.shape for x in values), (1, 1))
        results, (code,) = run(jnp, operations, dict(zip(entries, values, strict=True)))
        return [jnp.broadcast_to(y, shape) for y in (*results, code)]

    return entries, jax.jit(call)


def _double() -> Any:
    """The context in which jax computes in double precision; its name has changed."""
    import jax

    if hasattr(jax, "enable_x64"):
        return jax.enable_x64(True)
    from jax.experimental import enable_x64

    return enable_x64()


JAX_BLOCK = 2**20
"""Number of states that jax computes at a time."""


def by_jax(
    operations: Operations, arguments: Mapping[Entry, Any], out: Any, reason: Any, not_finite: int
) -> None:
    """As `by_numpy`, in double precision on the device that jax takes."""
    outer, inner = reason.shape
    entries, call = _jitted(operations)
    height = max(1, JAX_BLOCK // inner)
    with _double():
        for o in range(0, outer, height):
            rows = slice(o, o + height)
            values = [arguments[e][rows if arguments[e].shape[0] > 1 else slice(None)] for e in entries]
            *results, code = call(*values)
            for y, value in zip(out, results, strict=True):
                y[rows] = np.asarray(value)
            reason[rows] = np.asarray(code)
            _mark([y[rows] for y in out], reason[rows], not_finite)
