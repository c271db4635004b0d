"""modelDescription.xml (FMI 2.0) from a model's declarations."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any
from xml.etree.ElementTree import Element, SubElement

from ..engines import casadi_
from ..model import Model
from ..quantities import DISPLAY_UNITS, Variable, base_units


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
    def dependencies(self) -> list[tuple[list[int], list[int]]]:
        """Of each output: value references of what it truly depends on, in a run (inputs) and at the start
        (parameters and inputs), from the sparsity of the traced equations."""
        import casadi

        model = self.model
        symbols = [
            casadi.SX.sym(name, len(group))
            for name, group in (("p", self.parameters), ("u", self.inputs), ("x", self.states))
        ]
        p = model.parameter_layout.instance(casadi.vertsplit(symbols[0]))
        running = started = None
        if model.state_layout:
            running = model.state_layout.instance(casadi.vertsplit(symbols[2]))
            started = model.initial_states(p)
        in_run = self._influences(symbols, p, running)
        at_start = self._influences(symbols, p, started)
        return [
            ([i for i in known if i >= len(self.parameters)], first)
            for known, first in zip(in_run, at_start, strict=True)
        ]

    def _influences(self, symbols: list[Any], p: Any, x: Any) -> list[list[int]]:
        """Value references of the parameters and inputs that each output depends on, at states `x`."""
        import casadi

        model = self.model
        u = model.input_layout.instance(casadi.vertsplit(symbols[1]))
        outputs = model.state_layout.values(x) if model.state_layout else []
        for part, values in zip(model.parts, model.evaluate(casadi_(), p, u, x), strict=True):
            outputs += part.layout.values(values)
        f = casadi.Function("outputs", symbols, [casadi.vertcat(*outputs)])
        rows: list[list[int]] = [[] for _ in outputs]
        for side, offset in ((0, 0), (1, len(self.parameters))):
            for row, column in zip(*f.jac_sparsity(0, side).get_triplet(), strict=True):
                rows[row].append(offset + column)
        return rows


def model_description(interface: Interface, guid: str, options: dict[str, str], version: str) -> Element:
    """The XML tree of a co-simulation FMU; `options` are attributes of its CoSimulation element."""
    model = interface.model
    root = Element(
        "fmiModelDescription",
        fmiVersion="2.0",
        modelName=model.name,
        guid=guid,
        description=model.description,
        version=version,
        license="MIT",
        generationTool=f"chainunit {version}",
        variableNamingConvention="structured",
        numberOfEventIndicators="0",
    )
    SubElement(root, "CoSimulation", {"modelIdentifier": model.name, **options})
    _unit_definitions(root, {s.variable.unit for s in interface.signals})
    categories = SubElement(root, "LogCategories")
    for name in ("logStatusWarning", "logStatusDiscard", "logStatusError", "logStatusFatal", "logAll"):
        SubElement(categories, "Category", name=name)
    SubElement(root, "DefaultExperiment", startTime="0", stopTime="10", stepSize="0.001")
    variables = SubElement(root, "ModelVariables")
    for signal in interface.signals:
        _scalar(variables, signal)
    structure = SubElement(root, "ModelStructure")
    outputs = list(zip(interface.of("output"), interface.dependencies, strict=True))
    listed = SubElement(structure, "Outputs")
    for signal, (_, inputs) in outputs:
        _unknown(listed, signal, inputs)
    listed = SubElement(structure, "InitialUnknowns")
    for signal, (_, known) in outputs:
        _unknown(listed, signal, known)
    return root


def _unit_definitions(root: Element, units: Iterable[str]) -> None:
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


def _scalar(variables: Element, signal: Signal) -> None:
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
    node = SubElement(variables, "ScalarVariable", attributes)
    real = {"unit": v.unit}
    if v.unit in DISPLAY_UNITS:
        real["displayUnit"] = DISPLAY_UNITS[v.unit][0]
    if q.low > float("-inf"):
        real["min"] = repr(q.low)
    if q.high < float("inf"):
        real["max"] = repr(q.high)
    if q.nominal is not None:
        real["nominal"] = repr(q.nominal)
    if signal.start is not None:
        real["start"] = repr(float(signal.start))
    SubElement(node, "Real", real)


def _unknown(listed: Element, signal: Signal, known: list[int]) -> None:
    # FMI 2.0 counts variables from 1
    SubElement(
        listed,
        "Unknown",
        index=str(signal.reference + 1),
        dependencies=" ".join(str(i + 1) for i in sorted(known)),
        dependenciesKind=" ".join("dependent" for _ in known),
    )
