"""A recording: columns over time from the file of a logger."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from ..core.brief import briefly_shown
from ..core.errors import Faults, InputError, meant, near_name, printable
from ..core.inputs import decoded_by_marks, file_bytes, unzipped
from ..core.units import of_other_kind, scale, with_units
from ..drives.dc_motor import DcMotor
from ..drives.induction_motor import InductionMotor
from ..drives.motor import Motor
from .logger_columns import (
    complete_rows,
    decimal_signs,
    decimal_words,
    has_times,
    numbers,
    time_places,
    unwrapped,
)
from .logger_columns import times as times_of
from .logger_table import FEWEST, LoggerTable, name_and_unit, read_table
from .measurands import COLUMNS, MEASURANDS, PHASES, SIGNALS, Measurand


@briefly_shown
@dataclass(frozen=True)
class Recording:
    """The rows of a file: `time` [s], shape (n,), and the `columns` by the name of the quantity, each of shape (n,),
    in the unit of the quantity. `heads` are the heads of the columns in the file, `others` those of columns that were
    left out. `understood` says in one line how the file was read."""

    source: str
    time: Any
    columns: Mapping[str, Any]
    heads: Mapping[str, str]
    others: Sequence[str] = ()
    understood: str = ""

    @property
    def sentence(self) -> str:
        """How the file was read."""
        return f"{self.source} is read with {self.understood}"

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
    """Read a recording as loggers write it.

    A row of the file has the head of each column, with a name and a unit (``motor.i [A]``). A file whose name ends
    with ``.gz`` is unpacked. Columns that are none of `MEASURANDS` are left out, but for dates and times of the day,
    which make the time if no column has its name.

    Parameters
    ----------
    file : the text file, see `chainunit.recordings.logger_table`
    names : by the name of a quantity, the head of its column, where that is not the name of the quantity

    Raises
    ------
    InputError
        with a line for each fault: the file that cannot be read, a column without unit or with a unit that does not
        fit, cells that are no numbers, numbers that can be read in two ways, times that do not rise.
    """
    names, faults = names or {}, Faults()
    unnamed = [quantity for quantity in COLUMNS if quantity not in names]
    table = read_table(file, _text(file), [*unnamed, *names.values()])
    places = _places(table, names, faults)
    time_from = time_places(table, places.pop("time", None))
    scales = dict[str, tuple[float, float]]()
    for name, place in places.items():
        with faults.collected():
            scales[name] = _scale(table, place, COLUMNS[name])
    signs = {place: decimal_signs(table.column(place)) for place in (*time_from, *places.values())}

    def others(place: int) -> frozenset[str]:
        return frozenset[str]().union(*(shown for other, shown in signs.items() if other != place))

    if not time_from and not any(_is_named(head, names.get("time", "time")) for head in table.heads):
        faults.add([_without_time(table, places.values())])
    if not places:
        faults.add([_without_quantities(table, time_from)])
    with faults.collected():
        if len(time_from) == 1 and table.units[time_from[0]] and not has_times(table, time_from[0]):
            _scale(table, time_from[0], MEASURANDS["time"])
        times = times_of(table, time_from, others(time_from[0])) if time_from else None
    faults.refuse()
    assert times is not None
    raw = {place: numbers(table, place, others(place), name) for name, place in places.items()}
    whole, lost = complete_rows(table, {time_from[0]: times.missing, **raw})
    kept = whole[times.kept]
    rows = times.kept[kept]
    if "mark" in places:
        raw[places["mark"]] = _in_next_row(raw[places["mark"]], whole, rows)
    scaled = {name: raw[place][rows] * scales[name][0] + scales[name][1] for name, place in places.items()}
    _refuse_phases(table, places, scaled)
    columns, remarks = _quantities(scaled)
    rate = f"{len(rows):,} rows, {1.0 / float(np.median(np.diff(times.time[kept]))):.4g} Hz"
    parts = [times.source, decimal_words(table, others(-1), places.values()), rate, *times.remarks, *remarks]
    used = {*time_from, *places.values()}
    unused = [head for place, head in enumerate(table.heads) if head and place not in used]
    left_out = [*table.left_out, *lost]
    if unused:
        left_out.append(f"the column{'s' * (len(unused) > 1)} {printable(', '.join(unused), 80)}")
    heads = {name: table.heads[place] for name, place in places.items()} | {"time": table.heads[time_from[0]]}
    if "motor.i" in columns and "motor.i" not in heads:
        heads["motor.i"] = ", ".join(heads[name] for name in PHASES if name in heads)
    return Recording(
        str(file),
        times.time[kept],
        columns,
        heads,
        unused,
        ", ".join(parts) + (f"; left out: {', '.join(left_out)}" if left_out else ""),
    )


def remedy(quantity: str, heads: Sequence[str]) -> str:
    """Words for a file without the column of a quantity, with one of its `heads` for example: the key that names
    it."""
    head = printable(next((name for heading in heads if (name := name_and_unit(heading)[0])), ""))
    if not head:
        return ""
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
            message = "must lie within, or be left out"
            faults.add([InputError(f"{key} = {limit:.12g} s: {goes}; {message}")])
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
    return decoded_by_marks(file, content)


def _places(table: LoggerTable, names: Mapping[str, str], faults: Faults) -> dict[str, int]:
    """By quantity, the place of its column: the one with the head of `names`, or else with the name of the quantity.
    Two such columns, and names without a column, go to the `faults`."""
    file, heads = table.file, table.heads
    places = dict[str, int]()
    for quantity in COLUMNS:
        wanted = names.get(quantity, quantity)
        whole = [k for k, head in enumerate(heads) if head == wanted]
        alike = whole or [k for k, head in enumerate(heads) if _is_named(head, wanted)]
        if quantity not in names:
            alike = [k for k in alike if not any(_is_named(heads[k], head) for head in names.values())]
        if len(alike) > 1:
            columns = " and ".join(str(k + 1) for k in alike)
            different = len({heads[k] for k in alike}) == len(alike)
            advice = (
                f'name one by the key columns, such as columns = {{ "{quantity}" = "{printable(heads[alike[0]])}" }}'
                if different
                else "give all but one of them another head"
            )
            faults.add([InputError(f"{file}: columns {columns} have the head {printable(wanted)}; {advice}")])
        elif alike:
            places[quantity] = alike[0]
        elif quantity in names:
            hint = near_name(wanted, [name_and_unit(head)[0] for head in heads])
            hint = hint or f"; its heads are: {', '.join(heads)}"
            faults.add([InputError(f"columns.{quantity} = {wanted!r}: no such column of {file}{hint}")])
    for quantity in names:
        if quantity not in COLUMNS:
            hint = near_name(quantity, COLUMNS) or f"; there are {', '.join(COLUMNS)}"
            faults.add([InputError(f"columns.{quantity}: no such quantity{hint}")])
    return places


def _is_named(head: str, name: str) -> bool:
    return name_and_unit(head, [name])[0].lower() == name.lower()


def _in_next_row(mark: Any, whole: Any, rows: Any) -> Any:
    """The marks, of which those in rows without a number stand in the next one of the `rows` in time."""
    order = -1 if rows[0] > rows[-1] else 1
    lost = np.flatnonzero((mark > 0.5) & ~whole)
    after = np.searchsorted(order * rows, order * lost)
    mark = mark.copy()
    mark[rows[after[after < len(rows)]]] = 1.0
    return mark


_OF_COUNTS = ("", "1", "-", "0/1", "bool", "boolean", "count", "counts", "pulses", "imp", "inc")


def _scale(table: LoggerTable, place: int, quantity: Measurand) -> tuple[float, float]:
    """Factor and offset from the unit of the column to that of the quantity."""
    file, head, unit = table.file, table.heads[place], table.units[place]
    if quantity.unit == "1":
        if unit.lower() not in _OF_COUNTS:
            raise InputError(f"{file}, column {head}: must have the unit [1]")
        return 1.0, 0.0
    if not unit:
        raise InputError(
            f"{file}, column {head}: has no unit; write [{quantity.unit}] behind its name, or its own unit"
        )
    other = of_other_kind(unit, quantity.unit)
    if other:
        raise InputError(f"{file}, column {head}: {other}; must be {with_units(quantity.unit)}")
    try:
        return scale(unit, quantity.unit)
    except ValueError as error:
        raise InputError(
            f"{file}, column {head}: must have a unit like [{quantity.unit}]: {error}"
        ) from error


def _quantities(columns: Mapping[str, Any]) -> tuple[dict[str, Any], list[str]]:
    """The columns with the RMS of phase currents in their place, and counters without their jumps; words on both."""
    remarks = list[str]()
    phases = [name for name in PHASES if name in columns]
    quantities = {name: x for name, x in columns.items() if name not in PHASES}
    if phases and "motor.i" in columns:
        remarks.append(f"{', '.join(phases)} left out beside motor.i")
    elif phases:
        currents = [columns[name] for name in phases]
        quantities = {"motor.i": rms_of_phases(currents) if len(phases) > 1 else currents[0], **quantities}
        remarks.append(f"motor.i is {'the RMS of ' if len(phases) > 1 else ''}{', '.join(phases)}")
    if "mark" in quantities and set(np.unique(quantities["mark"])) == {-1.0, 0.0}:
        # true in Basic
        quantities["mark"] = np.abs(quantities["mark"])
    if "motor.count" in quantities:
        quantities["motor.count"], wraps = unwrapped(quantities["motor.count"])
        if wraps:
            remarks.append(f"the count begins anew {wraps} {'time' if wraps == 1 else 'times'}: joined")
    return quantities, remarks


def rms_of_phases(currents: Sequence[Any]) -> Any:
    """The RMS of a phase by the instantaneous currents of two or three phases, whose sum is zero, or by RMS values,
    which are positive."""
    if len(currents) == 2 and min(map(np.min, currents)) >= 0.0:
        return np.sqrt(sum(i**2 for i in currents) / 2.0)
    if len(currents) == 2:
        currents = [*currents, -currents[0] - currents[1]]
    return np.sqrt(sum(i**2 for i in currents) / 3.0)


def _refuse_phases(table: LoggerTable, places: Mapping[str, int], columns: Mapping[str, Any]) -> None:
    """Refuse instantaneous currents of two phases that are not a third of a period apart: the sum of the currents is
    zero."""
    for first, second in pairwise(name for name in PHASES if name in columns):
        x, y = (columns[name] - np.mean(columns[name]) for name in (first, second))
        size = math.sqrt(float(np.mean(x**2) * np.mean(y**2)))
        likeness = float(np.mean(x * y)) / size if size else -0.5
        if min(columns[first].min(), columns[second].min()) < 0.0 and not -0.8 < likeness < -0.2:
            raise InputError(
                f"{table.file}, columns {table.heads[places[first]]} and {table.heads[places[second]]}: have a "
                f"correlation of {likeness:.2g}, and currents of two phases have one of -0.5: change the sign of one "
                "whose sensor is reversed, or name the columns of two phases"
            )


_SUPPLY = (15.0, 1000.0)
"""Range of the frequency of a motor's current [Hz]."""
BOTH_SIGNS = 0.5
"""Standard deviations on both sides of zero from which on a current is no RMS with the noise of its sensor."""


