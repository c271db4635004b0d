"""Conditions on what a file gives: a reader evaluates them, and a JSON Schema prints them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

Schema = dict[str, Any]


@dataclass(frozen=True)
class Condition:
    """A condition on the tables of a file; ``&``, ``|`` and ``~`` join conditions."""

    holds: Callable[[Mapping[str, Any]], bool]
    """whether a file with these tables meets it"""
    schema: Callable[[], Schema]
    """the JSON Schema (draft 7) that these files meet"""

    def __and__(self, other: Condition) -> Condition:
        return Condition(
            lambda data: self.holds(data) and other.holds(data),
            lambda: {"allOf": [self.schema(), other.schema()]},
        )

    def __or__(self, other: Condition) -> Condition:
        return Condition(
            lambda data: self.holds(data) or other.holds(data),
            lambda: {"anyOf": [self.schema(), other.schema()]},
        )

    def __invert__(self) -> Condition:
        return Condition(lambda data: not self.holds(data), lambda: {"not": self.schema()})


NEVER = Condition(lambda data: False, lambda: {"not": {}})
"""No file meets it."""


def _value(path: str, test: Callable[[Any], bool], form: Schema) -> Condition:
    """Whether a file gives the key `path`, with a value that passes `test`; `form` is the JSON Schema of these."""
    names = path.split(".")

    def holds(data: Mapping[str, Any]) -> bool:
        """Whether a file fulfils the condition."""
        value: Any = data
        for name in names:
            if not isinstance(value, Mapping) or name not in value:
                return False
            value = value[name]
        return test(value)

    def schema() -> Schema:
        """The condition in JSON Schema: each table of the path is required."""
        whole = form
        for name in reversed(names):
            whole = {"type": "object", "required": [name]} | ({"properties": {name: whole}} if whole else {})
        return whole

    return Condition(holds, schema)


def given(path: str) -> Condition:
    """Whether a file gives a key."""
    return _value(path, lambda value: True, {})


def is_one_of(path: str, *values: str | bool) -> Condition:
    """Whether a key has one of these values, which are all texts or all true and false."""
    # 1 is no true value in a file
    allowed = {(type(value), value) for value in values}
    return _value(
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
    return _value(path, lambda value: isinstance(value, str) and value.lower().endswith(ending), form)


def is_empty_table(path: str) -> Condition:
    """Whether a key is a table without a key."""
    return _value(path, lambda value: value == {}, {"type": "object", "maxProperties": 0})


def has_entries(path: str) -> Condition:
    """Whether a key is a list or a table with entries."""
    form = {"anyOf": [{"type": "array", "minItems": 1}, {"type": "object", "minProperties": 1}]}
    return _value(path, lambda value: isinstance(value, list | Mapping) and len(value) > 0, form)


def has_entry(path: str, entry: str) -> Condition:
    """Whether a key is a list with this entry."""
    form = {"type": "array", "contains": {"const": entry}}
    return _value(path, lambda value: isinstance(value, list) and entry in value, form)


def is_above_zero(path: str) -> Condition:
    """Whether a key is a number above zero."""
    form = {"type": "number", "exclusiveMinimum": 0}
    return _value(path, lambda value: type(value) in (int, float) and value > 0, form)
