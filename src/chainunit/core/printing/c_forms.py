"""Numbers and operations as C."""

from __future__ import annotations

import math
from importlib import resources
from typing import Any


def forms() -> dict[str, str]:
    """The form of each operation in C, by its kind."""
    signs = {"ADD": "+", "SUB": "-", "MUL": "*", "DIV": "/", "LT": "<", "LE": "<=", "EQ": "==", "NE": "!="}
    signs |= {"AND": "&&", "OR": "||"}
    unary = "sqrt exp log sin cos tan asin acos atan sinh cosh tanh floor ceil fabs"
    binary = "fmin fmax pow fmod atan2 copysign"
    forms = {"SQ": "({0}*{0})", "TWICE": "(2.0*{0})", "INV": "(1.0/{0})", "NEG": "(-{0})", "NOT": "(!{0})"}
    forms |= {
        "IF_ELSE_ZERO": "({0}?{1}:0.0)",
        "SIGN": "sign({0})",
        "CONSTPOW": "pow({0},{1})",
        "ASSIGN": "{0}",
    }
    forms |= {name: f"({{0}}{sign}{{1}})" for name, sign in signs.items()}
    forms |= {name.upper(): f"{name}({{0}})" for name in unary.split()}
    return forms | {name.upper(): f"{name}({{0}},{{1}})" for name in binary.split()}


def number(x: float) -> str:
    """A number in C."""
    if math.isnan(x):
        return "NAN"
    text = "INFINITY" if math.isinf(x) else repr(abs(float(x)))
    return f"(-{text})" if math.copysign(1.0, x) < 0.0 else text


STEP = "step.h"
"""The file with the steps of the integrators in C."""


def c_file(name: str, package: str = __package__) -> str:
    """The text of a C file of a package, by default of this one."""
    return (resources.files(package) / name).read_text("utf-8")


def constant(name: str, value: Any) -> str:
    """The definition of a number, an array, or an array of rows; zeros fill up the shorter rows."""
    if not isinstance(value, tuple):
        return f"#define {name} {number(value)}"
    if not isinstance(value[0], tuple):
        return f"static const double {name}[{len(value)}] = {{{', '.join(map(number, value))}}};"
    rows = ",\n".join(f"    {{{', '.join(map(number, row)) or '0.0'}}}" for row in value)
    return f"static const double {name}[{len(value)}][{max(map(len, value))}] = {{\n{rows},\n}};"
