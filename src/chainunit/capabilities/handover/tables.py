"""The files of a handover in CSV: the motor's shaft over time, the candidates of sizing, the checks by clause.

Heads name the unit in brackets. A value that is not known is empty."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from ...reading.result_entries import as_mapping
from .studied import ShaftCycle

CANDIDATES, CHECKS = "candidates.csv", "checks.csv"
_FORMULA = re.compile(r"\s*[=+\-@\uff0b\uff0d\uff1d\uff20]")
"""Begin of a cell that a program for tables may take for a formula."""


def cycle_csv(cycle: ShaftCycle) -> str:
    """The motor's shaft, a row for each instant. The load torque acts from outside, positive along a growing angle:
    the negative of the motor's torque. It has the torque that accelerates the machine, whose inertia changes over the
    turn; so a reader must not add an inertia."""
    heads = (
        "Time [s]",
        "AngularPosition [rad]",
        "AngularVelocity [rad/s]",
        "AngularAcceleration [rad/s²]",
        "LoadTorque [Nm]",
    )
    columns = cycle.time, cycle.angle, cycle.speed, cycle.acceleration, -cycle.torque
    return _csv(heads, ([f"{x + 0.0:.9g}" for x in row] for row in zip(*columns, strict=True)))


def candidates_csv(candidates: Sequence[Mapping[str, Any]]) -> str:
    """The candidates in the order of their rank; ``peak_torque.utilisation`` is the share of its limit that a
    candidate takes by the check ``peak_torque``."""
    return _table(_candidate(rank, candidate) for rank, candidate in enumerate(candidates, 1))


def _candidate(rank: int, candidate: Mapping[str, Any]) -> dict[str, str]:
    """The cells of a candidate by their heads."""
    cells = {"rank": str(rank), "motor": text_of(candidate, "motor")}
    cells |= _numbers({"ratio": candidate.get("ratio")})
    cells |= {name: text_of(candidate, name) for name in ("gear", "series", "verdict", "criterion", "reason")}
    for row in map(as_mapping, candidate.get("parts") or ()):
        part = text_of(row, "part").replace(" ", "_")
        cells |= {f"{part}.{name}": text_of(row, name) for name in ("designation", "order_number")}
        cells |= _numbers({f"{part}.price": row.get("price")})
    cells |= _numbers({name: candidate[name] for name in ("total_price",) if name in candidate})
    for name, check in as_mapping(candidate.get("checks")).items():
        shares = {part: as_mapping(check).get(part) for part in ("value", "limit", "utilisation")}
        cells |= _numbers(shares, f"{name}.")
    cells |= _numbers(candidate.get("numbers"))
    return cells | _numbers(candidate.get("flywheel"), "flywheel.")


def _numbers(entries: Any, prefix: str = "") -> dict[str, str]:
    """The cells of numbers, whose heads have their units."""
    units = {name: as_mapping(entry).get("unit", "1") for name, entry in as_mapping(entries).items()}
    return {
        prefix + (name if unit == "1" else f"{name} [{unit}]"): _number(entries[name])
        for name, unit in units.items()
    }


def checks_csv(checks: Sequence[Mapping[str, Any]]) -> str:
    """The checks in their order; ``number`` is the place of the value in study.json."""
    return _table(
        {name: text_of(check, name) for name in ("of", "title", "clause", "formula")}
        | {
            "value": _number(check.get("value")),
            "bound": "at least" if check.get("at_least") else "at most",
            "limit": _number(check.get("limit")),
            "unit": text_of(as_mapping(check.get("limit")), "unit"),
            "utilisation": _number(check.get("utilisation")),
            "holds": "yes" if check.get("holds") else "no",
            "number": text_of(check, "number"),
        }
        for check in checks
    )


def _table(cells: Iterable[dict[str, str]]) -> str:
    """Rows whose cells have heads, not all of them the same ones."""
    rows = list(cells)
    heads = dict.fromkeys(head for row in rows for head in row)
    return _csv(heads, ([row.get(head, "") for head in heads] for row in rows))


def _csv(heads: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """A CSV: the heads, then the rows; separated by ``;``. Before a text that a program for tables would compute,
    as ``=1+1`` of a catalogue, stands an apostrophe; numbers stay numbers."""
    text = io.StringIO()
    writer = csv.writer(text, delimiter=";", lineterminator="\n")
    writer.writerows([map(_cell, heads), *(map(_cell, row) for row in rows)])
    return text.getvalue()


def _cell(text: str) -> str:
    """A text in one line; an apostrophe before one that a program for tables would compute."""
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


def _number(entry: Any) -> str:
    """A number of a result with every digit, as result.json has it."""
    value = as_mapping(entry).get("value")
    return "" if value is None else repr(value)
