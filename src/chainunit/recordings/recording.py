"""A recording: columns over time from a CSV file, with names and units in its header."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import Faults, InputError, meant, near_name, printable
from ..core.inputs import decoded, file_bytes, lines_of_table, unzipped
from ..core.units import must_be, of_other_kind, scale
from .measurands import MEASURANDS, SIGNALS, Measurand

FEWEST = 100
"""Fewest rows of a recording."""


@dataclass(frozen=True)
class Recording:
    """The rows of a file: `time` [s], shape (n,), and the `columns` by the name of the quantity, each of shape (n,),
    in the unit of the quantity. `heads` are the heads of the columns in the file, `others` those of columns that were
    left out."""

    source: str
    time: Any
    columns: Mapping[str, Any]
    heads: Mapping[str, str]
    others: Sequence[str] = ()

    @property
    def step(self) -> float:
        """Time between rows that follow one another without a gap [s]."""
        return float(np.median(np.diff(self.time)))

    @property
    def missing(self) -> float:
        """Share of the rows that are missing in gaps."""
        rows = (self.time[-1] - self.time[0]) / self.step + 1.0
        return max(0.0, 1.0 - len(self.time) / rows)

    @property
    def gaps(self) -> list[tuple[float, float]]:
        """Begin and end of each gap [s]."""
        places = np.flatnonzero(np.diff(self.time) > 1.5 * self.step)
        return [(float(self.time[k]), float(self.time[k + 1])) for k in places]

    def part(self, begin: float = -math.inf, end: float = math.inf) -> Recording:
        """The rows from `begin` to `end` [s], both included."""
        rows = (self.time >= begin) & (self.time <= end)
        columns = {name: x[rows] for name, x in self.columns.items()}
        return replace(self, time=self.time[rows], columns=columns)


def read_recording(file: Path, names: Mapping[str, str] | None = None) -> Recording:
    """Read a recording.

    The first row of the file is its head, with a name and a unit for each column (``motor.i [A]``). A file whose name
    ends with ``.gz`` is unpacked. Columns that are none of `MEASURANDS` are left out.

    Parameters
    ----------
    file : the CSV file, with commas or semicolons between the columns; after semicolons, numbers may have a decimal
        comma
    names : by the name of a quantity, the head of its column, where that is not the name of the quantity

    Raises
    ------
    InputError
        with a line for each fault: the file that cannot be read, a column without unit or with a unit that does not
        fit, a cell that is no finite number, times that do not rise.
    """
    lines = lines_of_table(file, _text(file))
    if not lines:
        raise InputError(f"{file}: is empty; must have a head and >= {FEWEST} rows")
    rows = [(number, line) for number, line in enumerate(lines[1:], 2) if line.partition("#")[0].strip()]
    if len(rows) < FEWEST:
        raise InputError(f"{file}: has {len(rows)} rows behind its head; must have >= {FEWEST}")
    mark = ";" if lines[0].count(";") > lines[0].count(",") else ","
    heads = [head.strip().strip('"') for head in lines[0].split(mark)]
    first = [_is_number(cell) for cell in rows[0][1].split(mark)]
    if len(first) != len(heads) or not any(first):
        raise InputError(
            f"{file}: is no table: its first line must be the heads of the columns, such as time [s],motor.i [A], "
            f"and the next one (line {rows[0][0]}) has to have a number for each of the {len(heads)}"
        )
    faults, units = Faults(), dict[str, tuple[int, float, float]]()
    known = dict(_places(file, heads, names or {}, faults))
    for name, (place, unit) in known.items():
        with faults.collected():
            units[name] = (place, *_scale(file, heads[place], MEASURANDS[name], unit))
    if "time" not in known:
        words = f"{meant('time', heads)} its heads are: {', '.join(heads)}"
        faults.add([InputError(f"{file}: has no column time [s]{words}{remedy('time', heads)}")])
    if not known.keys() - {"time"}:
        words = ", ".join(f"{each.name} [{each.unit}]" for each in MEASURANDS.values() if each.name != "time")
        words += f"; its heads are: {', '.join(heads)}{remedy('motor.i', heads[::-1])}"
        faults.add([InputError(f"{file}: has no column of a known quantity, such as {words}")])
    faults.refuse()
    table = _numbers(file, rows, mark, {units[name][0]: heads[units[name][0]] for name in known})
    columns = {name: table[:, k] * units[name][1] + units[name][2] for k, name in enumerate(known)}
    time = columns.pop("time")
    back = np.flatnonzero(np.diff(time) <= 0.0)
    if len(back):
        k = int(back[0])
        raise InputError(
            f"{file}, line {rows[k + 1][0]}: time = {time[k + 1]:.12g} s: must be later than {time[k]:.12g} s of the "
            "line before"
        )
    used = {place for place, _ in known.values()}
    return Recording(
        str(file),
        time,
        columns,
        {name: heads[place] for name, (place, _) in known.items()},
        [head for place, head in enumerate(heads) if place not in used],
    )


def _is_number(cell: str) -> bool:
    try:
        float(cell.replace(",", "."))
    except ValueError:
        return False
    return True


def name_and_unit(head: str) -> tuple[str, str]:
    """The name of a column and its unit, as its head has them; the unit may be missing."""
    name, _, rest = head.partition("[")
    return name.strip(), rest.partition("]")[0].strip()


def remedy(quantity: str, heads: Sequence[str]) -> str:
    """Words for a file without the column of a quantity, with one of its `heads` for example: the key that names
    it."""
    if not heads:
        return ""
    head = printable(name_and_unit(heads[0])[0])
    return f'; name it by the key columns, such as columns = {{ "{quantity}" = "{head}" }}'


def read_part(file: Path, names: Mapping[str, str], begin: float, end: float) -> Recording:
    """The rows of a recording from `begin` to `end` [s]; see `read_recording`. The count of an encoder begins with 0
    in the first of them.

    Raises
    ------
    InputError
        also where `begin` or `end` is beyond the recording, and where these rows are fewer than `FEWEST`.
    """
    full = read_recording(file, names)
    first, last = float(full.time[0]), float(full.time[-1])
    goes, faults = f"{file} goes from {first:.12g} s to {last:.12g} s", Faults()
    for key, limit in (("begin", begin), ("end", end)):
        # 60 s is the end of a minute whose last row is one step before
        if math.isfinite(limit) and not first - 1.01 * full.step <= limit <= last + 1.01 * full.step:
            words = "must lie within, or be left out"
            faults.add([InputError(f"{key} = {limit:.12g} s: {goes}; {words}")])
    faults.refuse()
    part = full.part(begin, end)
    if len(part.time) < FEWEST:
        begins = f"begin = {begin:.12g} s" if math.isfinite(begin) else "the first row"
        ends = f"end = {end:.12g} s" if math.isfinite(end) else "the last row"
        raise InputError(
            f"{goes}, and has {len(part.time)} rows from {begins} to {ends}; must have >= {FEWEST} rows in this part"
        )
    if "motor.count" in part.columns:
        count = part.columns["motor.count"]
        part = replace(part, columns={**part.columns, "motor.count": count - count[0]})
    return part


def read_signal(file: Path, names: Mapping[str, str], begin: float, end: float) -> Recording:
    """The rows of a recording from `begin` to `end` [s], with a column that depends on the torque.

    Raises
    ------
    InputError
        see `read_part`; and without such a column.
    """
    recording = read_part(file, names, begin, end)
    if not recording.columns.keys() & set(SIGNALS):
        others = recording.others
        more = (
            f"; its other heads are: {printable(', '.join(others))}{remedy('motor.i', others)}"
            if others
            else ""
        )
        raise InputError(
            f"{file}: has no column that tells the torque; must have one of {', '.join(SIGNALS)}{more}"
        )
    return recording


def _text(file: Path) -> str:
    content = file_bytes(file)
    if file.suffix == ".gz":
        content = unzipped(file, content)
    return decoded(file, content)


def _places(
    file: Path, heads: list[str], names: Mapping[str, str], faults: Faults
) -> Iterator[tuple[str, tuple[int, str]]]:
    """By quantity, the place of its column and its unit in the head."""
    plain = [name_and_unit(head)[0] for head in heads]
    for quantity, head in names.items():
        if quantity not in MEASURANDS:
            hint = near_name(quantity, MEASURANDS) or f"; there are {', '.join(MEASURANDS)}"
            faults.add([InputError(f"columns.{quantity}: no such quantity{hint}")])
        elif head not in plain and head not in heads:
            hint = near_name(head, plain) or f"; its heads are: {', '.join(heads)}"
            faults.add([InputError(f"columns.{quantity} = {head!r}: no such column of {file}{hint}")])
    taken = {head: quantity for quantity, head in names.items()}
    for place, (head, name) in enumerate(zip(heads, plain, strict=True)):
        quantity = taken.get(head, taken.get(name, name if name not in names else ""))
        if quantity in MEASURANDS:
            yield quantity, (place, name_and_unit(head)[1])


def _scale(file: Path, head: str, quantity: Measurand, unit: str) -> tuple[float, float]:
    """Factor and offset from the unit of the column to that of the quantity."""
    if quantity.unit == "1":
        if unit not in ("", "1"):
            raise InputError(f"{file}, column {head}: must have the unit [1]")
        return 1.0, 0.0
    if not unit:
        raise InputError(
            f"{file}, column {head}: has no unit; write [{quantity.unit}] behind its name, or its own unit"
        )
    other = of_other_kind(unit, quantity.unit)
    if other:
        raise InputError(f"{file}, column {head}: {other}; {must_be(quantity.unit)}")
    try:
        return scale(unit, quantity.unit)
    except ValueError as error:
        raise InputError(
            f"{file}, column {head}: must have a unit like [{quantity.unit}]: {error}"
        ) from error


def _numbers(file: Path, rows: Sequence[tuple[int, str]], mark: str, heads: Mapping[int, str]) -> Any:
    """The cells of the columns whose `heads` are given by place, shape (rows, columns), of lines with their
    numbers."""
    if mark == ";":
        rows = [(number, line.replace(",", ".")) for number, line in rows]
    try:
        table = np.loadtxt(
            [line for _, line in rows], delimiter=mark, usecols=list(heads), ndmin=2, comments=None
        )
        # it takes nan and inf for numbers
        if np.isfinite(table).all():
            return table
    except (ValueError, IndexError):
        pass
    for number, line in rows:
        cells = line.split(mark)
        for place, head in heads.items():
            cell = cells[place].strip() if place < len(cells) else ""
            try:
                if not math.isfinite(float(cell)):
                    raise ValueError
            except ValueError:
                words = (
                    f"{printable(cell) or 'an empty cell'} is no number; leave out rows without measurement"
                )
                raise InputError(f"{file}, line {number}, column {place + 1}, {head}: {words}") from None
    raise InputError(f"{file}: is no table of numbers")
