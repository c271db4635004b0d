"""Expressions of named quantities, such as ``2 * r + sqrt(l * l - r * r)``, for any engine.

Standard library only: FMUs carry this file.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

from ..errors import InputError, meant, shown

Evaluation = Callable[[Any, Mapping[str, Any]], Any]
"""The value of an expression: of the engine and the quantities by name."""

_ONE = ("sin", "cos", "sqrt", "asin", "acos", "exp", "log", "abs")
_TWO = {"atan2": "atan2", "min": "minimum", "max": "maximum"}
FUNCTIONS = (*_ONE, "tan", *_TWO)
CONSTANTS = {"pi": math.pi, "deg": math.pi / 180.0}
"""Names that every expression knows; ``30 * deg`` is an angle in radians."""
_OPERATORS: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: lambda a, b: a + b,
    ast.Sub: lambda a, b: a - b,
    ast.Mult: lambda a, b: a * b,
    ast.Div: lambda a, b: a / b,
}
MOST_POWER = 12


class Expression:
    """An expression: its text, the `names` of the quantities in it, and its value.

    Raises
    ------
    InputError
        for a text that is no expression, in one line.
    """

    def __init__(self, text: str) -> None:
        self.text = text
        try:
            tree = ast.parse(text.strip(), mode="eval").body
        except (SyntaxError, ValueError, RecursionError, MemoryError):
            raise InputError(
                f"{shown(text)} is no number with a unit and no expression, such as 2 * r + 0.01"
            ) from None
        names: dict[str, None] = {}
        self.value: Evaluation = self._compiled(tree, names)
        self.names = tuple(names)

    def _compiled(self, node: ast.AST, names: dict[str, None]) -> Evaluation:
        match node:
            case ast.Constant(value=int() | float() as number) if not isinstance(number, bool):
                return lambda xp, of, x=float(number): x  # type: ignore[misc]
            case ast.Name(id=name) if name in CONSTANTS:
                return lambda xp, of, x=CONSTANTS[name]: x  # type: ignore[misc]
            case ast.Name(id=name) if name not in FUNCTIONS:
                names[name] = None
                return lambda xp, of: of[name]
            case ast.UnaryOp(op=ast.USub(), operand=inner):
                value = self._compiled(inner, names)
                return lambda xp, of: -value(xp, of)
            case ast.UnaryOp(op=ast.UAdd(), operand=inner):
                return self._compiled(inner, names)
            case ast.BinOp(op=ast.Pow(), left=base, right=ast.Constant(value=int(power))) if (
                0 < power <= MOST_POWER and not isinstance(power, bool)
            ):
                return self._power(self._compiled(base, names), power)
            case ast.BinOp(op=ast.Div(), right=ast.Constant(value=number)) if number == 0:
                raise InputError(f"{shown(self.text)}: {ast.unparse(node)} divides by zero")
            case ast.BinOp(op=ast.Pow(), left=base, right=ast.Constant(value=float(power))):
                # of a positive number, such as the pressure of a gas
                value, exponent = self._compiled(base, names), float(power)
                return lambda xp, of: xp.exp(exponent * xp.log(value(xp, of)))
            case ast.BinOp(op=op, left=left, right=right) if type(op) in _OPERATORS:
                a, b, apply = self._compiled(left, names), self._compiled(right, names), _OPERATORS[type(op)]
                return lambda xp, of: apply(a(xp, of), b(xp, of))
            case ast.Call(func=ast.Name(id=name), args=args, keywords=[]):
                return self._call(name, [self._compiled(each, names) for each in args])
        raise InputError(
            f"{shown(self.text)}: {ast.unparse(node)} cannot be computed; an expression has numbers, names, "
            f"+ - * /, powers (whole ones up to {MOST_POWER}), brackets, and {', '.join(FUNCTIONS)}"
        )

    @staticmethod
    def _power(base: Evaluation, power: int) -> Evaluation:
        def value(xp: Any, of: Mapping[str, Any]) -> Any:
            x = result = base(xp, of)
            for _ in range(power - 1):
                result = result * x
            return result

        return value

    def _call(self, name: str, args: list[Evaluation]) -> Evaluation:
        wanted = 2 if name in _TWO else 1
        if name not in FUNCTIONS:
            raise InputError(
                f"{shown(self.text)}: no function {name}{meant(name, FUNCTIONS)} known here: "
                f"{', '.join(FUNCTIONS)}"
            )
        if len(args) != wanted:
            raise InputError(
                f"{shown(self.text)}: {name} has {wanted} argument{'s' * (wanted > 1)}, not {len(args)}"
            )
        if name == "tan":
            return lambda xp, of: (lambda x: xp.sin(x) / xp.cos(x))(args[0](xp, of))
        if name in _TWO:
            return lambda xp, of: getattr(xp, _TWO[name])(args[0](xp, of), args[1](xp, of))
        return lambda xp, of: getattr(xp, name)(args[0](xp, of))


@cache
def expression(text: str) -> Expression:
    """The expression of a text."""
    return Expression(text)


def value_of(xp: Any, given: float | str, of: Mapping[str, Any]) -> Any:
    """The value of a number or of the text of an expression."""
    return expression(given).value(xp, of) if isinstance(given, str) else given
