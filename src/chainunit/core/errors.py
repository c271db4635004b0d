"""Errors for an engineer: they name the quantity, its value, the allowed range and the remedy."""

from __future__ import annotations

import difflib
import itertools
import json
import re
import traceback
import unicodedata
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import date, time
from pathlib import Path
from typing import Any

_LINES = 8
"""Largest number of lines of a message in a notebook."""


class ShortTraceback(BaseException):
    """An error that a notebook shows by the line of the user, its class and its message, without the frames of this
    package."""

    def _render_traceback_(self) -> list[str]:
        """The lines that IPython shows."""
        frames = traceback.extract_tb(self.__traceback__)
        package = str(Path(__file__).parents[1])
        inside = next(
            (k for k, frame in enumerate(frames) if frame.filename.startswith(package)), len(frames)
        )
        place = [f"line {frame.lineno}: {frame.line}" for frame in frames[:inside][-1:] if frame.line]
        lines = str(self).splitlines() or [""]
        more = [f"... and {len(lines) - _LINES} more"] if len(lines) > _LINES else []
        head = f"{type(self).__name__}: "
        return [*place, head + lines[0], *lines[1:_LINES], *more]


class InputError(ShortTraceback, ValueError):
    """A value of the user is outside its allowed range; the message is one line.

    `key` is the full name of the refused value in its file. An error that stands for several refusals has
    these as `faults`, and a line of its message for each. The message of an error that is `placed` begins
    with the file and the line of the fault. `line` is the line of a fault that has no key, else 0.
    """

    def __init__(
        self,
        message: str = "",
        key: str = "",
        faults: Sequence[InputError] = (),
        *,
        line: int = 0,
        placed: bool = False,
    ) -> None:
        super().__init__(message)
        self.key = key
        self.line = line
        self.placed = placed
        self.faults: tuple[InputError, ...] = tuple(faults) or (self,)

    @classmethod
    def joined(cls, faults: Sequence[InputError]) -> InputError:
        """One error that stands for several; equal ones stand once."""
        faults = list({(fault.key, str(fault)): fault for fault in faults}.values())
        return faults[0] if len(faults) == 1 else InputError("\n".join(map(str, faults)), faults=faults)


class RemarkWarning(UserWarning):
    """A remark for the user beside a result."""


class GeometryError(InputError):
    """With these lengths the crank cannot make a full turn; `names` are the parameters that cause it."""

    names: tuple[str, ...] = ()


class UnknownNameError(InputError, KeyError):
    """A name that is not declared."""

    __str__ = BaseException.__str__


class RunError(ShortTraceback, RuntimeError):
    """A run stopped early; `partial` holds the earlier results, if there are any."""

    partial: Any = None


class InterruptedRunError(RunError):
    """The run was stopped from outside (Ctrl-C, SIGTERM)."""


class WriteError(RunError):
    """A file could not be written, such as on a full disk; the message names the file."""


@contextmanager
def each_refusal(change: Callable[[InputError], InputError]) -> Iterator[None]:
    """Replace each refusal of an InputError that is not yet `placed` by the result of `change`."""
    try:
        yield
    except InputError as error:
        changed = [fault if fault.placed else change(fault) for fault in error.faults]
        raise InputError.joined(changed) from error


@contextmanager
def refusal_prefix(prefix: str, key: str = "") -> Iterator[None]:
    """Put `prefix`, which names the place of a value, before each line of an InputError; `key` names the
    value if the error does not."""
    with each_refusal(lambda fault: InputError(f"{prefix}{fault}", fault.key or key, line=fault.line)):
        yield


class Faults:
    """A collection of refusals that are raised together."""

    def __init__(self) -> None:
        self.errors: list[InputError] = []
        self._places: set[int] = set()

    @contextmanager
    def collected(self) -> Iterator[None]:
        """Add the InputErrors of a block that are not yet collected, and go on after the block."""
        try:
            yield
        except InputError as error:
            self.add(fault for fault in error.faults if id(fault) not in self._places)

    def add(self, errors: Iterable[InputError]) -> None:
        """Add some errors."""
        for error in errors:
            self.errors.append(error)
            self._places.add(id(error))

    def refuse(self) -> None:
        """Raise the refusals, if there are any.

        Raises
        ------
        InputError
            with all refusals.
        """
        if self.errors:
            raise InputError.joined(self.errors)


def check_kind(name: str, value: Any, kind: Any, description: str = "") -> None:
    """Refuse a `value` of a script that is not of its kind; `description` says what it must be.

    Raises
    ------
    InputError
        in one line.
    """
    if not isinstance(value, kind):
        raise InputError(f"{name} = {shown(value)}: must be {description or kind.__qualname__}", name)


