"""A system of models compiled to one model, from which all follows that exists for models: FMU, batch evaluation,
monolithic reference.

Each load is evaluated at its own point, at the present angle and speed of its shaft: there is no linearised load and
no error of a coupling.
"""

from __future__ import annotations

import keyword
import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from ..core.engines import casadi_
from ..core.errors import InputError, printable, shown
from ..core.integrators import MAX_STEPS
from ..core.model import About, Model, Terminal
from ..core.ports import MEASURED
from ..core.system_description import RESERVED, SOLVER
from ..core.system_model import system_model
from ..fmu.backends import Backend, Origin
from ..fmu.backends import export as export_fmu
from ..fmu.description import Interface
from .graph import Component, Connection, ModelComponent, System, hold_loads, order


def compiled(
    system: System,
    name: str = "System",
    title: str = "",
    *,
    about: About | None = None,
    experiment: Mapping[str, float] | None = None,
) -> ModelComponent:
    """One model of a system of models, with the values of its parameters.

    Its names are the full names of the system: of parameters ("motor.armature.R"), states and outputs. Its inputs are
    the inputs without a connection. The slopes of load ports that are joined are neither inputs nor outputs, unless a
    free terminal passes them on. Terminals that are not joined are its terminals. One `solver.max_steps`, the largest
    of the components, holds for the integrator of the whole, which controls the error to `solver.tolerance`.

    Parameters
    ----------
    system : its components are all models
    name : name of the model and of its FMU: letters, digits and _
    title : description of the model, before that of the components
    about : who made the system, as its FMU says it
    experiment : ``step`` and ``stop`` [s] of the default experiment of its FMU, in place of the least ones of the
        components

    Raises
    ------
    InputError
        where a component is an FMU, whose equations are not known; for an algebraic loop, also of the start; and for
        a name that a component of a compiled system cannot have.
    """
    models: dict[str, Model] = {}
    for component_name, component in system.components.items():
        if not isinstance(component, ModelComponent):
            raise InputError(
                f"{component_name} ({component.title}): is an FMU, whose equations are not known; only a system "
                "of models can be one model (an SSP package takes FMUs as they are)"
            )
        if component_name in RESERVED or component_name.startswith("_") or keyword.iskeyword(component_name):
            raise InputError(
                f"{shown(component_name)}: a component of a system that becomes one model cannot have this name"
            )
        models[component_name] = component.model
    if not re.fullmatch(r"[A-Za-z]\w*", name, re.ASCII) or keyword.iskeyword(name):
        raise InputError(
            f"{shown(name)}: the name of a model must be of letters, digits and _, and begin with a letter"
        )
    description = _description(system, models, name, printable(title))
    description |= {"about": about and asdict(about), "experiment": dict(experiment or {})}
    model = system_model(description, models)
    values = system.values
    layout = model.parameter_layout
    limits = {
        setting: [values[full] for prefix in models if (full := f"{prefix}.{setting}") in values]
        for setting in SOLVER
    }
    own_values = {full: values[full] for full in layout.names if full in values}
    # as many steps as the part that needs most of them, as exact as the most exact part
    own_values |= {
        setting: (max if setting == MAX_STEPS else min)(bounds)
        for setting, bounds in limits.items()
        if bounds
    }
    return ModelComponent(model, layout.from_names(own_values))


def export_compiled(
    system: System,
    file: Path,
    *,
    name: str = "System",
    title: str = "",
    backend: Backend | None = None,
    fmi: int = 2,
    platforms: Sequence[str] = (),
    progress: Callable[[str], None] = lambda what: None,
) -> Origin:
    """Write a system of models as one FMU, with the start values of the system.

    Parameters
    ----------
    system, name, title : see `compiled`
    file, backend, fmi, platforms, progress : see `chainunit.fmu.backends.export`

    Raises
    ------
    InputError, RunError
        see `compiled` and `chainunit.fmu.backends.export`.
    """
    part = compiled(system, name, title)
    start = part.start | input_starts(system, part.model)
    return export_fmu(
        part.model, file, start, backend=backend, fmi=fmi, platforms=platforms, progress=progress
    )


def input_starts(system: System, model: Model) -> dict[str, float]:
    """The start values of the inputs of a compiled system, where the system gives one."""
    values = system.values
    return {full: values[full] for full in model.input_layout.names if full in values}


