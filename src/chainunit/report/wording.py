"""Adapts the words of a report to the machine. All texts are written for a machine with a crank; where the machine
has none, its own word replaces "crank"."""

from __future__ import annotations

import dataclasses
from typing import Any

from ..reading.text import turning
from .blocks import GivenValue, Section
from .figure import Figure
from .lines import Number, Words

_ADDRESSES = {GivenValue: ("name",), Section: ("name",), Figure: ("name", "file")}
"""Fields that hold an address, not words."""


def of_machine(node: Any, word: str) -> Any:
    """Blocks, lines and figures with the `word` of the machine in place of "crank"; texts of the result stay."""
    if word == "crank":
        return node
    if isinstance(node, str):
        return turning(node, word)
    if isinstance(node, tuple):
        return tuple(of_machine(each, word) for each in node)
    if isinstance(node, Number | Words) or not dataclasses.is_dataclass(node) or isinstance(node, type):
        return node
    changes = {
        field.name: of_machine(getattr(node, field.name), word)
        for field in dataclasses.fields(node)
        if field.init and field.name not in _ADDRESSES.get(type(node), ())
    }
    return dataclasses.replace(node, **changes)
