"""Expressions of named quantities, such as ``2 * r + sqrt(l * l - r * r)``, for any engine.

Standard library only: FMUs carry this file.
"""

from __future__ import annotations

import ast
import math
import re
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from itertools import pairwise
from typing import Any, NamedTuple

from ..core.engines import MATH
from ..core.errors import InputError, meant, shown
from .curves import TableCurve, positive, ramp, step

Evaluation = Callable[[Any, Mapping[str, Any]], Any]
"""The value of an expression: of the engine and the quantities by name."""

_ONE = ("sin", "cos", "sqrt", "asin", "acos", "exp", "log", "abs")
_TWO = {"atan2": "atan2", "min": "minimum", "max": "maximum"}
SMOOTH: Mapping[str, tuple[str, ...]] = {
    "step": ("x", "width"),
    "positive": ("x", "width"),
    "ramp": ("x", "begin", "end"),
    "where": ("x > limit", "then", "else", "width"),
    "table": ("x", "NAME of a table, or x1, y1, x2, y2, ..."),
}
"""Smooth functions and their arguments."""
EXTREMES = ("min", "max", "stroke")
"""Functions that have one argument, a place of the motion, and give its extremes over the way of the driver."""
WORDS = (*_ONE, "tan", *_TWO)
"""Functions whose names no quantity can have."""
FUNCTIONS = (*WORDS, "stroke", *SMOOTH)
CONSTANTS = {"pi": math.pi, "deg": math.pi / 180.0}
"""Names that every expression knows; ``30 * deg`` is an angle in radians."""
_OPERATORS: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: lambda a, b: a + b,
    ast.Sub: lambda a, b: a - b,
    ast.Mult: lambda a, b: a * b,
    ast.Div: lambda a, b: a / b,
}
MOST_POWER = 12
_KERNELS: Mapping[str, Callable[..., Any]] = {"step": step, "positive": positive, "ramp": ramp}
_PLACE = re.compile(r"\w+(\.\w+){0,2}")
_SWITCH = (
    "there is no if: a value is switched smoothly, over a width: where(vx > 0, 500, 0, 0.01) is 500 where vx is "
    "above 0.005 and 0 where it is below -0.005; step(vx, 0.01) is 1 and 0 there"
)
_EXTREME = (
    "min, max and stroke of a place of the motion are written min(LINK.POINT.y), max(LINK.POINT.x), "
    "stroke(LINK.angle), or min(y) at the point of the load"
)


class Width(NamedTuple):
    """The width of a smooth function in an expression: the text of its call, and the width itself. That of a `ramp`,
    its end less its begin, may be below zero; no width may be zero."""

    call: str
    of: Expression
    falls: bool

    @property
    def is_number(self) -> bool:
        """Whether it depends on no quantity."""
        return not (self.of.names or self.of.extremes or self.of.tables)

    def value(self, values: Mapping[str, Any]) -> float:
        """Its value; NaN where it has none."""
        try:
            return float(self.of.value(MATH, values))
        except (ArithmeticError, ValueError):
            return math.nan

    def fault(self, value: float) -> str:
        """Words on a value that no width can have; empty for one that is right."""
        if self.falls:
            return "" if abs(value) > 0.0 else f"the begin and the end of {self.call} must differ"
        return "" if value > 0.0 else f"the width of {self.call} is {value:.6g}; must be > 0"


