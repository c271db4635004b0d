"""modelDescription.xml (FMI 2.0 and 3.0) and terminalsAndIcons.xml from a model's declarations."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import cache, cached_property, lru_cache
from importlib import metadata
from typing import Any
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from ..core.engines import casadi_
from ..core.errors import InputError
from ..core.model import About, Model
from ..core.quantities import DISPLAY_UNITS, TYPES, Type, Variable, base_units, quotient, written
from ..core.symbolic_trace import Trace, trace
from .recipe import Experiment
from .script import Script, name_in_fmu

RELEASED = "2026-11-27"
"""The day of this version's release, equal to the one in CITATION.cff."""
TYPES_3: Mapping[Type, str] = {"Real": "Float64", "Integer": "Int32", "Boolean": "Boolean"}
"""The names of the types in FMI 3.0."""


@dataclass(frozen=True)
class Signal:
    """A variable of the FMU: its name, its declaration in the model, causality, start value, value reference."""

    name: str
    variable: Variable
    causality: str
    start: float | None
    reference: int


class Interface:
    """The variables of a model's FMU in the order of their value references: parameters, inputs, states
    (each an output), other outputs part by part."""

    def __init__(self, model: Model, start: dict[str, float], script: type[Script] | None = None) -> None:
        """
        Parameters
        ----------
        start : start values in place of the declared ones
        script : values in place of the model's; by default none

        Raises
        ------
        KeyError
            for a name in `start` that is neither parameter nor input.
        """
        self.model = model
        self.script = script or Script
        self.experiment = {**model.fmu_data.experiment, **self.script.experiment}
        self.sizes = {**model.fmu_data.sizes, **self.script.sizes}
        self.parameters = model.parameter_layout.variables
        self.inputs = model.input_layout.variables
        self.states = model.state_layout.variables if model.state_layout else ()
        self.others = tuple(v for part in model.parts for v in part.layout.variables)
        names = {v.name for v in (*self.parameters, *self.inputs)}
        for name in start:
            if name not in names:
                raise KeyError(f"{model.name} has no parameter or input {name!r}")
        self.signals: list[Signal] = []
        for causality, group in (
            ("parameter", self.parameters),
            ("input", self.inputs),
            ("output", (*self.states, *self.others)),
        ):
            for v in group:
                value = None if causality == "output" else start.get(v.name, v.quantity.start)
                self.signals.append(Signal(self.name(v.name), v, causality, value, len(self.signals)))

    def __eq__(self, other: object) -> bool:
        """Whether the other one has the same model, start values and script."""
        return isinstance(other, Interface) and self._contents == other._contents

    def __hash__(self) -> int:
        return hash(self._contents)

    @property
    def _contents(self) -> tuple[Any, ...]:
        return self.model, self.script, tuple(signal.start for signal in self.signals)

    def name(self, variable: str) -> str:
        """The name in the FMU of the variable of the model with that name."""
        return name_in_fmu(variable, self.script.names)

    def text(self, text: str) -> str:
        """A text that names variables of the model, with their names in the FMU."""
        if self.script.names == "structured":
            return text
        return re.sub(r"\w+(?:\.\w+)+", lambda m: self.name(m[0]) if m[0] in self._variables else m[0], text)

    @cached_property
    def _variables(self) -> frozenset[str]:
        return frozenset(signal.variable.name for signal in self.signals)

    @cached_property
    def repeated(self) -> dict[str, Signal]:
        """The outputs that repeat another one, by name in the FMU, with the signal of that one."""
        outputs = {signal.variable.name: signal for signal in self.signals_of("output")}
        return {outputs[name].name: outputs[original] for name, original in self.model.repeated.items()}

    @property
    def discrete(self) -> list[int]:
        """Places, among the outputs after the states, of counts and switches."""
        return [i for i, v in enumerate(self.others) if v.type != "Real"]

    def signals_of(self, causality: str) -> list[Signal]:
        """Signals of one causality, in order."""
        return [s for s in self.signals if s.causality == causality]

    @cached_property
    def start_parameters(self) -> Any:
        """The parameters at their start values, with the values that are derived from them.

        Raises
        ------
        InputError, GeometryError
            see `chainunit.core.model.Model.check`.
        """
        starts = [signal.start for signal in self.signals_of("parameter")]
        return self.model.check(self.model.parameter_layout.instance(starts))

    @cached_property
    def trace(self) -> Trace:
        """The model in symbols: the same as long as the interface is there, as `derived` has them, too."""
        return trace(self.model)

    @property
    def dependencies(self) -> list[tuple[list[int], list[int]]]:
        """The true dependencies of each output, then of each state's derivative: value references in a run (inputs
        and states) and at the start (parameters and inputs). They come from the sparsity of the traced equations. In
        a run a state depends only on itself."""
        return shared_interface(self.model)._dependencies

    @cached_property
    def _dependencies(self) -> list[tuple[list[int], list[int]]]:
        """See `dependencies`, by the equations of this interface."""
        model = self.model
        t = self.trace
        rows = rows_at_start = [*t.outputs, *t.derivatives]
        states, start = [], []
        if model.state_layout:
            states = model.state_layout.values(t.x)
            first = model.start(casadi_(), t.p, t.u, rounds=min(2, model.start_problem.rounds))
            start = model.state_layout.values(first)
            rows_at_start = [*t.outputs_at(first), *model.derivatives(casadi_(), t.p, t.u, first)]
        in_run = self._influences(t.symbols, [*states, *rows])
        at_start = self._influences(t.symbols, [*start, *rows_at_start])
        n = len(self.parameters)
        return [
            ([i for i in entries if i >= n], first) for entries, first in zip(in_run, at_start, strict=True)
        ]

    @cached_property
    def derived(self) -> list[Any]:
        """The values that `Model.derive` computes from the parameters, in symbols.

        Raises
        ------
        ValueError
            if one depends on a parameter that may change in a run.
        """
        import casadi

        if not self.model.derived_count:
            return []
        rows = [casadi.SX(v) for v in self.model.derive(casadi_(), self.trace.p)]
        places = {i for row in self._places(self.trace.symbols[:1], rows) for i in row}
        for i in sorted(places):
            if self.parameters[i].quantity.tunable:
                raise ValueError(
                    f"{self.model.name}: {self.parameters[i].name} is tunable, but `derive` takes it"
                )
        return rows

    @property
    def reinitialized(self) -> frozenset[str]:
        """The states that an event may change: `Model.constrained_states` gives others than the states themselves."""
        return shared_interface(self.model)._reinitialized

    @cached_property
    def _reinitialized(self) -> frozenset[str]:
        """See `reinitialized`, by the equations of this interface."""
        import casadi

        if not (self.model.state_layout and self.model.controlled):
            return frozenset()
        t = self.trace
        constrained = self.model.constrained_states(casadi_(), t.p, t.u, t.x)
        pairs = zip(self.states, self.model.state_layout.values(t.x), constrained, strict=True)
        return frozenset(v.name for v, start, met in pairs if not casadi.is_equal(casadi.SX(met), start))

    def _influences(self, symbols: list[Any], rows: list[Any]) -> list[list[int]]:
        """Value references of the parameters, inputs and states on which each row depends, directly or through
        derived values."""
        direct = self._places(symbols, rows)
        first = sum(symbol.shape[0] for symbol in symbols[:3])
        through = self._places(symbols[:1], self.derived) if self.model.derived_count else []
        return [
            sorted({j for i in row for j in (through[i - first] if i >= first else (i,))}) for row in direct
        ]

    @staticmethod
    def _places(symbols: list[Any], rows: list[Any]) -> list[list[int]]:
        """Places of the symbols on which each row depends."""
        import casadi

        f = casadi.Function("rows", symbols, [casadi.vertcat(*rows)])
        places: list[list[int]] = [[] for _ in rows]
        offset = 0
        for side, symbol in enumerate(symbols):
            for row, column in zip(*f.jac_sparsity(0, side).get_triplet(), strict=True):
                places[row].append(offset + column)
            offset += symbol.shape[0]
        return places


