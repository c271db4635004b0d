"""A model as a module of Python for its FMU: tables of its variables, and its functions as printed Python."""

from __future__ import annotations

from typing import Any

from ..core.integrators import MAX_STEPS
from ..core.model import Requirement
from ..core.printing.kernels import kernels
from ..core.printing.python_code import python_statements, python_text
from .description import Interface, shared_interface

_HEAD = '''\
"""{title}: tables and equations, printed from the model of chainunit."""

from math import *

from .core.printing.python_math import *

'''


def printed_model(interface: Interface) -> str:
    """The module of a model, as `chainunit.fmu.model_instance.ModelInstance` takes it."""
    model, shared = interface.model, shared_interface(interface.model)
    columns = [v.name for v in shared.others]
    values, *functions = kernels(shared.trace, shared.derived, slopes=False, columns=columns)
    statements, outputs = python_statements(values)
    rows = "\n".join(f"{name} = {_text(value)}" for name, value in _tables(interface).items())
    equations = f"STATEMENTS = {_text(statements)}\nOUTPUTS = {_text(outputs)}"
    head = _HEAD.format(title=model.name)
    return f"{head}{interface.text(rows)}\n{equations}\n\n\n{python_text(functions)}"


def _text(value: Any) -> str:
    if isinstance(value, list):
        return "".join(["[", *(f"\n    {row!r}," for row in value), "\n]" if value else "]"])
    return repr(value)


def _tables(interface: Interface) -> dict[str, Any]:
    """The tables by name; a variable in them is its value reference, or its place among outputs or inputs."""
    model = interface.model
    inputs, parameters = model.input_layout.names, model.parameter_layout.names

    def follows(name: str) -> int:
        """The place of the input that is the rate of an input; -1 without one."""
        return inputs.index(model.input_rates[name]) if name in model.input_rates else -1

    def required(requirements: tuple[Requirement, ...]) -> list[Any]:
        return [
            (r.subject, r.unit, r.why, r.remedy, tuple(map(parameters.index, r.context)))
            for r in requirements
        ]

    settable = [*interface.signals_of("parameter"), *interface.signals_of("input")]
    types = {s.reference: s.variable.type for s in interface.signals if s.variable.type != "Real"}
    return {
        "NAME": model.name,
        "SETTABLE": [_settable(s.variable, s.start) for s in settable],
        "PARAMETERS": len(parameters),
        "NOMINAL": tuple(v.quantity.nominal or 1.0 for v in interface.states),
        "TYPES": types,
        "RATES": [
            (inputs.index(name), follows(name), follows(rate)) for name, rate in model.input_rates.items()
        ],
        "DERIVED": bool(model.derived_count),
        "REQUIRED": required(model.required),
        "START_REQUIRED": required(model.start_problem.required),
        "UNKNOWNS": model.start_problem.unknowns,
        "START_ROUNDS": model.start_problem.rounds,
        "CONTROLLED": model.controlled,
        "MAX_STEPS": parameters.index(MAX_STEPS) if interface.states else -1,
    }


def _settable(variable: Any, start: float | None) -> tuple[Any, ...]:
    """The row of a parameter or an input, see `chainunit.fmu.model_instance.Settable`."""
    q = variable.quantity
    return (
        *(variable.name, q.unit, variable.description, q.allowed_range, q.low, q.high, q.slack),
        *(q.open_low, q.tunable, q.type, float(start or 0.0)),
    )
