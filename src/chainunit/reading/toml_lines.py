"""The lines of the keys in a TOML text, as tomllib gives only the values."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping
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


_SIGNS = re.compile(
    r'"""(?:\\.|[^\\])*?"{3,5}'
    r"|'''.*?'{3,5}"
    r'|"(?:\\.|[^"\\\n])*"'
    r"|'[^'\n]*'|#[^\n]*|[\[\]{}\n]",
    re.DOTALL,
)
"""Texts, comments, brackets and ends of lines of a TOML text."""


def statements(text: str) -> Iterator[Statement]:
    """The statements of a valid TOML text, in the order of the text.

    A statement ends with the line in which its brackets are closed.
    """
    text = text.replace("\r\n", "\n")
    lines = text.split("\n")
    table, numbers = "", dict[str, int]()
    for first, last in _blocks(text):
        data = _loaded("\n".join(lines[first:last]))
        if lines[first].lstrip().startswith("["):
            table = _heading(data, numbers)
            yield Statement(first + 1, last, table)
        elif data:
            yield Statement(first + 1, last, table, tuple(_names(data, f"{table}." if table else "")))


def _blocks(text: str) -> Iterator[tuple[int, int]]:
    """The first line of each statement, counted from 0, and the line after it."""
    depth = first = line = 0
    for sign in (match[0] for match in _SIGNS.finditer(text)):
        line += sign.count("\n")
        depth += (sign in "[{") - (sign in "]}")
        if sign == "\n" and depth <= 0:
            yield first, line
            depth, first = 0, line
    yield first, line + 1


def lines_of(text: str) -> dict[str, int]:
    """The line of each key and table of a TOML text by its full name (``machine.crank.m``, ``event.2.force``); the
    entries of an array of tables count from 1."""
    line_by_key: dict[str, int] = {}
    for statement in statements(text):
        for name in statement.keys or (statement.table,):
            # the line of a table is the line of its first key
            parts = name.split(".")
            for k in range(1, len(parts) + 1):
                line_by_key.setdefault(".".join(parts[:k]), statement.line)
    return line_by_key


def _loaded(statement: str) -> dict[str, Any]:
    """The data in a statement; none if it is no TOML."""
    try:
        return tomllib.loads(statement)
    except ValueError:
        return {}


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
    """The full names of all keys in a table, also of inner ones; entries of lists count from 1."""
    for key, value in data.items():
        yield prefix + key
        if isinstance(value, Mapping):
            yield from _names(value, f"{prefix}{key}.")
        elif isinstance(value, list):
            for k, entry in enumerate(value, 1):
                if isinstance(entry, Mapping):
                    yield f"{prefix}{key}.{k}"
                    yield from _names(entry, f"{prefix}{key}.{k}.")
