"""Export of models and their connections as an SSP 1.0 package: FMUs, parameter sets, the structure of the system.

The package runs as it is in libcosim, which reads every component's parameter set and, from an annotation, the
step; and in ecos, which takes the set by name (``init(parameter_set="start")``). Each FMU carries its start values,
too, so that a tool that passes the sets by runs the same system. Neither of the two reads connections to
connectors of the system itself: inputs that are not connected are left open, with their values in the sets.
"""

from __future__ import annotations

import math
import re
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import metadata
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement

from ..errors import InputError
from ..files import folder, whole
from ..fmu.backends import Backend
from ..fmu.backends import export as export_fmu
from ..fmu.description import Interface, Signal
from ..fmu.pack import checked, pack, written
from ..model import Model
from ..quantities import base_units

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


@dataclass(frozen=True)
class ModelSystem:
    """What is packaged: a `chainunit.system.System` of models in place of files.

    `models` maps instance names to models, `connections` are pairs (output, input) of full names such as
    ``("motor.phi", "machine.phi")``, `start` holds start values of parameters and inputs by full name, in the
    declared units; others start as declared. `name` and `description` are those of the whole.
    """

    name: str
    models: Mapping[str, type[Model]]
    connections: Sequence[tuple[str, str]]
    start: Mapping[str, float] = field(default_factory=dict)
    description: str = ""


def export(
    system: ModelSystem,
    file: Path,
    *,
    stop: float = 10.0,
    step: float = 1e-3,
    backend: Backend | None = None,
    report: Callable[[str], None] = lambda what: None,
) -> str:
    """Write `system` as an SSP 1.0 package and say, in words, what is in it. The same system gives the same file.

    Parameters
    ----------
    system : models, connections, start values
    file : path of the package; a file there is replaced, in one step
    stop, step : end of the default experiment, and its communication step, an annotation that libcosim reads [s]
    backend : of the FMUs, which are FMI 2.0; see `chainunit.fmu.backends.export`
    report : is told what is being done

    Raises
    ------
    InputError
        for a name that is not in the system, an input with two sources, a connection of different units, start
        values out of bounds or that make no machine, an experiment without end or step, and what
        `chainunit.fmu.backends.export` refuses.
    RunError
        where the compiler fails.
    """
    if not (0.0 < step < math.inf and 0.0 < stop < math.inf):
        raise InputError(f"an experiment of {stop:g} s in steps of {step:g} s: must go forward")
    start = _start(system)
    interfaces = {name: _interface(name, model, start[name]) for name, model in system.models.items()}
    driven = _driven(system, interfaces)
    file = Path(file)
    folder(file.parent)
    contents: dict[str, bytes] = {}
    sources: dict[str, str] = {}
    made: list[str] = []
    packed: dict[tuple[object, ...], str] = {}
    with tempfile.TemporaryDirectory(prefix="chainunit_") as scratch:
        for name, model in system.models.items():
            alike = (model.name, *sorted(start[name].items()))
            if alike not in packed:
                source = f"resources/{model.name}.fmu"
                packed[alike] = f"resources/{model.name}_{name}.fmu" if source in contents else source
                fmu = Path(scratch) / f"{model.name}.fmu"
                made.append(export_fmu(model, fmu, start[name], backend=backend, report=report))
                contents[packed[alike]] = fmu.read_bytes()
            sources[name] = packed[alike]
    for name, interface in interfaces.items():
        free = [s for s in interface.of("input") if f"{name}.{s.name}" not in driven]
        contents[_parameter_file(name)] = written(_parameter_set([*interface.of("parameter"), *free]))
    contents["SystemStructure.ssd"] = written(_description(system, interfaces, sources, stop, step))
    with whole(file) as part:
        pack(contents, part)
    parts = ", ".join(f"{name} ({model.name})" for name, model in system.models.items())
    return f"SSP 1.0, {parts}, {len(system.connections)} connections; {'; '.join(dict.fromkeys(made))}"


