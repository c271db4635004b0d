"""Export of a model as an FMU through pythonfmu.

The FMU contains the mechanics as a package folder. The name of the folder has a hash of all contents of the FMU, so
that two FMUs in one process never share code by accident. The same model gives the same file, byte for byte.
"""

from __future__ import annotations

import ast
import hashlib
import re
import sys
import uuid
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from functools import lru_cache
from importlib import metadata
from pathlib import Path
from xml.etree.ElementTree import Element, tostring

# imported here and not later: a Python FMU that runs in this process brings its own pythonfmu, without binaries
from pythonfmu import FmuBuilder

from ..core.errors import InputError
from ..core.files import atomic_file, folder
from ..core.model import Model
from ..core.temporary_folders import scratch
from .companion_files import companion_files
from .description import Interface, model_description
from .pack import interface_of, pack
from .recipe import script_file, script_of, script_with_names
from .script import Names, Script

_PACKAGE = Path(__file__).parents[1]
_KINDS = {
    "CoSimulation": {
        "needsExecutionTool": "true",
        "canHandleVariableCommunicationStepSize": "true",
        "canNotUseMemoryManagementFunctions": "true",
        "canGetAndSetFMUstate": "true",
        "canSerializeFMUstate": "true",
    }
}


def export(
    model: type[Model],
    file: Path,
    start: dict[str, float] | None = None,
    *,
    names: Names = "structured",
) -> Path:
    """Write `model` as a co-simulation FMU 2.0.

    Parameters
    ----------
    model : the model's class
    file : path of the FMU; an existing file is replaced, in one step
    start : start values of parameters and inputs, by their names in the model, in place of the declared ones
    names : "structured" for the names of the model, "flat" for underscores in place of their dots

    Raises
    ------
    KeyError
        for a name in `start` that the model does not have.
    InputError
        where the start values are out of bounds or make no machine, or two flat names are the same.
    """
    interface = interface_of(model, start, script_with_names(model, names))
    file = Path(file)
    folder(file.parent)
    with scratch() as work:
        text = _script(model, start or {}, names)
        script = work / f"{model.name}_{_hash(interface, _import_closure(text), model.name)}.py"
        script.write_text(text)
        raw = _build(script, work / "raw.fmu")
        version = metadata.version("chainunit")
        with atomic_file(file) as part:
            pack(_contents(raw) | companion_files(interface, version, 2, ("pythonfmu",)), part)
    return file


def complete(slave: type[Script], resources: Path) -> Element:
    """The description of the FMU that pythonfmu is building from a script. Writes the part of this package that the
    script imports beside the script, so that the FMU needs no installed chainunit.

    Parameters
    ----------
    slave : the class of the script
    resources : folder that pythonfmu packs after this call; the script in it imports from the added part

    Raises
    ------
    KeyError, InputError
        see `export`; also for an import in the script that cannot be copied into the FMU.
    """
    interface = interface_of(slave.model, slave.start, slave)
    script = resources / f"{slave.__module__}.py"
    text = script.read_text("utf-8")
    files = _import_closure(text)
    version, digest = metadata.version("chainunit"), _hash(interface, files, slave.__name__)
    package = resources / f"chainunit_{digest[:12]}"
    for name, content in files.items():
        target = package / name
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(content)
    (package / "__init__.py").write_text(
        f'"""chainunit {version}, the part that {interface.model.name} needs."""\n'
    )
    script.write_text(re.sub(r"(?m)^( *(?:from|import)) chainunit\b", rf"\1 {package.name}", text), "utf-8")
    # pythonfmu names the binaries by the class
    return model_description(
        interface, f"{{{uuid.UUID(digest)}}}", _KINDS, version, identifier=slave.__name__
    )


def _hash(interface: Interface, files: Mapping[str, bytes], identifier: str) -> str:
    """The hash of all contents of the FMU, 32 digits."""
    digest = hashlib.sha256()
    for name, content in sorted(files.items()):
        digest.update(name.encode() + b"\0" + content + b"\0")
    digest.update(metadata.version("pythonfmu").encode())
    version = metadata.version("chainunit")
    digest.update(tostring(model_description(interface, "", _KINDS, version, identifier=identifier)))
    return digest.hexdigest()[:32]


