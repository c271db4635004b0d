"""Export of models and their connections as an SSP 1.0 package: FMUs, parameter sets, the structure of the system.

The package runs as it is in libcosim, which reads every component's parameter set and, from an annotation, the
step; and in ecos, which takes the set by name (``init(parameter_set="start")``). Each FMU carries its start values,
too, so that a tool that passes the sets by runs the same system. Neither of the two reads connections to
connectors of the system itself: inputs that are not connected are left open, with their values in the sets.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib import metadata
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement

from ..errors import InputError, refusal_prefix
from ..files import folder, whole
from ..fmu.backends import Backend
from ..fmu.backends import export as export_fmu
from ..fmu.description import Interface, Signal
from ..fmu.pack import interface_of, pack, xml_bytes
from ..quantities import base_units
from .graph import ModelComponent, System

PARAMETER_SET = "start"
"""Name of every component's parameter set: tools that choose sets by name apply all that share one."""

_SSP = "http://ssp-standard.org/SSP1/SystemStructure"
# libcosim and ecos compare names with these very prefixes
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
    backend: Backend | None = None,
    report: Callable[[str], None] = lambda what: None,
) -> str:
    """Write `system` as an SSP 1.0 package and say, in words, what is in it. The same system gives the same file.

    Parameters
    ----------
    system : components, of which all are models
    file : path of the package; a file there is replaced, in one step
    name, description : of the whole
    stop, step : end of the default experiment, and its communication step, an annotation that libcosim reads [s]
    backend : of the FMUs, which are FMI 2.0; see `chainunit.fmu.backends.export`
    report : is told what is being done

    Raises
    ------
    InputError
        for a component that is an FMU of somebody else, start values out of bounds or that make no machine, an
        experiment without end or step, and what `chainunit.fmu.backends.export` refuses.
    RunError
        where the compiler fails.
    """
    if not (0.0 < step < math.inf and 0.0 < stop < math.inf):
        raise InputError(f"an experiment of {stop:g} s in steps of {step:g} s: must go forward")
    interfaces = _interfaces(system)
    driven = {target for _, target in system.connections}
    file = Path(file)
    folder(file.parent)
    contents: dict[str, bytes] = {}
    sources: dict[str, str] = {}
    origins: list[str] = []
    paths: dict[tuple[object, ...], str] = {}
    with tempfile.TemporaryDirectory(prefix="chainunit_") as scratch:
        for component, interface in interfaces.items():
            model, start = interface.model, _start(interface)
            alike = (model, *sorted(start.items()))
            if alike not in paths:
                source = f"resources/{model.name}.fmu"
                paths[alike] = f"resources/{model.name}_{component}.fmu" if source in contents else source
                fmu = Path(scratch) / f"{model.name}.fmu"
                origins.append(str(export_fmu(model, fmu, start, backend=backend, report=report)))
                contents[paths[alike]] = fmu.read_bytes()
            sources[component] = paths[alike]
    for component, interface in interfaces.items():
        free = [s for s in interface.of("input") if f"{component}.{s.name}" not in driven]
        contents[_parameter_file(component)] = xml_bytes(_parameter_set([*interface.of("parameter"), *free]))
    structure = _description(system, interfaces, sources, (name, description), (stop, step))
    contents["SystemStructure.ssd"] = xml_bytes(structure)
    with whole(file) as part:
        pack(contents, part)
    parts = ", ".join(f"{component} ({i.model.name})" for component, i in interfaces.items())
    return f"SSP 1.0, {parts}, {len(system.connections)} connections; {'; '.join(dict.fromkeys(origins))}"


def _interfaces(system: System) -> dict[str, Interface]:
    """The interface of each component with its start values."""
    start: dict[str, dict[str, float]] = {name: {} for name in system.components}
    for full, value in system.values.items():
        name, _, variable = full.partition(".")
        start[name][variable] = float(value)
    interfaces = {}
    for name, component in system.components.items():
        if not isinstance(component, ModelComponent):
            raise InputError(f"{name} ({component.title}): is an FMU of somebody else, which is not packaged")
        with refusal_prefix(f"{name}: "):
            interfaces[name] = interface_of(component.model, start[name])
    return interfaces


