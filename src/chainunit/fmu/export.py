"""Export of a model as an FMU through pythonfmu.

The FMU contains the equations as printed Python, in a package folder. The name of the folder has a hash of all
contents of the FMU, so that two FMUs in one process never share code by accident. The same model gives the same file,
byte for byte.
"""

from __future__ import annotations

import hashlib
import uuid
from importlib import metadata
from pathlib import Path
from xml.etree.ElementTree import Element, tostring

from ..core.files import atomic_file, folder
from ..core.model import Model
from .description import Interface, model_description, xml_bytes
from .pack import companion_files, interface_of, pack
from .printed_model import printed_model
from .script import Names, Script, script_with_names

_PACKAGE = Path(__file__).parents[1]
_CARRIED = (
    *("core/bounds.py", "core/integrators.py", "core/messages.py"),
    *("core/printing/python_functions.py", "core/printing/python_math.py"),
    *("fmu/model_instance.py", "fmu/printed_slave.py"),
)
"""The files of this package that a Python FMU carries; they need the standard library alone."""
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
    model: Model,
    file: Path,
    start: dict[str, float] | None = None,
    *,
    names: Names = "structured",
) -> Path:
    """Write `model` as a co-simulation FMU 2.0.

    Parameters
    ----------
    model : the model
    file : path of the FMU; an existing file is replaced, in one step
    start : start values of parameters and inputs, by their names in the model, in place of the declared ones
    names : "structured" for the names of the model, "flat" for underscores in place of their dots

    Raises
    ------
    KeyError
        for a name in `start` that the model does not have.
    InputError
        if the start values are out of bounds or make no machine, or two flat names are the same.
    """
    interface = interface_of(model, start, script_with_names(names))
    file = Path(file)
    folder(file.parent)
    files, digest = _resources(interface, model.name)
    module = f"{model.name}_{digest}"
    contents = {f"resources/{name}": content for name, content in files.items()}
    contents[f"resources/{module}.py"] = _script(model.name, digest)
    contents["resources/slavemodule.txt"] = module.encode()
    contents["modelDescription.xml"] = xml_bytes(_description(interface, model.name, digest))
    # not by its import: a Python FMU that runs in this process brings its own pythonfmu, without binaries
    pythonfmu = Path(str(metadata.distribution("pythonfmu").locate_file("pythonfmu")))
    for script in pythonfmu.glob("*.py"):
        contents[f"resources/pythonfmu/{script.name}"] = script.read_bytes()
    for binary in (pythonfmu / "resources" / "binaries").glob("*/*"):
        contents[f"binaries/{binary.parent.name}/{model.name}{binary.suffix}"] = binary.read_bytes()
    with atomic_file(file) as part:
        pack(contents | companion_files(interface, metadata.version("chainunit"), 2, ("pythonfmu",)), part)
    return file


def complete(slave: type[Script], resources: Path) -> Element:
    """The description of the FMU that pythonfmu is building from a script. Writes the code of the FMU beside the
    script and over it.

    Parameters
    ----------
    slave : the class of the script
    resources : folder that pythonfmu packs after this call

    Raises
    ------
    KeyError, InputError
        see `export`.
    """
    interface = interface_of(slave.model, slave.start, slave)
    files, digest = _resources(interface, slave.__name__)
    for name, content in files.items():
        target = resources / name
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(content)
    (resources / f"{slave.__module__}.py").write_bytes(_script(slave.__name__, digest))
    # pythonfmu names the binaries by the class
    return _description(interface, slave.__name__, digest)


def _description(interface: Interface, identifier: str, digest: str) -> Element:
    guid = f"{{{uuid.UUID(digest)}}}" if digest else ""
    return model_description(interface, guid, _KINDS, metadata.version("chainunit"), identifier=identifier)


def _resources(interface: Interface, identifier: str) -> tuple[dict[str, bytes], str]:
    """The package of the FMU by the paths of its files, and the hash of all contents of the FMU, 32 digits."""
    files = {name: (_PACKAGE / name).read_bytes() for name in _CARRIED}
    files["model.py"] = printed_model(interface).encode()
    hashed = hashlib.sha256(metadata.version("pythonfmu").encode())
    hashed.update(tostring(_description(interface, identifier, "")))
    for name, content in sorted(files.items()):
        hashed.update(name.encode() + b"\0" + content + b"\0")
    digest = hashed.hexdigest()[:32]
    return {f"{_package(digest)}/{name}": content for name, content in files.items()}, digest


def _package(digest: str) -> str:
    return f"chainunit_{digest[:12]}"


_SCRIPT = '''\
from {package} import model
from {package}.fmu.printed_slave import PrintedSlave, hold


@hold(globals(), model)
class {name}(PrintedSlave):
    """The class that pythonfmu instantiates."""
'''


def _script(name: str, digest: str) -> bytes:
    """The script in the FMU, with a class of this name."""
    return _SCRIPT.format(name=name, package=_package(digest)).encode()
