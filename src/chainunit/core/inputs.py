"""The reader of all files from outside: what is no regular file, or would fill the memory, is refused before anything
of it is unpacked or read.

A refusal never cites the content of a file that is not of the expected kind.
"""

from __future__ import annotations

import csv
import gzip
import io
import json
import re
import stat
import struct
import zipfile
import zlib
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

from .errors import InputError, printable

if TYPE_CHECKING:
    import xarray as xr

MIB = 2**20
TEXT, TOML, JSON, XML, ARCHIVE = 64 * MIB, MIB, 8 * MIB, 8 * MIB, 128 * MIB
"""Largest files of a kind that are read [B]: the memory that they take is some 5 to 25 times of it. TOML, whose lists
take some 2 s for each MiB, has the least."""
UNPACKED = 256 * MIB
"""Largest sum of the members of an archive, and of the series of a NetCDF file, in memory [B]."""
ON_DISK = 512 * MIB
"""Largest sum of the members of an FMU that is unpacked into a folder [B]."""
ROWS = 1_000_000
"""Most rows of a table."""
_DIRECTORY = 4 * MIB
"""Largest directory of an archive [B]: some 60,000 members."""
_COLUMNS = 1000
_KINDS = (
    (stat.S_ISDIR, "a folder"), (stat.S_ISCHR, "a device"), (stat.S_ISBLK, "a device"), (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISSOCK, "a socket"),
)  # fmt: skip
_OTHER_KINDS = {
    b"PK\x03\x04": "a ZIP archive, such as an FMU, an SSP package or a workbook of a spreadsheet",
    b"\x89HDF": "a NetCDF or HDF5 file, such as result.nc",
    b"CDF": "a NetCDF file",
    b"%PDF": "a PDF file",
    b"\x89PNG": "a picture",
    b"\xff\xd8\xff": "a picture",
    b"\x1f\x8b": "a compressed file",
    b"\x7fELF": "a program",
    b"MZ": "a program",
    b"\xd0\xcf\x11\xe0": "a workbook of a spreadsheet (XLS)",
    b"TDSm": "a TDMS file",
    b"MDF     ": "a measurement data file (MDF)",
    b"MATLAB 5": "a MAT file",
    b"<": "HTML or XML",
}
"""By first bytes, the kinds of files that are no text."""
ARCHIVE_ERRORS = (
    zipfile.BadZipFile, zlib.error, struct.error, NotImplementedError, RuntimeError, EOFError, OSError,
    ValueError, LookupError, OverflowError, MemoryError,
)  # fmt: skip
"""Errors of the library for archives with damage: it has no common one."""


def regular(file: Path) -> Path:
    """A file that is a regular one: no folder, and nothing that makes a reader wait or has no end.

    Raises
    ------
    InputError
        in one line that begins with the name of the file.
    """
    try:
        mode = file.stat().st_mode
    except (OSError, ValueError) as error:
        raise InputError(f"{file}: cannot be read ({getattr(error, 'strerror', None) or error})") from error
    if not stat.S_ISREG(mode):
        kind = next((kind for is_of, kind in _KINDS if is_of(mode)), "no regular file")
        raise InputError(f"{file}: cannot be read (is {kind}); name a file")
    return file


def file_bytes(file: Path, most: int = TEXT) -> bytes:
    """The content of a file of at most so many bytes.

    Raises
    ------
    InputError
        in one line that begins with the name of the file.
    """
    try:
        with regular(file).open("rb") as stream:
            data = stream.read(min(most, file.stat().st_size) + 1)
            # files of the system that state no size
            data += stream.read(most + 1 - len(data)) if len(data) <= most else b""
    except OSError as error:
        raise InputError(f"{file}: cannot be read ({error.strerror or error})") from error
    if len(data) > most:
        raise _too_large(str(file), most)
    return data


class TooLargeError(InputError):
    """A file or its unpacked content is larger than the limit."""


def _too_large(place: str, most: int, subject: str = "") -> InputError:
    return TooLargeError(
        f"{place}: {subject or 'the file'} has more than {most // MIB} MiB, the most that is read"
    )


def regular_bytes(file: Path) -> bytes | None:
    """The content of a file; None if `file_bytes` refuses it."""
    try:
        return file_bytes(file)
    except InputError:
        return None


