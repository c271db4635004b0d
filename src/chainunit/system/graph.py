"""A system: components by name, joined by terminals.

A component is a model with its parameters or an FMU file. A joint joins two terminals of one kind. For each member
that both have, it connects the side that gives the member with the side that takes it. A member that both sides give,
such as the torque of a shaft, is not connected: the two values can be compared. A shaft with a load port makes two
joints, `shaft_joints`."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any

from ..core.brief import briefly_shown
from ..core.declared_numbers import has_own_unit, number_in, one_number
from ..core.errors import InputError, check_kind, shown
from ..core.model import Model, Terminal
from ..core.ports import FLANGE, LOAD, PortSlopes
from ..core.quantities import Layout, Type, base_units

Connection = tuple[str, str]
"""Source and target by full name, such as ``("motor.phi", "machine.phi")``."""


@dataclass(frozen=True)
class Connector:
    """A variable of a component at which a connection can begin or end, or that has a `start` value: `causality` is
    "parameter", "input" or "output". `dimension` holds the powers of the base units; None where the unit is unknown.
    For a foreign FMU it also holds the bounds and the `description`. A switch of the `type` Boolean is 0 or 1."""

    name: str
    causality: str
    unit: str
    dimension: Mapping[str, int] | None
    start: float = 0.0
    description: str = ""
    least: float = -math.inf
    most: float = math.inf
    type: Type = "Real"


@briefly_shown
@dataclass(frozen=True)
class ModelComponent:
    """A model with its `parameters`, an instance of its declaration; texts and quantities of pint have their units.
    `file` is its FMU, or None before the export;
    the start values in the file do not count."""

    model: Model
    parameters: Any
    file: Path | None = None

    def __post_init__(self) -> None:
        layout = self.model.parameter_layout
        check_kind(
            "parameters", self.parameters, self.model.Parameters, f"the Parameters of {self.model.name}"
        )
        values = layout.by_name(self.parameters)
        if not all(isinstance(value, float) for value in values.values()):
            numbers = {v.name: one_number(v, values[v.name]) for v in layout.variables}
            object.__setattr__(self, "parameters", layout.from_names(numbers))

    @cached_property
    def terminals(self) -> Mapping[str, Terminal]:
        """Its terminals by name."""
        return {terminal.name: terminal for terminal in self.model.terminals}

    @cached_property
    def connectors(self) -> Mapping[str, Connector]:
        """Its variables by name."""
        model = self.model
        outputs = [v for part in model.parts for v in part.layout.variables]
        states = model.state_layout.variables if model.state_layout else ()
        variables_of = {
            "parameter": model.parameter_layout.variables,
            "input": model.input_layout.variables,
            "output": (*states, *outputs),
        }
        return {
            v.name: Connector(
                v.name, causality, v.unit, base_units(v.unit), float(v.quantity.start or 0.0), type=v.type
            )
            for causality, variables in variables_of.items()
            for v in variables
        }

    @property
    def start(self) -> dict[str, float]:
        """Its parameters by name."""
        return self.model.parameter_layout.by_name(self.parameters)

    @property
    def title(self) -> str:
        """Its kind, in a word."""
        return self.model.name


@briefly_shown
@dataclass(frozen=True)
class FmuComponent:
    """An FMU `file`; see `chainunit.system.foreign`. `names` maps names of the system to names of the FMU, where they
    differ; `connectors` and `terminals` use the names of the system."""

    file: Path
    connectors: Mapping[str, Connector]
    terminals: Mapping[str, Terminal]
    names: Mapping[str, str] = field(default_factory=dict)
    start: Mapping[str, float] = field(default_factory=dict)
    description: str = ""

    @property
    def title(self) -> str:
        """Its kind, in a word."""
        return self.file.name


Component = ModelComponent | FmuComponent


@dataclass(frozen=True)
class Bond:
    """A shaft through which power flows, from `driver` to `machine`, by the names of the components; `flanges` are
    the terminals on both sides."""

    driver: str
    machine: str
    flanges: tuple[Terminal, Terminal]


@briefly_shown
@dataclass(frozen=True)
class System:
    """Components and their connections.

    Parameters
    ----------
    components : by name; a machine comes before its driver
    joints : pairs of terminals by full name, such as ``("motor.flange", "machine.flange")``
    wires : single connections from an output to an input
    start : start values of parameters and inputs by full name, beside the start values of the components
    slopes : whether load ports pass their slopes; without them the load is held constant over a step

    Raises
    ------
    InputError
        for an unknown name, a terminal that is joined twice, terminals that do not fit, an input with two sources,
        and units or types that differ.
    """

    components: Mapping[str, Component]
    joints: Sequence[tuple[str, str]] = ()
    wires: Sequence[Connection] = ()
    start: Mapping[str, float] = field(default_factory=dict)
    slopes: bool = True

    def __post_init__(self) -> None:
        check_kind("components", self.components, Mapping, "a mapping of names to components")
        for name, component in self.components.items():
            check_kind(f"components.{name}", component, Component, "a ModelComponent or an FmuComponent")
            # names of components become names of files, and full names are split at the first dot
            if not re.fullmatch(r"[A-Za-z_]\w*", name, re.ASCII):
                raise InputError(f"{shown(name)}: a component's name must be of letters, digits and _")
        pairs_of_names = "a list of pairs of full names"
        for name, pairs in (("joints", self.joints), ("wires", self.wires)):
            check_kind(name, pairs, tuple | list, pairs_of_names)
            for pair in pairs:
                check_kind(name, pair, tuple | list, pairs_of_names)
        partners: dict[str, str] = {}
        for joint in self.joints:
            for one, other in (joint, joint[::-1]):
                if one in partners:
                    raise InputError(f"{one}: is joined to {partners[one]} and to {other}")
                partners[one] = other
        sources: dict[str, str] = {}
        for source, target in self.connections:
            if target in sources:
                raise InputError(f"{target}: is connected to {sources[target]} and to {source}")
            self._check_ends(source, target)
            sources[target] = source
        check_kind("start", self.start, Mapping, "a mapping of full names to values")
        object.__setattr__(self, "start", self.in_units(self.start, "parameter", "input"))

    # -- names

    def component(self, full: str) -> tuple[str, str, Component]:
        """For a full name: the name of the component, the rest of the full name, and the component."""
        name, _, rest = full.partition(".")
        if name not in self.components:
            raise InputError(
                f"{full}: there is no component {shown(name)}; there are {', '.join(self.components)}"
            )
        return name, rest, self.components[name]

    def connector(self, full: str, *causalities: str) -> Connector:
        """The variable of this full name, with one of these causalities.

        Raises
        ------
        InputError
            where there is no such variable.
        """
        _, rest, component = self.component(full)
        connector = component.connectors.get(rest)
        if connector is None or (causalities and connector.causality not in causalities):
            raise InputError(f"{full}: no such {' or '.join(causalities) or 'variable'} in the system")
        return connector

    def in_units(self, values: Mapping[str, Any], *causalities: str) -> dict[str, Any]:
        """Values by full name of a variable, in the unit of the variable; functions of time as they are.

        Raises
        ------
        InputError
            where there is no such variable of one of these causalities, for a unit of another kind, and for a value
            that is no number.
        """
        return {
            full: self._in_unit(self.connector(full, *causalities), full, x) for full, x in values.items()
        }

    def _in_unit(self, connector: Connector, full: str, value: Any) -> Any:
        if callable(value) or (connector.type != "Real" and not has_own_unit(value)):
            return value
        return number_in(connector.unit or "1", full, value, connector.description)

    def terminal(self, full: str) -> tuple[str, Terminal]:
        """For the full name of a terminal: the name of the component, and the terminal."""
        name, rest, component = self.component(full)
        if rest not in component.terminals:
            terminals = ", ".join(component.terminals) or "none"
            raise InputError(f"{full}: no such terminal; {name} ({component.title}) has {terminals}")
        return name, component.terminals[rest]

    # -- connections

    @cached_property
    def connections(self) -> list[Connection]:
        """All connections between variables, first those by joints."""
        excluded = () if self.slopes else Layout(PortSlopes).names
        connections = [
            c for joint in self.joints for member, c in self._joint(*joint) if member not in excluded
        ]
        for source, target in self.wires:
            self.connector(source, "output")
            self.connector(target, "input")
        return [*connections, *self.wires]

    def _joint(self, first: str, second: str) -> list[tuple[str, Connection]]:
        """The connections of a joint, each with the name of the member."""
        (name, left), (name2, right) = self.terminal(first), self.terminal(second)
        if left.kind != right.kind:
            raise InputError(
                f"{first} ({left.kind}) cannot be joined to {second} ({right.kind}): the kinds must be alike"
            )
        pairs = []
        for member in left.members:
            if member not in right.members:
                continue
            ends = [f"{name}.{left.members[member]}", f"{name2}.{right.members[member]}"]
            gives = [self.connector(end).causality == "output" for end in ends]
            if gives[0] != gives[1]:
                pairs.append((member, (ends[0], ends[1]) if gives[0] else (ends[1], ends[0])))
            elif member == "phi":
                both = "give" if gives[0] else "take"
                raise InputError(
                    f"{first} and {second} both {both} the angle: one must give it, the other take it"
                )
        return pairs

    def _check_ends(self, source: str, target: str) -> None:
        """Refuse a connection between variables of another dimension or type."""
        one, other = self.connector(source), self.connector(target)
        comparable = one.dimension is not None and other.dimension is not None
        if comparable and one.dimension != other.dimension:
            raise InputError(f"{source} in {one.unit} cannot be connected to {target} in {other.unit}")
        if other.type not in ("Real", one.type):
            raise InputError(f"{source}, a {one.type}, cannot be connected to {target}, a {other.type}")

    @cached_property
    def bonds(self) -> list[Bond]:
        """Every shaft through which power flows, in the order of the joints."""
        bonds = []
        for one, other in self.joints:
            ends = [self.terminal(one), self.terminal(other)]
            if ends[0][1].kind != FLANGE:
                continue
            (name, terminal), _ = ends
            if self.connector(f"{name}.{terminal.members['phi']}").causality != "output":
                ends.reverse()
            (driver, gives), (machine, takes) = ends
            bonds.append(Bond(driver, machine, (gives, takes)))
        return bonds

    # -- values

    @property
    def values(self) -> dict[str, float]:
        """Start values of all components and those of `start`, by full name."""
        starts = {f"{name}.{v}": x for name, c in self.components.items() for v, x in c.start.items()}
        return starts | dict(self.start)

    def with_values(self, values: Mapping[str, float]) -> System:
        """The system with other values of parameters and inputs, by full name."""
        components, start = dict(self.components), dict(self.start)
        for full, value in values.items():
            name, rest, component = self.component(full)
            if isinstance(component, ModelComponent) and rest in component.model.parameter_layout.names:
                layout, before = component.model.parameter_layout, components[name]
                assert isinstance(before, ModelComponent)
                parameters = layout.from_names({rest: value}, before.parameters)
                components[name] = replace(before, parameters=parameters)
            else:
                start[full] = value
        return replace(self, components=components, start=start)


def shaft_joints(
    driver: str, machine: str, *, flange: str = "flange", load: str = "load"
) -> list[tuple[str, str]]:
    """The two joints of a shaft with its load port; `flange` and `load` are the driver's terminals."""
    return [(f"{driver}.{flange}", f"{machine}.flange"), (f"{driver}.{load}", f"{machine}.load")]


