"""Conditions on what a file gives: a reader evaluates them, and a JSON Schema prints them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

Schema = dict[str, Any]


class Condition(ABC):
    """A condition on the tables of a file; ``&``, ``|`` and ``~`` join conditions."""

    @abstractmethod
    def holds(self, data: Mapping[str, Any]) -> bool:
        """Whether the file meets it."""

    @abstractmethod
    def schema(self) -> Schema:
        """The JSON Schema (draft 7) that these files meet."""

    def __and__(self, other: Condition) -> Condition:
        return _Joined((self, other), "allOf")

    def __or__(self, other: Condition) -> Condition:
        return _Joined((self, other), "anyOf")

    def __invert__(self) -> Condition:
        return _Not(self)


@dataclass(frozen=True)
class _Joined(Condition):
    parts: tuple[Condition, ...]
    word: str
    """``allOf`` or ``anyOf``"""

    def holds(self, data: Mapping[str, Any]) -> bool:
        results = (part.holds(data) for part in self.parts)
        return all(results) if self.word == "allOf" else any(results)

    def schema(self) -> Schema:
        return {self.word: [part.schema() for part in self.parts]}


@dataclass(frozen=True)
class _Not(Condition):
    of: Condition

    def holds(self, data: Mapping[str, Any]) -> bool:
        return not self.of.holds(data)

    def schema(self) -> Schema:
        return {"not": self.of.schema()}


class _Never(Condition):
    def holds(self, data: Mapping[str, Any]) -> bool:
        return False

    def schema(self) -> Schema:
        return {"not": {}}


NEVER = _Never()
"""No file meets it."""


@dataclass(frozen=True)
class _Value(Condition):
    """Whether a file gives the key `path`, with a value that passes `test`; `form` is the JSON Schema of these."""

    path: str
    test: Callable[[Any], bool]
    form: Schema

    def holds(self, data: Mapping[str, Any]) -> bool:
        value: Any = data
        for name in self.path.split("."):
            if not isinstance(value, Mapping) or name not in value:
                return False
            value = value[name]
        return self.test(value)

    def schema(self) -> Schema:
        form = self.form
        for name in reversed(self.path.split(".")):
            form = {"type": "object", "required": [name]} | ({"properties": {name: form}} if form else {})
        return form


def given(path: str) -> Condition:
    """Whether a file gives a key."""
    return _Value(path, lambda value: True, {})


def is_one_of(path: str, *values: str | bool) -> Condition:
    """Whether a key has one of these values, which are all texts or all true and false."""
    # 1 is no true value in a file
    allowed = {(type(value), value) for value in values}
    return _Value(
        path,
        lambda value: isinstance(value, str | bool) and (type(value), value) in allowed,
        {"enum": [*values]},
    )


def ends_with(path: str, ending: str) -> Condition:
    """Whether the text of a key ends so, in small or capital letters."""
    letters = "".join(
        f"[{letter}{letter.upper()}]" if letter.isalpha() else rf"\{letter}" for letter in ending
    )
    form = {"type": "string", "pattern": f"{letters}$"}
    return _Value(path, lambda value: isinstance(value, str) and value.lower().endswith(ending), form)


def is_empty_table(path: str) -> Condition:
    """Whether a key is a table without a key."""
    return _Value(path, lambda value: value == {}, {"type": "object", "maxProperties": 0})


def has_entries(path: str) -> Condition:
    """Whether a key is a list or a table with entries."""
    form = {"anyOf": [{"type": "array", "minItems": 1}, {"type": "object", "minProperties": 1}]}
    return _Value(path, lambda value: isinstance(value, list | Mapping) and len(value) > 0, form)


def has_entry(path: str, entry: str) -> Condition:
    """Whether a key is a list with this entry."""
    form = {"type": "array", "contains": {"const": entry}}
    return _Value(path, lambda value: isinstance(value, list) and entry in value, form)


def is_above_zero(path: str) -> Condition:
    """Whether a key is a number above zero."""
    form = {"type": "number", "exclusiveMinimum": 0}
    return _Value(path, lambda value: type(value) in (int, float) and value > 0, form)
