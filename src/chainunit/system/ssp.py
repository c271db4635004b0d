"""Export of models and their connections as an SSP 1.0 package: FMUs, parameter sets, the structure of the system.

Foreign FMUs are packaged unchanged, with their own names; the values that the system sets in them are in their
parameter sets. The package runs without changes in libcosim, which reads every component's parameter set and, from an
annotation, the step; and in ecos, which takes the set by name (``init(parameter_set="start")``). Each FMU also has
its start values, so that a tool that ignores the sets, as fmpy does, runs the same system. Neither libcosim nor ecos
reads connections to connectors of the system itself: inputs without connection stay open, with their values in the
sets. Only on demand are they connectors of the package, as fmpy connects such connectors to whatever output it
connected last (FMPy, issue 690).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import metadata
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement

from ..core.errors import InputError, refusal_prefix
from ..core.files import atomic_file, folder, scratch
from ..core.inputs import ARCHIVE, file_bytes
from ..core.model import Model
from ..core.quantities import written
from ..fmu.backends import Backend
from ..fmu.backends import export as export_fmu
from ..fmu.description import xml_bytes
from ..fmu.pack import interface_of, pack
from ..fmu.script import Names, name_in_fmu
from .graph import Connector, FmuComponent, System

PARAMETER_SET = "start"
"""Name of every component's parameter set: a tool that selects sets by name applies all sets of that name."""

_SSP = "http://ssp-standard.org/SSP1/SystemStructure"
# libcosim and ecos expect exactly these prefixes
_NAMESPACES = {
    "ssc": f"{_SSP}Common",
    "ssd": f"{_SSP}Description",
    "ssv": f"{_SSP}ParameterValues",
    "osp": "http://opensimulationplatform.com/SSP/OSPAnnotations",
}


def export(
    system: System,
    file: Path,
    *,
    name: str = "System",
    description: str = "",
    stop: float = 10.0,
    step: float = 1e-3,
    all_inputs: bool = False,
    names: Names = "structured",
    backend: Backend | None = None,
    progress: Callable[[str], None] = lambda what: None,
) -> str:
    """Write `system` as an SSP 1.0 package and return a text on its contents. The same system gives the same file.

    Parameters
    ----------
    system : its models become FMUs, foreign FMUs are packaged unchanged
    file : path of the package; an existing file is replaced, in one step
    name, description : name and description of the system
    stop, step : end of the default experiment, and its communication step, an annotation that libcosim reads [s]
    all_inputs : whether inputs without connection are connectors of their components, too
    names : of the variables of the models' FMUs, see `chainunit.fmu.export.export`
    backend : backend of the FMUs, which are FMI 2.0; see `chainunit.fmu.backends.export`
    progress : is called with texts on the work

    Raises
    ------
    InputError
        for start values out of bounds or that make no machine, for an experiment without end or step, and where
        `chainunit.fmu.backends.export` raises it.
    RunError
        where the compiler fails.
    """
    if not (0.0 < step < math.inf and 0.0 < stop < math.inf):
        raise InputError(f"an experiment of {stop:g} s in steps of {step:g} s: must go forward")
    parts = _parts(system, names)
    free = _free_inputs(system, parts)
    file = Path(file)
    folder(file.parent)
    contents: dict[str, bytes] = {}
    sources: dict[str, str] = {}
    origins: list[str] = []
    paths: dict[tuple[object, ...], str] = {}
    with scratch() as build_folder:
        for name_of, part in parts.items():
            alike = (part.of, *sorted(part.start.items()))
            if alike not in paths:
                source = f"resources/{part.title}.fmu"
                paths[alike] = f"resources/{part.title}_{name_of}.fmu" if source in contents else source
                if isinstance(part.of, Path):
                    fmu = part.of
                    origins.append(f"{fmu.name} as it is")
                else:
                    fmu = build_folder / f"{part.title}.fmu"
                    origins.append(
                        str(
                            export_fmu(
                                part.of, fmu, part.start, names=names, backend=backend, progress=progress
                            )
                        )
                    )
                contents[paths[alike]] = file_bytes(fmu, ARCHIVE)
            sources[name_of] = paths[alike]
    for name_of, part in parts.items():
        set_here = [c for c in part.of_kind("parameter") if c.name in part.start]
        contents[_parameter_file(name_of)] = xml_bytes(_parameter_set(part, [*set_here, *free[name_of]]))
    hidden = {} if all_inputs else free
    structure = _description(system, parts, sources, hidden, (name, description), (stop, step))
    contents["SystemStructure.ssd"] = xml_bytes(structure)
    with atomic_file(file) as temporary:
        pack(contents, temporary)
    titles = ", ".join(f"{name_of} ({part.title})" for name_of, part in parts.items())
    return f"SSP 1.0, {titles}, {len(system.connections)} connections; {'; '.join(dict.fromkeys(origins))}"


