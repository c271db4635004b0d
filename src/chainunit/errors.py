"""Errors that speak to an engineer: the quantity, its value, the allowed range, the remedy."""

from __future__ import annotations

import difflib
import json
import reprlib
import unicodedata
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any


class InputError(ValueError):
    """A value of the user is outside its allowed range; the message is one line.

    `key` is the full name of the refused value, as its file has it; `faults` are the refusals of which it consists,
    where it stands for several: its message has a line for each.
    """

    def __init__(self, message: str = "", key: str = "", faults: Sequence[InputError] = ()) -> None:
        super().__init__(message)
        self.key = key
        self.faults: tuple[InputError, ...] = tuple(faults) or (self,)

    @classmethod
    def of(cls, faults: Sequence[InputError]) -> InputError:
        """One for several."""
        return faults[0] if len(faults) == 1 else InputError("\n".join(map(str, faults)), faults=faults)


class GeometryError(InputError):
    """The lengths do not make a machine that turns a full crank revolution; `names` are the parameters behind it."""

    names: tuple[str, ...] = ()


class RunError(RuntimeError):
    """A run stopped half-way; `partial` holds the results before that, if there are any."""

    partial: Any = None


class InterruptedRunError(RunError):
    """The run was stopped from outside (Ctrl-C, SIGTERM)."""


class WriteError(RunError):
    """A file could not be written, such as on a full disk; the message names it."""


@contextmanager
def each_refusal(change: Callable[[InputError], InputError]) -> Iterator[None]:
    """Put `change` of it in the place of each refusal of an InputError."""
    try:
        yield
    except InputError as error:
        raise InputError.of([change(fault) for fault in error.faults]) from error


@contextmanager
def refusal_prefix(prefix: str, key: str = "") -> Iterator[None]:
    """Put `prefix`, which says where a value stands, before each line of an InputError; `key` names the value where
    the error does not."""
    with each_refusal(lambda fault: InputError(f"{prefix}{fault}", fault.key or key)):
        yield


class Faults:
    """Refusals that are collected, to be raised together."""

    def __init__(self) -> None:
        self._errors: list[InputError] = []

    @contextmanager
    def collected(self) -> Iterator[None]:
        """Take the InputErrors of the block, and go on behind it."""
        try:
            yield
        except InputError as error:
            self._errors += error.faults

    def add(self, errors: Iterable[InputError]) -> None:
        """Take some more."""
        self._errors += errors

    def refuse(self) -> None:
        """Raise what was collected, if there is anything.

        Raises
        ------
        InputError
            with all of it.
        """
        if self._errors:
            raise InputError.of(self._errors)


def near_name(given: str, known: Iterable[str]) -> str:
    """What to add to a refusal of a name that is near one of the `known`; else empty."""
    names = {name.lower(): name for name in known}
    near = difflib.get_close_matches(given.lower(), names, n=1, cutoff=0.75)
    return f'; was "{names[near[0]]}" meant?' if near else ""


_JOINERS = "\u200c\u200d"  # some scripts and signs need them inside a word


def printable(text: str, most: int = 200) -> str:
    """A text from outside in one line: characters that a terminal or a page would obey (control characters,
    directions of writing) or not show are written as escapes; of more than `most` characters the end is left out."""
    line = "".join(
        x if x.isprintable() or x in _JOINERS or unicodedata.category(x) == "Zs" else _escape(x)
        for x in text[:most]
    )
    return line if len(text) <= most else f"{line}... ({len(text) - most} more characters)"


def _escape(character: str) -> str:
    return character.encode("unicode_escape").decode()


class _Brief(reprlib.Repr):
    """Values of a file as Python writes them, cut in depth and length."""

    def __init__(self) -> None:
        super().__init__()
        self.maxlevel, self.maxstring, self.maxlong, self.maxother = 2, 60, 40, 60


def shown(given: Any) -> str:
    """A value from outside, as a refusal cites it: in one short line, a text in quotation marks."""
    if isinstance(given, list) and len(given) <= 4 and all(isinstance(x, str | int | float) for x in given):
        return f"[{', '.join(map(shown, given))}]"
    if not isinstance(given, str):
        return printable(_Brief().repr(given), 100)
    most = 60
    quoted = printable(json.dumps(given[:most], ensure_ascii=False), 8 * most)
    return quoted if len(given) <= most else f"{quoted}... ({len(given) - most} more characters)"