@lru_cache(maxsize=8)
def shared_interface(model: Model) -> Interface:
    """The interface that keeps the equations of a model: its start values, and the version of FMI, do not change
    them."""
    return Interface(model, {}, Script)


def model_description(
    interface: Interface,
    guid: str,
    kinds: Mapping[str, Mapping[str, str]],
    version: str,
    sources: Sequence[str] = (),
    identifier: str = "",
) -> Element:
    """The XML tree of an FMI 2.0 FMU.

    `kinds` maps "ModelExchange" and "CoSimulation" to the attributes of their elements; with Model Exchange the
    derivatives of the states are variables, too. `sources` are the files from which the FMU can be compiled.
    `identifier` is the name of its library, by default the name of the model.
    """
    exchange = "ModelExchange" in kinds
    root = _root(interface, version, {"fmiVersion": "2.0", "guid": guid})
    root.set("numberOfEventIndicators", "0")
    for kind, options in kinds.items():
        element = SubElement(root, kind, {"modelIdentifier": identifier or interface.model.name, **options})
        if sources:
            files = SubElement(element, "SourceFiles")
            for name in sources:
                SubElement(files, "File", name=name)

    def add_type(types: Element, name: str, attributes: dict[str, str]) -> None:
        SubElement(SubElement(types, "SimpleType", name=name), "Real", attributes)

    _definitions(root, interface, exchange, set(), add_type)
    variables = SubElement(root, "ModelVariables")
    for attributes, kind, typed, state in _variables(interface, exchange):
        # an output that repeats another one has its value reference, but a place of its own
        if (original := interface.repeated.get(attributes["name"])) is not None:
            attributes["valueReference"] = str(original.reference)
        # FMI 2.0 counts variables from 1
        derivative = {} if state is None else {"derivative": str(state + 1)}
        SubElement(SubElement(variables, "ScalarVariable", attributes), kind, {**typed, **derivative})
    structure = SubElement(root, "ModelStructure")
    lists = {name: Element(name) for name in ("Outputs", "Derivatives", "InitialUnknowns")}
    first_state = len(interface.parameters) + len(interface.inputs)
    for kind, reference, influences in _structure(interface, exchange):
        # in an FMU for Co-Simulation only, the knowns include no states
        places = [i for i in influences if exchange or kind == "InitialUnknown" or i < first_state]
        title = {"Output": "Outputs", "InitialUnknown": "InitialUnknowns"}.get(kind, "Derivatives")
        unknown = {"index": str(reference + 1), **_dependencies([i + 1 for i in places])}
        SubElement(lists[title], "Unknown", unknown)
    structure.extend(element for name, element in lists.items() if len(element) or name != "Derivatives")
    return root


