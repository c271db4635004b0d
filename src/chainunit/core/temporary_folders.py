"""The end of a process or of a result: temporary folders that go with it, also where a signal ends a worker.

A process that is killed leaves its folders behind. The next process that makes one removes them: each folder has a
file that is locked as long as its process lives.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import re
import secrets
import shutil
import signal
import tempfile
import threading
import time
import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

from .files import take_lock

_ALIVE = ".chainunit-alive"
"""Name of the file in a temporary folder that its process keeps locked."""
_NAME = re.compile(r"chainunit(_[a-z]+)?_[0-9a-f]{16}")
_NEW = f"{_ALIVE}.new"
_YOUNG = 600.0  # s, age below which a folder without a lock may be that of a process that is about to lock it

_folders: dict[str, int | None] = {}
"""The temporary folders of this process, each with the handle of its locked file once it is locked."""
_cleaned: set[str] = set()
"""The folders for temporary files from which those of killed processes are removed."""


def temporary_folder(name: str = "chainunit") -> str:
    """A new temporary folder, which only this user reads. It is removed at the end of the process at the latest."""
    parent = tempfile.gettempdir()
    if parent not in _cleaned:
        _cleaned.add(parent)
        _remove_abandoned(Path(parent))
    folder = str(Path(parent) / f"{name}_{secrets.token_hex(8)}")
    # before the folder exists: a signal may end the process between any two lines
    _folders[folder] = None
    Path(folder).mkdir(0o700)
    # the file has its name once it is locked: without the lock another process would take it for that of a dead one
    # (on Windows an open file keeps its name)
    new = Path(folder, _ALIVE if os.name == "nt" else _NEW)
    _folders[folder] = handle = os.open(new, os.O_RDWR | os.O_CREAT, 0o600)
    take_lock(handle)
    new.replace(Path(folder, _ALIVE))
    return folder


def remove_folder(folder: str) -> None:
    """Remove a temporary folder of this process."""
    handle, _folders[folder] = _folders.get(folder), None
    _close(handle)
    shutil.rmtree(folder, ignore_errors=True)
    _folders.pop(folder, None)


@contextmanager
def scratch() -> Iterator[Path]:
    """A temporary folder for as long as the context lasts."""
    folder = temporary_folder()
    try:
        yield Path(folder)
    finally:
        remove_folder(folder)


def _close(handle: int | None) -> None:
    if handle is not None:
        with contextlib.suppress(OSError):
            os.close(handle)


def _remove_abandoned(parent: Path) -> None:
    """Remove the temporary folders of this user whose processes were killed."""
    with contextlib.suppress(OSError), os.scandir(parent) as entries:
        found = [Path(each.path) for each in entries if _NAME.fullmatch(each.name)]
    for folder in found:
        with contextlib.suppress(OSError):
            if _is_abandoned(folder):
                shutil.rmtree(folder, ignore_errors=True)


def _is_abandoned(folder: Path) -> bool:
    about = folder.lstat()
    if (hasattr(os, "getuid") and about.st_uid != os.getuid()) or not folder.is_dir() or folder.is_symlink():
        return False
    try:
        handle = os.open(folder / _ALIVE, os.O_RDWR)
    except FileNotFoundError:
        # a process was killed between two lines; a folder with content and without a lock is of somebody else
        return time.time() - about.st_mtime > _YOUNG and {each.name for each in folder.iterdir()} <= {_NEW}
    try:
        return take_lock(handle, without_locks=False)
    finally:
        os.close(handle)


_Result = TypeVar("_Result")


def in_temporary_folder(make: Callable[[Path], _Result]) -> _Result:
    """The result that `make` gives in a new temporary folder, which lasts as long as the result."""
    folder = temporary_folder()
    try:
        result = make(Path(folder))
    except BaseException:
        remove_folder(folder)
        raise
    weakref.finalize(result, remove_folder, folder)
    return result


_removing = threading.RLock()
"""Held while all folders are removed: no other thread ends the process in the middle. A signal may come then, too."""


@atexit.register
def remove_folders() -> None:
    """Remove all temporary folders of this process."""
    with _removing:
        while _folders:
            folder, handle = _folders.popitem()
            _close(handle)
            shutil.rmtree(folder, ignore_errors=True)


def end_at_signals() -> None:
    """Prepare a worker process: it leaves Ctrl-C to the process that started it, and leaves no folder behind after
    SIGTERM. To be called in its main thread."""

    def leave(number: int, frame: Any) -> None:
        # another thread may be inside an FMU, which then cannot be closed
        remove_folders()
        os._exit(128 + number)

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, leave)