def _without_time(table: LoggerTable, places: Iterable[int]) -> InputError:
    """The fault of a table without a column of the time: it names the columns that may be the time, beside the
    columns of quantities at `places`."""
    may_be = [k for k, unit in enumerate(table.units) if not (unit and of_other_kind(unit, "s"))]
    may_be = [k for k in {*may_be} - {*places} if table.has_numbers(k) or has_times(table, k)]
    may_be.sort(key=lambda k: (not has_times(table, k), "time" not in table.heads[k].lower()))
    text = f"{meant('time', table.heads)} its heads are: {', '.join(table.heads)}"
    text += f"{remedy('time', [table.heads[k] for k in may_be])}{', or' if may_be else ';'} add it"
    return InputError(f"{table.file}: has no column time [s]{text}")


def _without_quantities(table: LoggerTable, time_from: Sequence[int]) -> InputError:
    """The fault of a table without a column of a quantity; the columns `time_from` have the time."""
    quantities = [f"{m.name} [{m.unit}]" for m in MEASURANDS.values() if m.name != "time"]
    likely = [head for k, head in enumerate(table.heads) if k not in time_from and table.has_numbers(k)]
    text = f"{', '.join(quantities)}; its heads are: {', '.join(table.heads)}"
    text += remedy("motor.i", (likely or table.heads)[::-1])
    return InputError(f"{table.file}: has no column of a known quantity, such as {text}")