def in_line(parts: Mapping[str, Component]) -> System:
    """A system of parts in one line: the machine first, then each part that drives the one before it, the motor last.
    A part between machine and motor has the terminals `driven` and `machine` on its side towards the machine."""
    joints: list[tuple[str, str]] = []
    for machine, driver in pairwise(parts):
        ends = ("driven", "machine") if "driven" in parts[driver].terminals else ("flange", "load")
        joints = [*shaft_joints(driver, machine, flange=ends[0], load=ends[1]), *joints]
    return System(parts, joints)


# -- the order of evaluation

Direct = Mapping[str, Mapping[str, set[str]]]
"""By component and output: the inputs on which the output depends directly."""


def direct_inputs(component: Component, dependencies: Mapping[str, set[str] | None]) -> dict[str, set[str]]:
    """By output, the inputs on which it depends directly: the inputs in `dependencies`; or, where this is None,
    inputs that follow from the terminals. The component that gives the motion of a shaft owns its inertia, so that
    angle and speed are states. A load port is given at a point and does not depend on the acceleration. Every other
    output counts as dependent on all inputs."""
    kinds: dict[str, list[Terminal]] = {FLANGE: [], LOAD: []}
    for terminal in component.terminals.values():
        kinds.setdefault(terminal.kind, []).append(terminal)
    states = {t.members[x] for t in kinds[FLANGE] for x in ("phi", "w") if x in t.members}
    accelerations = {t.members["a"] for t in kinds[FLANGE] if "a" in t.members}
    ports = {variable for t in kinds[LOAD] for variable in t.members.values()}
    inputs = {c.name for c in component.connectors.values() if c.causality == "input"}

    def by_terminals(output: str) -> set[str]:
        if output in states:
            return set()
        return inputs - accelerations if output in ports else inputs

    return {
        output: by_terminals(output) if inputs_of is None else inputs_of
        for output, inputs_of in dependencies.items()
    }


