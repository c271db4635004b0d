"""Python of a model's functions, printed from the list of operations: it needs the standard library alone."""

from __future__ import annotations

import math
from collections.abc import Iterable

from .kernels import ModelFunction
from .operations import ARGUMENT, NUMBER, Operation, Operations
from .python_functions import function_text

_RARE = "sqrt exp log pow sin cos tan asin acos sinh cosh fmod floor ceil".split()
"""Functions that `math` refuses to compute out of their domains."""


def _forms() -> dict[str, str]:
    """The form of each operation in Python, by its kind."""
    signs = {"ADD": "+", "SUB": "-", "MUL": "*", "DIV": "/", "LT": "<", "LE": "<=", "EQ": "==", "NE": "!="}
    unary = "sqrt exp log sin cos tan asin acos atan sinh cosh tanh floor ceil sign"
    forms = {kind: f"{{0}}{text}{{1}}" for kind, text in signs.items()}
    forms |= {name.upper(): f"{name}({{0}})" for name in unary.split()}
    forms |= {name.upper(): f"{name}({{0}},{{1}})" for name in ("pow", "fmod", "atan2", "copysign")}
    return forms | {
        "AND": "bool({0} and {1})",
        "OR": "bool({0} or {1})",
        "NOT": "not {0}",
        "NEG": "-{0}",
        "SQ": "{0}*{0}",
        "TWICE": "2.0*{0}",
        "INV": "1.0/{0}",
        "FABS": "abs({0})",
        "FMIN": "min({0},{1})",
        "FMAX": "max({0},{1})",
        "IF_ELSE_ZERO": "{1} if {0} else 0.0",
        "CONSTPOW": "pow({0},{1})",
        "ASSIGN": "{0}",
    }


def _rare_forms() -> dict[str, str]:
    """The forms of a function that is called once, which does not raise an error for a value out of a domain."""
    forms = _forms() | {"DIV": "Quotient({0},{1})", "INV": "Quotient(1.0,{0})"}
    for kind in (*map(str.upper, _RARE), "CONSTPOW"):
        forms[kind] = forms[kind][0].upper() + forms[kind][1:]
    return forms


def python_text(functions: Iterable[ModelFunction]) -> str:
    """The text of these functions, each ``NAME(p, u, ...)``: its arguments are sequences of numbers, its results a
    tuple of all groups. The text takes names from `math` and from `python_math`."""
    return "\n\n".join(
        function_text(f"def {function.name}({', '.join(function.takes)}):", *python_statements(function))
        for function in functions
    )


def python_statements(function: ModelFunction) -> tuple[list[str], list[str]]:
    """The statements of a function, as `function_text` takes them, and the expressions of its results."""
    operations = Operations(function.arguments, function.groups)
    forms = _rare_forms() if function.frequency == "ONCE" else _forms()
    texts: list[str] = []
    statements: list[str] = []
    for place, item in enumerate(operations.items):
        text = _text(item, function.takes, forms, texts)
        if item.kind != NUMBER:
            statements.append(f"a{place}={text}")
            text = f"a{place}"
        texts.append(text)
    return statements, [texts[place] for group in operations.results for place in group]


def _text(item: Operation, takes: str, forms: dict[str, str], texts: list[str]) -> str:
    """An operation in Python, from the texts of all before it."""
    if item.kind == NUMBER:
        return "nan" if math.isnan(item.value) else repr(float(item.value))
    if item.kind == ARGUMENT:
        argument, entry = item.entry
        return f"{takes[argument]}[{entry}]"
    return forms[item.kind].format(*(texts[operand] for operand in item.operands))