def with_rms(recording: Recording, turn: float, motor: Motor | None = None) -> Recording:
    """A recording of which an instantaneous current of one phase is replaced by its RMS over each period of the
    supply; `turn` is the time of a turn of the crank [s]. Each period makes a row. The current of a DC `motor` is the
    one of its armature, which may have both signs.

    Raises
    ------
    InputError
        for a current whose rows do not resolve its periods, for one of an induction motor that has both signs and no
        periods, and for the currents of phases of a DC motor.
    """
    current = recording.columns.get("motor.i")
    phases = [name for name in PHASES if name in recording.heads]
    if motor is DcMotor and phases:
        raise InputError(
            f"{recording.source}, column {recording.heads[phases[0]]}: is the current of a phase, and the motor is a "
            "DcMotor; name the column of the current of its armature motor.i"
        )
    if current is None or motor is DcMotor:
        return recording
    offset = float(np.mean(current)) if motor is InductionMotor else 0.0
    frequency = _alternating(recording.time, current - offset, turn)
    if not frequency:
        least, largest = (float(x) / (float(np.std(current)) or 1.0) for x in (current.min(), current.max()))
        if motor is InductionMotor and least < -BOTH_SIGNS and largest > BOTH_SIGNS:
            raise InputError(
                f"{recording.source}, column {recording.heads['motor.i']}: goes from {current.min():.4g} to "
                f"{current.max():.4g} A, and the RMS of a phase is positive: the column is an instantaneous current "
                "whose periods the rows do not resolve; record >= 8 rows in a period of the supply, the currents of "
                "two phases (motor.ia, motor.ib), or the RMS"
            )
        return recording
    rows = 1.0 / (frequency * recording.step)
    if rows < 8.0:
        raise InputError(
            f"{recording.source}, column {recording.heads['motor.i']}: is the instantaneous current of a phase, of "
            f"{frequency:.4g} Hz, with {rows:.2g} rows in a period; must have >= 8, or be the RMS"
        )
    means = _by_periods(recording, frequency, rows)
    remark = (
        f"motor.i is instantaneous, of {frequency:.4g} Hz: its RMS over each of {len(means.time):,} periods"
    )
    return replace(means, understood=f"{recording.understood}, {remark}")


