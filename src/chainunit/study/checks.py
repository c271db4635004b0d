"""Checks of values of a study file that contradict each other by their sizes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

from ..core.errors import InputError
from ..core.messages import unit_behind
from ..core.quantities import Layout
from .sections import all_sections


@cache
def _order() -> tuple[tuple[str, str, str], ...]:
    """Triples (low, relation, high): the value of `high` has to have this relation to that of `low`."""
    return tuple(
        (f"{table}.{low}", relation, f"{table}.{high}")
        for table, section in all_sections().items()
        for low, relation, high in section.order
    )


def lower_limits() -> dict[str, str]:
    """By the name of an upper limit, that of the lower one."""
    return {high: low for low, _, high in _order()}


def check_order(values: Mapping[str, Any]) -> Iterator[InputError]:
    """Refusals of limits with no value between them."""

    def value(name: str) -> tuple[float, str]:
        section, _, key = name.partition(".")
        x, declaration = getattr(values[section], key), type(values[section])
        unit = next(v.unit for v in Layout(declaration).variables if v.name == key)
        return x, f"{x:g}" + unit_behind(unit)

    for low, relation, high in _order():
        (least, limit), (most, text) = value(low), value(high)
        if most < least or (most == least and relation == ">"):
            yield InputError(f"{high} = {text}: must be {relation} {low}, {limit}", key=high)
