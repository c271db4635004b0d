"""Files that appear whole or not at all, temporary folders, and folders that one process at a time writes to."""

from __future__ import annotations

import contextlib
import errno
import hashlib
import re
import secrets
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from .errors import Faults, InputError, WriteError, check_kind, shown
from .inputs import regular_bytes

if TYPE_CHECKING:
    from filelock import FileLock

LOCK = ".chainunit-lock"
"""Name of the file that stands in a folder while a process writes there."""
LIST = ".chainunit-files"
"""Name of the list of the files that the program wrote into a folder."""
written: list[Path] = []
"""The results that this process wrote by `atomic_file`, in order."""
_lists: list[FileList] = []
"""The lists of files of the folders that this process has claimed."""
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EROFS)
_LINE = re.compile(r"[0-9a-f]{64}  \S.*")
_NAME = 66  # place of the name in a line
_PART = re.compile(r".+\.[0-9a-f]{16}\.part")
_FOREIGN = "as chainunit did not write it, or it was changed since; move it, or name another folder"


@contextmanager
def scratch() -> Iterator[Path]:
    """A temporary folder for as long as the context lasts."""
    with tempfile.TemporaryDirectory(prefix="chainunit_", ignore_cleanup_errors=True) as folder:
        yield Path(folder)


@contextmanager
def atomic_file(file: Path, *, is_result: bool = True) -> Iterator[Path]:
    """A temporary path to write to in place of `file`. It is renamed to `file` at the end, and removed after
    an error. A file that is no result, such as a part of a store, is in no list of files.

    Each call has a new temporary name, so that several processes may write the same file. The last one wins.

    Raises
    ------
    InputError
        if `file` is no regular file.
    WriteError
        if it cannot be written, such as on a full disk; an earlier `file` stays as it was.
    """
    if file.exists() and not file.is_file():
        raise InputError(f"{file}: is not a regular file; name another")
    listed = _list_of(file) if is_result else None
    if listed is not None and file.exists() and not listed.has(file):
        raise WriteError(f"{file}: stays as it is, {_FOREIGN}")
    part = file.with_name(f"{file.name}.{secrets.token_hex(8)}.part")
    try:
        with writing(file):
            yield part
            if listed is not None:
                listed.add(file, part)
            part.replace(file)
            if is_result:
                written.append(file)
    finally:
        part.unlink(missing_ok=True)


def named_file(file: str | Path, *endings: str) -> Path:
    """The path of a file that a script names, with one of these endings, such as ".fmu".

    Raises
    ------
    InputError
        for another ending, and for a value that is no path.
    """
    check_kind("file", file, str | Path, "the path of a file")
    if Path(file).suffix.lower() not in endings:
        raise InputError(f"file = {shown(str(file))}: must end in {', '.join(endings)}")
    return Path(file)


def write_file(file: Path, content: str | bytes) -> list[Path]:
    """Write a text, in UTF-8, or bytes into a file, whole or not at all; returns the file. See `atomic_file` for
    errors."""
    with atomic_file(file) as part:
        part.write_bytes(content.encode() if isinstance(content, str) else content)
    return [file]


@contextmanager
def writing(file: Path) -> Iterator[None]:
    """Name `file` in the error of an operating system that cannot write it.

    Raises
    ------
    WriteError
        in place of an OSError.
    """
    try:
        yield
    except OSError as error:
        raise WriteError(f"{file}: cannot be written ({error.strerror or error})") from error


@contextmanager
def netcdf() -> Iterator[None]:
    """Raise an OSError in place of the error of the NetCDF library, which does not say that the disk is full."""
    try:
        yield
    except RuntimeError as error:
        raise OSError(errno.EIO, f"{error}; is the disk full?") from error


def full(error: OSError) -> bool:
    """Whether the disk, and not the name of the file, is the cause of the error."""
    return error.errno in _FULL


def digest(file: Path) -> str:
    """The SHA-256 of a file, in hexadecimal digits."""
    with file.open("rb") as content:
        return hashlib.file_digest(content, "sha256").hexdigest()


def folder(path: Path) -> Path:
    """The folder `path`, which is made if it is missing, and can be written to.

    Raises
    ------
    InputError
        if it cannot be made or written to.
    """
    if path.is_file():
        raise InputError(f"{path}: is a file; must be a folder")
    try:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            return path
    except OSError as error:
        kind = WriteError if full(error) else InputError
        raise kind(f"{path}: cannot be written to ({error.strerror or error})") from error


