"""Export of a model as a native FMU: generate, compile, pack.

The same model gives the same sources and the same identifier; the binary is as reproducible as the compiler.
"""

from __future__ import annotations

import hashlib
import shutil
import subprocess
import tempfile
import uuid
from importlib import metadata
from pathlib import Path
from xml.etree.ElementTree import indent, tostring

from ...errors import InputError, RunError
from ...files import folder, whole
from ...model import Model
from ..description import model_description
from ..pack import checked, pack
from .generate import sources

_HERE = Path(__file__).parent
_LAYER = ("model.h", "runtime.h", "runtime.c", "fmi2.c")
_HEADERS = ("fmi2FunctionTypes.h", "fmi2Functions.h", "fmi2TypesPlatform.h")
_FLAGS = (
    "-std=c99",
    "-O2",
    "-fPIC",
    "-fvisibility=hidden",
    "-ffp-contract=off",
    "-shared",
    "-Wl,--build-id=none",
)
_COMMON = {
    "needsExecutionTool": "false",
    "canNotUseMemoryManagementFunctions": "true",
    "canGetAndSetFMUstate": "true",
    "canSerializeFMUstate": "true",
    "providesDirectionalDerivative": "true",
}
_KINDS = {
    "ModelExchange": _COMMON,
    "CoSimulation": _COMMON
    | {
        "canHandleVariableCommunicationStepSize": "true",
        "canInterpolateInputs": "true",
        "maxOutputDerivativeOrder": "1",
    },
}


def compiler() -> str | None:
    """The system's C compiler, if there is one."""
    return shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")


def export(model: type[Model], file: Path, start: dict[str, float] | None = None) -> Path:
    """Write `model` as a native FMU 2.0, Co-Simulation and Model Exchange, for this platform (linux64).

    Parameters
    ----------
    model, file, start : see `chainunit.fmu.export.export`

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
            "no C compiler found (cc, gcc or clang): install one, or export with --backend python"
        )
    interface = checked(model, start)
    file = Path(file)
    folder(file.parent)
    version = metadata.version("chainunit")
    names = ("kernels.c", "model.c", "runtime.c", "fmi2.c")
    generated = sources(interface, "", "")
    digest = hashlib.sha256()
    for text in (*generated.values(), *((_HERE / name).read_text("utf-8") for name in _LAYER)):
        digest.update(text.encode() + b"\0")
    digest.update(tostring(model_description(interface, "", _KINDS, version, names)))
    guid = f"{{{uuid.UUID(digest.hexdigest()[:32])}}}"
    with tempfile.TemporaryDirectory(prefix="chainunit_") as scratch:
        work = Path(scratch)
        for name, text in sources(interface, guid, guid).items():
            (work / name).write_text(text, "utf-8")
        for name in _LAYER:
            shutil.copy2(_HERE / name, work)
        for name in _HEADERS:
            shutil.copy2(_headers() / name, work)
        built = subprocess.run(
            [command, *_FLAGS, *names, "-o", f"{model.name}.so", "-lm"],
            cwd=work,
            capture_output=True,
            text=True,
        )
        if built.returncode:
            raise RunError(f"the C compiler {command} failed: {built.stderr.strip()}")
        description = model_description(interface, guid, _KINDS, version, names)
        indent(description)
        contents = {
            "modelDescription.xml": b'<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(description),
            f"binaries/linux64/{model.name}.so": (work / f"{model.name}.so").read_bytes(),
        }
        for name in (*names, *(n for n in _LAYER if n.endswith(".h")), *_HEADERS):
            contents[f"sources/{name}"] = (work / name).read_bytes()
        with whole(file) as part:
            pack(contents, part)
    return file


def _headers() -> Path:
    """The FMI headers, under their own licence, as fmpy ships them."""
    import fmpy

    return Path(fmpy.__file__).parent / "c-code"
