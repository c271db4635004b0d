"""The chosen outputs of a model and their derivatives, as operations of parameters, inputs and states."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

from ..core.engines import casadi_
from ..core.errors import InputError, near_name
from ..core.model import Model
from ..core.printing.operations import Operations
from ..core.quantities import Variable, quotient
from ..core.symbolic_trace import chosen_columns, trace


@dataclass(frozen=True)
class Result:
    """A column of results: an output, or the derivative of one."""

    name: str
    unit: str
    description: str


@dataclass(frozen=True, eq=False)
class Equations:
    """What a batch computes.

    `arguments` are the parameters, inputs and states of the model in declared order. `operations` has two groups of
    results: the `results`, and one number, which is 0 if all requirements of the model are met, and else the
    place of the first that is not, from 1.
    """

    model: Model
    arguments: tuple[Variable, ...]
    results: tuple[Result, ...]
    operations: Operations

    @property
    def not_finite(self) -> int:
        """The reason of a state that meets all requirements and has no finite result."""
        return len(self.model.required) + 1

    @cached_property
    def entries(self) -> dict[tuple[int, int], Variable]:
        """The arguments by their entries: parameters (0), inputs (1) or states (2), and the place among them."""
        layouts = (self.model.parameter_layout, self.model.input_layout, self.model.state_layout)
        return {
            (kind, k): v
            for kind, layout in enumerate(layouts)
            for k, v in enumerate(layout.variables if layout else ())
        }


def columns_of(model: Model) -> tuple[Variable, ...]:
    """All that a batch can compute of a model: its outputs, and the quantities of `Model.further_quantities`."""
    return tuple(variable for variable, _ in trace(model).columns.values())


def arguments_of(model: Model) -> tuple[Variable, ...]:
    """All parameters, inputs and states of a model in declared order."""
    layouts = (model.parameter_layout, model.input_layout, model.state_layout)
    return tuple(v for layout in layouts if layout for v in layout.variables)


def names_of(variables: Iterable[Variable]) -> list[str]:
    """The names of these variables."""
    return [v.name for v in variables]


def find(names: Iterable[str], among: Sequence[str], kind: str) -> list[int]:
    """The places of these names `among` others.

    Raises
    ------
    InputError
        for a name that is not there.
    """
    places, wanted = {name: k for k, name in enumerate(among)}, list(names)
    for name in wanted:
        if name not in places:
            raise InputError(f"{name}: no such {kind} of the model{near_name(name, list(places))}")
    return [places[name] for name in wanted]


@lru_cache(maxsize=64)
def equations(model: Model, outputs: tuple[str, ...], by: tuple[str, ...]) -> Equations:
    """The `outputs` of a model, and the derivative of each by each of the arguments `by`.

    Raises
    ------
    InputError
        for a name that the model does not have.
    """
    import casadi

    t, arguments = trace(model), arguments_of(model)
    variables = chosen_columns(t, outputs)
    columns = find(by, names_of(arguments), "parameter, input or state")
    p, u, x, _ = t.symbols
    rows = casadi.vertcat(*(casadi.SX(t.columns[name][1]) for name in outputs), casadi.SX(0, 1))
    rows, codes = t.explicit([rows, _first_unmet(list(model.requirements(casadi_(), t.p)))])
    point = casadi.vertcat(p, u, x)
    unit_vectors = casadi.SX(casadi.DM.eye(point.numel()))
    slopes = [casadi.jtimes(rows, point, unit_vectors[:, column]) for column in columns]
    results = [Result(v.name, v.unit, v.description) for v in variables]
    results += [
        Result(
            f"d({v.name})/d({argument.name})",
            quotient(v.unit, argument.unit),
            f"derivative of {v.description} by {argument.description}",
        )
        for argument in (arguments[column] for column in columns)
        for v in variables
    ]
    operations = Operations([p, u, x], [casadi.vertcat(rows, *slopes), codes])
    return Equations(model, arguments, tuple(results), operations)


def _first_unmet(limits: Sequence[tuple[Any, Any, Any]]) -> Any:
    """The place of the first requirement that is not met, from 1, or 0; a comparison with NaN is not met."""
    import casadi

    code, open_still = casadi.SX(0.0), casadi.SX(1.0)
    for place, (value, low, high) in enumerate(limits, 1):
        value, low, high = casadi.SX(value), casadi.SX(low), casadi.SX(high)
        met = casadi.SX(1.0)
        for smaller, larger in ((low, value), (value, high)):
            if not (smaller.is_constant() and float(smaller) == -float("inf")) and not (
                larger.is_constant() and float(larger) == float("inf")
            ):
                met = met * (smaller < larger)
        code = code + place * open_still * (1.0 - met)
        open_still = open_still * met
    return code
