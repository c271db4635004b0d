"""Rows of a CSV, and cells of them from a stored result."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Mapping
from typing import Any

from ...reading.result_entries import as_mapping

_FORMULA = re.compile(r"\s*[=+\-@\uff0b\uff0d\uff1d\uff20]")
"""Begin of a cell that a program for tables may take for a formula."""


def as_rows(heads: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """A CSV: the headings, then the rows; separated by ``;``. Before a text that a program for tables would compute,
    as ``=1+1`` of a catalogue, stands an apostrophe; numbers stay numbers."""
    text = io.StringIO()
    writer = csv.writer(text, delimiter=";", lineterminator="\n")
    writer.writerows([map(_cell, heads), *(map(_cell, row) for row in rows)])
    return text.getvalue()


def _cell(text: str) -> str:
    text = re.sub(r"[\t\r\n]+", " ", text)
    if not _FORMULA.match(text):
        return text
    try:
        float(text)
    except ValueError:
        return f"'{text}"
    return text


def text_of(entries: Mapping[str, Any], name: str) -> str:
    """The text of this name; empty where there is none."""
    value = entries.get(name)
    return value if isinstance(value, str) else ""


def number_of(entry: Any) -> str:
    """A number of a result with every digit, as result.json has it; empty where it is not known."""
    value = as_mapping(entry).get("value")
    return "" if value is None else repr(value)