def order(connections: Sequence[Connection], direct: Direct) -> list[tuple[str, list[str]]]:
    """Groups of connected outputs, each of one component, in an order in which each group depends only on earlier
    ones.

    Raises
    ------
    InputError
        for an algebraic loop, which is named.
    """
    sources = {target: source for source, target in connections}
    level: dict[str, int] = {}

    def rank(output: str, above: tuple[str, ...]) -> int:
        """The level of an output, one above the highest level of the outputs that feed it; `above` are the outputs
        that wait for it."""
        if output in above:
            loop = " -> ".join((*above[above.index(output) :], output))
            raise InputError(f"algebraic loop: {loop}; break it with a load port or a state")
        if output not in level:
            name, _, variable = output.partition(".")
            feeding = [
                sources[f"{name}.{entry}"]
                for entry in sorted(direct[name].get(variable, ()))
                if f"{name}.{entry}" in sources
            ]
            level[output] = 1 + max((rank(source, (*above, output)) for source in feeding), default=-1)
        return level[output]

    for output in sources.values():
        rank(output, ())
    groups: dict[tuple[int, str], list[str]] = {}
    for output, depth in level.items():
        name, _, variable = output.partition(".")
        groups.setdefault((depth, name), []).append(variable)
    places = {name: place for place, name in enumerate(direct)}
    return [(name, groups[depth, name]) for depth, name in sorted(groups, key=lambda g: (g[0], places[g[1]]))]


