"""JavaScript of models, printed from the operations of their functions (`chainunit.core.printing.kernels`).

`program` is an expression, whose value has an object for each model: its numbers as arrays, and functions that
compute from some of these arrays to others. They call no function of the host but a root, a size, a sign, a rounding
to whole numbers and the smaller or larger of two numbers, which have one result: the bits are those of native code.
Nothing is evaluated from texts, so that it runs under a content policy that admits scripts alone.

``p``, ``u``, ``x``, ``k``
    parameters, inputs, states, and the values derived from the parameters
``derive()``
    the derived values; to be called after each change of a parameter
``values()``
    to ``y``, the outputs
``derivatives()``
    to ``rates``, the derivatives of the states
``requirements()``, ``start_limits()``
    to ``requirements_`` and ``start_limits_``: value, lower and upper limit of each requirement on the parameters,
    and on the states at the start
``start()``, ``run(...)``
    the states at the start, and a run in the time, see ``steps.js``
``about``
    names and numbers of all these, as JSON has them
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict
from importlib.resources import files
from itertools import chain, count
from typing import Any

from ..engines import casadi_
from ..errors import InputError
from ..model import Model
from ..symbolic_trace import chosen_columns, outputs_of, trace
from .division import Division
from .elementary import OWN, is_pair, recording
from .kernels import STEP_NUMBERS, ModelFunction, kernels
from .operations import ARGUMENT, NUMBER, Operation, Operations
from .recorder import CHOOSE, EXPONENT, MANTISSA, POWER2

_LONGEST = {"OFTEN": 1000, "ONCE": 4000}
"""Largest number of operations in a function, by the frequency of its calls: browsers do not optimize longer ones."""
_NAMES = 100
"""Number of names that are first used for values of statements that are not alike."""
_WIDEST = 60
"""Largest number of characters of a value that has no name of its own."""
_CONDITIONS = {"LT": "{0}<{1}", "LE": "{0}<={1}", "EQ": "{0}==={1}", "NE": "{0}!=={1}"}
_CONDITIONS |= {"NOT": "!{c[0]}", "AND": "{c[0]}&&{c[1]}", "OR": "{c[0]}||{c[1]}"}
_FORMS = {kind: f"{{0}}{sign}{{1}}" for kind, sign in zip(("ADD", "SUB", "MUL", "DIV"), "+-*/", strict=True)}
_FORMS |= _CONDITIONS | {
    "NEG": "-{0}", "SQ": "{0}*{0}", "TWICE": "2*{0}", "INV": "1/{0}", "ASSIGN": "{0}",
    "SQRT": "Math.sqrt({0})", "FABS": "Math.abs({0})", "FLOOR": "Math.floor({0})", "CEIL": "Math.ceil({0})",
    "FMIN": "Math.min({0},{1})", "FMAX": "Math.max({0},{1})", "SIGN": "Math.sign({0})",
    "IF_ELSE_ZERO": "{c[0]}?{1}:0", CHOOSE: "{c[0]}?{1}:{2}",
    "COPYSIGN": "copysign({0},{1})", EXPONENT: "exponent({0})", MANTISSA: "mantissa({0})", POWER2: "power2({0})",
}  # fmt: skip
"""Each operation in JavaScript: ``{0}`` is its first operand, and ``{c[0]}`` that as a condition."""
_RESULTS = {"values": "y", "derivatives": "rates", "derive": "k", "guess": "z", "initial": "x"}
"""By function, the array of its results; the arrays of all others have the name of the function and ``_``."""
_HEAD = """\
const f8 = new Float64Array(1), i4 = new Int32Array(f8.buffer), u4 = new Uint32Array(f8.buffer);
const second = new Float64Array(1); // the second result of a function
// the nearest exponent of 2 of a positive number, and what that power is multiplied by; the bits of the root of 1/2
const exponent = (x) => ((f8[0] = x), (i4[1] - 0x3fe6a09e - (u4[0] < 0x667f3bcd)) >> 20);
const mantissa = (x) => {
  const k = exponent(x);
  i4[1] -= k << 20;
  return f8[0];
};
const power2 = (k) => ((i4[0] = 0), (i4[1] = (k + 1023) << 20), f8[0]);
const copysign = (a, b) => ((f8[0] = b), i4[1] < 0 ? -Math.abs(a) : Math.abs(a));
"""


def program(models: Mapping[str, str]) -> str:
    """The expression whose value has these models, each printed by `model_text`, by name."""
    rows = ",\n".join(f"{json.dumps(name)}: stepped({text})" for name, text in models.items())
    numbers = "".join(f"const {name} = {json.dumps(value)};\n" for name, value in STEP_NUMBERS.items())
    steps = (files(__package__) / "steps.js").read_text("utf-8")
    return f'(() => {{\n"use strict";\n{_HEAD}{_elementary()}{numbers}{steps}return {{\n{rows}\n}};\n}})()'


def model_text(model: Model, columns: Sequence[str] | None = None, derives: bool = True) -> str:
    """The text of a model, deterministic to the byte.

    Parameters
    ----------
    columns : outputs, or quantities of `Model.further_quantities`, by name, that ``values`` computes; by default all
        outputs
    derives : whether it has ``derive``; without it the host writes the derived values

    Raises
    ------
    InputError
        for an equation with a function whose bits differ between engines, and a column that the model does not have.
    """
    t = trace(model)
    names = [v.name for v in (outputs_of(model) if columns is None else chosen_columns(t, columns))]
    derived = model.derive(casadi_(), t.p) if model.derived_count else []
    functions = [kernel for kernel in kernels(t, derived, False, names) if derives or kernel.name != "derive"]
    sizes = dict.fromkeys("puxkzyw", 0)
    lines = [line for kernel in functions for line in _function(kernel, sizes)]
    states = model.state_layout.variables if model.state_layout else ()
    arguments = {"p": model.parameter_layout.variables, "u": model.input_layout.variables, "x": states}
    sizes |= {letter: len(variables) for letter, variables in arguments.items()}
    sizes |= {"k": model.derived_count, "z": model.start_problem.unknowns}
    arrays = [f"{name}=new Float64Array({size})" for name, size in sizes.items()]
    starts = [
        f"{letter}.set([{','.join(_number(v.quantity.start or 0.0) for v in arguments[letter])}]);"
        for letter in "pu"
    ]
    about = {
        "p": [v.name for v in arguments["p"]],
        "u": [v.name for v in arguments["u"]],
        "x": [v.name for v in states],
        "y": names,
        "requirements": [asdict(rule) for rule in model.required],
        "start_limits": [asdict(rule) for rule in model.start_problem.required],
        "rounds": model.start_problem.rounds,
        "controlled": bool(states) and model.controlled,
        "free": bool(states) and model.controlled and t.is_free,
        "nominal": [v.quantity.nominal or 1.0 for v in states],
    }
    members = ",".join([*sizes, *(kernel.name for kernel in functions)])
    return "\n".join(
        [
            "(() => {",
            f"const {','.join(arrays)};",
            *starts,
            *lines,
            f"return {{{members},about:{json.dumps(about, ensure_ascii=False)}}};",
            "})()",
        ]
    )


def _function(kernel: ModelFunction, sizes: dict[str, int]) -> list[str]:
    """The functions of a kernel of one group; `sizes` of the arrays that it needs."""
    operations = Operations(kernel.arguments, kernel.groups)
    items, (results,) = operations.items, operations.results
    division = Division(items, operations.results, _LONGEST[kernel.frequency])
    into = _RESULTS.get(kernel.name, f"{kernel.name}_")
    sizes[into] = len(results)
    # a result is computed to its place; one that stands twice, or is an argument or a number, is copied there
    kept: dict[int, str] = {}
    copied = []
    for k, place in enumerate(results):
        if place in division.slots and place not in kept:
            kept[place] = f"{into}[{k}]"
        else:
            copied.append((f"{into}[{k}]", place))
    rest = [place for place in division.slots if place not in kept]
    kept |= {place: f"w[{k}]" for k, place in enumerate(rest)}
    sizes["w"] = max(sizes["w"], len(rest))

    def outside(place: int) -> str:
        operation = items[place]
        if operation.kind == ARGUMENT:
            return f"{kernel.takes[operation.entry[0]]}[{operation.entry[1]}]"
        return _number(operation.value) if operation.kind == NUMBER else kept[place]

    copies = "".join(f"{to}={outside(place)};" for to, place in copied)
    usual: dict[Any, list[int]] = {}
    parts = [_statements(items, part, outside, kept, (), usual)[0] for part in division.parts]
    if len(parts) <= 1:
        return [f"function {kernel.name}(){{{''.join(parts)}{copies}}}"]
    calls = "".join(f"{kernel.name}_{n}();" for n in range(len(parts)))
    return [
        *(f"function {kernel.name}_{n}(){{{part}}}" for n, part in enumerate(parts)),
        f"function {kernel.name}(){{{calls}{copies}}}",
    ]


def _statements(
    items: Sequence[Operation],
    places: Iterable[int],
    outside: Callable[[int], str],
    kept: Mapping[int, str],
    results: Sequence[int],
    usual: dict[Any, list[int]],
) -> tuple[str, list[str]]:
    """The statements that compute the operations at these `places`, and the texts of the `results`.

    Parameters
    ----------
    outside : the text of a value that is computed elsewhere
    kept : by place, the array entry in which a value is stored
    results : places of values that are needed after the statements
    usual : see `_renamed`
    """
    inside = [place for place in places if items[place].operands]
    uses: dict[int, int] = dict.fromkeys(results, 1)
    for place in inside:
        form = _form(items[place].kind)
        for n, operand in enumerate(items[place].operands):
            uses[operand] = uses.get(operand, 0) + form.count(f"{{{n}}}") + form.count(f"{{c[{n}]}}")
    texts: dict[int, str] = {}
    truths: dict[int, str] = {}
    pairs: dict[tuple[str, tuple[int, ...]], int] = {}
    lines: list[str] = []

    def named(place: int, text: str) -> str:
        lines.append(f"$a{place}={text}" if place in uses else text)
        return f"$a{place}"

    def value(place: int) -> str:
        if place not in texts:
            text = outside(place)
            texts[place] = named(place, text) if uses[place] > 1 and items[place].kind != NUMBER else text
        return texts[place]

    for place in inside:
        kind, operands = items[place].kind, items[place].operands
        values = [value(k) for k in operands]
        text = _form(kind).format(
            *values, c=[truths.get(k, f"({x}!==0)") for k, x in zip(operands, values, strict=True)]
        )
        stored = f"{kept[place]}=" if place in kept else ""
        if is_pair(kind):
            first = pairs.setdefault((text, operands), place)
            if first == place:
                lines += [f"$s{place}={text}", f"$c{place}=second[0]"]
            texts[place] = f"${'sc'[OWN[kind][2]]}{first}"
            if stored:
                lines.append(stored + texts[place])
        elif kind in _CONDITIONS:
            inline = place not in uses or (uses[place] == 1 and not stored and len(text) <= _WIDEST)
            truths[place] = f"({text})" if inline else named(place, text)
            texts[place] = f"(+{truths[place]})"
            if stored:
                lines.append(stored + texts[place])
        elif not stored and uses[place] == 1 and len(text) <= _WIDEST:
            texts[place] = f"({text})"
        else:
            texts[place] = named(place, stored + text)
    return _renamed(lines, [texts[place] for place in results], usual)


_NAME = re.compile(r"\$\w+")
_LETTERS = "abcdefghijlmnoqrstvABCDEFGHIJKLMNOPQRSTUVWXYZ"
"""First letters of names of values; arrays have others."""


def _renamed(
    lines: Sequence[str], results: Sequence[str], usual: dict[Any, list[int]]
) -> tuple[str, list[str]]:
    """The statements and texts with few short names, each used again as soon as nothing needs its value.

    `usual` has the numbers of the names that statements of the same form had, by the form and the one before it. A
    value takes one of them if it is free: statements that stand again and again then have equal texts, which a packer
    finds.
    """
    texts = [*lines, *results]
    last_use = {name: n for n, text in enumerate(texts) for name in _NAME.findall(text)}
    forms = ["", *(_NAME.sub("", line) for line in lines)]
    numbers: dict[str, int] = {}
    busy: set[int] = set()
    for n, text in enumerate(texts):
        used = _NAME.findall(text)
        new = used.pop(0) if text.startswith("$") and n < len(lines) else ""
        busy.difference_update(numbers[name] for name in used if last_use[name] == n)
        if new:
            candidates = usual.setdefault((forms[n], forms[n + 1]), [])
            numbers[new] = next(k for k in chain(candidates, count(min(len(usual), _NAMES))) if k not in busy)
            if numbers[new] not in candidates:
                candidates.append(numbers[new])
            if last_use[new] > n:
                busy.add(numbers[new])
        texts[n] = _NAME.sub(lambda match: _short(numbers[match[0]]), text)
    head = f"let {','.join(map(_short, sorted(set(numbers.values()))))};" if numbers else ""
    return head + "".join(f"{text};" for text in texts[: len(lines)]), texts[len(lines) :]


def _short(n: int) -> str:
    """The name of a value by its number."""
    digits, letter = divmod(n, len(_LETTERS))
    return _LETTERS[letter] + (str(digits) if digits else "")


def _form(kind: str) -> str:
    """The form of an operation of this kind.

    Raises
    ------
    InputError
        for one that has no form.
    """
    if kind in OWN:
        function, arguments, _ = OWN[kind]
        return f"{function.__name__}({','.join(f'{{{n}}}' for n in range(arguments))})"
    if kind not in _FORMS:
        raise InputError(
            f"{kind.lower()}: this function of an equation has not the same bits in each browser; a power x**y is "
            "exp(y*log(x)), the others follow from sin, cos, asin, acos, atan2, exp and log"
        )
    return _FORMS[kind]


def _elementary() -> str:
    """The definitions in JavaScript of the functions of `chainunit.core.printing.elementary`, such as sine. A second
    result, as a cosine beside a sine, goes into the array `second`."""
    texts = {}
    for kind, (function, arguments, _) in OWN.items():
        traced = recording(kind)

        def outside(place: int, traced: Any = traced) -> str:
            operation = traced.items[place]
            return _number(operation.value) if operation.kind == NUMBER else f"x{operation.entry[1]}"

        lines, values = _statements(traced.items, range(len(traced.items)), outside, {}, traced.results, {})
        first, *rest = values
        second = "".join(f"second[0]={value};" for value in rest)
        names = ",".join(f"x{n}" for n in range(arguments))
        texts[function.__name__] = (
            f"function {function.__name__}({names}){{{lines}{second}return {first};}}\n"
        )
    return "".join(texts.values())


def _number(x: float) -> str:
    """A number in JavaScript."""
    if math.isnan(x):
        return "NaN"
    text = "Infinity" if math.isinf(x) else repr(abs(float(x))).removesuffix(".0")
    return f"(-{text})" if math.copysign(1.0, x) < 0.0 else text
