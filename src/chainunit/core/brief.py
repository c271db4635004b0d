"""The short `repr` of objects that hold much data."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Mapping
from enum import Enum
from pathlib import Path
from typing import Any, TypeVar

from .errors import printable

T = TypeVar("T", bound=type)
_MOST, _ENTRIES, _DEPTH, _LETTERS = 1500, 4, 2, 80
"""Largest length of a `repr`, entries that a list or a mapping shows, depth of objects in objects, and letters of a
text."""


def briefly_shown(cls: T) -> T:
    """Give a dataclass a `repr` of one line with its fields; of arrays it has the sizes, and of long lists the first
    entries."""
    cls.__repr__ = brief_repr  # type: ignore[assignment]
    return cls


def brief_repr(instance: Any) -> str:
    """The line for an instance of a dataclass."""
    return printable(_fields(instance, 0), _MOST)


def _fields(instance: Any, depth: int) -> str:
    fields = (f.name for f in dataclasses.fields(instance) if f.repr)
    inside = (f"{name}={_brief(getattr(instance, name), depth + 1)}" for name in fields)
    return f"{type(instance).__qualname__}({', '.join(inside)})"


def _brief(value: Any, depth: int) -> str:
    """The value in a few characters; entries of entries are left out beyond a `depth`."""
    if isinstance(value, str):
        return repr(value if len(value) <= _LETTERS else f"{value[:_LETTERS]}...")
    if isinstance(value, bool | int | float | complex | None):
        return repr(value)
    if isinstance(value, Path | Enum):
        return str(value)
    if shape := getattr(value, "shape", None):
        return f"<{type(value).__name__} of {' x '.join(map(str, shape))}>"
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return _fields(value, depth) if depth < _DEPTH else f"{type(value).__qualname__}(...)"
    if isinstance(value, list | tuple | Mapping):
        if depth > _DEPTH:
            return f"<{len(value)} entries>"
        first = itertools.islice(value.items() if isinstance(value, Mapping) else value, _ENTRIES)
        if isinstance(value, Mapping):
            inside = [f"{_brief(name, depth)}: {_brief(x, depth + 1)}" for name, x in first]
        else:
            inside = [_brief(x, depth + 1) for x in first]
        begin, end = "{}" if isinstance(value, Mapping) else "[]"
        return begin + ", ".join([*inside, *["..."] * (len(value) > _ENTRIES)]) + end
    return f"<{getattr(value, '__qualname__', type(value).__qualname__)}>"
