"""Export of a model as an FMU through pythonfmu.

The mechanics travel inside the FMU as a package folder whose name holds a hash of all that the FMU is made
of: two FMUs in one process never share code by accident, and the same model gives the same file, byte for byte.
"""

from __future__ import annotations

import hashlib
import sys
import tempfile
import uuid
import zipfile
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path
from xml.etree.ElementTree import tostring

# now, not at need: a Python FMU that has run in this process brings a pythonfmu of its own, without binaries
from pythonfmu import FmuBuilder

from ..files import folder, whole
from ..model import Model
from .accompany import accompanying
from .description import model_description
from .pack import checked, pack

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
    version = metadata.version("chainunit")
    shipped = dict(_shipped(model))
    digest = hashlib.sha256()
    for name, content in sorted(shipped.items()):
        digest.update(name.encode() + b"\0" + content + b"\0")
    digest.update(metadata.version("pythonfmu").encode())
    digest.update(tostring(model_description(interface, "", _KINDS, version)))
    hashed = digest.hexdigest()[:32]
    description = model_description(interface, f"{{{uuid.UUID(hashed)}}}", _KINDS, version)

    with tempfile.TemporaryDirectory(prefix="chainunit_") as scratch:
        work = Path(scratch)
        package = work / f"chainunit_{hashed[:12]}"
        for name, content in shipped.items():
            target = package / name
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(content)
        (package / "__init__.py").write_text(
            f'"""chainunit {version}, the part that {model.name} needs."""\n'
        )
        recipe = work / f"{model.name}_{hashed[:12]}.py"
        recipe.write_text(_recipe(model, package.name, start or {}))
        (work / "modelDescription.xml").write_bytes(tostring(description, "utf-8"))
        raw = _build(recipe, package, work / "modelDescription.xml", work / "raw.fmu")
        with whole(file) as part:
            pack(_contents(raw) | accompanying(interface, version, 2, ("pythonfmu",)), part)
    return file


def _shipped(model: type[Model]) -> Iterator[tuple[str, bytes]]:
    """Files of this package that the FMU carries, by their path inside it."""
    for name in (*_COMMON, *model.files):
        path = _PACKAGE / name
        for source in sorted(path.glob("*.py")) if path.is_dir() else [path]:
            yield source.relative_to(_PACKAGE).as_posix(), source.read_bytes()


def _recipe(model: type[Model], package: str, given: dict[str, float]) -> str:
    start = {name: float(given[name]) for name in sorted(given)}
    module, made = model.__module__.removeprefix("chainunit"), model.built_by or model.__qualname__
    return (
        f'"""{model.description}."""\n'
        f"from {package}.fmu.slave import ModelSlave, hold\n"
        f"from {package}{module} import {made.partition('(')[0]}\n\n"
        f"_Model = {made}\n"
        "hold(globals())\n\n\n"
        f"class {model.name}(ModelSlave):\n"
        f"    model = _Model\n"
        f"    start = {start!r}\n"
    )


def _build(recipe: Path, package: Path, description: Path, file: Path) -> Path:
    """pythonfmu's build, which leaves its traces in `sys.path` and `sys.modules` behind."""
    path = list(sys.path)
    modules = set(sys.modules)
    try:
        FmuBuilder.build_FMU(recipe, file, project_files=[package, description])
    finally:
        sys.path[:] = path
        for name in set(sys.modules) - modules:
            if name.split(".")[0] in (package.name, recipe.stem):
                del sys.modules[name]
    return file


def _contents(raw: Path) -> dict[str, bytes]:
    """What pythonfmu packed, the scaffold left out."""
    with zipfile.ZipFile(raw) as archive:
        return {
            name: archive.read(name)
            for name in archive.namelist()
            if name != "resources/modelDescription.xml" and "__pycache__" not in name
        }
