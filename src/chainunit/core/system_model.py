"""The model of a system of models: `system_model` makes it from a description (`core.system_description`)."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from types import MappingProxyType
from typing import Any, ClassVar

from .errors import GeometryError, refusal_prefix
from .model import About, FmuData, Making, Model, Part, StartProblem, keep
from .quantities import Layout
from .system_description import SystemDescription, SystemPoint, model_at


class SystemModel(Model):
    """A model that a system of models makes; `system_model` gives its subclasses.

    Its internal integrator controls the error: the limits of a control bend the course of the states, and friction
    near rest acts within microseconds. With equal steps of 0.25 ms such a bend alone costs an accuracy of 1e-6.
    """

    system: ClassVar[SystemDescription]

    @classmethod
    def at(cls, xp: Any, p: Any, u: Any, x: Any) -> SystemPoint:
        """The system at one point."""
        names = [name for name, member in cls.system.members.items() if member.states]
        return SystemPoint(cls.system, xp, p, u, {name: getattr(x, name) for name in names} if x else {})

    @classmethod
    def _components(cls) -> Iterator[tuple[str, type[Model]]]:
        yield from cls.system.models.items()

    @classmethod
    def with_derived(cls, xp: Any, p: Any, derived: list[Any] | None = None) -> Any:
        """See `Model.with_derived`; each component gets its own derived values."""
        if not cls.derived_count:
            return p
        ready, first = copy.copy(p), 0
        values: list[Any] = []
        # the copy has the values of the original
        vars(ready).pop("of_components", None)
        own = cls.system.parameters(ready)
        for name, model in cls._components():
            given = None if derived is None else derived[first : first + model.derived_count]
            own[name] = model.with_derived(xp, own[name], given)
            values += own[name].derived if model.derived_count else []
            first += model.derived_count
        object.__setattr__(ready, "derived", values)
        return ready

    @classmethod
    def derive(cls, xp: Any, p: Any) -> list[Any]:
        """The derived values of all components."""
        own = cls.system.parameters(p)
        return [v for name, model in cls._components() for v in model.derive(xp, own[name])]

    @classmethod
    def check(cls, p: Any) -> Any:
        """See `Model.check`; where a model has more to say on its geometry, the refusal says it."""
        try:
            return super().check(p)
        except GeometryError as error:
            own = cls.system.parameters(p)
            for name, model in cls._components():
                if next(base for base in model.__mro__ if "check" in vars(base)) is not Model:
                    with refusal_prefix(f"{name}: "):
                        model.check(own[name])
            raise error from None

    @classmethod
    def requirements(cls, xp: Any, p: Any) -> Iterator[tuple[Any, Any, Any]]:
        """The limits of all components."""
        own = cls.system.parameters(p)
        for name, model in cls._components():
            yield from model.requirements(xp, own[name])

    # -- the start

    @classmethod
    def _begin(
        cls, xp: Any, p: Any, u: Any, unknowns: Callable[[type[Model], Any, Any], list[Any]]
    ) -> tuple[list[Any], SystemPoint]:
        """The unknowns of the start of all components, and the system with the states that follow from them;
        `unknowns` gives those of a component from its model, parameters and inputs."""
        point = SystemPoint(cls.system, xp, p, u, {})
        z: list[Any] = []
        for name, outputs in cls.system.start:
            if outputs is not None:
                point.advance([(name, outputs)])
                continue
            model, parameters = cls.system.models[name], point.p[name]
            entries, _ = point.inputs(name)
            mine = unknowns(model, parameters, entries) if model.start_problem.unknowns else []
            z += mine

            def states(
                model: type[Model] = model,
                parameters: Any = parameters,
                entries: Any = entries,
                z: list[Any] = mine,
            ) -> Any:
                return model.start_states(xp, parameters, entries, z)

            point.begin(name, states)
        return z, point

    @classmethod
    def start_guess(cls, xp: Any, p: Any, u: Any) -> list[Any]:
        """First guess of the unknowns of the start, of all components in order."""
        return cls._begin(xp, p, u, lambda model, own, entries: model.start_guess(xp, own, entries))[0]

    @classmethod
    def improve_start(cls, xp: Any, p: Any, u: Any, z: list[Any]) -> list[Any]:
        """The unknowns of the start after one more round, of all components in order."""
        before = iter(z)

        def improved(model: type[Model], parameters: Any, entries: Any) -> list[Any]:
            mine = [next(before) for _ in range(model.start_problem.unknowns)]
            return model.improve_start(xp, parameters, entries, mine)

        return cls._begin(xp, p, u, improved)[0]

    @classmethod
    def start_states(cls, xp: Any, p: Any, u: Any, z: list[Any]) -> Any:
        """States at the start with the inputs `u`, from the unknowns `z` of all components."""
        before = iter(z)

        def given(model: type[Model], parameters: Any, entries: Any) -> list[Any]:
            return [next(before) for _ in range(model.start_problem.unknowns)]

        _, point = cls._begin(xp, p, u, given)
        assert cls.States is not None
        return cls.States(**{name: point.states(name) for name, m in cls.system.members.items() if m.states})

    @classmethod
    def start_limits(cls, xp: Any, p: Any, u: Any, x: Any) -> Iterator[tuple[Any, Any, Any]]:
        """The limits of all components."""
        point = cls.at(xp, p, u, x)
        point.advance(cls.system.steps)
        for name, model in cls._components():
            if model.start_problem.required:
                yield from model.start_limits(*point.arguments(name))

    # -- the run

    @classmethod
    def derivatives(cls, xp: Any, p: Any, u: Any, x: Any) -> list[Any]:
        """Time derivatives of the states, component by component."""
        point = cls.at(xp, p, u, x)
        point.advance(cls.system.rate_steps)
        rates: list[Any] = []
        for name, model in cls._components():
            if model.state_layout:
                rates += model.derivatives(*point.arguments(name))
        return rates

    @classmethod
    def shared(cls, xp: Any, p: Any, u: Any, x: Any) -> SystemPoint:
        """The system with all inputs of its components."""
        point = cls.at(xp, p, u, x)
        point.advance(cls.system.steps)
        return point

    @classmethod
    def _outputs(cls, declared: Any) -> Callable[..., Any]:
        """The equations of a part with this declaration."""
        layout = Layout(declared)
        names: dict[str, list[str]] = {}
        for full in layout.names:
            name, _, output = full.partition(".")
            names.setdefault(name, []).append(output)

        def equations(xp: Any, p: Any, u: Any, x: Any, point: SystemPoint) -> Any:
            return layout.instance([y for name, own in names.items() for _, y in point.outputs(name, own)])

        return equations

    @classmethod
    def _least(cls, xp: Any, values: Iterable[Any]) -> Any:
        least, *others = values
        for value in others:
            least = xp.minimum(least, value)
        return least

    @classmethod
    def internal_step(cls, xp: Any, p: Any) -> Any:
        """The least of the components' longest steps."""
        own = cls.system.parameters(p)
        models = [(name, model) for name, model in cls._components() if model.state_layout]
        return cls._least(xp, (model.internal_step(xp, own[name]) for name, model in models))

    @classmethod
    def tolerance(cls, xp: Any, p: Any) -> Any:
        """The parameter `solver.tolerance`, or the least tolerance of the components that control the error if it
        is less."""
        own = cls.system.parameters(p)
        models = [(name, model) for name, model in cls._components() if model.controlled]
        return cls._least(
            xp, [p.solver.tolerance, *(model.tolerance(xp, own[name]) for name, model in models)]
        )

    @classmethod
    def constrained_states(cls, xp: Any, p: Any, u: Any, x: Any) -> list[Any]:
        """The states near `x` that meet the constraints of each component; the others are those of `x`."""
        point = cls.at(xp, p, u, x)
        point.advance(cls.system.closed_steps)
        values: list[Any] = []
        for name, model in cls._components():
            if model.controlled:
                values += model.constrained_states(*point.arguments(name))
            elif model.state_layout:
                values += model.state_layout.values(point.states(name))
        return values


