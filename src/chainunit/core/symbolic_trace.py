"""The equations of a model in CasADi's symbols, from which native code, derivatives and dependencies come."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

from .engines import casadi_
from .errors import InputError, near_name
from .model import Model
from .quantities import Variable


@dataclass(frozen=True)
class Trace:
    """A model in symbols.

    `symbols` are the casadi vectors (p, u, x, derived values); `p`, `u` and `x` the same as instances of their
    declarations, `p` prepared with the derived values; `derivatives` are the derivatives of the states.
    """

    model: Model
    symbols: list[Any]
    p: Any
    u: Any
    x: Any
    derivatives: list[Any]

    @cached_property
    def outputs(self) -> list[Any]:
        """The outputs part by part in declared order."""
        return self.outputs_at(self.x)

    @cached_property
    def columns(self) -> dict[str, tuple[Variable, Any]]:
        """By name, all outputs and `Model.further_quantities`, each with its declaration and its value."""
        pairs = list(zip(outputs_of(self.model), self.outputs, strict=True))
        outputs = {variable.name: value for variable, value in pairs}
        pairs += self.model.further_quantities(casadi_(), self.p, self.u, self.x, outputs)
        return {variable.name: (variable, value) for variable, value in pairs}

    @cached_property
    def is_free(self) -> bool:
        """Whether the states have no constraints, see `Model.constrained_states`."""
        import casadi

        met = self.model.constrained_states(casadi_(), self.p, self.u, self.x)
        return all(
            casadi.is_equal(casadi.SX(x), symbol)
            for x, symbol in zip(met, casadi.vertsplit(self.symbols[2]), strict=True)
        )

    def outputs_at(self, x: Any) -> list[Any]:
        """The outputs with the states `x` in place of the symbols."""
        parts = self.model.evaluate(casadi_(), self.p, self.u, x)
        return [v for part, out in zip(self.model.parts, parts, strict=True) for v in part.layout.values(out)]

    def explicit(self, expressions: Sequence[Any]) -> list[Any]:
        """The expressions in terms of parameters, inputs and states alone, without the derived values."""
        import casadi

        if not self.model.derived_count:
            return list(expressions)
        p = self.model.parameter_layout.instance(casadi.vertsplit(self.symbols[0]))
        derived = casadi.vertcat(*self.model.derive(casadi_(), p))
        return list(casadi.substitute(list(expressions), [self.symbols[3]], [derived]))


def outputs_of(model: Model) -> tuple[Variable, ...]:
    """All outputs of a model in declared order."""
    return tuple(v for part in model.parts for v in part.layout.variables)


def chosen_columns(t: Trace, names: Sequence[str]) -> tuple[Variable, ...]:
    """The declarations of outputs and further quantities of a model, by name.

    Raises
    ------
    InputError
        for a name that the model does not have.
    """
    for name in names:
        if name not in t.columns:
            raise InputError(f"{name}: no such output of the model{near_name(name, list(t.columns))}")
    return tuple(t.columns[name][0] for name in names)


@lru_cache(maxsize=8)
def trace(model: Model) -> Trace:
    """The equations of `model` in symbols."""
    import casadi

    layouts = (model.parameter_layout, model.input_layout, model.state_layout)
    sizes = [len(layout.names) if layout else 0 for layout in layouts]
    symbols = [casadi.SX.sym(name, size) for name, size in zip("pux", sizes, strict=True)]
    symbols.append(casadi.SX.sym("k", model.derived_count))
    p = model.parameter_layout.instance(casadi.vertsplit(symbols[0]))
    if model.derived_count:
        p = model.with_derived(casadi_(), p, casadi.vertsplit(symbols[3]))
    u = model.input_layout.instance(casadi.vertsplit(symbols[1]))
    x = model.state_layout.instance(casadi.vertsplit(symbols[2])) if model.state_layout else None
    derivatives = model.derivatives(casadi_(), p, u, x) if model.state_layout else []
    return Trace(model, symbols, p, u, x, derivatives)