class Expression:
    """An expression: its text, the `names` of the quantities in it, of its `extremes` (such as ``min(ram.C.y)``) and
    of its `tables`, its value, of the engine and all of these by name, and the `widths` of its smooth functions.

    Raises
    ------
    InputError
        for a text that is no expression, or has a width that is a number and not above zero, in one line.
    """

    def __init__(self, text: str) -> None:
        self.text = text
        try:
            tree = ast.parse(text.strip(), mode="eval").body
        except (SyntaxError, ValueError, RecursionError, MemoryError):
            if re.search(r"\bif\b", text):
                raise InputError(f"{shown(text)}: {_SWITCH}") from None
            raise InputError(
                f"{shown(text)} is no number with a unit and no expression, such as 2 * r + 0.01"
            ) from None
        self._names: dict[str, None] = {}
        self._extremes: dict[str, None] = {}
        self._tables: dict[str, None] = {}
        self.widths: list[Width] = []
        self.value: Evaluation = self._compiled(tree)
        self.names, self.extremes = tuple(self._names), tuple(self._extremes)
        self.tables = tuple(self._tables)
        for width in self.widths:
            if width.is_number and (wrong := width.fault(width.value({}))):
                raise InputError(f"{shown(self.text)}: {wrong}")

    def _compiled(self, node: ast.AST) -> Evaluation:
        match node:
            case ast.Constant(value=int() | float() as number) if not isinstance(number, bool):
                return lambda xp, of, x=float(number): x  # type: ignore[misc]
            case ast.Name(id=name) if name in CONSTANTS:
                return lambda xp, of, x=CONSTANTS[name]: x  # type: ignore[misc]
            case ast.Name(id=name) if name not in WORDS:
                self._names[name] = None
                return lambda xp, of: of[name]
            case ast.UnaryOp(op=ast.USub(), operand=inner):
                value = self._compiled(inner)
                return lambda xp, of: -value(xp, of)
            case ast.UnaryOp(op=ast.UAdd(), operand=inner):
                return self._compiled(inner)
            case ast.BinOp(op=ast.Pow(), left=base, right=ast.Constant(value=int(power))) if (
                0 < power <= MOST_POWER and not isinstance(power, bool)
            ):
                return self._power(self._compiled(base), power)
            case ast.BinOp(op=ast.Div(), right=ast.Constant(value=number)) if number == 0:
                raise InputError(f"{shown(self.text)}: {ast.unparse(node)} divides by zero")
            case ast.BinOp(op=ast.Pow(), left=base, right=ast.Constant(value=float(power))):
                # of a positive number, such as the pressure of a gas
                value, exponent = self._compiled(base), float(power)
                return lambda xp, of: xp.exp(exponent * xp.log(value(xp, of)))
            case ast.BinOp(op=op, left=left, right=right) if type(op) in _OPERATORS:
                a, b, apply = self._compiled(left), self._compiled(right), _OPERATORS[type(op)]
                return lambda xp, of: apply(a(xp, of), b(xp, of))
            case ast.Call(func=ast.Name(id=name), args=[place], keywords=[]) if name in EXTREMES:
                return self._extreme(name, place)
            case ast.Call(func=ast.Name(id="table"), args=[x, *rest], keywords=[]) if rest:
                return self._table(self._compiled(x), rest)
            case ast.Call(func=ast.Name(id="where"), args=[condition, *rest], keywords=[]) if len(rest) == 3:
                value = self._where(condition, [self._compiled(each) for each in rest])
                self._keep_width(node, ast.unparse(rest[2]))
                return value
            case ast.Call(func=ast.Name(id=("where" | "table") as name)):
                raise self._written(name)
            case ast.Call(func=ast.Name(id=name), args=args, keywords=[]):
                value = self._call(name, [self._compiled(each) for each in args])
                match name, args:
                    case (("step" | "positive"), [_, width]):
                        self._keep_width(node, ast.unparse(width))
                    case "ramp", [_, begin, end]:
                        self._keep_width(node, f"({ast.unparse(end)}) - ({ast.unparse(begin)})", falls=True)
                return value
            case ast.Compare() | ast.IfExp() | ast.BoolOp():
                raise InputError(f"{shown(self.text)}: {_SWITCH}")
            case ast.Tuple():
                raise InputError(f"{shown(self.text)}: numbers have a decimal point, no comma")
            case ast.Attribute():
                raise InputError(
                    f"{shown(self.text)}: {ast.unparse(node)} is known as an extreme alone: {_EXTREME}"
                )
        raise InputError(
            f"{shown(self.text)}: {ast.unparse(node)} cannot be computed; an expression has numbers, names, "
            f"+ - * /, powers (whole ones up to {MOST_POWER}), brackets, and {', '.join(FUNCTIONS)}"
        )

    def _keep_width(self, call: ast.AST, text: str, falls: bool = False) -> None:
        self.widths.append(Width(ast.unparse(call), Expression(text), falls))

    @staticmethod
    def _power(base: Evaluation, power: int) -> Evaluation:
        def value(xp: Any, of: Mapping[str, Any]) -> Any:
            x = result = base(xp, of)
            for _ in range(power - 1):
                result = result * x
            return result

        return value

    def _extreme(self, name: str, place: ast.AST) -> Evaluation:
        text = ast.unparse(place)
        if not _PLACE.fullmatch(text):
            raise InputError(
                f"{shown(self.text)}: {name} of {text}: {name} has two arguments, or is an extreme: {_EXTREME}"
                if name in _TWO
                else f"{shown(self.text)}: {name} of {text}: {_EXTREME}"
            )
        if name == "stroke":
            self._extremes |= dict.fromkeys((f"max({text})", f"min({text})"))
            return lambda xp, of: of[f"max({text})"] - of[f"min({text})"]
        self._extremes[f"{name}({text})"] = None
        return lambda xp, of: of[f"{name}({text})"]

    def _where(self, condition: ast.AST, rest: Sequence[Evaluation]) -> Evaluation:
        match condition:
            case ast.Compare(left=left, ops=[ast.Gt() | ast.GtE()], comparators=[right]):
                above, below = self._compiled(left), self._compiled(right)
            case ast.Compare(left=left, ops=[ast.Lt() | ast.LtE()], comparators=[right]):
                above, below = self._compiled(right), self._compiled(left)
            case _:
                raise InputError(
                    f"{shown(self.text)}: {ast.unparse(condition)}: the first argument of where is one comparison, "
                    "such as vx > 0"
                )
        then, other, width = rest

        def value(xp: Any, of: Mapping[str, Any]) -> Any:
            no = other(xp, of)
            share = step(xp, above(xp, of) - below(xp, of), width(xp, of))
            return no + share * (then(xp, of) - no)

        return value

    def _table(self, x: Evaluation, rest: Sequence[ast.AST]) -> Evaluation:
        if len(rest) == 1 and isinstance(rest[0], ast.Name):
            name = rest[0].id
            self._tables[name] = None
            return lambda xp, of: of[f"table {name}"].value(xp, x(xp, of))
        names = dict(self._names)
        numbers = [self._compiled(each) for each in rest]
        if self._names != names or len(numbers) < 4 or len(numbers) % 2:
            raise InputError(
                f"{shown(self.text)}: table has x, then the name of a table, or two or more pairs of numbers: "
                "table(x, x1, y1, x2, y2)"
            )
        values = [float(each(MATH, {})) for each in numbers]
        places = values[::2]
        if any(b <= a for a, b in pairwise(places)):
            raise InputError(f"{shown(self.text)}: the places x1, x2, ... of the table must rise")
        curve = TableCurve(places, values[1::2], turns=False)
        return lambda xp, of: curve.value(xp, x(xp, of))

    def _call(self, name: str, args: list[Evaluation]) -> Evaluation:
        if name not in FUNCTIONS:
            raise InputError(
                f"{shown(self.text)}: no function {name}{meant(name, FUNCTIONS)} known here: "
                f"{', '.join(FUNCTIONS)}"
            )
        if name in (*SMOOTH, "stroke"):
            kernel = _KERNELS.get(name)
            if kernel is None or len(args) != len(SMOOTH[name]):
                raise self._written(name)
            return lambda xp, of: kernel(xp, *(each(xp, of) for each in args))
        wanted = 2 if name in _TWO else 1
        if len(args) != wanted:
            raise InputError(
                f"{shown(self.text)}: {name} has {wanted} argument{'s' * (wanted > 1)}, not {len(args)}"
            )
        if name == "tan":
            return lambda xp, of: (lambda x: xp.sin(x) / xp.cos(x))(args[0](xp, of))
        if name in _TWO:
            return lambda xp, of: getattr(xp, _TWO[name])(args[0](xp, of), args[1](xp, of))
        return lambda xp, of: getattr(xp, name)(args[0](xp, of))

    def _written(self, name: str) -> InputError:
        wanted = ", ".join(SMOOTH.get(name, ("LINK.POINT.y",)))
        comma = "; numbers have a decimal point" * bool(re.search(r"\d,\d", self.text))
        return InputError(f"{shown(self.text)}: {name} is written {name}({wanted}){comma}")


@cache
def expression(text: str) -> Expression:
    """The expression of a text."""
    return Expression(text)


def value_of(xp: Any, given: float | str, of: Mapping[str, Any]) -> Any:
    """The value of a number or of the text of an expression."""
    return expression(given).value(xp, of) if isinstance(given, str) else given
