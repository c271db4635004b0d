"""C source of a model: its kernels, and the tables that model.h declares.

There is no equation here: the model's own kernels are traced with symbols, so that the C code, its exact derivatives
and the Python results come from the same lines.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import lru_cache
from string import Formatter
from typing import Any

from ...core import integrators, messages
from ...core.integrators import MAX_STEPS
from ...core.model import Model
from ...core.printing.c_code import Program
from ...core.printing.c_forms import constant, number
from ...core.printing.kernels import difference_groups, output_groups
from ...core.printing.kernels import kernels as kernels_of
from ...core.quantities import Variable
from ..description import Interface, shared_interface


@lru_cache(maxsize=16)
def kernels(model: Model) -> tuple[str, int]:
    """``kernels.c`` with the functions of a model, and the memory that they need, as a number of doubles. They are
    the same for all start values and versions of FMI."""
    shared = shared_interface(model)
    programs = [Program(function) for function in kernels_of(shared.trace, shared.derived)]
    table = [f"    .{program.name} = kernel_{program.name}," for program in programs]
    text = "\n".join([_BEFORE_KERNELS, *(program.text for program in programs), _TABLE, *table, "};", ""])
    return text, max(program.room for program in programs)


_BEFORE_KERNELS = """\
#include <math.h>

#include "model.h"
#include "elementary.h"

/* a function that is seldom called is compiled with less optimization, in less time */
#if defined __clang__
#define OFTEN __attribute__((noinline))
#define SELDOM OFTEN
#define ONCE __attribute__((noinline, optnone))
#elif defined __GNUC__
#define OFTEN __attribute__((noinline))
#define SELDOM __attribute__((noinline, optimize("O1")))
#define ONCE __attribute__((noinline, optimize("O0")))
#else
#define OFTEN
#define SELDOM
#define ONCE
#endif

static inline double sign(double x) { return x < 0.0 ? -1.0 : x > 0.0 ? 1.0 : x; }
"""
_TABLE = "const Kernels kernels = {"


def _text(s: str) -> str:
    """A text in C."""
    return json.dumps(s)


def _unit(unit: str) -> str:
    return _text(messages.unit_behind(unit))


def _array(kind: str, name: str, items: list[str]) -> str:
    """The definition of an array; C has no empty ones."""
    body = ",\n    ".join(items or ["0"])
    return f"static const {kind} {name}[] = {{\n    {body},\n}};\n"


def rules() -> str:
    """``rules.h``: the texts of `chainunit.core.messages` as formats of printf, and the numbers of
    `chainunit.core.integrators`, which native code and Python have in common."""
    lines = ["/* Words and numbers of an FMU, generated from those of its Python code. */"]
    for name, value in (*_capitals(messages), *_capitals(integrators)):
        if isinstance(value, str):
            lines.append(f"#define {name} {_text(_printf(value))}")
        else:
            lines.append(constant(name, value))
    return "\n".join(lines) + "\n"


def _capitals(module: Any) -> Iterator[tuple[str, Any]]:
    return ((name, value) for name, value in vars(module).items() if name.isupper())


def _printf(text: str) -> str:
    """A text with fields in braces as a format of printf."""
    kinds = {"": "%s", "g": "%g", "d": "%u"}
    pieces = Formatter().parse(text)
    return "".join(x.replace("%", "%%") + (kinds[kind or ""] if name else "") for x, name, kind, _ in pieces)


def _quantity(v: Variable) -> str:
    """The row of a variable in the table of the declared quantities."""
    q = v.quantity
    return (
        f"{{{_text(v.name)}, {_unit(v.unit)}, {_text(q.allowed_range)}, {number(q.low)}, {number(q.high)}, "
        f"{number(q.slack)}, {int(q.open_low)}, {int(q.tunable)}, {q.type.upper()}}}"
    )


def tables(interface: Interface, guid: str, room: int) -> str:
    """``model.c``: the tables that model.h declares, with the GUID (in FMI 3.0 the instantiation token) and the
    memory `room` of the kernels."""
    model, groups = interface.model, output_groups(interface.model)
    inputs, parameters = model.input_layout.names, model.parameter_layout.names
    n_y = len(interface.others)
    group_of = {output: g for g, group in enumerate(groups) for output in group}
    place = {output: k for k, output in enumerate(output for group in groups for output in group)}
    group_rows = [f"{{{place[group[0]]}, {len(group)}}}" for group in groups]
    starts = [s.start for s in (*interface.signals_of("parameter"), *interface.signals_of("input"))]
    rates = [inputs.index(model.input_rates[name]) if name in model.input_rates else -1 for name in inputs]
    requirements = (*model.required, *model.start_problem.required)
    lines = [
        f"/* {model.name}: tables for model.h, generated from the model's declarations. */",
        "#include <math.h>",
        "#include <stddef.h>",
        "",
        '#include "model.h"',
        "",
        _array("double", "starts", [number(x or 0.0) for x in starts]),
        _array("Quantity", "declared", [_quantity(v) for v in (*interface.parameters, *interface.inputs)]),
        _array("double", "nominal", [number(v.quantity.nominal or 1.0) for v in interface.states]),
        _array("int", "rate_of", list(map(str, rates))),
        _array("int", "place", [str(place[i]) for i in range(n_y)]),
        _array("int", "group_of", [str(group_of[i]) for i in range(n_y)]),
        _array("Group", "group", group_rows),
        _array("Type", "discrete_type", [interface.others[i].type.upper() for i in interface.discrete]),
    ]
    for i, r in enumerate(requirements):
        lines.append(_array("int", f"given_{i}", [str(parameters.index(name)) for name in r.context]))
    rows = [
        f"{{{_text(r.subject)}, {_unit(r.unit)}, {_text(r.why)}, {_text(r.remedy)}, {len(r.context)}, given_{i}}}"
        for i, r in enumerate(requirements)
    ]
    if rows:
        lines.append(_array("Requirement", "required", rows))
    fields = {
        "name": _text(model.name),
        "guid": _text(guid),
        "n_p": len(interface.parameters),
        "n_u": len(interface.inputs),
        "n_x": len(interface.states),
        "n_y": n_y,
        "n_k": model.derived_count,
        "n_z": model.start_problem.unknowns,
        "n_w": room,
        "n_groups": len(group_rows),
        "differenced": f"{sum(1 << g for g in difference_groups(model))}u",
        "n_required": len(model.required),
        "n_start_required": len(model.start_problem.required),
        "start": "starts",
        "declared": "declared",
        "nominal": "nominal",
        "rate_of": "rate_of",
        "place": "place",
        "group_of": "group_of",
        "groups": "group",
        "discrete": len(group_rows) - 1 if interface.discrete else -1,
        "discrete_type": "discrete_type",
        "required": "required" if rows else "NULL",
        "start_rounds": model.start_problem.rounds,
        "max_steps": parameters.index(MAX_STEPS) if interface.states else -1,
    }
    lines.append("const Model model = {")
    lines += [f"    .{name} = {value}," for name, value in fields.items()]
    lines.append("};")
    return "\n".join(lines) + "\n"
