"""Libraries of FMUs and callbacks of their instances, on fmpy, which is imported only when it is used."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

_working_directory = threading.Lock()
"""Locked while fmpy loads a library: all threads of the process share one working directory."""


@contextmanager
def loading() -> Iterator[None]:
    """Keep the working directory of the process while fmpy loads a library: it changes to the folder of the library,
    and stays there after an error."""
    with _working_directory:
        before = Path.cwd()
        try:
            yield
        finally:
            os.chdir(before)


def fmi2_callbacks(logger: Callable[..., None]) -> Any:
    """The callbacks of an instance of FMI 2.0, which the caller must keep alive as long as the instance; `logger`
    takes environment, name, status, category and message."""
    from fmpy import calloc, fmi2, free

    callbacks = fmi2.fmi2CallbackFunctions()
    callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(logger)
    callbacks.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(calloc)
    callbacks.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(free)
    return callbacks