def _description(system: System, models: Mapping[str, Model], name: str, title: str) -> dict[str, Any]:
    """The description of a system as `chainunit.core.system_description.SystemDescription` takes it, in types of
    JSON: the exact connections, in place of the slopes of load ports; what is left out or shown in addition; and the
    order in which outputs, rates and the start are computed."""
    exact = hold_loads(system).connections
    influences = {component: _influences(model) for component, model in models.items()}
    free = _free_terminals(system)
    # variables of terminals that are not joined
    members = {
        f"{full.partition('.')[0]}.{variable}"
        for full in free
        for variable in system.terminal(full)[1].members.values()
    }
    slopes = {c for c in replace(system, slopes=True).connections if c not in exact}
    gears = {
        component: influences[component] for component, model in models.items() if not model.state_layout
    }
    # slopes that a part without states needs to pass them on to a free terminal
    passed = _passed_on(slopes, members, gears)
    connections = [*exact, *passed]
    left_out = {full for connection in slopes - set(passed) for full in connection}
    # outputs of further parts of the models, such as slopes, are extra ones of the system, if they are needed
    further = {
        f"{name}.{output}"
        for name, model in models.items()
        for part in model.parts[1:]
        for output in part.layout.names
    }
    extra = further & (members | {source for source, _ in connections})
    plan = _Plan(connections, models, influences)
    kinds = ", ".join(f"{component} ({model.name})" for component, model in models.items())
    return {
        "name": name,
        "title": f"{title}: {kinds}" if title else f"System of {kinds}",
        "connections": [list(connection) for connection in connections],
        "left_out": sorted(left_out - extra),
        "terminals": free,
        "extra": sorted(extra),
        "steps": plan.steps,
        "rate_steps": plan.steps_for("rates"),
        "closed_steps": plan.steps_for("closed"),
        "start": plan.start(),
        "start_rounds": plan.start_rounds(),
    }


def _passed_on(
    slopes: Collection[Connection], members: Collection[str], gears: Mapping[str, _Influences]
) -> list[Connection]:
    """The connections of slopes, by source and target, on which outputs of free terminals depend: a gear, which has
    no states, passes the slopes of its machine on. A component with states takes the load at its own point."""
    sources = {target: source for source, target in slopes}
    passed: list[Connection] = []
    waiting = sorted(members)
    while waiting:
        name, _, output = waiting.pop(0).partition(".")
        for entry in sorted(gears[name].direct.get(output, ()) if name in gears else ()):
            source = sources.pop(full := f"{name}.{entry}", None)
            if source is not None:
                passed.append((source, full))
                waiting.append(source)
    return passed


def _free_terminals(system: System) -> list[str]:
    """The terminals, by full name, none of whose variables is connected or belongs to a joined terminal, and those of
    measured signals that it gives. A load port needs the free shaft to which it belongs."""
    taken = {full for connection in system.connections for full in connection}
    for joint in system.joints:
        for full in joint:
            name, terminal = system.terminal(full)
            taken |= {f"{name}.{variable}" for variable in terminal.members.values()}
    free = []
    for name, component in system.components.items():
        open_terminals = [
            terminal
            for terminal in component.terminals.values()
            if not taken & {f"{name}.{variable}" for variable in terminal.members.values()}
            or _gives_signals(component, terminal)
        ]
        # who gives the motion takes the load
        moved = [t.members["phi"] for t in open_terminals if t.kind != MEASURED and "phi" in t.members]
        shafts = {component.connectors[name].causality for name in moved}
        ports = {
            t.name: component.connectors[t.members["tau_bias"]]
            for t in open_terminals
            if "tau_bias" in t.members
        }
        free += [
            f"{name}.{t.name}"
            for t in open_terminals
            if t.name not in ports or shafts - {ports[t.name].causality}
        ]
    return free


def _gives_signals(component: Component, terminal: Terminal) -> bool:
    """Whether it is a terminal of measured signals that the component gives: any number of others may read them."""
    return terminal.kind == MEASURED and component.connectors[terminal.members["w"]].causality == "output"


@dataclass(frozen=True)
class _Influences:
    """The inputs of a model on which its quantities depend directly: by output and state, and of the derivatives, the
    states at the start, and the constraints."""

    direct: Mapping[str, set[str]]
    rates: set[str]
    start: set[str]
    closed: set[str]


