"""The checks by clause as CSV: a row for each, with value, limit and used share."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from ...reading.result_entries import as_mapping
from .rows import as_rows, number_of, text_of

CHECKS = "checks.csv"
_TEXTS = ("of", "title", "clause", "formula")


def checks_csv(rows: Sequence[Mapping[str, Any]]) -> str:
    """The checks in their order. A value that is not known is empty; ``number`` is the place of the value in
    study.json."""
    heads = (*_TEXTS, "value", "bound", "limit", "unit", "utilisation", "holds", "number")
    return as_rows(heads, map(_cells, rows))


def _cells(row: Mapping[str, Any]) -> Iterator[str]:
    yield from (text_of(row, name) for name in _TEXTS)
    yield number_of(row.get("value"))
    yield "at least" if row.get("at_least") else "at most"
    yield number_of(row.get("limit"))
    yield text_of(as_mapping(row.get("limit")), "unit")
    yield number_of(row.get("utilisation"))
    yield "yes" if row.get("holds") else "no"
    yield text_of(row, "number")
