"""The candidates of sizing as CSV: a row for each, with its share of each limit and the reason of its rank."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from typing import Any

from ...study.stored_result import as_mapping

CANDIDATES = "candidates.csv"
_PARTS = ("value", "limit", "utilisation")


def candidates_csv(candidates: Sequence[Mapping[str, Any]]) -> str:
    """The candidates in the order of their rank. Heads name the unit in brackets; ``peak_torque.utilisation`` is the
    share of its limit that a candidate takes by the check ``peak_torque``. A value that is not known is empty."""
    rows = [_cells(rank, each) for rank, each in enumerate(candidates, 1)]
    heads = dict.fromkeys(head for row in rows for head in row)
    text = io.StringIO()
    writer = csv.writer(text, delimiter=";", lineterminator="\n")
    writer.writerow(heads)
    writer.writerows([row.get(head, "") for head in heads] for row in rows)
    return text.getvalue()


def _cells(rank: int, candidate: Mapping[str, Any]) -> dict[str, str]:
    """The cells of a candidate by their heads."""
    cells = {"rank": str(rank), "motor": _text(candidate, "motor")} | _entry("ratio", candidate.get("ratio"))
    cells |= {name: _text(candidate, name) for name in ("gear", "series", "verdict", "criterion", "reason")}
    for each in candidate.get("parts") or ():
        part = _text(as_mapping(each), "part").replace(" ", "_")
        cells |= {f"{part}.{name}": _text(as_mapping(each), name) for name in ("designation", "order_number")}
        cells |= _entry(f"{part}.price", as_mapping(each).get("price"))
    cells |= _entry("total_price", candidate.get("total_price")) if "total_price" in candidate else {}
    for name, check in as_mapping(candidate.get("checks")).items():
        for part in _PARTS:
            cells |= _entry(f"{name}.{part}", as_mapping(check).get(part))
    for group, prefix in (("numbers", ""), ("flywheel", "flywheel.")):
        for name, entry in as_mapping(candidate.get(group)).items():
            cells |= _entry(f"{prefix}{name}", entry)
    return cells


def _entry(name: str, entry: Any) -> dict[str, str]:
    """The cell of a number, whose head has its unit."""
    unit, value = as_mapping(entry).get("unit", "1"), as_mapping(entry).get("value")
    # every digit: the utilisation here is the number of result.json
    return {name if unit == "1" else f"{name} [{unit}]": "" if value is None else repr(value)}


def _text(candidate: Mapping[str, Any], name: str) -> str:
    value = candidate.get(name)
    return value if isinstance(value, str) else ""
