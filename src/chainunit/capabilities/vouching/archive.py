"""Zip archives in which every byte is determined by the members: certified files are written in this form alone.

The entries stand one behind the other from the first byte on, then the directory. The time of each entry is the
earliest of the format, there are no comments and no extra fields. The form is that of PKWARE's APPNOTE 6.3.3 without
encryption, splitting and ZIP64, so that a file has less than 4 GiB.
"""

from __future__ import annotations

import io
import struct
import zipfile
import zlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from ...core.errors import InputError, shown
from ...core.inputs import ARCHIVE_ERRORS, UNPACKED, TooLargeError, refuse_large_archive

LOCAL, CENTRAL, END = b"PK\x03\x04", b"PK\x01\x02", b"PK\x05\x06"
_HEAD = struct.Struct("<4sHHHHHIIIHH")
_RECORD = struct.Struct("<4sHHHHHHIIIHHHHHII")
_END = struct.Struct("<4sHHHHIIH")
_VERSION, _UNIX, _DAY = 20, 3, 0x21  # 2.0, the system of the file modes, 1 January 1980
_UTF8 = 0x800
_MODE = 0o644 << 16
_LIMIT = 2**32 - 1


@dataclass(frozen=True)
class ArchiveEntry:
    """One member in an archive: its name, its `head` and its compressed `data` as they stand in the file."""

    name: str
    head: bytes
    data: bytes

    @property
    def whole(self) -> bytes:
        """All bytes of the entry."""
        return self.head + self.data


def entry(name: str, content: bytes, *, stored: bool = False) -> ArchiveEntry:
    """The entry of a member; `stored` without compression, so that it has one form only."""
    raw = name.encode()
    if stored:
        data = content
    else:
        squeeze = zlib.compressobj(9, zlib.DEFLATED, -15)
        data = squeeze.compress(content) + squeeze.flush()
    return ArchiveEntry(
        name, head(raw, 0 if stored else 8, zlib.crc32(content), len(data), len(content)), data
    )


def head(raw: bytes, method: int, crc: int, packed: int, size: int) -> bytes:
    """The head of an entry: its name in UTF-8, method 0 (stored) or 8 (deflated), checksum, sizes [B]."""
    return _HEAD.pack(LOCAL, _VERSION, _flags(raw), method, 0, _DAY, crc, packed, size, len(raw), 0) + raw


def is_entry(whole: bytes, name: str, content: bytes) -> bool:
    """Whether the bytes of an entry are in the form that `entry` gives a member, by any compression."""
    raw = name.encode()
    packed, method = len(whole) - _HEAD.size - len(raw), int.from_bytes(whole[8:10], "little")
    return packed >= 0 and whole.startswith(head(raw, method, zlib.crc32(content), packed, len(content)))


def _flags(raw: bytes) -> int:
    return 0 if raw.isascii() else _UTF8


def directory(heads: Iterable[tuple[bytes, int]]) -> list[bytes]:
    """The directory behind entries with these heads and places in the file [B]: a record for each, then the end."""
    records = []
    for top, at in heads:
        _, _, flags, method, time, day, crc, packed, size, length, _ = _HEAD.unpack_from(top)
        fixed = (
            CENTRAL,
            _VERSION | _UNIX << 8,
            _VERSION,
            flags,
            method,
            time,
            day,
            crc,
            packed,
            size,
            length,
        )
        records.append(_RECORD.pack(*fixed, 0, 0, 0, 0, _MODE, at) + top[_HEAD.size :])
    return records


def end(records: Sequence[bytes], at: int) -> bytes:
    """The end of an archive whose directory, these `records`, begins at that place [B]."""
    return _END.pack(END, 0, 0, len(records), len(records), sum(map(len, records)), at, 0)


def archive(entries: Sequence[ArchiveEntry]) -> bytes:
    """The whole file.

    Raises
    ------
    InputError
        for more than 65535 members or 4 GiB.
    """
    places, at = [], 0
    for each in entries:
        places.append((each.head, at))
        at += len(each.head) + len(each.data)
    records = directory(places)
    if len(entries) > 0xFFFF or at + sum(map(len, records)) > _LIMIT:
        raise InputError(f"{len(entries)} members in {at} B: must be 65535 in 4 GiB at most")
    return b"".join([*(each.whole for each in entries), *records, end(records, at)])


