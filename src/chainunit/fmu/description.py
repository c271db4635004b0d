"""modelDescription.xml (FMI 2.0 and 3.0) and terminalsAndIcons.xml from a model's declarations."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cached_property
from importlib import metadata
from typing import Any
from xml.etree.ElementTree import Element, SubElement

from ..engines import casadi_
from ..errors import InputError
from ..model import Model
from ..quantities import DISPLAY_UNITS, TYPES, Variable, base_units
from .recipe import experiment

RELEASED = "2026-11-21"
"""The day of this version's release, as CITATION.cff has it."""


@dataclass(frozen=True)
class Signal:
    """A variable of the FMU: declaration, causality, start value, value reference."""

    variable: Variable
    causality: str
    start: float | None
    reference: int

    @property
    def name(self) -> str:
        """Its full name."""
        return self.variable.name


class Interface:
    """The variables of a model's FMU in the order of their value references: parameters, inputs, states
    (each an output), other outputs part by part."""

    def __init__(self, model: type[Model], start: dict[str, float]) -> None:
        """
        Raises
        ------
        KeyError
            for a name in `start` that is neither parameter nor input.
        """
        self.model = model
        self.parameters = model.parameter_layout.variables
        self.inputs = model.input_layout.variables
        self.states = model.state_layout.variables if model.state_layout else ()
        self.others = tuple(v for part in model.parts for v in part.layout.variables)
        known = {v.name for v in (*self.parameters, *self.inputs)}
        for name in start:
            if name not in known:
                raise KeyError(f"{model.name} has no parameter or input {name!r}")
        self.signals: list[Signal] = []
        for causality, group in (
            ("parameter", self.parameters),
            ("input", self.inputs),
            ("output", (*self.states, *self.others)),
        ):
            for v in group:
                value = None if causality == "output" else start.get(v.name, v.quantity.start)
                self.signals.append(Signal(v, causality, value, len(self.signals)))

    def of(self, causality: str) -> list[Signal]:
        """Signals of one causality, in order."""
        return [s for s in self.signals if s.causality == causality]

    @cached_property
    def traced(self) -> tuple[list[Any], Any, Any, Any, list[Any], list[Any]]:
        """The model in symbols: (p, u, x, what is derived from p, as casadi vectors), p, u and x as declarations,
        outputs part by part in declared order, and derivatives of the states."""
        import casadi

        model = self.model
        symbols = [
            casadi.SX.sym(name, len(group))
            for name, group in (("p", self.parameters), ("u", self.inputs), ("x", self.states))
        ]
        symbols.append(casadi.SX.sym("k", model.derived))
        p = model.parameter_layout.instance(casadi.vertsplit(symbols[0]))
        if model.derived:
            p = model.prepared(casadi_(), p, casadi.vertsplit(symbols[3]))
        u = model.input_layout.instance(casadi.vertsplit(symbols[1]))
        x = model.state_layout.instance(casadi.vertsplit(symbols[2])) if model.state_layout else None
        outputs = self._outputs(p, u, x)
        derivatives = model.derivatives(casadi_(), p, u, x) if model.state_layout else []
        return symbols, p, u, x, outputs, derivatives

    def _outputs(self, p: Any, u: Any, x: Any) -> list[Any]:
        parts = self.model.evaluate(casadi_(), p, u, x)
        return [v for part, out in zip(self.model.parts, parts, strict=True) for v in part.layout.values(out)]

    @cached_property
    def dependencies(self) -> list[tuple[list[int], list[int]]]:
        """Of each output, and of each state's derivative behind them: value references of its true
        dependencies, in a run (inputs and states) and at the start (parameters and inputs), from the sparsity of the
        traced equations. A state, in a run, depends on itself alone."""
        model = self.model
        symbols, p, u, x, outputs, derivatives = self.traced
        states, started = [], []
        rows_at_start = [*outputs, *derivatives]
        if model.state_layout:
            states = model.state_layout.values(x)
            first = model.start(casadi_(), p, u, rounds=min(2, model.start_rounds))
            started = model.state_layout.values(first)
            rows_at_start = [*self._outputs(p, u, first), *model.derivatives(casadi_(), p, u, first)]
        in_run = self._influences(symbols, [*states, *outputs, *derivatives])
        at_start = self._influences(symbols, [*started, *rows_at_start])
        n = len(self.parameters)
        return [([i for i in known if i >= n], first) for known, first in zip(in_run, at_start, strict=True)]

    @cached_property
    def derived(self) -> list[Any]:
        """What is derived from the parameters, in symbols.

        Raises
        ------
        ValueError
            where it depends on a parameter that may change in a run.
        """
        import casadi

        if not self.model.derived:
            return []
        symbols, p, *_ = self.traced
        rows = [casadi.SX(v) for v in self.model.derive(casadi_(), p)]
        known = {i for row in self._known(symbols[:1], rows) for i in row}
        for i in sorted(known):
            if self.parameters[i].quantity.tunable:
                raise ValueError(
                    f"{self.model.name}: {self.parameters[i].name} is tunable, but `derive` takes it"
                )
        return rows

    def _influences(self, symbols: list[Any], rows: list[Any]) -> list[list[int]]:
        """Value references of parameters, inputs and states that each row depends on, also through what is derived
        from parameters."""
        known = self._known(symbols, rows)
        first = sum(symbol.shape[0] for symbol in symbols[:3])
        through = self._known(symbols[:1], self.derived) if self.model.derived else []
        return [
            sorted({j for i in row for j in (through[i - first] if i >= first else (i,))}) for row in known
        ]

    @staticmethod
    def _known(symbols: list[Any], rows: list[Any]) -> list[list[int]]:
        """Places among the symbols that each row depends on."""
        import casadi

        f = casadi.Function("rows", symbols, [casadi.vertcat(*rows)])
        known: list[list[int]] = [[] for _ in rows]
        offset = 0
        for side, symbol in enumerate(symbols):
            for row, column in zip(*f.jac_sparsity(0, side).get_triplet(), strict=True):
                known[row].append(offset + column)
            offset += symbol.shape[0]
        return known


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
    derivatives of the states are variables, too. `sources` are the files that the FMU can be compiled from.
    `identifier` is the name of its library, where that is not the model's.
    """
    model = interface.model
    root = _root(model, version, {"fmiVersion": "2.0", "guid": guid})
    root.set("numberOfEventIndicators", "0")
    for kind, options in kinds.items():
        element = SubElement(root, kind, {"modelIdentifier": identifier or model.name, **options})
        if sources:
            files = SubElement(element, "SourceFiles")
            for name in sources:
                SubElement(files, "File", name=name)
    exchange = "ModelExchange" in kinds
    units = {s.variable.unit for s in interface.signals}
    if exchange:
        units |= {_per_second(v.unit) for v in interface.states}
    _definitions(
        root,
        units,
        lambda types, name, of: SubElement(SubElement(types, "SimpleType", name=name), "Real", of),
    )
    _log_categories(root)
    _experiment(root, model)
    variables = SubElement(root, "ModelVariables")
    for signal in interface.signals:
        _scalar(variables, signal)
    first_state, first_derivative = len(interface.parameters) + len(interface.inputs), len(interface.signals)
    if exchange:
        for i, v in enumerate(interface.states):
            _derivative(variables, v, first_state + i, first_derivative + i)
    structure = SubElement(root, "ModelStructure")
    outputs = interface.of("output")
    known = interface.dependencies
    listed = SubElement(structure, "Outputs")
    for signal, (in_run, _) in zip(outputs, known, strict=False):
        used = in_run if exchange else [i for i in in_run if i < first_state]
        _unknown(listed, signal.reference, used)
    if exchange and interface.states:
        listed = SubElement(structure, "Derivatives")
        for i, (in_run, _) in enumerate(known[len(outputs) :]):
            _unknown(listed, first_derivative + i, in_run)
    listed = SubElement(structure, "InitialUnknowns")
    for signal, (_, at_start) in zip(outputs, known, strict=False):
        _unknown(listed, signal.reference, at_start)
    if exchange:
        for i, (_, at_start) in enumerate(known[len(outputs) :]):
            _unknown(listed, first_derivative + i, at_start)
    return root


def model_description_3(
    interface: Interface, token: str, kinds: Mapping[str, Mapping[str, str]], version: str
) -> Element:
    """The XML tree of an FMI 3.0 FMU, with the same value references as that of FMI 2.0 and, behind them, time."""
    model = interface.model
    root = _root(model, version, {"fmiVersion": "3.0", "instantiationToken": token})
    for kind, options in kinds.items():
        SubElement(root, kind, {"modelIdentifier": model.name, **options})
    _definitions(
        root,
        {
            "s",
            *(s.variable.unit for s in interface.signals),
            *(_per_second(v.unit) for v in interface.states),
        },
        lambda types, name, of: SubElement(types, "Float64Type", {"name": name, **of}),
    )
    _log_categories(root)
    _experiment(root, model)
    variables = SubElement(root, "ModelVariables")
    for signal in interface.signals:
        SubElement(variables, "Float64", {**_attributes(signal), **_real(signal)})
    first_state, first_derivative = len(interface.parameters) + len(interface.inputs), len(interface.signals)
    for i, v in enumerate(interface.states):
        attributes = _derivative_attributes(v, first_derivative + i)
        SubElement(
            variables,
            "Float64",
            {**attributes, **_unit(_per_second(v.unit))},
            derivative=str(first_state + i),
        )
    time = {
        "name": "time",
        "valueReference": str(first_derivative + len(interface.states)),
        "description": "time",
        "causality": "independent",
        "variability": "continuous",
    }
    SubElement(variables, "Float64", time | _unit("s"))
    structure = SubElement(root, "ModelStructure")
    known = interface.dependencies
    references = [s.reference for s in interface.of("output")]
    derivatives = [first_derivative + i for i in range(len(interface.states))]

    def listed(kind: str, reference: int, used: Sequence[int]) -> None:
        attributes = {"valueReference": str(reference), "dependencies": " ".join(map(str, sorted(used)))}
        SubElement(structure, kind, attributes, dependenciesKind=" ".join("dependent" for _ in used))

    for reference, (in_run, _) in zip(references, known, strict=False):
        listed("Output", reference, in_run)
    for reference, (in_run, _) in zip(derivatives, known[len(references) :], strict=True):
        listed("ContinuousStateDerivative", reference, in_run)
    for reference, (_, at_start) in zip([*references, *derivatives], known, strict=True):
        listed("InitialUnknown", reference, at_start)
    return root


def _root(model: type[Model], version: str, own: Mapping[str, str]) -> Element:
    """The root element, with what both versions of FMI call alike."""
    fmi, identifier = own.items()
    return Element(
        "fmiModelDescription",
        dict(
            [
                fmi,
                ("modelName", model.name),
                identifier,
                ("description", model.description),
                ("author", metadata.metadata("chainunit")["Author"]),
                ("version", version),
                ("copyright", _copyright()),
                ("license", "MIT"),
                ("generationTool", f"chainunit {version}"),
                ("generationDateAndTime", generated()),
                ("variableNamingConvention", "structured"),
            ]
        ),
    )


def _copyright() -> str:
    (line,) = (x for x in licence_text("chainunit").splitlines() if x.startswith("Copyright"))
    return line


def licence_text(package: str) -> str:
    """The licence of an installed package."""
    return metadata.distribution(package).read_text("licenses/LICENSE") or ""


def generated() -> str:
    """When the FMU was made, in UTC: SOURCE_DATE_EPOCH [s], else the day of this version's release, so that the same
    model gives the same file.

    Raises
    ------
    InputError
        where SOURCE_DATE_EPOCH is no number of seconds.
    """
    given = os.environ.get("SOURCE_DATE_EPOCH", "")
    if not given:
        return f"{RELEASED}T00:00:00Z"
    try:
        return datetime.fromtimestamp(int(given), UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
    except (ValueError, OverflowError, OSError) as error:
        raise InputError(
            f"SOURCE_DATE_EPOCH = {given[:40]!r}: must be a whole number of seconds since 1970, or not set"
        ) from error


def _experiment(root: Element, model: type[Model]) -> None:
    e = experiment(model)
    attributes = {"startTime": 0.0, "stopTime": e.stop, "tolerance": e.tolerance, "stepSize": e.step}
    SubElement(root, "DefaultExperiment", {name: f"{value:g}" for name, value in attributes.items()})


def _per_second(unit: str) -> str:
    """The unit of a derivative by time, in base units where it has no name of its own."""
    if unit == "1":
        return "1/s"
    powers = base_units(unit)
    powers["s"] = powers.get("s", 0) - 1
    top = ".".join(f"{b}{'' if n == 1 else n}" for b, n in powers.items() if n > 0)
    below = [f"{b}{'' if n == -1 else -n}" for b, n in powers.items() if n < 0]
    return (top or "1") + (f"/({'.'.join(below)})" if len(below) > 1 else "".join(f"/{b}" for b in below))


def _log_categories(root: Element) -> None:
    categories = SubElement(root, "LogCategories")
    for name in ("logStatusWarning", "logStatusDiscard", "logStatusError", "logStatusFatal", "logAll"):
        SubElement(categories, "Category", name=name)


def _derivative_attributes(state: Variable, reference: int) -> dict[str, str]:
    return {
        "name": f"der({state.name})",
        "valueReference": str(reference),
        "description": f"derivative by time: {state.description}",
        "causality": "local",
        "variability": "continuous",
        "initial": "calculated",
    }


def _derivative(variables: Element, state: Variable, of: int, reference: int) -> None:
    node = SubElement(variables, "ScalarVariable", _derivative_attributes(state, reference))
    SubElement(node, "Real", _unit(_per_second(state.unit)), derivative=str(of + 1))


def _definitions(
    root: Element, units: Iterable[str], add_type: Callable[[Element, str, dict[str, str]], Element]
) -> None:
    """Definitions of the units, and a declared type for each that has a name of its kind."""
    definitions = SubElement(root, "UnitDefinitions")
    for unit in sorted(units):
        node = SubElement(definitions, "Unit", name=unit)
        SubElement(node, "BaseUnit", {base: str(power) for base, power in base_units(unit).items()})
        if unit in DISPLAY_UNITS:
            shown, factor, offset = DISPLAY_UNITS[unit]
            attributes = {"name": shown, "factor": repr(factor)}
            if offset:
                attributes["offset"] = repr(offset)
            SubElement(node, "DisplayUnit", attributes)
    types = SubElement(root, "TypeDefinitions")
    for unit in sorted(units):
        if unit in TYPES:
            add_type(types, TYPES[unit], {"quantity": TYPES[unit], **_shown(unit)})


def _shown(unit: str) -> dict[str, str]:
    return {"unit": unit} | ({"displayUnit": DISPLAY_UNITS[unit][0]} if unit in DISPLAY_UNITS else {})


def _unit(unit: str) -> dict[str, str]:
    """Attributes of a variable that say what it is measured in; importers that know no types find the unit, too."""
    return ({"declaredType": TYPES[unit]} if unit in TYPES else {}) | _shown(unit)


def _attributes(signal: Signal) -> dict[str, str]:
    v, q = signal.variable, signal.variable.quantity
    fixed = "tunable" if q.tunable else "fixed"
    attributes = {
        "name": v.name,
        "valueReference": str(signal.reference),
        "description": v.description,
        "causality": signal.causality,
        "variability": fixed if signal.causality == "parameter" else "continuous",
    }
    if signal.causality != "input":
        attributes["initial"] = "calculated" if signal.causality == "output" else "exact"
    return attributes


def _real(signal: Signal) -> dict[str, str]:
    q = signal.variable.quantity
    real = _unit(signal.variable.unit)
    if q.low > float("-inf"):
        real["min"] = repr(q.low)
    if q.high < float("inf"):
        real["max"] = repr(q.high)
    if q.nominal is not None:
        real["nominal"] = repr(q.nominal)
    if signal.start is not None:
        real["start"] = repr(float(signal.start))
    return real


def _scalar(variables: Element, signal: Signal) -> None:
    SubElement(SubElement(variables, "ScalarVariable", _attributes(signal)), "Real", _real(signal))


def _unknown(listed: Element, reference: int, known: Sequence[int]) -> None:
    # FMI 2.0 counts variables from 1
    SubElement(
        listed,
        "Unknown",
        index=str(reference + 1),
        dependencies=" ".join(str(i + 1) for i in sorted(known)),
        dependenciesKind=" ".join("dependent" for _ in known),
    )


def terminals(interface: Interface) -> Element:
    """The XML tree of terminalsAndIcons.xml (FMI 3.0): the model's icon, and what connects as one."""
    root = Element("fmiTerminalsAndIcons", fmiVersion="3.0")
    graphics = SubElement(root, "GraphicalRepresentation")
    box = {"x1": "-100", "y1": "-100", "x2": "100", "y2": "100"}
    SubElement(graphics, "CoordinateSystem", box, suggestedScalingFactorTo_mm="0.1")
    SubElement(graphics, "Icon", box)
    listed = SubElement(root, "Terminals")
    for terminal in interface.model.terminals:
        node = SubElement(
            listed,
            "Terminal",
            name=terminal.name,
            matchingRule="plug",
            terminalKind=terminal.kind,
            description=terminal.description,
        )
        for member, variable in terminal.members.items():
            kind = terminal.flows.get(member, "signal")
            SubElement(
                node, "TerminalMemberVariable", variableName=variable, memberName=member, variableKind=kind
            )
    return root