@lru_cache(maxsize=64)
def _influences(model: Model) -> _Influences:
    """The inputs on which outputs, derivatives and start of a model depend, by its equations."""
    interface = Interface(model, {})
    n_states, n_outputs = len(interface.states), len(interface.others)

    def inputs(references: list[int]) -> set[str]:
        signals = (interface.signals[i] for i in references if i < len(interface.signals))
        return {signal.name for signal in signals if signal.causality == "input"}

    rows = interface.dependencies
    ends = n_states + n_outputs
    names = [v.name for v in (*interface.states, *interface.others)]
    return _Influences(
        {name: inputs(in_run) for name, (in_run, _) in zip(names, rows, strict=False)},
        set[str]().union(*(inputs(in_run) for in_run, _ in rows[ends:])),
        set[str]().union(*(inputs(first) for _, first in rows[:n_states])),
        _constraints(interface) if model.controlled else set(),
    )


def _constraints(interface: Interface) -> set[str]:
    """The inputs on which the states after an event depend, see `Model.constrained_states`."""
    import casadi

    t = interface.trace
    rows = casadi.vertcat(*interface.model.constrained_states(casadi_(), t.p, t.u, t.x))
    depends = casadi.which_depends(rows, t.symbols[1], 1, False)
    names = [v.name for v in interface.inputs]
    return {name for name, counts in zip(names, depends, strict=True) if counts}


class _Plan:
    """The order in which the equations of a system are evaluated."""

    def __init__(
        self,
        connections: list[Connection],
        models: Mapping[str, Model],
        influences: Mapping[str, _Influences],
    ) -> None:
        self._models, self._of = models, influences
        self._sources = {target: source for source, target in connections}
        direct = {name: influence.direct for name, influence in influences.items()}
        self.steps = [(name, outputs) for name, outputs in order(connections, direct)]

    def _feeding(self, name: str, inputs: set[str]) -> list[tuple[str, str]]:
        """Component and variable of each source of these inputs of a component."""
        fulls = [f"{name}.{variable}" for variable in sorted(inputs)]
        sources = [self._sources[full] for full in fulls if full in self._sources]
        return [(source.partition(".")[0], source.partition(".")[2]) for source in sources]

    def steps_for(self, kind: str) -> list[tuple[str, list[str]]]:
        """The steps that the derivatives ("rates") or the constraints ("closed") of the components need."""
        needed: set[tuple[str, str]] = set()
        waiting = [
            source
            for name, influence in self._of.items()
            for source in self._feeding(name, getattr(influence, kind))
        ]
        while waiting:
            name, output = waiting.pop()
            if (name, output) not in needed:
                needed.add((name, output))
                waiting += self._feeding(name, self._of[name].direct[output])
        steps = [(name, [x for x in outputs if (name, x) in needed]) for name, outputs in self.steps]
        return [(name, outputs) for name, outputs in steps if outputs]

    def start(self) -> list[tuple[str, list[str] | None]]:
        """The steps of the start in their order: the name of a component and None, if its states start, or else its
        output, in a list, which the start of other components depends on.

        Raises
        ------
        InputError
            for states that depend on each other.
        """
        steps: list[tuple[str, list[str] | None]] = []
        self._started_by: dict[str, set[str]] = {}

        def begin(name: str, above: tuple[str, ...]) -> None:
            """Add the start of a component to the steps, after all outputs that its states need; `above` are the
            components that wait for it."""
            if name in above:
                loop = " -> ".join((*above[above.index(name) :], name))
                raise InputError(f"the states at the start depend on each other: {loop}")
            layout = self._models[name].state_layout
            if name in self._started_by or layout is None:
                return
            before: set[str] = set()
            for source in self._feeding(name, self._of[name].start):
                before |= know(*source, (*above, name))
            self._started_by[name] = before
            steps.append((name, None))

        def know(name: str, variable: str, above: tuple[str, ...]) -> set[str]:
            """Compute a variable; returns the components whose start it depends on."""
            layout = self._models[name].state_layout
            begin(name, above)
            before = {name} if layout else set()
            if layout is None or variable not in layout.names:
                for source in self._feeding(name, self._of[name].direct[variable]):
                    before |= know(*source, above)
                steps.append((name, [variable]))
            return before

        for name in self._models:
            begin(name, ())
        return steps

    def start_rounds(self) -> int:
        """Rounds of the iteration of the start: where one start depends on another, one iteration needs the result of
        the other."""

        def rounds(name: str) -> int:
            before = max(map(rounds, self._started_by[name]), default=0)
            return before + self._models[name].start_problem.rounds

        return max(map(rounds, self._started_by), default=0)
