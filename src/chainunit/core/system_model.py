"""The model of a system of models: `system_model` makes it from a description (`core.system_description`)."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import Any

from .errors import GeometryError, refusal_prefix
from .model import About, FmuData, Model, Part, StartProblem
from .quantities import Layout
from .system_description import SystemDescription, SystemPoint


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class SystemModel(Model):
    """A model that a system of models makes; `system_model` gives it.

    Its internal integrator controls the error: the limits of a control bend the course of the states, and friction
    near rest acts within microseconds. With equal steps of 0.25 ms such a bend alone costs an accuracy of 1e-6.
    """

    system: SystemDescription

    def __post_init__(self) -> None:
        self.follow(
            derive=self._derived,
            requirements=self._limits,
            start_guess=self._start_guess,
            improve_start=self._improved_start,
            start_states=self._start_states,
            start_limits=self._start_limits,
            derivatives=self._rates,
            shared=self._advanced,
            internal_step=self._internal_step,
            tolerance=self._tolerance,
            constrained_states=self._closed,
        )
        super().__post_init__()

    def point(self, xp: Any, p: Any, u: Any, x: Any) -> SystemPoint:
        """The system with these parameters, inputs and states."""
        names = [name for name, member in self.system.members.items() if member.states]
        return SystemPoint(self.system, xp, p, u, {name: getattr(x, name) for name in names} if x else {})

    def with_derived(self, xp: Any, p: Any, derived: list[Any] | None = None) -> Any:
        """See `Model.with_derived`; each component gets its own derived values."""
        if not self.derived_count:
            return p
        ready, first = copy.copy(p), 0
        values: list[Any] = []
        # the copy has the values of the original
        vars(ready).pop("of_components", None)
        parameters = self.system.parameters(ready)
        for name, model in self.system.models.items():
            numbers = None if derived is None else derived[first : first + model.derived_count]
            parameters[name] = model.with_derived(xp, parameters[name], numbers)
            values += parameters[name].derived if model.derived_count else []
            first += model.derived_count
        object.__setattr__(ready, "derived", values)
        return ready

    def _derived(self, xp: Any, p: Any) -> list[Any]:
        """The derived values of all components."""
        parameters = self.system.parameters(p)
        return [v for name, model in self.system.models.items() for v in model.derive(xp, parameters[name])]

    def check(self, p: Any) -> Any:
        """See `Model.check`; the refusal of a machine is the one of its own model, if it has an `obstacle`."""
        try:
            return super().check(p)
        except GeometryError as error:
            parameters = self.system.parameters(p)
            for name, model in self.system.models.items():
                if model.obstacle is not None:
                    with refusal_prefix(f"{name}: "):
                        model.check(parameters[name])
            raise error from None

    def _limits(self, xp: Any, p: Any) -> Iterator[tuple[Any, Any, Any]]:
        """The limits of all components."""
        parameters = self.system.parameters(p)
        for name, model in self.system.models.items():
            yield from model.requirements(xp, parameters[name])

    # -- the start

    def _begin(
        self, xp: Any, p: Any, u: Any, unknowns: Callable[[str, Any, Any], list[Any]]
    ) -> tuple[list[Any], SystemPoint]:
        """The unknowns of the start of all components in the order of the start, and the system with the states that
        follow from them; `unknowns` gives the unknowns of one component by its name, parameters and inputs."""
        point = SystemPoint(self.system, xp, p, u, {})
        z: list[Any] = []
        for name, outputs in self.system.start:
            if outputs is not None:
                point.advance([(name, outputs)])
                continue
            model, parameters, inputs = self.system.models[name], point.p[name], point.inputs(name)[0]
            component_z = unknowns(name, parameters, inputs) if model.start_problem.unknowns else []
            z += component_z
            point.begin(name, partial(model.start_states, xp, parameters, inputs, component_z))
        return z, point

    def _start_guess(self, xp: Any, p: Any, u: Any) -> list[Any]:
        """First guess of the unknowns of the start."""

        def guess(name: str, parameters: Any, inputs: Any) -> list[Any]:
            return self.system.models[name].start_guess(xp, parameters, inputs)

        return self._begin(xp, p, u, guess)[0]

    def _improved_start(self, xp: Any, p: Any, u: Any, z: list[Any]) -> list[Any]:
        """The unknowns of the start after one more round."""

        def improved(name: str, parameters: Any, inputs: Any) -> list[Any]:
            before = z[self.system.unknowns[name]]
            return self.system.models[name].improve_start(xp, parameters, inputs, before)

        return self._begin(xp, p, u, improved)[0]

    def _start_states(self, xp: Any, p: Any, u: Any, z: list[Any]) -> Any:
        """States at the start with the inputs `u`, from the unknowns `z` of all components."""
        _, point = self._begin(xp, p, u, lambda name, parameters, inputs: z[self.system.unknowns[name]])
        return self.States(
            **{name: point.states(name) for name, m in self.system.members.items() if m.states}
        )

    def _start_limits(self, xp: Any, p: Any, u: Any, x: Any) -> Iterator[tuple[Any, Any, Any]]:
        """The limits of all components."""
        point = self.point(xp, p, u, x)
        point.advance(self.system.steps)
        for name, model in self.system.models.items():
            if model.start_problem.required:
                yield from model.start_limits(*point.arguments(name))

    # -- the run

    def _rates(self, xp: Any, p: Any, u: Any, x: Any) -> list[Any]:
        """Time derivatives of the states, component by component."""
        point = self.point(xp, p, u, x)
        point.advance(self.system.rate_steps)
        rates: list[Any] = []
        for name, model in self.system.models.items():
            if model.state_layout:
                rates += model.derivatives(*point.arguments(name))
        return rates

    def _advanced(self, xp: Any, p: Any, u: Any, x: Any) -> SystemPoint:
        """The system with all inputs of its components."""
        point = self.point(xp, p, u, x)
        point.advance(self.system.steps)
        return point

    def _internal_step(self, xp: Any, p: Any) -> Any:
        """The least of the components' longest steps."""
        parameters = self.system.parameters(p)
        models = [(name, model) for name, model in self.system.models.items() if model.state_layout]
        return _least(xp, (model.internal_step(xp, parameters[name]) for name, model in models))

    def _tolerance(self, xp: Any, p: Any) -> Any:
        """The parameter `solver.tolerance`, or the least tolerance of the components that control the error if it
        is less."""
        parameters = self.system.parameters(p)
        models = [(name, model) for name, model in self.system.models.items() if model.controlled]
        return _least(
            xp, [p.solver.tolerance, *(model.tolerance(xp, parameters[name]) for name, model in models)]
        )

    def _closed(self, xp: Any, p: Any, u: Any, x: Any) -> list[Any]:
        """The states near `x` that meet the constraints of the components; a component without constraints keeps its
        states."""
        point = self.point(xp, p, u, x)
        point.advance(self.system.closed_steps)
        values: list[Any] = []
        for name, model in self.system.models.items():
            if model.controlled:
                values += model.constrained_states(*point.arguments(name))
            elif model.state_layout:
                values += model.state_layout.values(point.states(name))
        return values


