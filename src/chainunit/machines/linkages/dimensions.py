"""The dimension of an expression: a length cannot be added to a mass."""

from __future__ import annotations

import ast
from collections.abc import Mapping
from functools import cache

from ...core.errors import InputError, shown
from ...core.quantities import base_units
from ...mechanism.expressions import CONSTANTS, EXTREMES, Expression, expression, parts_of_chain

Dimension = tuple[tuple[str, float], ...]
"""Exponents of the base units, angles apart; None stands for a number that takes any dimension."""


@cache
def dimension_of_unit(unit: str) -> Dimension:
    """The dimension of a unit."""
    return tuple((name, float(power)) for name, power in base_units(unit).items() if name != "rad" and power)


Dimensions = Mapping[str, Dimension | None]


def checked_dimension(text: str, dimensions: Dimensions, unit: str | None) -> Dimension | None:
    """The dimension of an expression; `dimensions` has the dimension of each name, extreme and table in it, None for
    one that is not known yet. One of numbers alone takes any dimension, as a number does.

    Raises
    ------
    InputError
        in one line, for an expression that adds what does not fit together, or is not of the dimension of `unit`.
    """
    parsed = expression(text)
    result = _dimension(parsed.tree, dimensions, parsed)
    if not (parsed.names or parsed.extremes or parsed.tables):
        return None
    if unit is not None and result is not None and result != dimension_of_unit(unit):
        remedy = (
            "" if result else ": multiply by a parameter that has it, as a number in a product has no unit"
        )
        raise InputError(f"is {shown(text)}, in {_unit(result)}; must be in {unit.replace('.', ' ')}{remedy}")
    return result


def _dimension(node: ast.AST, dimensions: Dimensions, parsed: Expression) -> Dimension | None:
    """The dimension of a node; None for a plain number, which fits any."""
    match node:
        case ast.Constant():
            return None
        case ast.Name(id=name):
            return () if name in CONSTANTS else dimensions[name]
        case ast.UnaryOp(operand=inner):
            return _dimension(inner, dimensions, parsed)
        case ast.BinOp(op=ast.Pow(), left=base, right=ast.Constant(value=int() | float() as power)):
            return _powered(_dimension(base, dimensions, parsed), power)
        case ast.BinOp():
            first, steps = parts_of_chain(node)
            a = _dimension(first, dimensions, parsed)
            for whole, op, right in steps:
                b = _dimension(right, dimensions, parsed)
                if isinstance(op, ast.Add | ast.Sub):
                    a = _same(a, b, whole, parsed)
                # a number in a product is a pure one
                elif a is not None or b is not None:
                    a = _product(a or (), b or (), 1.0 if isinstance(op, ast.Mult) else -1.0)
            return a
        case ast.Call(func=ast.Name(id=name), args=[place]) if name in EXTREMES:
            return dimensions[f"{'max' if name == 'stroke' else name}({ast.unparse(place)})"]
        case ast.Compare(left=left, comparators=[right]):
            return _same(
                _dimension(left, dimensions, parsed),
                _dimension(right, dimensions, parsed),
                node,
                parsed,
            )
        case ast.Call(func=ast.Name(id="table"), args=[x, ast.Name(id=name)]):
            _same(_dimension(x, dimensions, parsed), dimensions[f"x of {name}"], node, parsed)
            return dimensions[f"table {name}"]
        case ast.Call(func=ast.Name(id=name), args=args):
            inside_all = [_dimension(argument, dimensions, parsed) for argument in args]
            return _of_function(name, inside_all, node, parsed)
    return None


def _powered(dimension: Dimension | None, power: float) -> Dimension | None:
    return None if dimension is None else tuple((unit, k * power) for unit, k in dimension)


def _of_function(
    name: str, args: list[Dimension | None], node: ast.AST, parsed: Expression
) -> Dimension | None:
    """The dimension of the value of a function, by the dimensions of its arguments, which are checked."""
    first, *others = args
    if name == "sqrt":
        return _powered(first, 0.5)
    if name == "abs":
        return first
    if name == "table":  # of numbers, which take any dimension
        return None
    if name == "where":
        _same(first, others[2], node, parsed)
        return _same(others[0], others[1], node, parsed)
    if name in ("min", "max", "positive", "step", "ramp", "atan2"):
        for argument in others:
            first = _same(first, argument, node, parsed)
        return first if name in ("min", "max", "positive") else ()
    if first:
        raise InputError(f"is {shown(parsed.text)}; {name} takes an angle or a ratio, not {_unit(first)}")
    return ()


def _same(a: Dimension | None, b: Dimension | None, node: ast.AST, parsed: Expression) -> Dimension | None:
    """The common dimension of two sides of a sum, a comparison or a function; a plain number takes the other one."""
    if a is None or b is None:
        return b if a is None else a
    if a != b:
        raise InputError(
            f"is {shown(parsed.text)}; in {parsed.words(node)} the one is in {_unit(a)}, the other in {_unit(b)}"
        )
    return a


def _product(a: Dimension, b: Dimension, sign: float) -> Dimension:
    powers = dict(a)
    for name, power in b:
        powers[name] = powers.get(name, 0.0) + sign * power
    order = ("kg", "m", "s", "A", "K", "mol", "cd")
    return tuple((name, powers[name]) for name in order if powers.get(name))


_NAMED = ("N", "N.m", "N/m", "N.s/m", "N/m2", "W")


def _unit(dimension: Dimension) -> str:
    for unit in _NAMED:
        if sorted(dimension) == sorted(dimension_of_unit(unit)):
            return unit.replace(".", " ")
    return " ".join(f"{name}{'' if power == 1.0 else f'{power:g}'}" for name, power in dimension) or "no unit"