class FileList:
    """The files that the program wrote into a `folder`, by which it tells them from the files of others.

    A line has the SHA-256 of a file and its name in the folder, as ``sha256sum`` writes and checks it. While a file
    is replaced, it has two lines, as a process that is killed leaves the old or the new file.

    Raises
    ------
    InputError
        if the file of the list has other content.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder.absolute()
        self._file, self._lines = self.folder / LIST, set[str]()
        if self._file.exists() or self._file.is_symlink():
            # a pipe would be waited for, and a link may lead anywhere
            content = None if self._file.is_symlink() else regular_bytes(self._file)
            self._lines.update((content or b"").decode(errors="replace").split("\n"))
            self._lines.discard("")
            if content is None or not all(map(_LINE.fullmatch, self._lines)):
                raise InputError(
                    f"{self._file}: is no list of files of chainunit; move it, or name another folder"
                )

    def _line(self, file: Path, content: Path) -> str:
        return f"{digest(content)}  {file.absolute().relative_to(self.folder).as_posix()}"

    def has(self, file: Path) -> bool:
        """Whether the program wrote this file as it is now."""
        return self._line(file, file) in self._lines

    def add(self, file: Path, content: Path) -> None:
        """Note that `file` is about to get this content; as it is now, it stays in the list until `close`."""
        self._lines.add(self._line(file, content))
        self._write()

    def close(self) -> None:
        """Keep the lines of the files as they are now."""
        files = {self.folder / line[_NAME:] for line in self._lines}
        self._lines &= {self._line(file, file) for file in files if file.is_file()}
        self._write()

    def _write(self) -> None:
        """Write the lines in the order of their names, or take the file away if there are none."""
        if not self._lines:
            self._file.unlink(missing_ok=True)
            return
        with atomic_file(self._file, is_result=False) as part:
            lines = sorted(self._lines, key=lambda line: line[_NAME:])
            part.write_text("".join(f"{line}\n" for line in lines), "utf-8", newline="\n")


def _list_of(file: Path) -> FileList | None:
    """The list of the claimed folder in which a file lies."""
    return next(
        (listing for listing in reversed(_lists) if file.absolute().is_relative_to(listing.folder)), None
    )


def clear(folder: Path, *names: str) -> None:
    """Remove the files of an earlier run; files that no run wrote stay."""
    for stale in (folder / name for name in names if (folder / name).is_file()):
        listed = _list_of(stale)
        if listed is None or listed.has(stale):
            stale.unlink()


@contextmanager
def claim(path: Path, *names: str) -> Iterator[Path]:
    """The `folder` at `path`, for this process alone as long as the context lasts; `names` are the files that are
    going to be written. Parts of files that a killed process left are removed, and after an error also a new folder
    that is empty. A file system without locks gives no protection.

    Raises
    ------
    InputError
        if another process writes there, and with a line for each file that no earlier run wrote and that would be
        lost; see also `folder`.
    """
    from filelock import FileLock

    is_new, is_complete = not path.exists(), False
    lock = FileLock(folder(path) / LOCK)
    try:
        _acquire(lock, path)
        for part in filter(lambda file: _PART.fullmatch(file.name), path.iterdir()):
            part.unlink()
        listed = FileList(path)
        faults = Faults()
        for file in (path / name for name in dict.fromkeys(names)):
            if file.exists() and not (file.is_file() and listed.has(file)):
                faults.add([InputError(f"{file}: would be lost, {_FOREIGN}")])
        faults.refuse()
        _lists.append(listed)
        try:
            yield path
            is_complete = True
        finally:
            _lists.remove(listed)
            with contextlib.suppress(OSError, WriteError):
                listed.close()
    finally:
        if lock.is_locked:
            with contextlib.suppress(OSError):  # on Windows an open file stays until it is closed
                (path / LOCK).unlink()
            lock.release()
        if is_new and not is_complete:
            for place in (*sorted(path.rglob("*"), reverse=True), path):
                with contextlib.suppress(OSError):  # a file, or a folder that holds one
                    place.rmdir()


def _acquire(lock: FileLock, path: Path) -> None:
    """Lock the folder at `path`, or refuse one in which another process writes."""
    from filelock import Timeout

    try:
        lock.acquire(blocking=False)
    except Timeout as error:
        raise InputError(
            f"{path}: another chainunit writes to this folder; wait until it ends, or name another folder with -o"
        ) from error
    except PermissionError:
        raise
    except (OSError, NotImplementedError):  # a file system without locks
        pass