def check_choice(name: str, value: Any, allowed: Collection[str]) -> None:
    """Refuse a `value` of a script that is none of the `allowed` texts.

    Raises
    ------
    InputError
        in one line.
    """
    if not isinstance(value, str) or value not in allowed:
        raise InputError(f"{name} = {shown(value)}: must be {one_of(value, allowed)}", name)


def texts_in(name: str, value: Any) -> tuple[str, ...]:
    """The texts of an argument of a script that is a sequence of them; one text alone is a sequence of one.

    Raises
    ------
    InputError
        in one line.
    """
    try:
        listed = (value,) if isinstance(value, str) else tuple(value)
    except TypeError:  # also of an array without a dimension
        listed = (value,)
    for text in listed:
        check_kind(name, text, str, "a text, or a list of texts")
    return listed


def near_name(text: str, allowed: Iterable[str]) -> str:
    """The question whether one of the `allowed` names was meant, to follow the refusal of a `text`: a name that is
    similar or begins with it, or one of its words; empty if there is none."""
    names = {name.lower(): name for name in allowed}
    near = difflib.get_close_matches(text.lower(), names, n=1, cutoff=0.75)
    near = near or [name for name in names if name.startswith(f"{text.lower()}_")]
    near = near or [word for word in text.lower().split() if word in names and " " in text]
    return f'; was "{names[near[0]]}" meant?' if near else ""


def meant(text: str, allowed: Iterable[str]) -> str:
    """The end of a refusal that goes on after it: the question of `near_name`, or a semicolon."""
    return near_name(text, allowed) or ";"


def one_of(value: object, allowed: Collection[str]) -> str:
    """All allowed names in a refusal, and the question of `near_name`."""
    return f"one of {', '.join(allowed)}{near_name(str(value), allowed)}"


_JOINERS = "\u200c\u200d"  # some scripts and signs need these characters inside a word


def printable(text: str, most: int = 200) -> str:
    """A text from outside in one line. Characters that control a terminal or a page (control characters,
    directions of writing), and invisible ones, are written as escapes. Beyond `most` characters the end is
    left out."""
    line = "".join(
        x
        if x.isprintable() or x in _JOINERS or unicodedata.category(x) == "Zs"
        else x.encode("unicode_escape").decode()
        for x in text[:most]
    )
    return line if len(text) <= most else f"{line}... ({len(text) - most} more characters)"


_LETTERS, _ENTRIES, _DEPTH = 60, 4, 2
"""Largest numbers that `shown` writes out: letters of a text, entries of a list or a table, and nested
tables."""


def shown(value: Any, depth: int = 0) -> str:
    """A value from outside for citation in a refusal: in one short line, as TOML writes it."""
    if isinstance(value, str):
        quoted = printable(json.dumps(value[:_LETTERS], ensure_ascii=False), 8 * _LETTERS)
        rest = len(value) - _LETTERS
        return quoted if rest <= 0 else f"{quoted}... ({rest} more characters)"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Mapping | list | tuple) and value and depth > _DEPTH:
        # before anything inside is written out: it may be nested without end
        return "{ ... }" if isinstance(value, Mapping) else "[...]"
    if isinstance(value, Mapping):
        entries = [f"{_bare(str(name))} = {shown(x, depth + 1)}" for name, x in _first(value.items())]
        return _bracketed("{ ", entries, len(value), " }")
    if isinstance(value, list | tuple):
        return _bracketed("[", [shown(x, depth + 1) for x in _first(value)], len(value), "]")
    if hasattr(value, "magnitude"):  # of a library such as pint
        return shown(str(value))
    if hasattr(value, "tolist"):  # of numpy
        plain = value.tolist()
        # a number of numpy that Python lacks stays as it is
        return printable(str(plain)) if type(plain) is type(value) else shown(plain, depth)
    if isinstance(value, date | time):
        return value.isoformat()
    return printable(_brief(value), 100)


def _first(entries: Iterable[Any]) -> Iterator[Any]:
    return itertools.islice(entries, _ENTRIES)


def _bracketed(begin: str, entries: Sequence[str], number: int, end: str) -> str:
    """The text of a list or a table of `number` entries, of which the first are written out."""
    if not number:
        return begin.strip() + end.strip()
    more = ["..."] if number > len(entries) else []
    return begin + ", ".join([*entries, *more]) + end


def _bare(name: str) -> str:
    """A key as TOML writes it."""
    return name if re.fullmatch(r"[A-Za-z0-9_-]{1,60}", name) else shown(name)


def _brief(value: Any) -> str:
    """The shortened text of a number, or of a value that no file can have."""
    try:
        text = repr(value)
    except ValueError:  # Python writes no integer of more than 4300 digits
        return f"a number of about {round(0.30103 * int(value).bit_length())} digits"
    return text if len(text) <= _LETTERS else f"{text[:20]}...{text[-10:]}"
