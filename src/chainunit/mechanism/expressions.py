"""Expressions of named quantities, such as ``2 * r + sqrt(l * l - r * r)``, for any engine."""

from __future__ import annotations

import ast
import math
import re
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from itertools import chain, pairwise
from typing import Any, NamedTuple

from ..core.engines import MATH
from ..core.errors import InputError, meant, shown
from ..core.jets import Jet, jet, variable
from ..groups.driver import Course
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
MOST_NESTED = 100
"""Largest number of brackets, functions and signs inside each other; a sum or product of many terms is one."""
MOST_TERMS = 1000
"""Largest number of terms of a sum or product."""
LONGEST = 10_000
"""Largest number of letters of an expression."""
_KERNELS: Mapping[str, Callable[..., Any]] = {"step": step, "positive": positive, "ramp": ramp}
_PLACE = re.compile(r"\w+(\.\w+){0,2}")
_SWITCH = (
    "there is no if: a value is switched smoothly, over a width: where(vx > 0, 500, 0, 0.01) is 500 where vx is "
    "above 0.005 and 0 where it is below -0.005; step(vx, 0.01) is 1 and 0 there"
)
_SPLIT = "; name a part of it as a parameter of its own, or take a table"
_EXTREME = (
    "min, max and stroke of a place of the motion are written min(LINK.POINT.y), max(LINK.POINT.x), "
    "stroke(LINK.angle), or min(y) at the point of the load"
)


class Term(NamedTuple):
    """A part of an expression: its `value`, and the names of the quantities, extremes and tables in it."""

    value: Evaluation
    names: tuple[str, ...] = ()
    extremes: tuple[str, ...] = ()
    tables: tuple[str, ...] = ()

    @classmethod
    def of(cls, value: Evaluation, *terms: Term) -> Term:
        """The value of a function of some `terms`, with the names in them."""
        names, extremes, tables = (
            tuple(dict.fromkeys(chain.from_iterable(parts)))
            for parts in (
                [term.names for term in terms],
                [term.extremes for term in terms],
                [term.tables for term in terms],
            )
        )
        return cls(value, names, extremes, tables)

    @property
    def is_number(self) -> bool:
        """Whether it depends on no quantity."""
        return not (self.names or self.extremes or self.tables)

    def number(self, values: Mapping[str, Any]) -> float:
        """Its value as a number; NaN where it has none."""
        try:
            return float(self.value(MATH, values))
        except (ArithmeticError, ValueError):
            return math.nan


class Width(NamedTuple):
    """The width of a smooth function in an expression: the text of its call, and the width itself. That of a `ramp`,
    its end less its begin, may be below zero; no width may be zero."""

    call: str
    of: Term
    falls: bool

    def fault(self, value: float) -> str:
        """Words on a value that no width can have; empty for one that is right."""
        if self.falls:
            return "" if abs(value) > 0.0 else f"the begin and the end of {self.call} must differ"
        return "" if value > 0.0 else f"the width of {self.call} is {value:.6g}; must be > 0"