@dataclass(frozen=True)
class _Part:
    """A component in the package: its model or the file of a foreign FMU, its variables, and their names in the FMU
    where they differ."""

    of: Model | Path
    title: str
    description: str
    connectors: Sequence[Connector]
    start: dict[str, float]
    """start values of parameters and inputs, in the FMU itself or in its parameter set"""
    names: Mapping[str, str]

    def of_kind(self, causality: str) -> list[Connector]:
        """The variables of a causality."""
        return [c for c in self.connectors if c.causality == causality]

    def name(self, variable: str) -> str:
        """The name of a variable in the FMU."""
        return self.names.get(variable, variable)


def _parts(system: System, names: Names) -> dict[str, _Part]:
    """The components with their start values; `names` are the names of the variables of models."""
    start: dict[str, dict[str, float]] = {name: {} for name in system.components}
    for full, value in system.values.items():
        name, _, variable = full.partition(".")
        start[name][variable] = float(value)
    parts = {}
    for name, component in system.components.items():
        if isinstance(component, FmuComponent):
            declared = list(component.connectors.values())
            title = component.file.stem
            parts[name] = _Part(
                component.file, title, component.description, declared, start[name], component.names
            )
            continue
        with refusal_prefix(f"{name}: "):
            interface = interface_of(component.model, start[name])
        connector_by_name = component.connectors
        declared = [
            replace(connector_by_name[s.variable.name], start=float(s.start or 0.0))
            for s in interface.signals
        ]
        connectors = [
            replace(c, description=s.variable.description)
            for c, s in zip(declared, interface.signals, strict=True)
        ]
        values = {c.name: c.start for c in connectors if c.causality != "output"}
        model = component.model
        in_fmu = {c.name: name_in_fmu(c.name, names) for c in connectors}
        parts[name] = _Part(model, model.name, model.description, connectors, values, in_fmu)
    return parts


def _free_inputs(system: System, parts: Mapping[str, _Part]) -> dict[str, list[Connector]]:
    """By component, its inputs without connection."""
    targets = {target for _, target in system.connections}
    return {
        name: [c for c in part.of_kind("input") if f"{name}.{c.name}" not in targets]
        for name, part in parts.items()
    }


# -- XML


def _parameter_file(instance: str) -> str:
    return f"resources/{instance}.ssv"


def _root(tag: str, name: str, prefixes: Iterable[str], description: str = "") -> Element:
    """The root of a file of SSP, with the namespaces of its prefixes."""
    spaces = {f"xmlns:{prefix}": _NAMESPACES[prefix] for prefix in prefixes}
    root = Element(tag, {**spaces, "version": "1.0", "name": name})
    if description:
        root.set("description", description)
    root.set("generationTool", f"chainunit {metadata.version('chainunit')}")
    return root


