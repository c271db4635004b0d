"""The words of a report follow the machine: what the motor turns is a crank, or the machine itself where it has
no other link. Texts are written for a crank; here they get the machine's word."""

from __future__ import annotations

import dataclasses
from typing import Any

from ..text import turning
from .blocks import GivenValue, Section
from .figure import Figure
from .lines import Number, Words

_ADDRESSES = {GivenValue: ("name",), Section: ("name",), Figure: ("name", "file")}
"""Fields that name a place, and are no words."""


def of_machine(node: Any, word: str) -> Any:
    """Blocks, lines and figures with the `word` of the machine; what stands in the result is left as it is there."""
    if word == "crank":
        return node
    if isinstance(node, str):
        return turning(node, word)
    if isinstance(node, tuple):
        return tuple(of_machine(each, word) for each in node)
    if isinstance(node, Number | Words) or not dataclasses.is_dataclass(node) or isinstance(node, type):
        return node
    told = {
        field.name: of_machine(getattr(node, field.name), word)
        for field in dataclasses.fields(node)
        if field.init and field.name not in _ADDRESSES.get(type(node), ())
    }
    return dataclasses.replace(node, **told)