def file_text(file: Path, most: int = TEXT) -> str:
    """The text of a file in UTF-8, with or without a byte order mark.

    Raises
    ------
    InputError
        in one line that begins with the name of the file.
    """
    data = file_bytes(file, most)
    _refuse_other_kinds(file, data)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
            raise InputError(f"{file}: is not UTF-8 text but UTF-16; save it as UTF-8") from error
        line = 1 + data[: error.start].count(b"\n")
        raise InputError(f"{file}:{line}: is not UTF-8 text; save it as UTF-8", placed=True) from error
    if "\0" in text:
        raise InputError(f"{file}: is not UTF-8 text; save it as UTF-8")
    return text


def _refuse_other_kinds(file: Path, data: bytes) -> None:
    for begin, kind in _OTHER_KINDS.items():
        if data.startswith(begin):
            raise InputError(f"{file}: is {kind}; must be a text file")


def decoded_by_marks(file: Path, data: bytes) -> str:
    """The text in the content of a file of an instrument: in UTF-8 or UTF-16 by its mark, else in UTF-8, else in the
    code page 1252.

    Raises
    ------
    InputError
        in one line that begins with the name of the file.
    """
    _refuse_other_kinds(file, data)
    # a text in UTF-16 without its mark has zeros in place of every other letter
    wide = {b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16"}.get(data[:2])
    for name, zeros in (("utf-16-le", data[1:80:2]), ("utf-16-be", data[0:80:2])):
        wide = wide or (name if len(data) > 80 and not any(zeros) and any(data[:80]) else None)
    for encoding in [wide] if wide else ["utf-8-sig", "cp1252"]:
        try:
            text = data.decode(encoding)
        except UnicodeDecodeError:
            continue
        # Ctrl-Z ends a text of DOS
        text = text.rstrip("\0\x1a")
        # a logger that lost its power leaves lines of zeros
        text = re.sub(r"^\0+$", "", text, flags=re.MULTILINE) if "\0" in text else text
        if not re.search(r"[\0-\x08\x0e-\x1b\x7f]", text):
            return text
        break
    raise InputError(f"{file}: is not UTF-8 text; save it as UTF-8, or export a table as CSV")


def unzipped(file: Path, data: bytes, most: int = TEXT) -> bytes:
    """The content of a file that gzip packed, by its packed `data`.

    Raises
    ------
    InputError
        in one line that begins with the name of the file.
    """
    try:
        with gzip.GzipFile(fileobj=io.BytesIO(data)) as stream:
            content = stream.read(most + 1)
    except (OSError, EOFError, zlib.error) as error:
        raise InputError(f"{file}: cannot be unpacked ({printable(str(error))})") from error
    if len(content) > most:
        raise _too_large(str(file), most, "its content")
    return content


def lines_of_table(file: Path, text: str, most: int = ROWS) -> list[str]:
    """The lines of a table.

    Raises
    ------
    InputError
        in one line, for more than so many lines or too many columns.
    """
    count = sum(map(text.count, "\n\r\v\f\x1c\x1d\x1e\x85\u2028\u2029"))
    if count > 2 * most or (count > most and len(text.splitlines()) > most):
        raise InputError(
            f"{file}: has more than {most} rows, the most that are read; keep a part of them, or every tenth one"
        )
    lines = text.splitlines()
    if any(line.count(mark) > _COLUMNS for line in lines[:1] for mark in ",;\t"):
        raise InputError(f"{file}: has more than {_COLUMNS} columns, the most that are read")
    return lines


def cells_of(file: Path | str, lines: Iterable[str], mark: str) -> list[list[str]]:
    """The cells of lines of CSV.

    Raises
    ------
    InputError
        in one line, for a cell that is too long.
    """
    reader = csv.reader(lines, delimiter=mark)
    try:
        return list(reader)
    except csv.Error as error:
        raise InputError(f"{file}: line {reader.line_num}: no valid CSV ({error})") from error


def json_of(data: bytes, name: str, kind: str = "JSON") -> Any:
    """The data in the content of a file in JSON; `kind` names in words the kind of file that it must be.

    Raises
    ------
    InputError
        in one line that begins with the `name` of the file, also for numbers that JSON does not have.
    """
    if len(data) > JSON:
        raise _too_large(name, JSON)
    try:
        return json.loads(data, parse_constant=_no_number, parse_float=_finite)
    except RecursionError as error:
        raise InputError(f"{name}: is no {kind} (it is nested too deeply)") from error
    except ValueError as error:
        raise InputError(f"{name}: is no {kind} ({printable(str(error))})") from error


def _no_number(constant: str) -> Any:
    raise ValueError(f"{constant} is no number of JSON")


def _finite(text: str) -> float:
    number = float(text)
    if number - number != 0.0:
        raise ValueError("a number is too large")
    return number


def xml_of(data: bytes, name: str) -> ElementTree.Element:
    """The root of a document in XML, without a document type and the entities that it may define.

    Raises
    ------
    InputError
        in one line that begins with the `name` of the document.
    """
    if len(data) > XML:
        raise _too_large(name, XML, "the document")
    try:
        return ElementTree.fromstring(data, ElementTree.XMLParser(target=_TreeWithoutType()))
    except _HasTypeError:
        raise InputError(
            f"{name}: has a document type, by which a text may grow without end; take it out"
        ) from None
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise InputError(f"{name}: is no XML that can be read ({printable(str(error))})") from error


class _HasTypeError(Exception):
    """A document has a document type."""


class _TreeWithoutType(ElementTree.TreeBuilder):
    """The builder of a tree that stops at a document type, before it can define entities."""

    def doctype(self, *_: Any) -> None:
        raise _HasTypeError


def check_archive(source: Path | bytes, name: str, most: int = UNPACKED, kind: str = "zip archive") -> None:
    """Refuse an archive whose members are more than `most` bytes together, by its directory alone: a library that
    unpacks it takes no more of a member than the directory says.

    Raises
    ------
    InputError
        in one line that begins with the `name` of the archive; also if it is none of its `kind`.
    """
    try:
        with source.open("rb") if isinstance(source, Path) else io.BytesIO(source) as stream:
            if _size_of_directory(stream) > _DIRECTORY:
                raise _too_large(name, _DIRECTORY, "its directory")
            with zipfile.ZipFile(stream) as archive:
                infos = archive.infolist()
    except InputError:
        raise
    except ARCHIVE_ERRORS as error:
        raise InputError(f"{name}: is no {kind} ({printable(str(error))})") from error
    if sum(info.file_size for info in infos) > most:
        raise _too_large(name, most, "its content")


def refuse_large_archive(data: bytes, name: str) -> None:
    """Refuse an archive as `check_archive` does, but for its size alone: the caller reports damage.

    Raises
    ------
    TooLargeError
        in one line that begins with the `name` of the archive.
    """
    try:
        check_archive(data, name)
    except TooLargeError:
        raise
    except InputError:
        pass


_END = 22
_END_MARK, _END_64_MARK, _LOCATOR_MARK = b"PK\x05\x06", b"PK\x06\x06", b"PK\x06\x07"


def _size_of_directory(stream: Any) -> int:
    """The size of the directory of an archive by the record at its end [B]; 0 without one."""
    size = stream.seek(0, io.SEEK_END)
    begin = stream.seek(max(0, size - 2**16 - _END - 20))
    tail = stream.read()
    offset = tail.rfind(_END_MARK)
    if offset < 0 or len(tail) < offset + _END:
        return 0
    of_directory = int(struct.unpack_from("<I", tail, offset + 12)[0])
    if offset >= 20 and tail[offset - 20 : offset - 16] == _LOCATOR_MARK:
        (place,) = struct.unpack_from("<Q", tail, offset - 12)
        stream.seek(place if place < begin + offset else 0)
        record = stream.read(56)
        if record.startswith(_END_64_MARK) and len(record) == 56:
            of_directory = max(of_directory % (2**32 - 1), struct.unpack_from("<Q", record, 40)[0])
    return of_directory


def dataset(file: Path, group: str) -> xr.Dataset:
    """The series of a group of a NetCDF file, in memory.

    Raises
    ------
    InputError
        in one line that begins with the name of the file.
    """
    import xarray as xr

    try:
        with xr.open_dataset(regular(file), group=group) as lazy:
            if sum(variable.nbytes for variable in lazy.variables.values()) > UNPACKED:
                raise _too_large(str(file), UNPACKED, "its content")
            return lazy.load()
    except InputError:
        raise
    except Exception as error:  # the library raises errors of its parts
        raise InputError(f"{file}: cannot be read ({printable(str(error))})") from error
