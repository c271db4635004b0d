"""Lines of text with numbers in them. A number has its declared unit and kind and its place in the result;
`chainunit.reading.text` alone decides how a number looks."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TypeAlias


@dataclass(frozen=True)
class Number:
    """A number, or the text `none` where `value` is None. With `as_given` it is shown with all digits of a given
    value, not with the few of a result."""

    value: float | None
    unit: str
    kind: str = ""
    path: str = ""
    as_given: bool = False
    digits: int = 0
    none: str = "-"
    over: bool = False
    """whether the number exceeds its limit"""


class Words(str):
    """A text of the result, at `path`."""

    path: str

    def __new__(cls, text: str, path: str) -> Words:
        """The text with its path."""
        words = super().__new__(cls, text)
        words.path = path
        return words


@dataclass(frozen=True)
class Name:
    """A name as a file has it, such as that of a key: its letters stay as they are."""

    text: str


@dataclass(frozen=True)
class Strong:
    """A line with emphasis."""

    line: Line


@dataclass(frozen=True)
class Aside:
    """A line that adds something to the piece before it, such as an interval."""

    line: Line


Piece: TypeAlias = "str | Number | Name | Strong | Aside"
Line: TypeAlias = "Piece | tuple[Piece, ...]"


def pieces(line: Line) -> tuple[Piece, ...]:
    """The pieces of a line."""
    return line if isinstance(line, tuple) else (line,)


def line(*parts: Line) -> tuple[Piece, ...]:
    """One line from several parts."""
    return tuple(piece for part in parts for piece in pieces(part))


def filled(template: str, *parts: Line) -> tuple[Piece, ...]:
    """One line from a template, with a part in place of each ``{}``."""
    texts = template.split("{}")
    pairs = zip(texts, (*parts, ""), strict=True)
    return tuple(piece for pair in pairs for piece in line(*pair) if piece)


def join(lines: Iterable[Line], between: str = ", ") -> tuple[Piece, ...]:
    """One line from several lines, with `between` between two of them."""
    return line(*(part for entry in lines for part in (between, entry)))[1:]


def capital(text: str) -> str:
    """The text with a capital as its first letter."""
    return text[:1].upper() + text[1:]


def spoken(name: str) -> str:
    """The name of a number in words."""
    return "RMS" if name == "rms" else name.replace("_", " ")
