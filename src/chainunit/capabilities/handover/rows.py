"""Rows of a CSV, and cells of them from a stored result."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping
from typing import Any

from ...study.stored_result import as_mapping


def as_rows(heads: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """A CSV: the headings, then the rows; separated by ``;``."""
    text = io.StringIO()
    writer = csv.writer(text, delimiter=";", lineterminator="\n")
    writer.writerow(heads)
    writer.writerows(rows)
    return text.getvalue()


def text_of(entries: Mapping[str, Any], name: str) -> str:
    """The text of this name; empty where there is none."""
    value = entries.get(name)
    return value if isinstance(value, str) else ""


def number_of(entry: Any) -> str:
    """A number of a result with every digit, as result.json has it; empty where it is not known."""
    value = as_mapping(entry).get("value")
    return "" if value is None else repr(value)