def _units(parent: Element, prefix: str, connectors: Iterable[Connector]) -> None:
    """Add the definitions of the units of connectors."""
    dimensions = {c.unit: c.dimension for c in connectors if c.unit and c.type == "Real"}
    if not dimensions:
        return
    group = SubElement(parent, f"{prefix}:Units")
    for unit, dimension in sorted(dimensions.items()):
        node = SubElement(group, "ssc:Unit", name=unit)
        SubElement(node, "ssc:BaseUnit", {base: str(power) for base, power in (dimension or {}).items()})


def _typed(node: Element, prefix: str, c: Connector, attributes: Mapping[str, str] | None = None) -> None:
    """Add the element of the type of a variable."""
    unit = {"unit": c.unit} if c.unit and c.type == "Real" else {}
    SubElement(node, f"{prefix}:{c.type}", {**(attributes or {}), **unit})


def _parameter_set(part: _Part, connectors: Sequence[Connector]) -> Element:
    """The XML tree of an SSV file with the start values of `connectors`."""
    root = _root("ssv:ParameterSet", PARAMETER_SET, ("ssv", "ssc"))
    group = SubElement(root, "ssv:Parameters")
    for c in connectors:
        node = SubElement(group, "ssv:Parameter", name=part.name(c.name), description=c.description)
        _typed(node, "ssv", c, {"value": written(part.start.get(c.name, c.start), c.type)})
    _units(root, "ssv", connectors)
    return root


def _description(
    system: System,
    parts: Mapping[str, _Part],
    sources: Mapping[str, str],
    hidden: Mapping[str, Sequence[Connector]],
    title: tuple[str, str],
    experiment: tuple[float, float],
) -> Element:
    """The XML tree of SystemStructure.ssd; `sources` are the FMUs' paths by component, `hidden` the variables without
    a connector, `title` is name and description of the system, `experiment` end and step [s]."""
    # a description may hold characters that XML does not allow
    description = "".join(c if c.isprintable() else " " for c in title[1])
    root = _root("ssd:SystemStructureDescription", title[0], ("ssd", "ssc", "osp"), description)
    top = SubElement(root, "ssd:System", name=title[0])
    elements = SubElement(top, "ssd:Elements")
    for name, part in parts.items():
        shown = [c for c in part.connectors if c not in hidden.get(name, ())]
        _component(elements, name, part, shown, sources[name])
    if system.connections:
        connections = SubElement(top, "ssd:Connections")
        for ends in system.connections:
            (source, output), (target, entry) = (full.split(".", 1) for full in ends)
            SubElement(
                connections,
                "ssd:Connection",
                startElement=source,
                startConnector=parts[source].name(output),
                endElement=target,
                endConnector=parts[target].name(entry),
            )
    _units(root, "ssd", [c for part in parts.values() for c in part.connectors])
    stop, step = (repr(float(x)) for x in experiment)
    default = SubElement(root, "ssd:DefaultExperiment", startTime="0.0", stopTime=stop)
    annotations = SubElement(default, "ssd:Annotations")
    annotation = SubElement(annotations, "ssc:Annotation", type="com.opensimulationplatform")
    algorithm = SubElement(annotation, "osp:Algorithm")
    SubElement(algorithm, "osp:FixedStepAlgorithm", baseStepSize=step)
    return root


def _component(elements: Element, name: str, part: _Part, shown: Iterable[Connector], source: str) -> None:
    """Add a component with the `shown` connectors, its FMU at `source`, and its file of parameters."""
    component = SubElement(
        elements,
        "ssd:Component",
        name=name,
        description=part.description,
        type="application/x-fmu-sharedlibrary",
        source=source,
        implementation="CoSimulation",
    )
    connectors = SubElement(component, "ssd:Connectors")
    for c in shown:
        node = SubElement(
            connectors, "ssd:Connector", name=part.name(c.name), description=c.description, kind=c.causality
        )
        _typed(node, "ssc", c)
    bindings = SubElement(component, "ssd:ParameterBindings")
    SubElement(
        bindings, "ssd:ParameterBinding", type="application/x-ssp-parameter-set", source=_parameter_file(name)
    )
