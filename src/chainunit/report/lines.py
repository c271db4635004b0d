"""Lines of text with numbers in them. A number carries its declared unit and kind and its place in the result; how it
looks is decided in one place (`chainunit.text`)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TypeAlias


@dataclass(frozen=True)
class Number:
    """A number, or `none` in its place; `given` shows it as it was given, not with the digits of a result."""

    value: float | None
    unit: str
    kind: str = ""
    path: str = ""
    given: bool = False
    digits: int = 0
    none: str = "-"
    over: bool = False
    """whether it passes its limit"""


@dataclass(frozen=True)
class Words:
    """Words that stand in the result at `path`."""

    text: str
    path: str


@dataclass(frozen=True)
class Strong:
    """A line that is to be seen first."""

    line: Line


@dataclass(frozen=True)
class Aside:
    """A line that says more about the one before it, such as an interval."""

    line: Line


Piece: TypeAlias = "str | Number | Words | Strong | Aside"
Line: TypeAlias = "Piece | tuple[Piece, ...]"


def pieces(line: Line) -> tuple[Piece, ...]:
    """The pieces of a line."""
    return line if isinstance(line, tuple) else (line,)


def line(*parts: Line) -> tuple[Piece, ...]:
    """One line from several."""
    return tuple(piece for part in parts for piece in pieces(part))


def joined(lines: Iterable[Line], between: str = ", ") -> tuple[Piece, ...]:
    """One line from several, with `between` them."""
    return line(*(part for each in lines for part in (between, each)))[1:]


def capital(text: str) -> str:
    """The text with a capital at its begin."""
    return text[:1].upper() + text[1:]


def spoken(name: str) -> str:
    """The name of a number in words."""
    return "RMS" if name == "rms" else name.replace("_", " ")
