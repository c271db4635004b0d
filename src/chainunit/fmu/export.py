"""Export of a model as an FMU through pythonfmu.

The mechanics travel inside the FMU as a package folder whose name holds a hash of all that the FMU is made
of: two FMUs in one process never share code by accident, and the same model gives the same file, byte for byte.
"""

from __future__ import annotations

import hashlib
import re
import sys
import tempfile
import uuid
import zipfile
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path
from xml.etree.ElementTree import Element, tostring

# now, not at need: a Python FMU that has run in this process brings a pythonfmu of its own, without binaries
from pythonfmu import FmuBuilder

from ..files import folder, whole
from ..model import Model
from .accompany import accompanying
from .description import Interface, model_description
from .pack import checked, pack, recipes
from .slave import ModelSlave

_PACKAGE = Path(__file__).parents[1]
_COMMON = (
    "engines.py",
    "errors.py",
    "integrate.py",
    "model.py",
    "planar.py",
    "ports.py",
    "quantities.py",
    "fmu/__init__.py",
    "fmu/slave.py",
)
_KINDS = {
    "CoSimulation": {
        "needsExecutionTool": "true",
        "canHandleVariableCommunicationStepSize": "true",
        "canNotUseMemoryManagementFunctions": "true",
        "canGetAndSetFMUstate": "true",
        "canSerializeFMUstate": "true",
    }
}


def export(model: type[Model], file: Path, start: dict[str, float] | None = None) -> Path:
    """Write `model` as a co-simulation FMU 2.0.

    Parameters
    ----------
    model : the model's class
    file : path of the FMU; a file there is replaced, in one step
    start : start values of parameters and inputs, by name, that replace the declared ones

    Raises
    ------
    KeyError
        for a name in `start` that the model does not have.
    InputError
        where the start values are out of bounds or make no machine.
    """
    interface = checked(model, start)
    file = Path(file)
    folder(file.parent)
    with tempfile.TemporaryDirectory(prefix="chainunit_") as scratch:
        work = Path(scratch)
        script = work / f"{model.name}_{_hash(interface)}.py"
        script.write_text(_script(model, start or {}))
        raw = _build(script, work / "raw.fmu")
        version = metadata.version("chainunit")
        with whole(file) as part:
            pack(_contents(raw) | accompanying(interface, version, 2, ("pythonfmu",)), part)
    return file


def complete(slave: type[ModelSlave], resources: Path) -> Element:
    """Describe the FMU that pythonfmu is building from a script, and put beside that script the part of this package
    that it imports, so that the FMU needs no installed chainunit.

    Parameters
    ----------
    slave : the class of the script
    resources : folder that pythonfmu packs after this call; the script in it imports from the added part

    Raises
    ------
    KeyError, InputError
        see `export`.
    """
    interface = checked(slave.model, slave.start)
    version, hashed = metadata.version("chainunit"), _hash(interface)
    package = resources / f"chainunit_{hashed[:12]}"
    for name, content in _shipped(slave.model):
        target = package / name
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(content)
    (package / "__init__.py").write_text(
        f'"""chainunit {version}, the part that {interface.model.name} needs."""\n'
    )
    script = resources / f"{slave.__module__}.py"
    script.write_text(re.sub(r"(?m)^(from|import) chainunit\b", rf"\1 {package.name}", script.read_text()))
    return model_description(interface, f"{{{uuid.UUID(hashed)}}}", _KINDS, version)


def _hash(interface: Interface) -> str:
    """Of all that the FMU is made of, 32 digits."""
    digest = hashlib.sha256()
    for name, content in sorted(_shipped(interface.model)):
        digest.update(name.encode() + b"\0" + content + b"\0")
    digest.update(metadata.version("pythonfmu").encode())
    digest.update(tostring(model_description(interface, "", _KINDS, metadata.version("chainunit"))))
    return digest.hexdigest()[:32]


def _shipped(model: type[Model]) -> Iterator[tuple[str, bytes]]:
    """Files of this package that the FMU carries, by their path inside it."""
    for name in (*_COMMON, *model.files):
        path = _PACKAGE / name
        for source in sorted(path.glob("*.py")) if path.is_dir() else [path]:
            yield source.relative_to(_PACKAGE).as_posix(), source.read_bytes()


def _script(model: type[Model], start: dict[str, float]) -> str:
    """The model's script in `fmu/`, with those start values and, for a class that a function makes, that function's
    arguments."""
    text = (recipes() / f"{model.name}.py").read_text()
    if model.built_by:
        text = re.sub(r"(?m)^(    model = \w+\.)\w+\([\d, ]*\)", rf"\g<1>{model.built_by}", text)
    given = {name: float(start[name]) for name in sorted(start)}
    return text + (f"    start = {given!r}\n" if given else "")


def _build(script: Path, file: Path) -> Path:
    """pythonfmu's build, which leaves its traces in `sys.path` and `sys.modules` behind."""
    path = list(sys.path)
    modules = set(sys.modules)
    try:
        FmuBuilder.build_FMU(script, file)
    finally:
        sys.path[:] = path
        for name in set(sys.modules) - modules:
            if name == script.stem:
                del sys.modules[name]
    return file


def _contents(raw: Path) -> dict[str, bytes]:
    """What pythonfmu packed, the scaffold left out."""
    with zipfile.ZipFile(raw) as archive:
        return {name: archive.read(name) for name in archive.namelist() if "__pycache__" not in name}
