"""Verification: the bytes of a certified file, its evidence by the equations of the package here, and its experiments
again on this machine. The package here sets the limits; a file can only state stricter ones."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ...core.errors import InputError, printable
from ...core.inputs import ARCHIVE, file_bytes, refuse_large_archive, regular_bytes
from . import documents as docs
from .integrity import Finding, Integrity, integrity
from .manifest import sha3

if TYPE_CHECKING:
    from ...core.model import Model
    from .certify import Told

HOLDS, FAILS, OPEN = 0, 1, 3
"""Exit statuses: all holds, a line does not, no line fails but a judgement is left open."""


def verify(
    file: Path,
    key: bytes | None,
    model: Model | None = None,
    *,
    run: bool = True,
    told: Told = print,
) -> list[Finding]:
    """Check a certified file line by line.

    Parameters
    ----------
    key : public key of whom the receiver expects the signature; without one no code of the file runs
    model : of the FMU, where the caller has it; else it is found by its name
    run : whether the experiments run again; this loads the library of the FMU
    told : is called with texts on the work

    Raises
    ------
    InputError
        for a file that is not there, or no archive at all.
    """
    data = file_bytes(file, ARCHIVE)
    refuse_large_archive(data, str(file))
    found = integrity(data, key)
    if not found.is_archive:
        raise InputError(f"{file}: is no FMU and no SSP package: it is not a zip archive")
    _beside(found, file, data)
    unrun = "" if run and key else "as the signer is not named by --key" if run else "as --no-run asks"
    if manifest := found.trusted_manifest():
        # no other file takes the time of this import
        from .judgement import judge

        judge(found, manifest, file.name, model, unrun, told)
    return found.findings


def conclusion(findings: Sequence[Finding]) -> tuple[int, str]:
    """The exit status of a check, and its last words: only what was judged as a whole, by a signer who is named,
    holds."""
    if failed := sum(each.holds is False for each in findings):
        return FAILS, f"does not hold: {failed} of {len(findings)} lines fail"
    if not (left := list(dict.fromkeys(each.open for each in findings if each.open))):
        return HOLDS, "holds"
    unnamed = next((each.open for each in findings if each.topic == "signature" and each.open), None)
    return OPEN, f"intact, {unnamed}" if unnamed else f"holds, but {' and '.join(left)}"


def _beside(found: Integrity, file: Path, data: bytes) -> None:
    """The checksum of the SRMD beside the file, if it is there."""
    text = regular_bytes(file.with_suffix(".srmd"))
    if text is None:
        return
    name = f"{printable(file.with_suffix('.srmd').name)} beside the file"
    try:
        of, checksum = docs.resource_of(text, name)
    except InputError as error:
        found.add(False, "SRMD", str(error))
        return
    if not re.fullmatch("[0-9A-Fa-f]{64}", checksum):
        found.add(False, "SRMD", f"{name}: has no checksum of 256 bits")
    elif checksum.lower() == sha3(data):
        found.add(True, "SRMD", f"{name} has its SHA3-256")
    elif of not in ("", file.name):
        found.add(None, "SRMD", f"{name}: is that of {printable(of)}")
    else:
        found.add(False, "SRMD", f"{name}: is of another file, its SHA3-256 differs")
