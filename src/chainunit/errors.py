"""Errors that speak to an engineer: the quantity, its value, the allowed range, the remedy."""

from __future__ import annotations

import json
import reprlib
import unicodedata
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


class InputError(ValueError):
    """A value of the user is outside its allowed range; the message is one line."""


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
def refusal_prefix(prefix: str) -> Iterator[None]:
    """Put `prefix`, which says where a value stands, before the line of an InputError."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{prefix}{error}") from error


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
