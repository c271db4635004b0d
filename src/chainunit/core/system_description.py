"""A system of models as one: declarations side by side, and equations in the order of their dependencies.

The description of a system is data as JSON has them, beside its models by name: `chainunit.system.compiled` writes
it, and `chainunit.core.system_model.system_model` makes the model of both. Each component is a group: the
names are the full names of the system, such as ``motor.armature.R``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate, pairwise
from operator import attrgetter
from typing import Any, NamedTuple

from .integrators import MAX_STEPS
from .model import Model, Requirement, Terminal
from .ports import Solver
from .quantities import Layout, Value, declaration, declared_class, group, pruned, quantity

_SOLVER = MAX_STEPS.partition(".")[0]
RESERVED = (_SOLVER, "derived", "of_components")
"""Names that a component cannot have, as the model has something else by that name."""
Steps = Sequence[tuple[str, Sequence[str]]]
"""Outputs that are evaluated together, by component, in order."""


@declaration
class SystemSolver(Solver):
    """Limits of the internal integrator of a system, in place of the limits of its components."""

    tolerance: Value = quantity(
        "1",
        "relative tolerance of the internal integrator, of each state or its nominal size",
        default=1e-10,
        min=1e-12,
        max=1e-2,
        tunable=True,
    )


SOLVER = tuple(f"{_SOLVER}.{name}" for name in Layout(SystemSolver).names)
"""Full names of the parameters of the integrator."""


# -- the parts of a system


@dataclass(frozen=True)
class Member:
    """A component: its model, and how its parameters and inputs follow from the parameters and inputs of the system.

    `parameters` has for each parameter a function of the system's parameters. `free` has for each input a function of
    the system's inputs, or None for an input that is connected or left out; `sources` has for each input the full
    name of its source, or None. An input with neither has its declared start value.
    """

    name: str
    model: Model
    parameters: Sequence[Any]
    free: Sequence[Any]
    sources: Sequence[str | None]
    sites: Mapping[str, tuple[int, Any]]
    """by output: the number of its part, and the function that reads it from the values of the part"""

    @property
    def states(self) -> tuple[str, ...]:
        """The names of its states."""
        return self.model.state_layout.names if self.model.state_layout else ()


class SystemDescription:
    """The declarations, components and orders of evaluation of a system, from its description and its models by name.

    The `data` have the ``name`` and ``title`` of the model, the ``connections``, the inputs and outputs that are
    ``left_out``, the free ``terminals`` by full name, the ``extra`` outputs besides the variables of the first parts;
    the outputs in the order of their dependencies: all (``steps``), the outputs for the derivatives (``rate_steps``)
    and for the constraints (``closed_steps``); and the order of the ``start``, in which None in place of outputs
    stands for the states. `unknowns` has by component the places of its unknowns among all unknowns of the start.
    """

    def __init__(self, data: Mapping[str, Any], models: Mapping[str, Model]) -> None:
        self.data, self.models = data, models
        self.sources: dict[str, str] = {target: source for source, target in data["connections"]}
        self.steps: Steps = data["steps"]
        self.rate_steps: Steps = data["rate_steps"]
        self.closed_steps: Steps = data["closed_steps"]
        self.start: Sequence[tuple[str, Sequence[str] | None]] = data["start"]
        begun = [name for name, outputs in self.start if outputs is None]
        ends = accumulate((models[name].start_problem.unknowns for name in begun), initial=0)
        self.unknowns = {name: slice(*pair) for name, pair in zip(begun, pairwise(ends), strict=True)}
        self.has_states = any(model.state_layout for model in self.models.values())
        left_out = {*data["left_out"]}
        common = {
            f"{name}.{setting}": setting for name in self.models for setting in SOLVER if self.has_states
        }
        solver = group(SystemSolver, "internal integrator", default=SystemSolver())
        settings = [(_SOLVER, SystemSolver, solver)] if self.has_states else []
        self.Parameters = self._declared("Parameters", lambda model: model.Parameters, common, settings)
        inputs = left_out | set(self.sources)
        self.Inputs = self._declared("Inputs", lambda model: model.Inputs, inputs)
        self.States = self._declared("States", lambda model: model.States, ())
        self.Outputs = self._declared("Outputs", lambda model: model.parts[0].layout.cls, left_out)
        self.Extra = self._extra(data["extra"])
        self.members = {
            name: self._member(name, model, inputs, common) for name, model in self.models.items()
        }

    def _declared(
        self,
        name: str,
        declaration_of: Callable[[Model], type | None],
        leave_out: Iterable[str],
        further_fields: Any = (),
    ) -> Any:
        """A declaration with a group for each component that has such quantities."""
        fields = []
        for component, model in self.models.items():
            declared = declaration_of(model)
            inner = pruned(declared, {*leave_out}, f"{component}.") if declared else None
            if inner is not None:
                variables = Layout(inner).variables
                has_starts = all(v.quantity.start is not None for v in variables)
                default = Layout(inner).from_names({}) if has_starts else None
                fields.append((component, inner, group(inner, component, default=default)))
        return declared_class(name, (), [*fields, *further_fields])

    def _extra(self, names: Iterable[str]) -> Any:
        """A declaration of these outputs of further parts, by full name; None without any."""
        wanted = {*names}
        fields = []
        for component, model in self.models.items():
            inner = []
            for part in model.parts[1:]:
                others = {f"{component}.{name}" for name in part.layout.names} - wanted
                declared = pruned(part.layout.cls, others, f"{component}.")
                inner += [declared] if declared else []
            if inner:
                further = declared_class("Further", tuple(inner))
                fields.append((component, further, group(further, component)))
        return declared_class("FurtherOutputs", (), fields) if fields else None

    def _member(self, name: str, model: Model, inputs: Iterable[str], common: Mapping[str, str]) -> Member:
        """A component, from the inputs that are connected or left out and the parameters that are `common`."""
        parameters = [f"{name}.{parameter}" for parameter in model.parameter_layout.names]
        taken = [f"{name}.{variable}" for variable in model.input_layout.names]
        return Member(
            name,
            model,
            [attrgetter(common.get(full, full)) for full in parameters],
            [None if full in {*inputs} else attrgetter(full) for full in taken],
            [self.sources.get(full) for full in taken],
            {
                output: (k, attrgetter(output))
                for k, part in reversed([*enumerate(model.parts)])
                for output in part.layout.names
            },
        )

    # -- attributes of the model

    def text(self) -> str:
        """A text on the model for its users."""
        kinds = ", ".join(f"{name} is of the model {model.name}" for name, model in self.models.items())
        joined = ", ".join(f"{source} to {target}" for target, source in self.sources.items())
        return (
            f"A system as one model: {kinds}. Each load is evaluated at the present angle and speed of its shaft, so "
            "that there is no error of a coupling; one integrator, which controls the error to solver.tolerance, "
            f"makes the steps of all.\n\nConnected inside: {joined or 'nothing'}."
        )

    def required(self, requirements_of: Callable[[Model], Sequence[Requirement]]) -> tuple[Requirement, ...]:
        """The requirements of all components, by full names."""
        return tuple(
            replace(
                requirement,
                subject=self._full(name, requirement.subject),
                context=tuple(self._full(name, x) for x in requirement.context),
                depends=tuple(self._full(name, x) for x in requirement.depends),
            )
            for name, model in self.models.items()
            for requirement in requirements_of(model)
        )

    def _full(self, name: str, subject: str) -> str:
        """The subject of a refusal with its component: a full name, or words."""
        variables = (*self.models[name].parameter_layout.names, *self.models[name].input_layout.names)
        return f"{name}.{subject}" if subject in variables else f"{name}: {subject}"

    def terminals(self) -> tuple[Terminal, ...]:
        """The free terminals, by full name."""
        terminals = []
        for full in self.data["terminals"]:
            name, _, port = full.partition(".")
            (terminal,) = (candidate for candidate in self.models[name].terminals if candidate.name == port)
            members = {member: f"{name}.{variable}" for member, variable in terminal.members.items()}
            description = f"{name}: {terminal.description}"
            terminals.append(replace(terminal, name=full, description=description, members=members))
        return tuple(terminals)

    def input_rates(self) -> dict[str, str]:
        """The free inputs whose derivative is a free input, too."""
        free = set(Layout(self.Inputs).names)
        pairs = {
            f"{name}.{variable}": f"{name}.{rate}"
            for name, model in self.models.items()
            for variable, rate in model.input_rates.items()
        }
        return {variable: rate for variable, rate in pairs.items() if {variable, rate} <= free}

    def by_differences(self) -> frozenset[str]:
        """The outputs whose derivatives are central differences."""
        return frozenset(
            f"{name}.{output}"
            for name, model in self.models.items()
            for part in model.parts
            for output in part.by_differences
        )

    # -- values

    def parameters(self, p: Any) -> dict[str, Any]:
        """The parameters of each component; kept with `p`, as they are the same in each evaluation."""
        kept: dict[str, Any] | None = getattr(p, "of_components", None)
        if kept is None:
            kept = {
                name: member.model.parameter_layout.instance([get(p) for get in member.parameters])
                for name, member in self.members.items()
            }
            object.__setattr__(p, "of_components", kept)
        return kept


class _ComponentPoint(NamedTuple):
    """A component at one point: its inputs, what its parts share, and the outputs of the computed parts by number."""

    inputs: Any
    shared: Any
    parts: dict[int, Any]


class SystemPoint:
    """A system at one point: the values of its connected outputs as far as they are known.

    Each component is evaluated as often as the order needs: once it knows all its inputs, not again. An input that is
    not yet known has its declared start value. The order sees to it that no output that is read depends on it.
    """

    def __init__(
        self, description: SystemDescription, xp: Any, p: Any, u: Any, states: Mapping[str, Any]
    ) -> None:
        self._system, self._xp, self._u = description, xp, u
        self.p = description.parameters(p)
        self._states = dict(states)
        self._values: dict[str, Any] = {}
        self._final: dict[str, _ComponentPoint] = {}

    def begin(self, name: str, states: Callable[[], Any]) -> None:
        """Give a component its states, which are computed when they are needed."""
        self._states[name] = states

    def states(self, name: str) -> Any:
        """The states of a component; None if it has none."""
        states = self._states.get(name)
        if callable(states):
            states = self._states[name] = states()
        return states

    def _source(self, full: str) -> Any:
        """The value of an output or a state; None if it is not yet known."""
        if full in self._values:
            return self._values[full]
        name, _, variable = full.partition(".")
        if name in self._states and variable in self._system.members[name].states:
            self._values[full] = attrgetter(variable)(self.states(name))
        return self._values.get(full)

    def inputs(self, name: str) -> tuple[Any, bool]:
        """The inputs of a component, and whether all of them are known."""
        member, values, complete = self._system.members[name], [], True
        layout = member.model.input_layout
        for variable, get, source in zip(layout.variables, member.free, member.sources, strict=True):
            value = get(self._u) if get else self._source(source) if source else variable.quantity.start
            if value is None:
                value, complete = variable.quantity.start, False
            values.append(value)
        return layout.instance(values), complete

    def arguments(self, name: str) -> tuple[Any, Any, Any, Any]:
        """The arguments of the equations of a component: namespace, parameters, inputs as far as they are known,
        states."""
        return self._xp, self.p[name], self.inputs(name)[0], self.states(name)

    def advance(self, steps: Steps) -> None:
        """Compute the outputs of these steps that are not yet known, and keep them for the inputs that take them."""
        for name, outputs in steps:
            missing = [output for output in outputs if self._source(f"{name}.{output}") is None]
            for output, value in self.outputs(name, missing) if missing else ():
                self._values[f"{name}.{output}"] = value

    def outputs(self, name: str, wanted: Iterable[str]) -> Iterator[tuple[str, Any]]:
        """These outputs of a component by name, with the inputs that are known so far."""
        member, evaluation = self._system.members[name], self._evaluation(name)
        u, shared, parts = evaluation.inputs, evaluation.shared, evaluation.parts
        for output in wanted:
            k, get = member.sites[output]
            if k not in parts:
                equations = member.model.parts[k].equations
                parts[k] = equations(self._xp, self.p[name], u, self.states(name), shared)
            yield output, get(parts[k])

    def _evaluation(self, name: str) -> _ComponentPoint:
        """The evaluation of a component with the inputs that are known; it is kept once all of them are."""
        if name in self._final:
            return self._final[name]
        u, complete = self.inputs(name)
        shared = self._system.models[name].shared(self._xp, self.p[name], u, self.states(name))
        evaluation = _ComponentPoint(u, shared, {})
        if complete:
            self._final[name] = evaluation
        return evaluation
