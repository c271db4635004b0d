"""Export of a model as a native FMU: generate, compile, pack.

The same model gives the same sources and the same identifier; the binary is as reproducible as the compiler.
"""

from __future__ import annotations

import hashlib
import platform
import shutil
import subprocess
import sys
import tempfile
import uuid
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from ...errors import InputError, RunError
from ...files import folder, whole
from ...model import Model
from ..description import model_description, model_description_3
from ..documentation import page
from ..pack import checked, pack
from .generate import kernels, tables

_HERE = Path(__file__).parent
_LAYER = ("model.h", "runtime.h", "runtime.c")
_FLAGS = (
    "-std=c99",
    "-O2",
    "-fPIC",
    "-fvisibility=hidden",
    "-ffp-contract=off",
    "-shared",
    "-Wl,--build-id=none",
)


@dataclass(frozen=True)
class _Version:
    """What one FMI version needs."""

    layer: str
    headers: tuple[str, ...]
    binaries: str
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
        "fmi2.c",
        ("fmi2FunctionTypes.h", "fmi2Functions.h", "fmi2TypesPlatform.h"),
        "linux64",
        {"ModelExchange": _COMMON_2, "CoSimulation": _COMMON_2 | _STEP | {"canInterpolateInputs": "true"}},
    ),
    3: _Version(
        "fmi3.c",
        ("fmi3FunctionTypes.h", "fmi3Functions.h", "fmi3PlatformTypes.h"),
        "x86_64-linux",
        {"ModelExchange": _COMMON_3, "CoSimulation": _COMMON_3 | _STEP},
    ),
}


def compiler() -> str | None:
    """The system's C compiler, if there is one that makes code for 64-bit Linux, so far the only platform."""
    if sys.platform != "linux" or platform.machine() not in ("x86_64", "AMD64"):
        return None
    return shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")


def export(model: type[Model], file: Path, start: dict[str, float] | None = None, *, fmi: int = 2) -> Path:
    """Write `model` as a native FMU, Co-Simulation and Model Exchange, for 64-bit Linux.

    Parameters
    ----------
    model, file, start : see `chainunit.fmu.export.export`
    fmi : version of FMI, 2 or 3

    Raises
    ------
    KeyError, InputError
        see there.
    RunError
        where the compiler fails, with what it said.
    """
    command = compiler()
    if command is None:
        raise InputError(
            "no C compiler (cc, gcc or clang) for 64-bit Linux found: install one there, or export with "
            "--backend python"
        )
    interface = checked(model, start)
    file = Path(file)
    folder(file.parent)
    wanted = _VERSIONS[fmi]
    version = metadata.version("chainunit")
    layer = (*_LAYER, wanted.layer)
    compiled = ("kernels.c", "model.c", *(name for name in layer if name.endswith(".c")))

    def description(token: str) -> bytes:
        if fmi == 2:
            root = model_description(interface, token, wanted.kinds, version, compiled)
        else:
            root = model_description_3(interface, token, wanted.kinds, version)
        indent(root)
        return b'<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root)

    digest = hashlib.sha256(description(""))
    functions = kernels(interface)
    for text in (
        functions,
        tables(interface, "", ""),
        *((_HERE / name).read_text("utf-8") for name in layer),
    ):
        digest.update(text.encode() + b"\0")
    token = f"{{{uuid.UUID(digest.hexdigest()[:32])}}}"
    contents = {
        "modelDescription.xml": description(token),
        "documentation/index.html": page(interface, version).encode(),
        "sources/kernels.c": functions.encode(),
        "sources/model.c": tables(interface, token, token).encode(),
    }
    for name in layer:
        contents[f"sources/{name}"] = (_HERE / name).read_bytes()
    for name in wanted.headers:
        contents[f"sources/{name}"] = (_headers() / name).read_bytes()
    if fmi == 3:
        contents["sources/buildDescription.xml"] = _build_description(model.name, compiled)
    contents[f"binaries/{wanted.binaries}/{model.name}.so"] = _compile(command, contents, compiled)
    with whole(file) as part:
        pack(contents, part)
    return file


def _compile(command: str, contents: Mapping[str, bytes], names: tuple[str, ...]) -> bytes:
    with tempfile.TemporaryDirectory(prefix="chainunit_") as scratch:
        work = Path(scratch)
        for name, content in contents.items():
            if name.startswith("sources/"):
                (work / Path(name).name).write_bytes(content)
        built = subprocess.run(
            [command, *_FLAGS, *names, "-o", "model.so", "-lm"], cwd=work, capture_output=True, text=True
        )
        if built.returncode:
            raise RunError(f"the C compiler {command} failed: {built.stderr.strip()}")
        return (work / "model.so").read_bytes()


def _build_description(identifier: str, names: tuple[str, ...]) -> bytes:
    root = Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = SubElement(root, "BuildConfiguration", modelIdentifier=identifier)
    files = SubElement(configuration, "SourceFileSet", language="C99")
    for name in names:
        SubElement(files, "SourceFile", name=name)
    indent(root)
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root)


def _headers() -> Path:
    """The FMI headers, under their own licence, as fmpy ships them."""
    import fmpy

    return Path(fmpy.__file__).parent / "c-code"