class Expression:
    """An expression: its text, the `names` of the quantities in it, of its `extremes` (such as ``min(ram.C.y)``) and
    of its `tables`, its `value`, of the engine and all of these by name, the `widths` of its smooth functions, and
    its `tree`.

    Raises
    ------
    InputError
        for a text that is no expression, is too long or too deep, has a part that is a number and not finite, or a
        width that is a number and not above zero, in one line.
    """

    def __init__(self, text: str) -> None:
        self.text, self._depth = text, 0
        self.widths: list[Width] = []
        self.lookups: list[str] = []
        self.points: list[int] = []
        if len(text) > LONGEST:
            raise InputError(f"{shown(text)}: has {len(text)} letters; must have <= {LONGEST}{_SPLIT}")
        try:
            self.tree = ast.parse(text.strip(), mode="eval").body
            whole = self._term(self.tree)
        except (RecursionError, MemoryError):
            raise self._too_deep() from None
        except (SyntaxError, ValueError) as error:
            if isinstance(error, InputError):
                raise
            if re.search(r"\bif\b", text):
                raise InputError(f"{shown(text)}: {_SWITCH}") from None
            if "nested" in str(error):
                raise self._too_deep() from None
            united = re.search(r"\d [A-Za-z]", text)
            hint = ": no unit stands in one, take a parameter" if united else ", such as 2 * r + 0.01"
            raise InputError(f"{shown(text)} is no number with a unit and no expression{hint}") from None
        self.value, self.number = whole.value, whole.number
        self.names, self.extremes, self.tables = whole.names, whole.extremes, whole.tables

    def _too_deep(self) -> InputError:
        return InputError(f"{shown(self.text)}: is nested more than {MOST_NESTED} times{_SPLIT}")

    def words(self, node: ast.AST) -> str:
        """The text of a node of its `tree`."""
        return " ".join((ast.get_source_segment(self.text.strip(), node) or "").split())

    def _term(self, node: ast.AST) -> Term:
        """The term of a node; a number is computed here, once."""
        self._depth += 1
        if self._depth > MOST_NESTED:
            raise self._too_deep()
        term = self._compiled(node)
        self._depth -= 1
        if not term.is_number:
            return term
        number = term.number({})
        if not math.isfinite(number):
            raise InputError(f"{shown(self.text)}: {self.words(node)} has no value, or an infinite one")
        return Term(lambda xp, quantities: number)

    def _compiled(self, node: ast.AST) -> Term:
        """The term of a node by its kind: a number, a name, a sign, a power, a sum or product, a function. Any other
        node is refused, with what to write in its place."""
        match node:
            case ast.Constant(value=int() | float() as number) if not isinstance(number, bool):
                return Term(lambda xp, quantities: as_float(number))
            case ast.Name(id=name) if name in CONSTANTS:
                return Term(lambda xp, quantities: CONSTANTS[name])
            case ast.Name(id=name) if name not in WORDS:
                return Term(lambda xp, quantities: quantities[name], (name,))
            case ast.UnaryOp(op=ast.USub(), operand=inner):
                term = self._term(inner)
                return Term.of(lambda xp, quantities: -term.value(xp, quantities), term)
            case ast.UnaryOp(op=ast.UAdd(), operand=inner):
                return self._term(inner)
            case ast.BinOp(op=ast.Pow(), left=base, right=ast.Constant(value=int(power))) if (
                0 < power <= MOST_POWER and not isinstance(power, bool)
            ):
                return self._power(self._term(base), power)
            case ast.BinOp(op=ast.Pow(), left=base, right=ast.Constant(value=float(power))):
                # of a positive number, such as the pressure of a gas
                term, exponent = self._term(base), float(power)
                return Term.of(
                    lambda xp, quantities: xp.exp(exponent * xp.log(term.value(xp, quantities))), term
                )
            case ast.BinOp(op=op) if type(op) in _OPERATORS:
                return self._chain(node)
            case ast.Call(func=ast.Name(id=name), args=[place], keywords=[]) if name in EXTREMES:
                return self._extreme(name, place)
            case ast.Call(func=ast.Name(id="table"), args=[x, *rest], keywords=[]) if rest:
                return self._table(self._term(x), rest)
            case ast.Call(func=ast.Name(id="where"), args=[condition, *rest], keywords=[]) if len(rest) == 3:
                terms = [self._term(argument) for argument in rest]
                term = self._where(condition, terms)
                self._keep_width(node, terms[2])
                return term
            case ast.Call(func=ast.Name(id=("where" | "table") as name)):
                raise self._written(name)
            case ast.Call(func=ast.Name(id=name), args=args, keywords=[]):
                terms = [self._term(argument) for argument in args]
                term = self._call(name, terms)
                match name, terms:
                    case (("step" | "positive"), [_, width]):
                        self._keep_width(node, width)
                    case "ramp", [_, begin, end]:
                        width = Term.of(
                            lambda xp, quantities: end.value(xp, quantities) - begin.value(xp, quantities),
                            begin,
                            end,
                        )
                        self._keep_width(node, width, falls=True)
                return term
            case ast.Compare() | ast.IfExp() | ast.BoolOp():
                raise InputError(f"{shown(self.text)}: {_SWITCH}")
            case ast.Tuple():
                raise InputError(f"{shown(self.text)}: numbers have a decimal point, no comma")
            case ast.Attribute():
                raise InputError(
                    f"{shown(self.text)}: {self.words(node)} is known as an extreme alone: {_EXTREME}"
                )
        raise InputError(
            f"{shown(self.text)}: {self.words(node)} cannot be computed; an expression has numbers, names, "
            f"+ - * /, powers (whole ones up to {MOST_POWER}), brackets, and {', '.join(FUNCTIONS)}"
        )

    def _chain(self, node: ast.AST) -> Term:
        """A sum or a product of any number of terms, from left to right."""
        first, steps = parts_of_chain(node)
        if len(steps) >= MOST_TERMS:
            raise InputError(
                f"{shown(self.text)}: has {len(steps) + 1} terms; must have <= {MOST_TERMS}{_SPLIT}"
            )
        terms = [self._term(first), *(self._term(right) for _, _, right in steps)]
        for (whole, op, _), divisor in zip(steps, terms[1:], strict=True):
            if isinstance(op, ast.Div) and divisor.is_number and divisor.number({}) == 0.0:
                raise InputError(f"{shown(self.text)}: {self.words(whole)} divides by zero")
        rest = [(_OPERATORS[type(op)], term.value) for (_, op, _), term in zip(steps, terms[1:], strict=True)]
        begin = terms[0].value

        def value(xp: Any, quantities: Mapping[str, Any]) -> Any:
            result = begin(xp, quantities)
            for apply, right in rest:
                result = apply(result, right(xp, quantities))
            return result

        return Term.of(value, *terms)

    def _keep_width(self, call: ast.AST, width: Term, falls: bool = False) -> None:
        """Keep the `width` over which the function of a `call` changes, and refuse a number that is wrong."""
        kept = Width(self.words(call), width, falls)
        if width.is_number and (wrong := kept.fault(width.number({}))):
            raise InputError(f"{shown(self.text)}: {wrong}")
        self.widths.append(kept)

    @staticmethod
    def _power(base: Term, power: int) -> Term:
        """A whole power, as a product: `xp` may have symbols."""

        def value(xp: Any, quantities: Mapping[str, Any]) -> Any:
            x = result = base.value(xp, quantities)
            for _ in range(power - 1):
                result = result * x
            return result

        return Term.of(value, base)

    def _extreme(self, name: str, place: ast.AST) -> Term:
        """The extreme of a place of the motion by its function, such as ``max(ram.C.y)``: a quantity by that name. A
        stroke is the difference of two."""
        cited = self.words(place)
        text = cited.replace(" ", "")
        if not _PLACE.fullmatch(text):
            raise InputError(
                f"{shown(self.text)}: {name} of {cited}: {name} has two arguments, or is an extreme: {_EXTREME}"
                if name in _TWO
                else f"{shown(self.text)}: {name} of {cited}: {_EXTREME}"
            )
        if name == "stroke":
            return Term(
                lambda xp, quantities: quantities[f"max({text})"] - quantities[f"min({text})"],
                extremes=(f"max({text})", f"min({text})"),
            )
        return Term(lambda xp, quantities: quantities[f"{name}({text})"], extremes=(f"{name}({text})",))

    def _where(self, condition: ast.AST, rest: Sequence[Term]) -> Term:
        """The term of ``where(a > b, then, other, width)``: it goes smoothly from `other` to `then` while a - b goes
        over the width; `rest` are the last three arguments."""
        match condition:
            case ast.Compare(left=left, ops=[ast.Gt() | ast.GtE()], comparators=[right]):
                above, below = self._term(left), self._term(right)
            case ast.Compare(left=left, ops=[ast.Lt() | ast.LtE()], comparators=[right]):
                above, below = self._term(right), self._term(left)
            case _:
                raise InputError(
                    f"{shown(self.text)}: {self.words(condition)}: the first argument of where is one comparison, "
                    "such as vx > 0"
                )
        then, other, width = rest

        def value(xp: Any, quantities: Mapping[str, Any]) -> Any:
            no = other.value(xp, quantities)
            share = step(
                xp, above.value(xp, quantities) - below.value(xp, quantities), width.value(xp, quantities)
            )
            return no + share * (then.value(xp, quantities) - no)

        return Term.of(value, above, below, then, other, width)

    def _table(self, x: Term, rest: Sequence[ast.AST]) -> Term:
        """The term of a table at `x`: one of the file, if `rest` is its name, or one of the pairs of numbers in
        `rest`."""
        if len(rest) == 1 and isinstance(rest[0], ast.Name):
            name = rest[0].id
            self.lookups.append(name)
            return Term(
                lambda xp, quantities: quantities[f"table {name}"].value(xp, x.value(xp, quantities)),
                x.names,
                x.extremes,
                (*x.tables, name),
            )
        numbers = [self._term(argument) for argument in rest]
        if not all(number.is_number for number in numbers) or len(numbers) < 4 or len(numbers) % 2:
            raise InputError(
                f"{shown(self.text)}: table has x, then the name of a table, or two or more pairs of numbers: "
                "table(x, x1, y1, x2, y2)"
            )
        values = [number.number({}) for number in numbers]
        places = values[::2]
        if any(b <= a for a, b in pairwise(places)):
            raise InputError(f"{shown(self.text)}: the places x1, x2, ... of the table must rise")
        self.points.append(len(places))
        curve = TableCurve(places, values[1::2], turns=False)
        return Term.of(lambda xp, quantities: curve.value(xp, x.value(xp, quantities)), x)

    def _call(self, name: str, args: list[Term]) -> Term:
        """The term of a function of other terms: a smooth one, of two numbers, or one of the engine's."""
        if name not in FUNCTIONS:
            raise InputError(
                f"{shown(self.text)}: no function {name}{meant(name, FUNCTIONS)} known here: "
                f"{', '.join(FUNCTIONS)}"
            )
        if name in (*SMOOTH, "stroke"):
            kernel = _KERNELS.get(name)
            if kernel is None or len(args) != len(SMOOTH[name]):
                raise self._written(name)
            return Term.of(
                lambda xp, quantities: kernel(xp, *(argument.value(xp, quantities) for argument in args)),
                *args,
            )
        wanted = 2 if name in _TWO else 1
        if len(args) != wanted:
            raise InputError(
                f"{shown(self.text)}: {name} has {wanted} argument{'s' * (wanted > 1)}, not {len(args)}"
            )
        first = args[0].value
        if name == "tan":
            return Term.of(
                lambda xp, quantities: (lambda x: xp.sin(x) / xp.cos(x))(first(xp, quantities)), *args
            )
        if name in _TWO:
            second = args[1].value
            return Term.of(
                lambda xp, quantities: getattr(xp, _TWO[name])(first(xp, quantities), second(xp, quantities)),
                *args,
            )
        return Term.of(lambda xp, quantities: getattr(xp, name)(first(xp, quantities)), *args)

    def _written(self, name: str) -> InputError:
        wanted = ", ".join(SMOOTH.get(name, ("LINK.POINT.y",)))
        comma = "; numbers have a decimal point" * bool(re.search(r"\d,\d", self.text))
        return InputError(f"{shown(self.text)}: {name} is written {name}({wanted}){comma}")