# -- twins: the system without one part


def without(system: System, names: Collection[str]) -> System:
    """The system without these components and without their connections; inputs without a source keep their start
    values."""
    for name in names:
        system.component(name)

    def stays(full: str) -> bool:
        return full.partition(".")[0] not in names

    return replace(
        system,
        components={name: c for name, c in system.components.items() if stays(name)},
        joints=[joint for joint in system.joints if all(map(stays, joint))],
        wires=[wire for wire in system.wires if all(map(stays, wire))],
        start={full: x for full, x in system.start.items() if stays(full)},
    )


def hold_loads(system: System) -> System:
    """The system with every load held constant over a step: the coupling is of first order only."""
    return replace(system, slopes=False)


def bridge(system: System, name: str) -> System:
    """The system without the component `name`; its driver is joined to the component that it drives."""
    rest = without(system, (name,))
    ends: dict[str, list[str]] = {}
    for joint in system.joints:
        if joint not in rest.joints:
            for full in joint:
                if full.partition(".")[0] != name:
                    ends.setdefault(system.terminal(full)[1].kind, []).append(full)
    for kind, fulls in ends.items():
        if len(fulls) != 2:
            raise InputError(f"{name}: has no two neighbours with a terminal of the kind {kind} to be joined")
    return replace(rest, joints=[*((one, other) for one, other in ends.values()), *rest.joints])


def rigid(system: System, line: str) -> System:
    """The system with a rigid shaft in place of the component `line`: its inertia `J4` on the rotor of its driver,
    its gear `ratio` in the machine behind it.

    Raises
    ------
    InputError
        where a component has no such parameter, such as a foreign FMU.
    """
    values = system.values
    driver = next((bond.driver for bond in system.bonds if bond.machine == line), "what drives it")
    machine = next((bond.machine for bond in system.bonds if bond.driver == line), "what it drives")
    names = (f"{line}.J4", f"{line}.ratio", f"{driver}.rotor.J", f"{machine}.ratio")
    for full in names:
        if full not in values:
            raise InputError(f"{full}: is not known, so that there is no twin with a rigid shaft")
    J, ratio, rotor, gear = (values[full] for full in names)
    return bridge(system, line).with_values(
        {f"{driver}.rotor.J": rotor + J / ratio**2, f"{machine}.ratio": gear * ratio}
    )
