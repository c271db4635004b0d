"""The dimension of an expression: a length cannot be added to a mass."""

from __future__ import annotations

import ast
from collections.abc import Mapping

from ...core.errors import InputError, shown
from ...core.quantities import base_units
from ...mechanism.expressions import CONSTANTS, EXTREMES

Dimension = tuple[tuple[str, float], ...]
"""Exponents of the base units, angles apart; None stands for a number that takes any dimension."""


def dimension_of_unit(unit: str) -> Dimension:
    """The dimension of a unit."""
    return tuple((name, float(power)) for name, power in base_units(unit).items() if name != "rad" and power)


def checked_dimension(text: str, units: Mapping[str, str | None], unit: str | None) -> None:
    """Refuse an expression that is not of the dimension of `unit`, or, without it, adds what does not fit together;
    `units` has the units of the names, extremes and tables in it, None for one that is not known yet.

    Raises
    ------
    InputError
        in one line.
    """
    known = {name: None if each is None else dimension_of_unit(each) for name, each in units.items()}
    result = _dimension(ast.parse(text.strip(), mode="eval").body, known, text)
    if unit is not None and result is not None and result != dimension_of_unit(unit):
        raise InputError(f"is {shown(text)}, in {_unit(result)}; must be in {unit.replace('.', ' ')}")


def _dimension(node: ast.AST, known: Mapping[str, Dimension | None], text: str) -> Dimension | None:
    match node:
        case ast.Constant():
            return None
        case ast.Name(id=name):
            return () if name in CONSTANTS else known[name]
        case ast.UnaryOp(operand=inner):
            return _dimension(inner, known, text)
        case ast.BinOp(op=ast.Pow(), left=base, right=ast.Constant(value=int() | float() as power)):
            inside = _dimension(base, known, text)
            return None if inside is None else tuple((name, k * power) for name, k in inside)
        case ast.BinOp(op=op, left=left, right=right):
            a, b = _dimension(left, known, text), _dimension(right, known, text)
            if isinstance(op, ast.Add | ast.Sub):
                return _same(a, b, node, text)
            # a number in a product is a pure one
            return (
                _product(a or (), b or (), 1.0 if isinstance(op, ast.Mult) else -1.0)
                if (a is not None or b is not None)
                else None
            )
        case ast.Call(func=ast.Name(id=name), args=[place]) if name in EXTREMES:
            return known[f"{'max' if name == 'stroke' else name}({ast.unparse(place)})"]
        case ast.Compare(left=left, comparators=[right]):
            return _same(_dimension(left, known, text), _dimension(right, known, text), node, text)
        case ast.Call(func=ast.Name(id="table"), args=[x, ast.Name(id=name)]):
            _same(_dimension(x, known, text), known[f"x of {name}"], node, text)
            return known[f"table {name}"]
        case ast.Call(func=ast.Name(id=name), args=args):
            inside_all = [_dimension(each, known, text) for each in args]
            return _of_function(name, inside_all, node, text)
    return None


def _of_function(name: str, args: list[Dimension | None], node: ast.AST, text: str) -> Dimension | None:
    first = args[0]
    if name == "sqrt":
        return None if first is None else tuple((unit, 0.5 * k) for unit, k in first)
    if name == "abs":
        return first
    if name == "table":  # of numbers, which take any dimension
        return None
    if name in ("step", "positive", "ramp"):
        for each in args[1:]:
            first = _same(first, each, node, text)
        return first if name == "positive" else ()
    if name == "where":
        _same(first, args[3], node, text)
        return _same(args[1], args[2], node, text)
    if name in ("min", "max"):
        return _same(first, args[1], node, text)
    if name == "atan2":
        _same(first, args[1], node, text)
        return ()
    if first:
        raise InputError(f"is {shown(text)}; {name} takes an angle or a ratio, not {_unit(first)}")
    return ()


def _same(a: Dimension | None, b: Dimension | None, node: ast.AST, text: str) -> Dimension | None:
    if a is None or b is None:
        return b if a is None else a
    if a != b:
        raise InputError(
            f"is {shown(text)}; in {ast.unparse(node)} the one is in {_unit(a)}, the other in {_unit(b)}"
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