def parts_of_chain(node: ast.AST) -> tuple[ast.AST, list[tuple[ast.AST, ast.operator, ast.AST]]]:
    """The first term of a sum or product, and by each further one the node that it ends, its sign, and itself."""
    steps: list[tuple[ast.AST, ast.operator, ast.AST]] = []
    while isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS:
        steps.append((node, node.op, node.right))
        node = node.left
    return node, steps[::-1]


def as_float(number: float) -> float:
    """A number as a float; infinite if it is too large."""
    try:
        return float(number)
    except OverflowError:
        return math.inf


@cache
def expression(text: str) -> Expression:
    """The expression of a text."""
    return Expression(text)


def value_of(xp: Any, entry: float | str, quantities: Mapping[str, Any]) -> Any:
    """The value of a number or of the text of an expression."""
    return expression(entry).value(xp, quantities) if isinstance(entry, str) else entry


class LawCourse(NamedTuple):
    """A course by a `law`: an expression of ``phi``, of quantities with `values`, and of `tables` over ``phi``."""

    law: float | str
    values: Mapping[str, Any]
    tables: Mapping[str, TableCurve]

    def __call__(self, xp: Any, q: Any) -> Course:
        """The place and its derivatives at the place `q` of the first driver."""
        engine, phi = jet(xp), variable(q)
        names = expression(self.law).names if isinstance(self.law, str) else ()
        over_phi = {name: table.value(engine, phi) for name, table in self.tables.items() if name in names}
        place = value_of(engine, self.law, {**self.values, **over_phi, "phi": phi})
        return Course(place.parts[0], place.parts[1:]) if isinstance(place, Jet) else held(place)


def held(place: Any) -> Course:
    """The course of a driver that stands at a place."""
    return Course(place, (0.0, 0.0, 0.0))


def splines(tables: Mapping[str, Mapping[str, Any]], turns: bool) -> dict[str, TableCurve]:
    """The tables over the place of the first driver, which may turn round, as laws take them."""
    return {
        name: TableCurve(table["places"], table["values"], turns, spline=True)
        for name, table in tables.items()
        if table["over"] == "phi"
    }
