"""The checks by clause as CSV: a row for each, with value, limit and used share."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from typing import Any

from ...study.stored_result import as_mapping

CHECKS = "checks.csv"
_TEXTS = ("of", "title", "clause", "formula")


def checks_csv(rows: Sequence[Mapping[str, Any]]) -> str:
    """The checks in their order. A value that is not known is empty; ``number`` is the place of the value in
    study.json."""
    text = io.StringIO()
    writer = csv.writer(text, delimiter=";", lineterminator="\n")
    writer.writerow((*_TEXTS, "value", "bound", "limit", "unit", "utilisation", "holds", "number"))
    for row in rows:
        value, limit, used = (as_mapping(row.get(name)) for name in ("value", "limit", "utilisation"))
        writer.writerow(
            (
                *(_text(row.get(name)) for name in _TEXTS),
                _number(value),
                "at least" if row.get("at_least") else "at most",
                _number(limit),
                _text(limit.get("unit")),
                _number(used),
                "yes" if row.get("holds") else "no",
                _text(row.get("number")),
            )
        )
    return text.getvalue()


def _text(value: Any) -> str:
    return value if isinstance(value, str) else ""


def _number(entry: Mapping[str, Any]) -> str:
    """Every digit: the number is the one of result.json."""
    value = entry.get("value")
    return "" if value is None else repr(value)
