"""The functions of a model that native code computes, as groups of symbolic results.

C and JavaScript are printed from the same list.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from .. import integrators
from ..engines import casadi_
from ..model import Model
from ..symbolic_trace import Trace

STEP_NUMBERS = {
    name: getattr(integrators, name)
    for name in (
        "RK4_NODES RK4_WEIGHTS NODES STAGES ERRORS SHORTEST FIRST SAFETY ERROR_POWER LEAST_GROWTH MOST_GROWTH "
        "NO_ERROR DENSE"
    ).split()
}
"""The numbers of `chainunit.core.integrators` that a printed loop of steps needs, by name."""


@dataclass(frozen=True, eq=False)
class ModelFunction:
    """Groups of results of the same arguments.

    `arguments` are the symbols of its arguments, as casadi vectors, and `takes` their letters: ``p`` parameters,
    ``u`` inputs, ``x`` states, ``k`` derived values, ``z`` unknowns of the start, ``d`` and ``e`` changes of inputs
    and states. `groups` are the results, as casadi vectors, with their `offsets` among all results. `frequency`
    says how often it is called, "OFTEN", "SELDOM" or "ONCE": for rare calls the time of the compiler counts more.
    """

    name: str
    takes: str
    arguments: list[Any]
    groups: list[Any]
    offsets: list[int]
    frequency: str


def frequent_outputs(model: Model) -> set[str]:
    """The outputs that are read at every step: the members of the terminals."""
    return {name for terminal in model.terminals for name in terminal.members.values()}


def output_groups(model: Model) -> list[list[int]]:
    """Outputs that are evaluated together, as places among the declared outputs: last all discrete ones."""
    lists: list[list[int]] = []
    terminal_outputs, discrete, offset = frequent_outputs(model), [], 0
    for part in model.parts:
        real: dict[str, int] = {}
        for i, v in enumerate(part.layout.variables, offset):
            if v.type == "Real":
                real[v.name] = i
            else:
                discrete.append(i)
        offset += len(part.layout.names)
        often = [i for name, i in real.items() if name in terminal_outputs - part.by_differences]
        apart = [i for name, i in real.items() if name in part.by_differences]
        rest = [i for i in real.values() if i not in often and i not in apart]
        lists += [group for group in (often, rest, apart) if group]
    return [*lists, discrete] if discrete else lists


def difference_groups(model: Model) -> set[int]:
    """The groups without code for their derivatives, see `chainunit.core.model.Part`."""
    places = [name for part in model.parts for name in part.layout.names]
    names = {name for part in model.parts for name in part.by_differences}
    return {g for g, group in enumerate(output_groups(model)) if places[group[0]] in names}


def kernels(
    t: Trace, derived: Sequence[Any], slopes: bool = True, columns: Sequence[str] | None = None
) -> Iterator[ModelFunction]:
    """The functions of a traced model, each with the values of the model's method of that name: ``values``, the
    outputs in their groups, and ``forward``, their derivatives in a direction; with states, their ``derivatives``,
    the functions of their start and the numbers of their integrator; the limits of the ``requirements``; and
    ``derive``, the values derived from parameters.

    Parameters
    ----------
    t : the model in symbols
    derived : the derived values in symbols, shape (derived_count,)
    slopes : whether to give ``forward``
    columns : names of outputs; with them, ``values`` gives these alone, in one group
    """
    import casadi

    model, (p, u, x, k) = t.model, t.symbols
    z = casadi.SX.sym("z", model.start_problem.unknowns)
    du, dx = casadi.SX.sym("du", u.shape[0]), casadi.SX.sym("dx", x.shape[0])
    symbols = {"p": p, "u": u, "x": x, "k": k, "z": z, "d": du, "e": dx}
    # derived values come last among the arguments, and only if the model has them
    last = "k" if model.derived_count else ""

    def kernel(name: str, takes: str, groups: list[Any], offsets: list[int], frequency: str) -> ModelFunction:
        return ModelFunction(name, takes, [symbols[letter] for letter in takes], groups, offsets, frequency)

    def single(name: str, takes: str, results: Sequence[Any], frequency: str = "ONCE") -> ModelFunction:
        """A function with one group of results."""
        return kernel(name, takes, [casadi.vertcat(*map(casadi.SX, results))], [0], frequency)

    if columns is None:
        outputs, places = list(t.outputs), output_groups(model)
    else:
        outputs = [t.columns[name][1] for name in columns]
        places = [list(range(len(outputs)))]
    offsets = [sum(map(len, places[:g])) for g in range(len(places))]
    values = [casadi.vertcat(*(outputs[place] for place in group)) for group in places]
    yield kernel("values", f"pux{last}", values, offsets, "OFTEN")
    if slopes:
        apart = groups_without_slopes(model)
        smooth = [casadi.SX(0, 1) if g in apart else group for g, group in enumerate(values)]
        smooth.append(casadi.vertcat(*t.derivatives))
        along = [casadi.jtimes(row, casadi.vertcat(u, x), casadi.vertcat(du, dx)) for row in smooth]
        yield kernel("forward", f"puxde{last}", along, [*offsets, len(outputs)], "SELDOM")
    if model.state_layout:
        yield single("derivatives", f"pux{last}", t.derivatives, "OFTEN")
        yield from _start(t, z, single, last)
        yield single("internal_step", "p", [model.internal_step(casadi_(), t.p)])
        if model.controlled:
            yield single("tolerance", "p", [model.tolerance(casadi_(), t.p)])
            yield single("closed", f"pux{last}", model.constrained_states(casadi_(), t.p, t.u, t.x), "OFTEN")
    if limits := [v for row in model.requirements(casadi_(), t.p) for v in row]:
        yield single("requirements", f"p{last}", limits)
    if model.derived_count:
        yield single("derive", "p", derived)


def groups_without_slopes(model: Model) -> set[int]:
    """The groups of outputs whose derivatives ``forward`` does not have: those by differences, and discrete ones."""
    places = [v for part in model.parts for v in part.layout.variables]
    groups = output_groups(model)
    return difference_groups(model) | {g for g, group in enumerate(groups) if places[group[0]].type != "Real"}


def _start(
    t: Trace, unknowns: Any, single: Callable[..., ModelFunction], last: str
) -> Iterator[ModelFunction]:
    """The functions that give the states at the start; `unknowns` are the unknowns of the start in symbols,
    `single` makes a function with one group, and `last` is the letter of the derived values, or empty."""
    import casadi

    model = t.model
    assert model.state_layout is not None
    z = casadi.vertsplit(unknowns) if model.start_problem.unknowns else []
    if z:
        yield single("guess", "pu", model.start_guess(casadi_(), t.p, t.u))
        yield single("improved", "puz", model.improve_start(casadi_(), t.p, t.u, z))
    yield single("initial", "puz", model.state_layout.values(model.start_states(casadi_(), t.p, t.u, z)))
    if model.start_problem.required:
        limits = [v for row in model.start_limits(casadi_(), t.p, t.u, t.x) for v in row]
        yield single("start_limits", f"pux{last}", limits)
