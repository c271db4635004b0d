"""The common parts of both backends: the check of start values, the files of an FMU besides its model (documentation,
licences, icon and terminals, reference results), and archives that are the same byte for byte."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import IO

from ..core.errors import InputError
from ..core.model import Model
from ..core.quantities import complaint
from .description import Interface, licence_text, terminals, xml_bytes
from .documentation import page
from .recipe import icon
from .reference import reference_results
from .script import Script

_EPOCH = (1980, 1, 1, 0, 0, 0)  # the earliest time of a zip entry


def interface_of(
    model: Model, start: Mapping[str, float] | None, script: type[Script] | None = None
) -> Interface:
    """The interface of `model` with these start values; they are checked as parameters of the model.

    Raises
    ------
    KeyError
        for a name in `start` that the model does not have.
    InputError
        if the start values are out of bounds or make no machine, or two flat names are the same.
    """
    interface = Interface(model, {name: float(value) for name, value in (start or {}).items()}, script)
    _refuse_same_names(interface)
    for signal in interface.signals_of("input"):
        if not signal.variable.quantity.admits(signal.start or 0.0):
            raise InputError(complaint(signal.variable, signal.start))
    _ = interface.start_parameters  # refuses start values that make no machine
    return interface


def _refuse_same_names(interface: Interface) -> None:
    """Refuse variables with one name in the FMU."""
    by_name: dict[str, list[str]] = {}
    for signal in interface.signals:
        by_name.setdefault(signal.name, []).append(signal.variable.name)
    clashes = [
        f"{' and '.join(variables)} would be {name}"
        for name, variables in by_name.items()
        if len(variables) > 1
    ]
    if clashes:
        raise InputError(
            f"{interface.model.name} with flat names: {'; '.join(clashes)}; rename one of them, or take structured "
            "names"
        )


def companion_files(
    interface: Interface, version: str, fmi: int, libraries: Sequence[str] = ()
) -> dict[str, bytes]:
    """Files by their path inside the FMU; `libraries` are the packages whose code the FMU contains: their licences
    are added."""
    model = interface.model
    sketch = model.sketch(interface.start_parameters)
    png, svg = (icon(model, kind, sketch) for kind in ("png", "svg"))
    files = {
        "documentation/index.html": interface.text(page(interface, version, sketch)).encode(),
        "documentation/licenses/license.txt": licence("chainunit", *libraries).encode(),
    }
    if fmi == 2:
        files["model.png"] = png
    else:
        files |= {"terminalsAndIcons/icon.png": png, "terminalsAndIcons/icon.svg": svg}
    if fmi == 3 or model.terminals:
        files["terminalsAndIcons/terminalsAndIcons.xml"] = xml_bytes(terminals(interface, with_icon=fmi == 3))
    return files | reference_results(interface)


def licence(*packages: str) -> str:
    """The licences of installed packages, in series."""
    return "\n\n".join(f"{name}\n\n{licence_text(name)}" for name in packages)


def pack(contents: Mapping[str, bytes], file: Path | IO[bytes], comment: bytes = b"") -> None:
    """Write an archive with a fixed order and a fixed time stamp of its entries."""
    with zipfile.ZipFile(file, "w") as archive:
        archive.comment = comment
        for name in sorted(contents):
            entry = zipfile.ZipInfo(name, _EPOCH)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, contents[name], compresslevel=9)