def model_description_3(
    interface: Interface, token: str, kinds: Mapping[str, Mapping[str, str]], version: str
) -> Element:
    """The XML tree of an FMI 3.0 FMU; the value references are the same as in FMI 2.0, followed by the time."""
    root = _root(interface, version, {"fmiVersion": "3.0", "instantiationToken": token})
    for kind, options in kinds.items():
        SubElement(root, kind, {"modelIdentifier": interface.model.name, **options})

    def add_type(types: Element, name: str, attributes: dict[str, str]) -> None:
        SubElement(types, "Float64Type", {"name": name, **attributes})

    _definitions(root, interface, True, {"s"}, add_type)
    variables = SubElement(root, "ModelVariables")
    elements: dict[str, Element] = {}
    last = 0
    for attributes, kind, typed, state in _variables(interface, True):
        last = int(attributes["valueReference"])
        if attributes["name"] in interface.repeated:
            continue
        derivative = {} if state is None else {"derivative": str(state)}
        tag = TYPES_3[kind]
        elements[attributes["name"]] = SubElement(variables, tag, {**attributes, **typed, **derivative})
    for signal in interface.signals_of("output"):
        if (original := interface.repeated.get(signal.name)) is not None:
            description = interface.text(signal.variable.description)
            SubElement(elements[original.name], "Alias", name=signal.name, description=description)
    time = {
        "name": "time",
        "valueReference": str(last + 1),
        "description": "time",
        "causality": "independent",
        "variability": "continuous",
    }
    SubElement(variables, "Float64", time | _unit("s"))
    structure = SubElement(root, "ModelStructure")
    aliases = {signal.reference for signal in interface.signals if signal.name in interface.repeated}
    for kind, reference, influences in _structure(interface, True):
        if reference in aliases:
            continue
        SubElement(structure, kind, {"valueReference": str(reference), **_dependencies(influences)})
    return root


