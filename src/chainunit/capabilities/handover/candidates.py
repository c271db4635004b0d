"""The candidates of sizing as CSV: a row for each, with its share of each limit and the reason of its rank."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ...reading.result_entries import as_mapping
from .rows import as_rows, number_of, text_of

CANDIDATES = "candidates.csv"
_PARTS = ("value", "limit", "utilisation")


def candidates_csv(candidates: Sequence[Mapping[str, Any]]) -> str:
    """The candidates in the order of their rank. Heads name the unit in brackets; ``peak_torque.utilisation`` is the
    share of its limit that a candidate takes by the check ``peak_torque``. A value that is not known is empty."""
    rows = [_cells(rank, candidate) for rank, candidate in enumerate(candidates, 1)]
    heads = dict.fromkeys(head for row in rows for head in row)
    return as_rows(heads, ([row.get(head, "") for head in heads] for row in rows))


def _cells(rank: int, candidate: Mapping[str, Any]) -> dict[str, str]:
    """The cells of a candidate by their heads."""
    cells = {"rank": str(rank), "motor": text_of(candidate, "motor")} | _entry(
        "ratio", candidate.get("ratio")
    )
    cells |= {name: text_of(candidate, name) for name in ("gear", "series", "verdict", "criterion", "reason")}
    for ordered_part in candidate.get("parts") or ():
        part = text_of(as_mapping(ordered_part), "part").replace(" ", "_")
        cells |= {
            f"{part}.{name}": text_of(as_mapping(ordered_part), name)
            for name in ("designation", "order_number")
        }
        cells |= _entry(f"{part}.price", as_mapping(ordered_part).get("price"))
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
    unit = as_mapping(entry).get("unit", "1")
    return {name if unit == "1" else f"{name} [{unit}]": number_of(entry)}