def _import_closure(script: str) -> dict[str, bytes]:
    """The files of this package that a script imports, directly or through another file, by their path. Imports
    inside functions do not count.

    Raises
    ------
    InputError
        for an import of anything but a module.
    """
    files: dict[str, bytes] = {}
    waiting = list(_imports(ast.walk(ast.parse(script)), ()))
    for module in waiting:
        if not module or not _file(module):
            raise InputError(
                f"the script imports {'.'.join(('chainunit', *module))}: must be a module of chainunit, "
                "such as `from chainunit.machines import chain_unit`"
            )
    while waiting:
        module = waiting.pop()
        for depth in range(1, len(module) + 1):
            path = _file(module[:depth])
            name = path.relative_to(_PACKAGE).as_posix() if path else ""
            if path is None or name in files:
                continue
            files[name] = path.read_bytes()
            place = module[:depth] if path.name == "__init__.py" else module[: depth - 1]
            waiting += _imported(files[name], place)
    return files


@lru_cache(maxsize=512)
def _imported(content: bytes, package: tuple[str, ...]) -> tuple[tuple[str, ...], ...]:
    """The modules that a file with this content in that subpackage imports when it is imported."""
    return tuple(_imports(_at_import(ast.parse(content)), package))


def _imports(nodes: Iterable[ast.AST], package: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
    """The modules of chainunit that code in its subpackage `package` imports, by the parts of their names after
    "chainunit"; no parts for chainunit itself."""
    for node in nodes:
        if isinstance(node, ast.Import):
            for alias in node.names:
                first, *parts = alias.name.split(".")
                if first == "chainunit":
                    yield tuple(parts if alias.asname else ())
        elif isinstance(node, ast.ImportFrom):
            parts = node.module.split(".") if node.module else []
            if node.level:
                parts = [*package[: len(package) - node.level + 1], *parts]
            elif parts.pop(0) != "chainunit":
                continue
            for alias in node.names:
                inner = (*parts, alias.name)
                yield inner if _file(inner) else tuple(parts)


def _at_import(tree: ast.Module) -> Iterator[ast.AST]:
    """The nodes of a module that run at its import."""
    waiting: list[ast.AST] = [tree]
    while waiting:
        for node in ast.iter_child_nodes(waiting.pop()):
            if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)) or (
                isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
            ):
                continue
            yield node
            waiting.append(node)


def _file(module: tuple[str, ...]) -> Path | None:
    """The file of a module or package inside this package."""
    place = _PACKAGE.joinpath(*module)
    return next((p for p in (place / "__init__.py", place.with_suffix(".py")) if p.is_file()), None)


_SCRIPT = """\
{imports}
from chainunit.fmu.slave import ModelSlave, hold


@hold(globals())
class {name}(ModelSlave):
    model = {module}.{call}
{more}"""


def _script(model: type[Model], start: dict[str, float], names: Names) -> str:
    """The model's script in `fmu/`, or else a script of the same form, with these start values and names and, for a
    class that a function makes, the arguments of that function."""
    file = script_file(model)
    module = model.__module__.rpartition(".")[2]
    made, call = model.made, model.expression()
    paths = (
        *(f"{__package__.partition('.')[0]}.{each}" for each in (made.modules if made else ())),
        model.__module__,
    )
    imports = "\n".join("from {0} import {2}".format(*path.rpartition(".")) for path in paths)
    own = script_of(model)
    extras = {"experiment": own.experiment, "sizes": own.sizes}
    more = "".join(f"    {name} = {values!r}\n" for name, values in extras.items() if values)
    plain = _SCRIPT.format(name=model.name, imports=imports, module=module, call=call, more=more)
    text = file.read_text() if file else plain
    if made:
        text = re.sub(r"(?m)^(    model = \w+\.)\w+\([\d, ]*\)(?:\.\w+\(\))*", rf"\g<1>{call}", text)
    if names != own.names:
        text += f"    names = {names!r}\n"
    values = {name: float(start[name]) for name in sorted(start)}
    return text + (f"    start = {values!r}\n" if values else "")


def _build(script: Path, file: Path) -> Path:
    """Build with pythonfmu, and undo its changes of `sys.path` and `sys.modules`."""
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
    """The files that pythonfmu packed, without compiled Python."""
    with zipfile.ZipFile(raw) as archive:
        return {name: archive.read(name) for name in archive.namelist() if "__pycache__" not in name}