def _variables(
    interface: Interface, derivatives: bool
) -> Iterator[tuple[dict[str, str], Type, dict[str, str], int | None]]:
    """For each variable, in the order of the value references: its attributes, its type with the attributes of that,
    and, for a derivative, the value reference of its state."""
    reinitialized = interface.reinitialized if derivatives else frozenset[str]()
    for signal in interface.signals:
        model_name, kind = signal.variable.name, signal.variable.type
        events = {"reinit": "true"} if model_name in reinitialized else {}
        attributes = _attributes(signal, interface.text(signal.variable.description))
        if (value := interface.model.constant.get(model_name)) is not None:
            constant = {"variability": "constant", "initial": "exact"}
            yield attributes | constant, kind, _typed(replace(signal, start=value)), None
        else:
            yield attributes, kind, _typed(signal) | events, None
    first = len(interface.parameters) + len(interface.inputs)
    for i, state in enumerate(interface.states if derivatives else ()):
        attributes = {
            "name": f"der({interface.name(state.name)})",
            "valueReference": str(len(interface.signals) + i),
            "description": interface.text(f"derivative by time: {state.description}"),
            "causality": "local",
            "variability": "continuous",
            "initial": "calculated",
        }
        yield attributes, "Real", _unit(quotient(state.unit, "s")), first + i


def _structure(interface: Interface, derivatives: bool) -> Iterator[tuple[str, int, list[int]]]:
    """For each unknown: its kind in FMI 3.0, its value reference, and the value references of its dependencies."""
    outputs = [s.reference for s in interface.signals_of("output")]
    rates = [len(interface.signals) + i for i in range(len(interface.states) if derivatives else 0)]
    kinds = ["Output"] * len(outputs) + ["ContinuousStateDerivative"] * len(rates)
    unknowns = list(zip(kinds, [*outputs, *rates], interface.dependencies, strict=False))
    for kind, reference, (in_run, _) in unknowns:
        yield kind, reference, in_run
    constant = {s.reference for s in interface.signals if s.variable.name in interface.model.constant}
    for _, reference, (_, at_start) in unknowns:
        if reference not in constant:
            yield "InitialUnknown", reference, at_start


def _dependencies(references: Iterable[int]) -> dict[str, str]:
    texts = [str(i) for i in sorted(references)]
    return {"dependencies": " ".join(texts), "dependenciesKind": " ".join("dependent" for _ in texts)}


def _root(interface: Interface, version: str, identity: Mapping[str, str]) -> Element:
    """The root element, with the attributes that are common to both versions of FMI; `version` is the version of
    this package."""
    model = interface.model
    fmi, identifier = identity.items()
    about = model.fmu_data.about or About(
        metadata.metadata("chainunit")["Author"], _copyright(), "MIT", version
    )
    texts = {"author": about.author, "version": about.version}
    texts |= {"copyright": about.copyright, "license": about.license}
    return Element(
        "fmiModelDescription",
        dict(
            [
                fmi,
                ("modelName", model.name),
                identifier,
                ("description", model.description),
                *((name, text) for name, text in texts.items() if text),
                ("generationTool", f"chainunit {version}"),
                ("generationDateAndTime", generation_time()),
                ("variableNamingConvention", interface.script.names),
            ]
        ),
    )


def _copyright() -> str:
    (line,) = (x for x in licence_text("chainunit").splitlines() if x.startswith("Copyright"))
    return line


@cache
def licence_text(package: str) -> str:
    """The licence of an installed package."""
    return metadata.distribution(package).read_text("licenses/LICENSE") or ""


