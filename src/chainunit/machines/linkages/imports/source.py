"""The source of a linkage: a linkage file, or what another program wrote."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from ....core import units
from ....core.errors import InputError
from ....core.inputs import TOML, file_bytes
from ....mechanism.models import InverseMachine
from ....reading.tables import UnusualValue, in_file, option_value
from ..file import linkage_from, linkage_in
from . import linkage2, pmks, pyslvs
from .foreign import ForeignLinkage
from .tables import tables_of


class ImportedLinkage(NamedTuple):
    """A linkage from another program: the tables of its linkage file, its name, and sentences for the result."""

    tables: Mapping[str, Any]
    name: str
    remarks: tuple[str, ...]


def imported(source: str, density: str | None = None, scale: str | None = None) -> ImportedLinkage | None:
    """The linkage in a file of another program, an address of PMKS+ or an expression of Pyslvs; None for a linkage
    file.

    Parameters
    ----------
    density : mass per length of links without a mass, with its unit
    scale : unit of length of the drawing; without it that of the source, or mm

    Raises
    ------
    InputError
        with a line for each fault of the source, and for each thing that cannot be carried over.
    """
    is_text = pyslvs.begins(source) or "j=" in source
    name = source[:20] if is_text else source
    linkage = _foreign(source.encode() if is_text else file_bytes(Path(source), TOML), name)
    if linkage is None:
        for option, text in (("--density", density), ("--scale", scale)):
            if text is not None:
                raise InputError(f"{option}: is for drawings of other programs; {source} is a linkage file")
        return None
    with in_file(name, dict):
        unit = scale or linkage.unit
        length = option_value("--scale", unit if units.has_unit(unit) else f"1 {unit}", "m", "unit of length")
        per_metre = option_value("--density", density, "kg/m", "mass per length") if density else None
        tables = tables_of(linkage, length, per_metre)
    remarks = [f"read from a drawing of {linkage.program}, with lengths in {unit}", *linkage.remarks]
    if per_metre is not None:
        remarks.append(f"links without a mass have {per_metre:g} kg per metre between their farthest pins")
    return ImportedLinkage(tables, "drawing" if is_text else Path(source).stem, tuple(remarks))


def _foreign(data: bytes, name: str) -> ForeignLinkage | None:
    """The linkage in the content of a source, by its beginning; None for a linkage file."""
    if data.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<") or name.lower().endswith(".linkage2"):
        return linkage2.read(data, name)
    text = data.decode("utf-8", "replace").lstrip("\ufeff")
    if pyslvs.begins(text):
        return pyslvs.read(text, name)
    return pmks.read(text, name) if "?j=" in text or text.startswith("j=") else None


def linkage_of(
    source: str, density: str | None = None, scale: str | None = None
) -> tuple[InverseMachine, tuple[UnusualValue, ...], tuple[str, ...]]:
    """The machine of a source as of `imported`, its values of an unusual size, and the remarks of the import.

    Raises
    ------
    InputError
        as `imported`, and with a line for each fault of the linkage file.
    """
    found = imported(source, density, scale)
    if found is None:
        return *linkage_in(Path(source)), ()
    try:
        with in_file(found.name, dict):
            return *linkage_from(found.tables, found.name), found.remarks
    except InputError as error:
        remedy = InputError(
            f"{found.name}: to change it, write it as a linkage file with --to {found.name}.toml"
        )
        raise InputError.joined([*error.faults, remedy]) from error
