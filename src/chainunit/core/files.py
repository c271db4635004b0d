"""Files that appear whole or not at all, and folders that one process at a time writes to."""

from __future__ import annotations

import contextlib
import errno
import os
import re
import secrets
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from .errors import Faults, InputError, WriteError, check_kind, shown
from .inputs import JSON, file_bytes, json_of
from .ledger import Ledger

LOCK = ".chainunit-lock"
"""Name of the file that stands in a folder while a process writes there."""


class ResultKind(NamedTuple):
    """A kind of result: its words, the file that has its numbers, and a key that only this kind has there; without a
    key the name of the file tells the kind."""

    words: str
    file: str = "result.json"
    key: str = ""

    def is_in(self, folder: Path) -> bool:
        """Whether a folder has a result of this kind."""
        if not (folder / self.file).is_file():
            return False
        if not self.key:
            return True
        try:
            result = json_of(file_bytes(folder / self.file, JSON), self.file)
        except InputError:
            return False
        return isinstance(result, dict) and self.key in result


PAGE = "report.html"
written: list[Path] = []
"""The results that this process wrote by `atomic_file`, in order."""
_ledgers: list[Ledger] = []
"""The lists of files of the folders that this process has claimed for a command."""
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EROFS)


@contextmanager
def atomic_file(file: Path, *, is_result: bool = True) -> Iterator[Path]:
    """A temporary path to write to in place of `file`. It is renamed to `file` at the end, and removed after
    an error. A file that is no result, such as a part of a store, is in no list of files.

    Each call has a new temporary name, so that several processes may write the same file. The last one wins.

    Raises
    ------
    InputError
        where `file` is no regular file.
    WriteError
        where it cannot be written, such as on a full disk; an earlier `file` stays as it was.
    """
    if file.exists() and not file.is_file():
        raise InputError(f"{file}: is not a regular file; name another")
    ledger = _ledger_of(file) if is_result else None
    if ledger is not None and file.exists() and not ledger.wrote(file):
        raise WriteError(f"{file}: stays as it is, {_FOREIGN}")
    part = file.with_name(f"{file.name}.{secrets.token_hex(8)}.part")
    try:
        with writing(file):
            yield part
            if ledger is not None:
                ledger.add(file, part)
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
    """Write a text, in UTF-8, or bytes into a file, whole or not at all; returns the file, as a writer of `write_all`
    does. Errors are those of `atomic_file`."""
    with atomic_file(file) as part:
        part.write_bytes(content.encode() if isinstance(content, str) else content)
    return [file]


_FOREIGN = "as chainunit did not write it, or it was changed since; move it, or name another folder"


def _ledger_of(file: Path) -> Ledger | None:
    """The list of the claimed folder in which a file lies."""
    return next((ledger for ledger in reversed(_ledgers) if ledger.has(file)), None)


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
    """Raise an OSError in place of the error of the NetCDF library, which does not say that the disk is
    full."""
    try:
        yield
    except RuntimeError as error:
        raise OSError(errno.EIO, f"{error}; is the disk full?") from error


def write_all(writers: Iterable[Callable[[], list[Path]]]) -> tuple[list[Path], WriteError | None]:
    """Call every writer, also after one that failed. Returns the files that were written, and the first
    `WriteError`, or None."""
    paths: list[Path] = []
    failure = None
    for write in writers:
        try:
            paths += write()
        except WriteError as error:
            failure = failure or error
    return paths, failure


def full(error: OSError) -> bool:
    """Whether the disk, and not the name of the file, is the cause of the error."""
    return error.errno in _FULL


def leftovers(file: Path) -> list[Path]:
    """Temporary files beside `file`, from processes that were killed while they wrote it."""
    name = re.compile(re.escape(file.name) + r"\.[0-9a-f]{16}\.part")
    return [path for path in file.parent.iterdir() if name.fullmatch(path.name)]


def clear(folder: Path, *names: str) -> None:
    """Remove the files of an earlier run; files that no run wrote stay.

    Raises
    ------
    InputError
        where one of the names is no file.
    """
    for stale in (folder / name for name in names):
        if stale.exists() and not stale.is_file():
            raise InputError(f"{stale}: is not a regular file; name another folder")
        ledger = _ledger_of(stale)
        if ledger is None or (stale.exists() and ledger.wrote(stale)):
            stale.unlink(missing_ok=True)
        for part in leftovers(stale):
            part.unlink(missing_ok=True)


