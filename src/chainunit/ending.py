"""The end of a process or of a result: temporary folders that go with it, also where a signal ends a worker."""

from __future__ import annotations

import atexit
import os
import secrets
import shutil
import signal
import tempfile
import threading
import weakref
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn, TypeVar

_folders: set[str] = set()
"""The temporary folders of this process."""


def temporary_folder(name: str) -> str:
    """A new temporary folder, which only this user reads. It is removed at the end of the process at the latest."""
    folder = str(Path(tempfile.gettempdir()) / f"{name}_{secrets.token_hex(8)}")
    # before the folder exists: a signal may end the process between any two lines
    _folders.add(folder)
    Path(folder).mkdir(0o700)
    return folder


def remove_folder(folder: str) -> None:
    """Remove a temporary folder of this process."""
    shutil.rmtree(folder, ignore_errors=True)
    _folders.discard(folder)


_Result = TypeVar("_Result")


def in_temporary_folder(make: Callable[[Path], _Result]) -> _Result:
    """The result that `make` gives in a new temporary folder, which lasts as long as the result."""
    folder = temporary_folder("chainunit")
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
            shutil.rmtree(_folders.pop(), ignore_errors=True)


def end_at_signals() -> None:
    """Prepare a worker process: it leaves Ctrl-C to the process that started it, and leaves no folder behind after
    SIGTERM. To be called in its main thread."""

    def leave(number: int, frame: Any) -> None:
        # another thread may be inside an FMU, which then cannot be closed
        remove_folders()
        os._exit(128 + number)

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, leave)


def dask_setup(worker: Any) -> None:
    """What a worker of Dask calls when it begins, as this module is preloaded there."""
    end_at_signals()
    leave = os._exit

    def leave_nothing(status: int) -> NoReturn:
        remove_folders()
        leave(status)

    # a thread of Dask ends the worker so, and calls nothing else, where the process that started it is gone
    os._exit = leave_nothing
