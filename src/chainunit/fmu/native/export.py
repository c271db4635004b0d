"""Export of a model as a native FMU: generate, compile, pack.

The same model gives the same sources and the same identifier; the binary is as reproducible as the compiler.
"""

from __future__ import annotations

import hashlib
import uuid
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement

from ...core.files import atomic_file, folder
from ...core.model import Model
from ...core.printing.c_elementary import HEADER, header
from ...core.printing.c_forms import STEP, c_file
from ..description import model_description, model_description_3, xml_bytes
from ..pack import companion_files, interface_of, pack
from ..recipe import recipes
from ..script import Names, script_with_names
from .generate import kernels, rules, tables
from .platforms import build, choose, units_of

_LAYER = ("model.h", "runtime.c", "fmi.h")


@dataclass(frozen=True)
class _Version:
    """The files and attributes of one FMI version."""

    guid: str
    headers: tuple[str, ...]
    kinds: Mapping[str, Mapping[str, str]]


_COMMON_2 = {
    "needsExecutionTool": "false",
    "canNotUseMemoryManagementFunctions": "true",
    "canGetAndSetFMUstate": "true",
    "canSerializeFMUstate": "true",
    "providesDirectionalDerivative": "true",
}
_COMMON_3 = {
    "needsExecutionTool": "false",
    "canGetAndSetFMUState": "true",
    "canSerializeFMUState": "true",
    "providesDirectionalDerivatives": "true",
}
_STEP = {"canHandleVariableCommunicationStepSize": "true", "maxOutputDerivativeOrder": "1"}
_VERSIONS = {
    2: _Version(
        "guid",
        ("fmi2FunctionTypes.h", "fmi2Functions.h", "fmi2TypesPlatform.h"),
        {"ModelExchange": _COMMON_2, "CoSimulation": _COMMON_2 | _STEP | {"canInterpolateInputs": "true"}},
    ),
    3: _Version(
        "instantiationToken",
        ("fmi3FunctionTypes.h", "fmi3Functions.h", "fmi3PlatformTypes.h"),
        {"ModelExchange": _COMMON_3, "CoSimulation": _COMMON_3 | _STEP},
    ),
}


def export(
    model: Model,
    file: Path,
    start: dict[str, float] | None = None,
    *,
    fmi: int = 2,
    platforms: Sequence[str] = (),
    names: Names = "structured",
    progress: Callable[[str], None] = lambda what: None,
) -> Path:
    """Write `model` as a native FMU, Co-Simulation and Model Exchange.

    Parameters
    ----------
    model, file, start, names : see `chainunit.fmu.export.export`
    fmi : version of FMI, 2 or 3
    platforms : names from `chainunit.fmu.native.platforms.PLATFORMS`; by default the platform of this machine
    progress : is called with texts on the work

    Raises
    ------
    KeyError, InputError
        see `chainunit.fmu.export.export`; also if there is no compiler for a platform.
    RunError
        if the compiler fails, with its messages.
    """
    targets, compiler = choose(platforms, fmi)
    interface = interface_of(model, start, script_with_names(names))
    file = Path(file)
    folder(file.parent)
    of_version = _VERSIONS[fmi]
    version = metadata.version("chainunit")
    units = units_of(fmi)
    layer = (*_LAYER, units[-1])

    kinds = dict(of_version.kinds)
    if fmi == 3 and (model.state_layout or interface.discrete):
        # FMI 2.0 expects the call from every importer
        kinds["ModelExchange"] = {**kinds["ModelExchange"], "needsCompletedIntegratorStep": "true"}

    progress("generating C")
    if fmi == 2:
        description = model_description(interface, "", kinds, version, units)
    else:
        description = model_description_3(interface, "", kinds, version)
    functions, room = kernels(model)
    sources = {name: (recipes() / "native" / name).read_bytes() for name in layer}
    sources |= {"kernels.c": functions.encode(), "rules.h": interface.text(rules()).encode()}
    sources |= {HEADER: header().encode(), STEP: c_file(STEP).encode()}
    digest = hashlib.sha256(xml_bytes(description))
    for text in (*sources.values(), interface.text(tables(interface, "", room)).encode()):
        digest.update(text + b"\0")
    guid = f"{{{uuid.UUID(digest.hexdigest()[:32])}}}"
    description.set(of_version.guid, guid)
    sources["model.c"] = interface.text(tables(interface, guid, room)).encode()
    sources |= {name: (_headers() / name).read_bytes() for name in of_version.headers}
    contents = {f"sources/{name}": text for name, text in sources.items()}
    contents["modelDescription.xml"] = xml_bytes(description)
    contents |= companion_files(interface, version, fmi)
    if fmi == 3:
        contents["sources/buildDescription.xml"] = _build_description(model.name, units)
    for name in targets:
        slow = ", the first time about a minute" if compiler.zig and name == "win64" else ""
        progress(f"compiling for {name}{slow}")
        contents |= build(compiler, name, fmi, model.name, sources, units)
    with atomic_file(file) as part:
        pack(contents, part)
    return file


def _build_description(identifier: str, names: Sequence[str]) -> bytes:
    """The contents of buildDescription.xml of FMI 3.0, with the `names` of the sources to compile."""
    root = Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = SubElement(root, "BuildConfiguration", modelIdentifier=identifier)
    files = SubElement(configuration, "SourceFileSet", language="C99")
    for name in names:
        SubElement(files, "SourceFile", name=name)
    return xml_bytes(root)


def _headers() -> Path:
    """The folder of the FMI headers in fmpy; they have their own licence."""
    import fmpy

    return Path(fmpy.__file__).parent / "c-code"
