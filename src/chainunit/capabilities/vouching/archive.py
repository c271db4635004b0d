"""Certified files: zip archives that end with a signature of all bytes before it.

The signature is in the comment of the archive, with which the file ends. Readers of zip archives pass over it; a
program that packs the members anew loses it.
"""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Mapping
from typing import TYPE_CHECKING

from ...core.errors import InputError, printable
from ...core.inputs import ARCHIVE_ERRORS, refuse_large_archive
from ...fmu.pack import pack

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

LOCAL = b"PK\x03\x04"
"""Begin of an archive."""
MARK = b"chainunit vouching 2, Ed25519: "
"""Begin of the comment; its number changes if an earlier `verify` would misread the file."""
_DIGITS = 192
"""Hexadecimal digits at the end of the file: 64 of the public key, 128 of the signature of the bytes before them."""


def contents(data: bytes, name: str) -> dict[str, bytes]:
    """The members of an archive; `name` is its file, for errors.

    Raises
    ------
    InputError
        in one line for each fault of the archive or a member; a TooLargeError if it has more than is read.
    """
    refuse_large_archive(data, name)
    try:
        archive = zipfile.ZipFile(io.BytesIO(data))
    except ARCHIVE_ERRORS as error:
        reason = "the directory at the end of the archive cannot be read, it is damaged or cut off"
        raise InputError(f"{name}: {reason} ({printable(str(error))})") from error
    members: dict[str, bytes] = {}
    faults = []
    for info in archive.infolist():
        place = f"{name}: {printable(info.filename)}"
        if info.filename in members or _is_unsafe(info.filename):
            fault = "stands in the archive twice" if info.filename in members else "leads out of its folder"
            faults.append(InputError(f"{place}: {fault}"))
            continue
        try:
            with archive.open(info) as stream:
                members[info.filename] = stream.read()
        except ARCHIVE_ERRORS as error:
            faults.append(InputError(f"{place}: cannot be read ({printable(str(error))})"))
    if faults:
        raise InputError.joined(faults)
    return members


def archives_in(members: Mapping[str, bytes]) -> list[str]:
    """The names of the FMUs and other archives among the members."""
    return sorted(name for name, data in members.items() if name.endswith(".fmu") or data.startswith(LOCAL))


def _is_unsafe(name: str) -> bool:
    """Whether a name leads out of a folder into which an archive is unpacked, or means different files to different
    systems."""
    parts = name.removesuffix("/").split("/")
    return not {"", ".", ".."}.isdisjoint(parts) or not {"\\", ":", "\0"}.isdisjoint(name)


def signed(members: Mapping[str, bytes], key: Ed25519PrivateKey) -> bytes:
    """The certified file with these members; the same arguments give the same bytes."""
    stream = io.BytesIO()
    pack(members, stream, MARK + b"0" * _DIGITS)
    data = stream.getvalue()[:-_DIGITS]
    return data + (key.public_key().public_bytes_raw() + key.sign(data)).hex().encode()


def signature_of(data: bytes) -> tuple[bytes, bytes, bytes] | None:
    """The bytes of a certified file that are signed, the public key and the signature; None if there is none."""
    message, digits = data[:-_DIGITS], data[-_DIGITS:]
    if not message.endswith(MARK) or not re.fullmatch(rb"[0-9a-f]{%d}" % _DIGITS, digits):
        return None
    numbers = bytes.fromhex(digits.decode())
    return message, numbers[:32], numbers[32:]