def _by_periods(recording: Recording, frequency: float, rows: float) -> Recording:
    """The recording with a row for each whole period of a `frequency` [Hz], which has `rows` rows: the RMS of the
    current, without its mean over the recording, and the means of all other columns; a mark stays one row."""
    current = recording.columns["motor.i"]
    period = np.floor((recording.time - recording.time[0]) * frequency).astype(int)
    # the RMS of a part of a period is another one
    whole = np.bincount(period) > 0.9 * rows
    place = (np.cumsum(whole) - 1)[period]
    inside, count = whole[period], np.bincount(period)[whole]

    def mean(x: Any) -> Any:
        return np.bincount(place[inside], x[inside]) / count

    time = mean(recording.time)
    columns = {name: mean(x) for name, x in recording.columns.items()}
    columns["motor.i"] = np.sqrt(mean((current - np.mean(current)) ** 2))
    if "mark" in columns:
        passed = recording.time[recording.columns["mark"] > 0.5]
        columns["mark"] = np.zeros(len(time))
        rows_after = np.searchsorted(time, passed)
        columns["mark"][rows_after[rows_after < len(time)]] = 1.0
    if "motor.count" in columns:
        columns["motor.count"] = np.floor(columns["motor.count"])
    return replace(recording, time=time, columns=columns)


def _alternating(time: Any, current: Any, turn: float) -> float:
    """The frequency of a current without a mean that alternates faster than the crank turns [Hz]; else 0."""
    size = float(np.sqrt(np.mean(current**2)))
    if not abs(float(np.mean(current))) < 0.1 * size:
        return 0.0
    step = float(np.median(np.diff(time)))
    even = np.interp(np.arange(time[0], time[-1], step), time, current)
    power = np.abs(np.fft.rfft((even - np.mean(even)) * np.hanning(len(even)))) ** 2
    frequencies = np.fft.rfftfreq(len(even), step)
    peak = float(frequencies[np.argmax(power)])
    near = np.abs(frequencies - peak) <= 0.1 * peak
    if not _SUPPLY[0] <= peak <= _SUPPLY[1] or peak * turn < 2.5 or power[near].sum() < 0.7 * power.sum():
        return 0.0
    return float(np.average(frequencies[near], weights=power[near]))