@dataclass
class ArchiveContents:
    """What an archive holds, as far as it can be read: the members by name, and a sentence for each fault."""

    members: dict[str, bytes] = field(default_factory=dict)
    faults: dict[str, str] = field(default_factory=dict)
    """by the name of a member; by the empty name for the archive"""
    is_archive: bool = True


def contents(data: bytes) -> ArchiveContents:
    """The members of an archive; never an error, whatever the bytes are."""
    found = ArchiveContents()
    try:
        refuse_large_archive(data, "the archive")
        opened = zipfile.ZipFile(io.BytesIO(data))
        listed = opened.infolist()
    except TooLargeError as error:
        found.faults[""] = str(error)
        return found
    except ARCHIVE_ERRORS as error:
        found.is_archive = data.startswith(LOCAL)
        found.faults[""] = (
            f"the directory at the end of the archive cannot be read, it is damaged or cut off ({_words(error)})"
        )
        return found
    for info in listed:
        name = info.filename
        if name in found.members or name in found.faults:
            found.faults[name] = "stands in the archive twice"
            continue
        try:
            with opened.open(info) as stream:
                content = stream.read()
        except ARCHIVE_ERRORS as error:
            found.faults[name] = f"cannot be read ({_words(error)})"
        else:
            found.members[name] = content
    return found


def _words(error: BaseException) -> str:
    return shown(str(error) or type(error).__name__).strip('"')


def head_of(data: bytes, at: int) -> bytes:
    """The head of the entry at a place [B], with its name."""
    fixed = data[at : at + _HEAD.size]
    length = _HEAD.unpack(fixed)[9] if len(fixed) == _HEAD.size else 0
    return fixed + data[at + _HEAD.size : at + _HEAD.size + length]


def content_of(entry: bytes, size: int) -> bytes | None:
    """The content of an entry by its own bytes, `size` + 1 of them at most; None where it cannot be unpacked."""
    if len(entry) < _HEAD.size:
        return None
    _, _, _, method, *_, length, extra = _HEAD.unpack_from(entry)
    data = entry[_HEAD.size + length + extra :]
    if method != 8:
        return data
    squeeze = zlib.decompressobj(-15)
    try:
        return squeeze.decompress(data, min(size, UNPACKED) + 1)
    except zlib.error:
        return None


def unsafe(names: Iterable[str]) -> list[str]:
    """The names that lead out of a folder into which an archive is unpacked, or mean different files to different
    systems."""
    return [
        name
        for name in names
        if not name or name.startswith("/") or "\\" in name or ":" in name or "\0" in name
        or any(part in ("", ".", "..") for part in name.removesuffix("/").split("/"))
    ]  # fmt: skip


def located(data: bytes, name: str) -> tuple[int, int, int] | None:
    """Where a stored member stands: the place of its head, of its content, and of the end of that [B]; by its head,
    or where that is damaged by the directory. None where neither is found."""
    raw = name.encode()
    at = data.rfind(raw) - _HEAD.size
    while at >= 0:
        if data.startswith(LOCAL, at) and (place := _place(data, at, data[at : at + _HEAD.size], raw)):
            return place
        at = data.rfind(raw, 0, at + _HEAD.size) - _HEAD.size
    try:
        info = zipfile.ZipFile(io.BytesIO(data)).getinfo(name)
    except ARCHIVE_ERRORS:
        return None
    begin = info.header_offset + _HEAD.size + len(raw)
    place = info.header_offset, begin, begin + info.file_size
    return place if place[2] <= len(data) else None


def _place(data: bytes, at: int, top: bytes, raw: bytes) -> tuple[int, int, int] | None:
    size, extra = _HEAD.unpack_from(top)[7], _HEAD.unpack_from(top)[10]
    begin = at + _HEAD.size + len(raw)
    return (at, begin, begin + size) if begin + size <= len(data) and not extra else None


def missing_and_added(signed: Iterable[str], there: Mapping[str, object]) -> tuple[list[str], list[str]]:
    """The names that are signed but not there, and those that are there but not signed."""
    names = set(signed)
    return sorted(names - set(there)), sorted(set(there) - names)