def system_model(data: Mapping[str, Any]) -> type[SystemModel]:
    """The model of a description; equal descriptions of the same components have one model."""
    # a class that was defined anew, as in a notebook, makes a new model
    models = (model_at(each) for _, each in data["components"])
    return _system_model(json.dumps(data, sort_keys=True), *models)


def _shortest(models: Iterable[type[Model]]) -> dict[str, float]:
    """The shortest step and stop, and the least tolerance, of the components' default experiments."""
    experiment: dict[str, float] = {}
    for model in models:
        own = model.fmu_data.experiment
        experiment = {key: min(x, experiment.get(key, x)) for key, x in {**experiment, **own}.items()}
    return experiment


def _sizes(of: SystemDescription) -> dict[str, float]:
    """The components' sizes of the free inputs."""
    free = set(Layout(of.Inputs).names)
    sizes = {f"{name}.{key}": x for name, m in of.models.items() for key, x in m.fmu_data.sizes.items()}
    return {name: x for name, x in sizes.items() if name in free}


@cache
def _system_model(text: str, *models: type[Model]) -> type[SystemModel]:
    of = SystemDescription(json.loads(text), models)
    apart = of.by_differences()
    about = of.data["about"]
    members: dict[str, Any] = {
        "__module__": __name__,
        "__doc__": of.words(),
        "name": of.data["name"],
        "description": of.data["title"],
        "system": of,
        "components": MappingProxyType(of.models),
        "made": Making(system_model, (of.data,)),
        "Parameters": of.Parameters,
        "Inputs": of.Inputs,
        "States": of.States if of.has_states else None,
        "required": of.required(lambda model: model.required),
        "start_problem": StartProblem(
            sum(model.start_problem.unknowns for model in models),
            of.data["start_rounds"],
            of.required(lambda model: model.start_problem.required),
        ),
        "fmu_data": FmuData(
            about=None if about is None else About(**about),
            experiment=MappingProxyType(_shortest(models) | of.data["experiment"]),
            sizes=MappingProxyType(_sizes(of)),
        ),
        "repeated": {
            f"{own}.{name}": f"{own}.{one}"
            for own, model in of.models.items()
            for name, one in model.repeated.items()
        },
        "constant": {
            f"{own}.{name}": value
            for own, model in of.models.items()
            for name, value in model.constant.items()
        },
        "terminals": of.terminals(),
        "derived_count": sum(model.derived_count for model in models),
        "input_rates": of.input_rates(),
        "controlled": of.has_states,
        "parts": tuple(
            Part(
                declared,
                SystemModel._outputs(declared),
                by_differences=apart & {*Layout(declared).names},
            )
            for declared in (of.Outputs, of.Extra)
            if declared
        ),
    }
    model = type(of.data["name"], (SystemModel,), members)
    keep(model, *("Parameters", "Inputs", *(["States"] if of.has_states else [])))
    return model