def folder(path: Path) -> Path:
    """The folder `path`, which is made if it is missing, and can be written to.

    Raises
    ------
    InputError
        where it cannot be made or written to.
    """
    if path.is_file():
        raise InputError(f"{path}: is a file; must be a folder")
    try:
        path.mkdir(parents=True, exist_ok=True)
        probe = path / f".{secrets.token_hex(8)}.part"
        probe.touch(exist_ok=False)
        probe.unlink()
    except OSError as error:
        kind = WriteError if full(error) else InputError
        raise kind(f"{path}: cannot be written to ({error.strerror or error})") from error
    return path


@contextmanager
def claim(
    path: Path, *names: str, kind: ResultKind | None = None, others: Iterable[ResultKind] = ()
) -> Iterator[Path]:
    """The `folder` at `path`, for this process alone as long as the context lasts; for a result of that `kind` it
    must not have one of the `others`, nor files that no earlier run wrote and that would be written: the numbers, the
    same as text, and the page, and of the further `names`.

    A lock of the operating system on a file guards the folder. The file is removed at the end. The lock ends
    with the process, even if the process is killed. A file system without locks gives no protection. A folder
    that was made here is removed if an error leaves it empty.

    Raises
    ------
    InputError
        where another process writes there, for a result of another kind, and with a line for each file that would be
        lost; see also `folder`.
    """
    if other := next((other for other in others if other.is_in(path)), None):
        raise InputError(f"{path}: has the result of {other.words}, which would be lost; name another folder")
    ours, left_empty = not path.exists(), False
    lock = folder(path) / LOCK
    while True:
        handle = os.open(lock, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            if not take_lock(handle):
                raise InputError(
                    f"{path}: another chainunit writes to this folder; wait until it ends, or name another folder "
                    "with -o"
                )
            # the owner of the lock may have removed its file after it was opened here, before it was locked
            with contextlib.suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(handle), lock.stat()):
                    break
        except BaseException:
            os.close(handle)
            raise
        os.close(handle)
    try:
        with _listed(path, kind.file, names) if kind else contextlib.nullcontext():
            yield path
    except BaseException:
        left_empty = ours
        raise
    finally:
        if sys.platform == "win32":  # an open file cannot be removed there
            os.close(handle)
        # a file with content is no lock file of this package
        with contextlib.suppress(OSError):
            if not lock.stat().st_size:
                lock.unlink()
        if sys.platform != "win32":
            os.close(handle)
        if left_empty:
            _remove_empty(path)


@contextmanager
def _listed(path: Path, numbers: str, names: Sequence[str]) -> Iterator[None]:
    """Keep the list of the files of a claimed folder; `numbers` is the name of the file of the numbers."""
    ledger = Ledger(path)
    _ledgers.append(ledger)
    try:
        faults = Faults()
        for file in dict.fromkeys(
            path / name for name in (PAGE, numbers, numbers.replace(".json", ".md"), *names)
        ):
            if file.is_file() and not ledger.wrote(file):
                faults.add([InputError(f"{file}: would be lost, {_FOREIGN}")])
        faults.refuse()
        yield
    finally:
        _ledgers.remove(ledger)
        with contextlib.suppress(OSError):
            ledger.close()


def _remove_empty(path: Path) -> None:
    """Remove the folder and the folders in it; folders that hold a file stay."""
    for inner in (inner for inner in path.iterdir() if inner.is_dir() and not inner.is_symlink()):
        _remove_empty(inner)
    with contextlib.suppress(OSError):
        path.rmdir()


def take_lock(handle: int, *, without_locks: bool = True) -> bool:
    """Take the lock of an open file; False where another process has it. `without_locks` is the answer of a file
    system that has no locks."""
    try:
        if sys.platform == "win32":
            import msvcrt

            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        return without_locks and error.errno not in (errno.EWOULDBLOCK, errno.EACCES, errno.EDEADLK)
    return True
