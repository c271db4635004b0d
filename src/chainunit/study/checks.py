"""Checks of values of a study file that contradict each other by their sizes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from ..core.errors import InputError
from ..core.messages import unit_behind
from ..core.quantities import Layout

_ORDER = (
    ("sizing.poles_least", ">=", "sizing.poles_most"),
    ("sizing.ambient", ">", "sizing.temperature"),
    ("chain.sweep_lowest", ">", "chain.sweep_highest"),
    ("torsion.slowest", ">", "torsion.fastest"),
    ("torsion.bend_low", ">", "torsion.bend_high"),
)
"""Triples (low, relation, high): the value of `high` has to have this relation to that of `low`."""
LOWER_LIMITS = {high: low for low, _, high in _ORDER}


def check_order(values: Mapping[str, Any]) -> Iterator[InputError]:
    """Refusals of limits with no value between them."""

    def value(name: str) -> tuple[float, str]:
        section, _, key = name.partition(".")
        x, declaration = getattr(values[section], key), type(values[section])
        unit = next(v.unit for v in Layout(declaration).variables if v.name == key)
        return x, f"{x:g}" + unit_behind(unit)

    for low, relation, high in _ORDER:
        (least, limit), (most, text) = value(low), value(high)
        if most < least or (most == least and relation == ">"):
            yield InputError(f"{high} = {text}: must be {relation} {low}, {limit}", key=high)
