"""Signals that end the program. Each interrupts the work by a KeyboardInterrupt, is remembered, and is never lost.

Python drops a KeyboardInterrupt that it raises in a destructor or in a callback from C: the work would go on. It is
then raised again. A library may turn it into another error, or take it as a failed attempt: the signal is remembered,
so that the program still ends with its status. After `hold` a signal no longer interrupts: the end of a process has
no place that could take an error.

This module imports little, as a signal that comes before it is in place ends with the words of Python.
"""

from __future__ import annotations

import _thread
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

_NUMBERS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
_PAUSE = 0.01  # s, until a lost interrupt is raised again

_received: list[int] = []
"""The signals since `begin`, in order."""
_before: dict[int, Any] = {}
"""The handlers before `begin`."""
_state: dict[str, Any] = {"held": False, "hook": None}
"""Whether signals no longer interrupt, and the hook for lost errors before `begin`."""


def received() -> int | None:
    """The number of the first signal since `begin`; None without one."""
    return _received[0] if _received else None


def status() -> int:
    """The exit status after the signal that was received; without one, the status of Ctrl-C."""
    return 128 + (received() or signal.SIGINT)


def begin() -> None:
    """Handle the signals from now on. A signal that the parent lets this process ignore (``nohup``, a job in the
    background) stays ignored. To be called in the main thread."""
    _received.clear()
    _state.update(held=False, hook=sys.unraisablehook)
    sys.unraisablehook = _on_lost
    for number in _NUMBERS:
        if signal.getsignal(number) != signal.SIG_IGN:
            _before[number] = signal.signal(number, _on_signal)


def hold() -> None:
    """Let no signal interrupt any more. The first one is only remembered; a further one ends the process at once."""
    _state["held"] = True


@contextmanager
def remembered() -> Iterator[None]:
    """Handle the signals within the context, if this thread may, and nobody does so already."""
    if _before or threading.current_thread() is not threading.main_thread():
        yield
        return
    begin()
    try:
        yield
    finally:
        hold()
        sys.unraisablehook = _state["hook"]
        while _before:
            signal.signal(*_before.popitem())


def _on_signal(number: int, frame: Any) -> None:
    """The handler of the signals."""
    again = number in _received
    _received.append(number)
    if not _state["held"]:
        raise KeyboardInterrupt
    if again:
        os._exit(128 + number)


def _on_lost(lost: Any) -> None:
    """Python's hook for an error that no caller can take."""
    if _received and issubclass(lost.exc_type, KeyboardInterrupt):
        _thread.start_new_thread(_raise_again, (_received[-1],))
    else:
        _state["hook"](lost)


def _raise_again(number: int) -> None:
    """Send this process the signal once more, after a pause."""
    time.sleep(_PAUSE)
    if _state["held"]:
        return
    if hasattr(signal, "pthread_kill"):
        # a real signal ends a call of the system, such as a sleep or a read, too
        signal.pthread_kill(threading.main_thread().ident or 0, number)
    else:
        _thread.interrupt_main(signal.Signals(number))


@contextmanager
def stoppable() -> Iterator[Callable[[], bool]]:
    """Hold a KeyboardInterrupt back, since it would be a fatal error inside an FMU, and give a function that tells,
    between steps, whether one came. It may come from Ctrl-C, or from a handler of SIGTERM that raises it. An
    interrupt after the last call of the function is raised at the end of the context."""
    interrupts: list[KeyboardInterrupt] = []
    reports: list[bool] = []
    if threading.current_thread() is not threading.main_thread():
        yield lambda: False
        return

    def later(number: int, frame: Any) -> None:
        try:
            previous[number](number, frame)
        except KeyboardInterrupt as error:
            interrupts.append(error)

    def stopped() -> bool:
        reports.extend([True] * len(interrupts))
        return bool(reports)

    previous: dict[int, Any] = {n: handler for n in _NUMBERS if callable(handler := signal.getsignal(n))}
    for number in previous:
        signal.signal(number, later)
    try:
        yield stopped
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)
        if interrupts and not reports:
            raise interrupts[0]
