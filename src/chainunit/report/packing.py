"""Data of a page, packed: as JSON with the differences of series in place of their numbers, gzip, and base64. The
page unpacks it (``packing.js``)."""

from __future__ import annotations

import base64
import gzip
import json
from typing import Any

_SHORTEST = 8
"""Least number of numbers of a series."""
_MOST_DIGITS, _LARGEST = 12, 2**53
"""Most digits behind the point, and largest whole number, with which a page has the same number."""
SERIES = "+"
"""Key of a series: its digits behind the point, and the differences of its numbers as whole numbers of the last
digit, from 0 on."""


def packed_bytes(content: bytes) -> str:
    """Bytes, packed."""
    return base64.b64encode(gzip.compress(content, 6, mtime=0)).decode()


def packed(data: Any) -> str:
    """Data as JSON has it, packed."""
    text = json.dumps(_shortened(data), allow_nan=False, ensure_ascii=False, separators=(",", ":"))
    return packed_bytes(text.encode())


def unpacked(text: str) -> Any:
    """The data of `packed`, as a page reads it."""
    return _restored(json.loads(gzip.decompress(base64.b64decode(text))))


def _shortened(data: Any) -> Any:
    if isinstance(data, dict):
        return {name: _shortened(x) for name, x in data.items()}
    if isinstance(data, list | tuple):
        series = _series(data)
        return [_shortened(x) for x in data] if series is None else {SERIES: series}
    return data


def _series(values: Any) -> list[int] | None:
    """A list of numbers as a series; None where it is none, or would not come back the same."""
    if len(values) < _SHORTEST or any(type(x) not in (int, float) for x in values):
        return None
    digits = max(len(repr(x).partition(".")[2]) if type(x) is float else 0 for x in values)
    if digits > _MOST_DIGITS or any("e" in repr(x) for x in values):
        return None
    whole = [round(x * 10**digits) for x in values]
    if any(abs(n) > _LARGEST or n / 10**digits != x for n, x in zip(whole, values, strict=True)):
        return None
    return [digits, *(n - before for n, before in zip(whole, [0, *whole], strict=False))]


def _restored(data: Any) -> Any:
    if isinstance(data, list):
        return [_restored(x) for x in data]
    if not isinstance(data, dict):
        return data
    if SERIES not in data:
        return {name: _restored(x) for name, x in data.items()}
    digits, *differences = data[SERIES]
    values, whole = [], 0
    for difference in differences:
        whole += difference
        values.append(whole / 10**digits)
    return values