_MODELS: dict[Any, SystemModel] = {}


def system_model(data: Mapping[str, Any], models: Mapping[str, Model]) -> SystemModel:
    """The model of a description and of its components by name; equal descriptions of the same components have one
    model."""
    # a model that was defined anew, as in a notebook, makes a new system
    key = json.dumps(data, sort_keys=True), tuple(models.items())
    if key not in _MODELS:
        _MODELS[key] = _new_model(SystemDescription(data, models))
    return _MODELS[key]


def _outputs_of(declared: Any) -> Callable[..., Any]:
    """The equations of a part of the system with this declaration, whose names are ``component.output``: they take
    each value from its component at the point of the system."""
    layout = Layout(declared)
    names: dict[str, list[str]] = {}
    for full in layout.names:
        name, _, output = full.partition(".")
        names.setdefault(name, []).append(output)

    def equations(xp: Any, p: Any, u: Any, x: Any, point: SystemPoint) -> Any:
        return layout.instance(
            [y for name, variables in names.items() for _, y in point.outputs(name, variables)]
        )

    return equations


def _least(xp: Any, values: Iterable[Any]) -> Any:
    least, *others = values
    for value in others:
        least = xp.minimum(least, value)
    return least


def _shortest(models: Iterable[Model]) -> dict[str, float]:
    """The shortest step and stop, and the least tolerance, of the components' default experiments."""
    experiment: dict[str, float] = {}
    for model in models:
        limits = model.fmu_data.experiment
        experiment = {key: min(x, experiment.get(key, x)) for key, x in {**experiment, **limits}.items()}
    return experiment


def _sizes(description: SystemDescription) -> dict[str, float]:
    """The components' sizes of the free inputs."""
    free = set(Layout(description.Inputs).names)
    sizes = {
        f"{name}.{key}": x for name, m in description.models.items() for key, x in m.fmu_data.sizes.items()
    }
    return {name: x for name, x in sizes.items() if name in free}


def _new_model(description: SystemDescription) -> SystemModel:
    """The model of a description: all it has by the names of its components."""
    data, models = description.data, description.models.values()
    by_differences = description.by_differences()
    return SystemModel(
        name=data["name"],
        text=description.text(),
        description=data["title"],
        system=description,
        components=MappingProxyType(description.models),
        made=(system_model, (data, description.models)),
        Parameters=description.Parameters,
        Inputs=description.Inputs,
        States=description.States if description.has_states else None,
        required=description.required(lambda model: model.required),
        start_problem=StartProblem(
            sum(model.start_problem.unknowns for model in models),
            data["start_rounds"],
            description.required(lambda model: model.start_problem.required),
        ),
        fmu_data=FmuData(
            about=None if data["about"] is None else About(**data["about"]),
            experiment=MappingProxyType(_shortest(models) | data["experiment"]),
            sizes=MappingProxyType(_sizes(description)),
        ),
        repeated={
            f"{component}.{name}": f"{component}.{original}"
            for component, model in description.models.items()
            for name, original in model.repeated.items()
        },
        constant={
            f"{component}.{name}": value
            for component, model in description.models.items()
            for name, value in model.constant.items()
        },
        terminals=description.terminals(),
        derived_count=sum(model.derived_count for model in models),
        input_rates=description.input_rates(),
        controlled=description.has_states,
        parts=tuple(
            Part(declared, _outputs_of(declared), by_differences=by_differences & {*Layout(declared).names})
            for declared in (description.Outputs, description.Extra)
            if declared
        ),
    )