# -- checks


def _start(system: ModelSystem) -> dict[str, dict[str, float]]:
    """Start values by instance and name."""
    split: dict[str, dict[str, float]] = {}
    for name in system.models:
        # these become names of files, and full names are cut at the first dot
        if not re.fullmatch(r"[A-Za-z_]\w*", name, re.ASCII):
            raise InputError(f"{name!r}: an instance's name must be of letters, digits and _")
        split[name] = {}
    for full, value in system.start.items():
        name, _, variable = full.partition(".")
        known = system.models.get(name)
        if known is None or variable not in (*known.parameter_layout.names, *known.input_layout.names):
            raise InputError(f"{full}: no such parameter or input in the system")
        split[name][variable] = float(value)
    return split


def _interface(name: str, model: type[Model], start: Mapping[str, float]) -> Interface:
    try:
        return checked(model, start)
    except InputError as error:
        raise InputError(f"{name}: {error}") from error


def _driven(system: ModelSystem, interfaces: Mapping[str, Interface]) -> dict[str, str]:
    """Source of each connected input, by full names."""
    units = {
        kind: {f"{name}.{s.name}": s.variable.unit for name, i in interfaces.items() for s in i.of(kind)}
        for kind in ("input", "output")
    }
    driven: dict[str, str] = {}
    for source, target in system.connections:
        for kind, full in (("output", source), ("input", target)):
            if full not in units[kind]:
                raise InputError(f"{full}: no such {kind} in the system")
        if target in driven:
            raise InputError(f"{target}: is connected to {driven[target]} and to {source}")
        given, taken = units["output"][source], units["input"][target]
        if base_units(given) != base_units(taken):
            raise InputError(f"{source} in {given} cannot be connected to {target} in {taken}")
        driven[target] = source
    return driven


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
    listed = SubElement(parent, f"{prefix}:Units")
    for unit in sorted({s.variable.unit for s in signals}):
        node = SubElement(listed, "ssc:Unit", name=unit)
        SubElement(node, "ssc:BaseUnit", {base: str(power) for base, power in base_units(unit).items()})


def _parameter_set(signals: Sequence[Signal]) -> Element:
    """The XML tree of an SSV file with the start values of `signals`."""
    root = _root("ssv:ParameterSet", PARAMETER_SET, ("ssv", "ssc"))
    listed = SubElement(root, "ssv:Parameters")
    for s in signals:
        node = SubElement(listed, "ssv:Parameter", name=s.name, description=s.variable.description)
        SubElement(node, "ssv:Real", value=repr(float(s.start or 0.0)), unit=s.variable.unit)
    _units(root, "ssv", signals)
    return root


def _description(
    system: ModelSystem,
    interfaces: Mapping[str, Interface],
    sources: Mapping[str, str],
    stop: float,
    step: float,
) -> Element:
    """The XML tree of SystemStructure.ssd; `sources` are the FMUs' paths by instance."""
    # a title may hold characters that XML cannot
    described = "".join(c if c.isprintable() else " " for c in system.description)
    root = _root("ssd:SystemStructureDescription", system.name, ("ssd", "ssc", "osp"), described)
    top = SubElement(root, "ssd:System", name=system.name)
    elements = SubElement(top, "ssd:Elements")
    for name, interface in interfaces.items():
        component = SubElement(
            elements,
            "ssd:Component",
            name=name,
            description=interface.model.description,
            type="application/x-fmu-sharedlibrary",
            source=sources[name],
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
    experiment = SubElement(root, "ssd:DefaultExperiment", startTime="0.0", stopTime=repr(float(stop)))
    annotations = SubElement(experiment, "ssd:Annotations")
    annotation = SubElement(annotations, "ssc:Annotation", type="com.opensimulationplatform")
    algorithm = SubElement(annotation, "osp:Algorithm")
    SubElement(algorithm, "osp:FixedStepAlgorithm", baseStepSize=repr(float(step)))
    return root
