"""The source of a linkage: a linkage file, or what another program wrote."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, NamedTuple

from ....core import units
from ....core.errors import InputError
from ....core.inputs import TOML, file_bytes
from ....mechanism.models import InverseMachine
from ....reading.tables import UnusualValue, in_file, option_value
from ..file import linkage_from
from . import linkage2, pmks, pyslvs
from .tables import tables_of


class ImportedLinkage(NamedTuple):
    """A linkage from another program: its name, the tables of its linkage file, and sentences for the result."""

    name: str
    tables: dict[str, Any]
    remarks: tuple[str, ...]

    def machine(self) -> tuple[InverseMachine, tuple[UnusualValue, ...]]:
        """The machine, and its values of an unusual size.

        Raises
        ------
        InputError
            with a line for each fault of the linkage file.
        """
        try:
            with in_file(self.name, dict):
                return linkage_from(self.tables, Path(self.name).stem)
        except InputError as error:
            remedy = InputError(f"{self.name}: to change it, write it as a linkage file: --to machine.toml")
            raise InputError.joined([*error.faults, remedy]) from error


def imported(source: str, density: str | None = None, scale: str | None = None) -> ImportedLinkage | None:
    """The linkage in a file of another program, an address or an expression; None for a linkage file.

    Parameters
    ----------
    density : mass per length of links without a mass, with its unit
    scale : unit of length of the drawing; without it that of the source, or mm

    Raises
    ------
    InputError
        with a line for each fault of the source, and for each thing that cannot be carried over.
    """
    is_text = pyslvs.begins(source) or source.startswith("j=") or "://" in source
    name = "drawing" if is_text else source
    data = source.encode() if is_text else file_bytes(Path(source), TOML)
    text = data.decode("utf-8-sig", "replace")
    if name.lower().endswith(".linkage2") or text.lstrip().startswith("<"):
        linkage = linkage2.read(data, name)
    elif pyslvs.begins(text) or "?j=" in text or text.startswith("j="):
        linkage = (pyslvs if pyslvs.begins(text) else pmks).read(text, name)
    elif re.match(r"\w+://", text):
        raise InputError(
            f"{name}: is an address without joints; the address of a machine in PMKS+ has ?j= and &l=; a shorter "
            "one of a newer version is not read: write its joints as M[J[R, P[x, y], L[ground, L1]], ...]"
        )
    elif density or scale:
        raise InputError(f"--density, --scale: {source} is a linkage file, and these are for drawings alone")
    else:
        return None
    unit = scale or linkage.unit
    length = option_value("--scale", unit if units.has_unit(unit) else f"1 {unit}", "m", "unit of length")
    per_metre = option_value("--density", density, "kg/m", "mass per length") if density else 0.0
    with in_file(name, dict):
        tables = tables_of(linkage, length, per_metre)
    remarks = [f"read from a drawing of {linkage.program}, with lengths in {unit}", *linkage.remarks]
    if density:
        remarks.append(f"links without a mass in the drawing have {density} between their farthest pins")
    return ImportedLinkage(name, tables, tuple(remarks))
