"""modelDescription.xml (FMI 2.0 and 3.0) and terminalsAndIcons.xml from a model's declarations."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
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
from .recipe import Experiment, script_of
from .script import Script

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

    def __init__(self, model: type[Model], start: dict[str, float], own: type[Script] | None = None) -> None:
        """
        Parameters
        ----------
        start : start values that replace the declared ones
        own : the class of a script of the user's; else that of the model's script in `fmu/`

        Raises
        ------
        KeyError
            for a name in `start` that is neither parameter nor input.
        """
        self.model = model
        self.script = own or script_of(model)
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
    def trace(self) -> tuple[list[Any], Any, Any, Any, list[Any], list[Any]]:
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
        symbols, p, u, x, outputs, derivatives = self.trace
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
        symbols, p, *_ = self.trace
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
    exchange = "ModelExchange" in kinds
    root = _root(interface.model, version, {"fmiVersion": "2.0", "guid": guid})
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
    for attributes, real, state in _variables(interface, exchange):
        # FMI 2.0 counts variables from 1
        derivative = {} if state is None else {"derivative": str(state + 1)}
        SubElement(SubElement(variables, "ScalarVariable", attributes), "Real", {**real, **derivative})
    structure = SubElement(root, "ModelStructure")
    lists = {name: Element(name) for name in ("Outputs", "Derivatives", "InitialUnknowns")}
    first_state = len(interface.parameters) + len(interface.inputs)
    for kind, reference, influences in _structure(interface, exchange):
        # in Co-Simulation alone no state is among the knowns
        used = [i for i in influences if exchange or kind == "InitialUnknown" or i < first_state]
        where = {"Output": "Outputs", "InitialUnknown": "InitialUnknowns"}.get(kind, "Derivatives")
        unknown = {"index": str(reference + 1), **_dependencies([i + 1 for i in used])}
        SubElement(lists[where], "Unknown", unknown)
    structure.extend(element for name, element in lists.items() if len(element) or name != "Derivatives")
    return root


def model_description_3(
    interface: Interface, token: str, kinds: Mapping[str, Mapping[str, str]], version: str
) -> Element:
    """The XML tree of an FMI 3.0 FMU, with the same value references as that of FMI 2.0 and, behind them, time."""
    root = _root(interface.model, version, {"fmiVersion": "3.0", "instantiationToken": token})
    for kind, options in kinds.items():
        SubElement(root, kind, {"modelIdentifier": interface.model.name, **options})

    def add_type(types: Element, name: str, attributes: dict[str, str]) -> None:
        SubElement(types, "Float64Type", {"name": name, **attributes})

    _definitions(root, interface, True, {"s"}, add_type)
    variables = SubElement(root, "ModelVariables")
    for attributes, real, state in _variables(interface, True):
        derivative = {} if state is None else {"derivative": str(state)}
        SubElement(variables, "Float64", {**attributes, **real, **derivative})
    time = {
        "name": "time",
        "valueReference": str(len(variables)),
        "description": "time",
        "causality": "independent",
        "variability": "continuous",
    }
    SubElement(variables, "Float64", time | _unit("s"))
    structure = SubElement(root, "ModelStructure")
    for kind, reference, influences in _structure(interface, True):
        SubElement(structure, kind, {"valueReference": str(reference), **_dependencies(influences)})
    return root


def _variables(
    interface: Interface, derivatives: bool
) -> Iterator[tuple[dict[str, str], dict[str, str], int | None]]:
    """Of each variable, in the order of their value references: its attributes, those of its type, and the value
    reference of the state that it is the derivative of."""
    for signal in interface.signals:
        yield _attributes(signal), _real(signal), None
    first = len(interface.parameters) + len(interface.inputs)
    for i, state in enumerate(interface.states if derivatives else ()):
        attributes = {
            "name": f"der({state.name})",
            "valueReference": str(len(interface.signals) + i),
            "description": f"derivative by time: {state.description}",
            "causality": "local",
            "variability": "continuous",
            "initial": "calculated",
        }
        yield attributes, _unit(_per_second(state.unit)), first + i


def _structure(interface: Interface, derivatives: bool) -> Iterator[tuple[str, int, list[int]]]:
    """What FMI 3.0 calls each unknown, its value reference, and the value references that it depends on."""
    outputs = [s.reference for s in interface.of("output")]
    rates = [len(interface.signals) + i for i in range(len(interface.states) if derivatives else 0)]
    kinds = ["Output"] * len(outputs) + ["ContinuousStateDerivative"] * len(rates)
    unknowns = list(zip(kinds, [*outputs, *rates], interface.dependencies, strict=False))
    for kind, reference, (in_run, _) in unknowns:
        yield kind, reference, in_run
    for _, reference, (_, at_start) in unknowns:
        yield "InitialUnknown", reference, at_start


def _dependencies(references: Iterable[int]) -> dict[str, str]:
    texts = [str(i) for i in sorted(references)]
    return {"dependencies": " ".join(texts), "dependenciesKind": " ".join("dependent" for _ in texts)}


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
                ("generationDateAndTime", generation_time()),
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


def generation_time() -> str:
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


def _per_second(unit: str) -> str:
    """The unit of a derivative by time, in base units where it has no name of its own."""
    if unit == "1":
        return "1/s"
    powers = base_units(unit)
    powers["s"] = powers.get("s", 0) - 1
    top = ".".join(f"{b}{'' if n == 1 else n}" for b, n in powers.items() if n > 0)
    below = [f"{b}{'' if n == -1 else -n}" for b, n in powers.items() if n < 0]
    return (top or "1") + (f"/({'.'.join(below)})" if len(below) > 1 else "".join(f"/{b}" for b in below))


def _definitions(
    root: Element,
    interface: Interface,
    derivatives: bool,
    more: set[str],
    add_type: Callable[[Element, str, dict[str, str]], None],
) -> None:
    """Definitions of the units, of those in `more`, too; a declared type for each that has a name of its kind;
    categories of messages; and the default experiment."""
    units = more | {s.variable.unit for s in interface.signals}
    units |= {_per_second(v.unit) for v in interface.states if derivatives}
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
    categories = SubElement(root, "LogCategories")
    for name in ("logStatusWarning", "logStatusDiscard", "logStatusError", "logStatusFatal", "logAll"):
        SubElement(categories, "Category", name=name)
    e = Experiment(**interface.script.experiment)
    values = {"startTime": 0.0, "stopTime": e.stop, "tolerance": e.tolerance, "stepSize": e.step}
    SubElement(root, "DefaultExperiment", {name: f"{value:g}" for name, value in values.items()})


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
