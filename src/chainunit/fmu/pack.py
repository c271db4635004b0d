"""The common parts of both backends: the check of start values, and archives that are the same byte for byte."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import IO
from xml.etree.ElementTree import Element, indent, tostring

from ..core.errors import InputError
from ..core.model import Model
from ..core.quantities import complaint
from .description import Interface
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
        where the start values are out of bounds or make no machine, or two flat names are the same.
    """
    interface = Interface(model, {name: float(value) for name, value in (start or {}).items()}, script)
    _refuse_same_names(interface)
    for signal in interface.signals_of("input"):
        if not signal.variable.quantity.admits(signal.start or 0.0):
            raise InputError(complaint(signal.variable, signal.start))
    _ = interface.start_parameters  # refuses those that make no machine
    return interface


def _refuse_same_names(interface: Interface) -> None:
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


def pack(contents: Mapping[str, bytes], file: Path | IO[bytes], comment: bytes = b"") -> None:
    """Write an archive with a fixed order and a fixed time stamp of its entries."""
    with zipfile.ZipFile(file, "w") as archive:
        archive.comment = comment
        for name in sorted(contents):
            entry = zipfile.ZipInfo(name, _EPOCH)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, contents[name], compresslevel=9)


def xml_bytes(root: Element) -> bytes:
    """The contents of an XML file with this root, indented."""
    indent(root)
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root)