def _start(interface: Interface) -> dict[str, float]:
    return {s.name: float(s.start or 0.0) for s in (*interface.of("parameter"), *interface.of("input"))}


# -- XML


def _parameter_file(instance: str) -> str:
    return f"resources/{instance}.ssv"


def _root(tag: str, name: str, prefixes: Iterable[str], description: str = "") -> Element:
    spaces = {f"xmlns:{prefix}": _NAMESPACES[prefix] for prefix in prefixes}
    root = Element(tag, {**spaces, "version": "1.0", "name": name})
    if description:
        root.set("description", description)
    root.set("generationTool", f"chainunit {metadata.version('chainunit')}")
    return root


def _units(parent: Element, prefix: str, signals: Iterable[Signal]) -> None:
    group = SubElement(parent, f"{prefix}:Units")
    for unit in sorted({s.variable.unit for s in signals}):
        node = SubElement(group, "ssc:Unit", name=unit)
        SubElement(node, "ssc:BaseUnit", {base: str(power) for base, power in base_units(unit).items()})


def _parameter_set(signals: Sequence[Signal]) -> Element:
    """The XML tree of an SSV file with the start values of `signals`."""
    root = _root("ssv:ParameterSet", PARAMETER_SET, ("ssv", "ssc"))
    group = SubElement(root, "ssv:Parameters")
    for s in signals:
        node = SubElement(group, "ssv:Parameter", name=s.name, description=s.variable.description)
        SubElement(node, "ssv:Real", value=repr(float(s.start or 0.0)), unit=s.variable.unit)
    _units(root, "ssv", signals)
    return root


def _description(
    system: System,
    interfaces: Mapping[str, Interface],
    sources: Mapping[str, str],
    title: tuple[str, str],
    experiment: tuple[float, float],
) -> Element:
    """The XML tree of SystemStructure.ssd; `sources` are the FMUs' paths by component, `title` is name and
    description of the whole, `experiment` end and step [s]."""
    # a title may hold characters that XML cannot
    described = "".join(c if c.isprintable() else " " for c in title[1])
    root = _root("ssd:SystemStructureDescription", title[0], ("ssd", "ssc", "osp"), described)
    top = SubElement(root, "ssd:System", name=title[0])
    elements = SubElement(top, "ssd:Elements")
    for name, interface in interfaces.items():
        _component(elements, name, interface, sources[name])
    if system.connections:
        connections = SubElement(top, "ssd:Connections")
        for ends in system.connections:
            (source, output), (target, entry) = (full.split(".", 1) for full in ends)
            SubElement(
                connections,
                "ssd:Connection",
                startElement=source,
                startConnector=output,
                endElement=target,
                endConnector=entry,
            )
    _units(root, "ssd", [s for interface in interfaces.values() for s in interface.signals])
    stop, step = (repr(float(x)) for x in experiment)
    default = SubElement(root, "ssd:DefaultExperiment", startTime="0.0", stopTime=stop)
    annotations = SubElement(default, "ssd:Annotations")
    annotation = SubElement(annotations, "ssc:Annotation", type="com.opensimulationplatform")
    algorithm = SubElement(annotation, "osp:Algorithm")
    SubElement(algorithm, "osp:FixedStepAlgorithm", baseStepSize=step)
    return root


def _component(elements: Element, name: str, interface: Interface, source: str) -> None:
    component = SubElement(
        elements,
        "ssd:Component",
        name=name,
        description=interface.model.description,
        type="application/x-fmu-sharedlibrary",
        source=source,
        implementation="CoSimulation",
    )
    connectors = SubElement(component, "ssd:Connectors")
    for s in interface.signals:
        about = s.variable.description
        node = SubElement(connectors, "ssd:Connector", name=s.name, description=about, kind=s.causality)
        SubElement(node, "ssc:Real", unit=s.variable.unit)
    bindings = SubElement(component, "ssd:ParameterBindings")
    SubElement(
        bindings,
        "ssd:ParameterBinding",
        type="application/x-ssp-parameter-set",
        source=_parameter_file(name),
    )