def generation_time() -> str:
    """The time at which the FMU was made, in UTC: SOURCE_DATE_EPOCH [s], else the day of this version's release, so
    that the same model gives the same file.

    Raises
    ------
    InputError
        if SOURCE_DATE_EPOCH is no number of seconds.
    """
    setting = os.environ.get("SOURCE_DATE_EPOCH", "")
    if not setting:
        return f"{RELEASED}T00:00:00Z"
    try:
        return datetime.fromtimestamp(int(setting), UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
    except (ValueError, OverflowError, OSError) as error:
        raise InputError(
            f"SOURCE_DATE_EPOCH = {setting[:40]!r}: must be a whole number of seconds since 1970, or not set"
        ) from error


def _definitions(
    root: Element,
    interface: Interface,
    derivatives: bool,
    further_units: set[str],
    add_type: Callable[[Element, str, dict[str, str]], None],
) -> None:
    """Write the definitions of all units with the `further_units`, the declared types, the categories of messages,
    and the default experiment."""
    units = further_units | {s.variable.unit for s in interface.signals if s.variable.type == "Real"}
    units |= {quotient(v.unit, "s") for v in interface.states if derivatives}
    definitions = SubElement(root, "UnitDefinitions")
    for unit in sorted(units):
        node = SubElement(definitions, "Unit", name=unit)
        SubElement(node, "BaseUnit", {base: str(power) for base, power in base_units(unit).items()})
        if unit in DISPLAY_UNITS:
            display, factor, offset = DISPLAY_UNITS[unit]
            attributes = {"name": display, "factor": repr(factor)}
            if offset:
                attributes["offset"] = repr(offset)
            SubElement(node, "DisplayUnit", attributes)
    types = SubElement(root, "TypeDefinitions")
    for unit in sorted(units):
        if unit in TYPES:
            add_type(types, TYPES[unit], {"quantity": TYPES[unit], **_display_unit(unit)})
    categories = SubElement(root, "LogCategories")
    for name in ("logStatusWarning", "logStatusDiscard", "logStatusError", "logStatusFatal", "logAll"):
        SubElement(categories, "Category", name=name)
    e = Experiment(**interface.experiment)
    values = {"startTime": 0.0, "stopTime": e.stop, "tolerance": e.tolerance, "stepSize": e.step}
    SubElement(root, "DefaultExperiment", {name: f"{value:g}" for name, value in values.items()})


def _display_unit(unit: str) -> dict[str, str]:
    return {"unit": unit} | ({"displayUnit": DISPLAY_UNITS[unit][0]} if unit in DISPLAY_UNITS else {})


def _unit(unit: str) -> dict[str, str]:
    """The declared type and the unit of a variable; the unit is for importers that do not read types."""
    return ({"declaredType": TYPES[unit]} if unit in TYPES else {}) | _display_unit(unit)


def _attributes(signal: Signal, description: str) -> dict[str, str]:
    """The attributes of a variable that do not depend on its type."""
    q = signal.variable.quantity
    if signal.causality == "parameter":
        variability = "tunable" if q.tunable else "fixed"
    else:
        variability = "continuous" if q.type == "Real" else "discrete"
    attributes = {
        "name": signal.name,
        "valueReference": str(signal.reference),
        "description": description,
        "causality": signal.causality,
        "variability": variability,
    }
    if signal.causality != "input":
        attributes["initial"] = "calculated" if signal.causality == "output" else "exact"
    return attributes


def _typed(signal: Signal) -> dict[str, str]:
    """The attributes of a variable that its type has."""
    q = signal.variable.quantity
    start = {} if signal.start is None else {"start": written(signal.start, q.type)}
    if q.type == "Boolean":
        return start
    typed = _unit(signal.variable.unit) if q.type == "Real" else {}
    if q.low > float("-inf"):
        typed["min"] = written(q.low, q.type)
    if q.high < float("inf"):
        typed["max"] = written(q.high, q.type)
    if q.nominal is not None:
        typed["nominal"] = repr(q.nominal)
    return typed | start


def terminals(interface: Interface, *, with_icon: bool = True) -> Element:
    """The XML tree of terminalsAndIcons.xml, as FMI 3.0 defines it and FMI 2.0.4 takes it over: the terminals of the
    model and, `with_icon`, the place of the icon in that folder."""
    root = Element("fmiTerminalsAndIcons", fmiVersion="3.0")
    if with_icon:
        graphics = SubElement(root, "GraphicalRepresentation")
        box = {"x1": "-100", "y1": "-100", "x2": "100", "y2": "100"}
        SubElement(graphics, "CoordinateSystem", box, suggestedScalingFactorTo_mm="0.1")
        SubElement(graphics, "Icon", box)
    if not interface.model.terminals:
        return root
    group = SubElement(root, "Terminals")
    for terminal in interface.model.terminals:
        node = SubElement(
            group,
            "Terminal",
            name=terminal.name,
            matchingRule=terminal.rule,
            terminalKind=terminal.kind,
            description=terminal.description,
        )
        for member, variable in terminal.members.items():
            kind = terminal.flows.get(member, "signal")
            name = interface.name(variable)
            SubElement(
                node, "TerminalMemberVariable", variableName=name, memberName=member, variableKind=kind
            )
    return root


def xml_bytes(root: Element) -> bytes:
    """The contents of an XML file with this root, indented."""
    indent(root)
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root)
