"""The lines of the keys in a TOML text, as tomllib gives only the values."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Statement:
    """A heading, or a key with its value: a part of a TOML text that is complete by itself."""

    line: int
    """its first line, counted from 1"""
    last: int
    """its last line"""
    table: str
    """the table that contains it, or that it opens; an entry of an array has its number, from 1:
    ``event.2``"""
    keys: tuple[str, ...] = ()
    """full names of all keys that it sets, also in inner tables; empty for a heading"""


def statements(text: str) -> Iterator[Statement]:
    """The statements of a valid TOML text, in the order of the text.

    A statement ends with the first line up to which it is valid TOML by itself.
    """
    lines = text.replace("\r\n", "\n").split("\n")
    table, numbers, first = "", dict[str, int](), 0
    while first < len(lines):
        last = first + 1
        while (data := _loaded(lines, first, last)) is None and last < len(lines):
            last += 1
        opens = lines[first].lstrip().startswith("[")
        if opens:
            table = _heading(data or {}, numbers)
            yield Statement(first + 1, last, table)
        elif data:
            yield Statement(first + 1, last, table, tuple(_names(data, f"{table}." if table else "")))
        first = last


def lines_of(text: str) -> dict[str, int]:
    """The line of each key and table of a TOML text by its full name (``machine.crank.m``, ``event.2.force``); the
    entries of an array of tables count from 1."""
    found: dict[str, int] = {}
    for statement in statements(text):
        for name in statement.keys or (statement.table,):
            # the line of a table is that of its first key
            parts = name.split(".")
            for k in range(1, len(parts) + 1):
                found.setdefault(".".join(parts[:k]), statement.line)
    return found


def _loaded(lines: Sequence[str], first: int, last: int) -> dict[str, Any] | None:
    """The data in these lines; None where the lines are no complete statement."""
    end = lines[last - 1].strip()
    # a list of many lines is parsed only at lines where it may end, not at each line
    if (
        last - first > 1
        and last < len(lines)
        and not end.endswith(("]", "}", '"""', "'''"))
        and "#" not in end
    ):
        return None
    try:
        return tomllib.loads("\n".join(lines[first:last]))
    except tomllib.TOMLDecodeError:
        return None


def _heading(data: Mapping[str, Any], numbers: dict[str, int]) -> str:
    """The name of the table that a heading opens; entries of arrays are counted in `numbers`."""
    parts: list[str] = []
    inner: Any = data
    while isinstance(inner, Mapping) and inner:
        (name, inner), *_ = inner.items()
        parts.append(name)
        path = ".".join(parts)
        if isinstance(inner, list):
            numbers[path] = numbers.get(path, 0) + 1
            inner = inner[0]
        if path in numbers:
            parts.append(str(numbers[path]))
    return ".".join(parts)


def _names(data: Mapping[str, Any], prefix: str) -> Iterator[str]:
    for key, value in data.items():
        yield prefix + key
        if isinstance(value, Mapping):
            yield from _names(value, f"{prefix}{key}.")
        elif isinstance(value, list):
            for k, entry in enumerate(value, 1):
                if isinstance(entry, Mapping):
                    yield f"{prefix}{key}.{k}"
                    yield from _names(entry, f"{prefix}{key}.{k}.")
