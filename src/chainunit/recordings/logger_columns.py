"""The numbers and the times in the columns of a logger's table."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from datetime import date
from typing import Any, NamedTuple

import numpy as np

from ..core.errors import InputError, printable
from ..core.units import dimension, scale
from .logger_table import (
    MARKS,
    MISSING,
    NAMES_IN_ROWS,
    WITH_UNIT,
    LoggerTable,
    bare_unit,
    date_and_clock,
    is_data,
    is_time,
    name_and_unit,
)

LOST = 0.2
"""Largest share of the rows without a number in a column."""
SOME, COARSE = 0.02, 0.2
"""Shares of rows with the time of the row before: from which on a clock may be coarse, and from which on it is."""
WRAPS = tuple(sorted([2.0**bits for bits in range(10, 33)] + [10.0**digits for digits in range(3, 10)]))
"""Sizes of counters that begin anew."""
LEAST_OF_CLOCKS, PERIODS = 2.0**16, (60.0, 3600.0, 86400.0, 604800.0)
"""Least size of the counter of a clock, and the times after which seconds of a minute, an hour, a day or a week begin
anew [s]."""
LEFT_OUT = 0.01
"""Largest share of numbers without a decimal sign from which it was left out."""
_OVERLOAD = 9.8e37
"""A meter in overload, by IEEE 488.2, gives 9.9e37."""
_BOOLEANS = {
    word: float(k)
    for k, column in enumerate(
        ("false f off no n low falsch aus nein faux inactive", "true t on yes y high wahr ein ja vrai active")
    )
    for word in column.split()
}
_FRACTIONS = {"ms": 1e-3, "msec": 1e-3, "millis": 1e-3, "us": 1e-6, "usec": 1e-6, "µs": 1e-6, "ns": 1e-9} | {
    f"{prefix}{word}": factor
    for prefix, factor in (("milli", 1e-3), ("micro", 1e-6), ("nano", 1e-9))
    for word in ("second", "seconds", "sekunden", "tm", "s", "")
} | dict.fromkeys(("fraction", "fractional", "subsecond", "subseconds", "subsec"), 1.0)  # fmt: skip
_DAY = 86400.0
_EPOCHS = (("s", 1e9, 3e9), ("ms", 1e12, 3e12), ("µs", 1e15, 3e15), ("ns", 1e18, 3e18))
"""By unit, the numbers of the years 2001 to 2065 since 1970."""
_SIGN = re.compile(r"^([+-]) +(?=\d)", re.MULTILINE)
_OF_FORTRAN = re.compile(r"(?<=[\d.,])[dD](?=[+-]\d)")
_OF_ACCOUNTS = re.compile(r"^(?:\(([\d.,' ]+)\)|([\d.,' ]+)-)$", re.MULTILINE)
"""Negative numbers in parentheses, or with their sign behind."""
_ABSENT = re.compile(
    r"^[+-]?(?:9{4,}(?:\.[09]*)?|[67]999(?:\.0*)?|32768|1(?:\.0*)?e\+?3\d)$", re.MULTILINE | re.IGNORECASE
)
"""Numbers in place of a missing measurement, if all others are far smaller."""
_HALF = re.compile(r"[AaPp]\.?[Mm]\.?")
"""The half of a day of a clock of 12 hours."""
_NAN = "nan"
_BLANKS = " '’\u00a0\u2009\u202f"
_GROUP = re.compile(rf"(?<=\d)[{_BLANKS}](?=\d{{3}}(?!\d))")


def numbers(table: LoggerTable, place: int, others: frozenset[str], quantity: str = "") -> Any:
    """The numbers of a column, NaN where a cell has none.

    Parameters
    ----------
    others : the decimal signs that other columns show
    quantity : its quantity; a mark may be a word, such as "on"

    Raises
    ------
    InputError
        for a cell that is no number, and for signs that may be decimal ones or stand between thousands.
    """
    cells = _plain(table, place, others)
    try:
        values = list(map(float, cells))
    except ValueError:
        values = [_number(cell, quantity == "mark") for cell in cells]
    x = np.array(values)
    if quantity == "mark" and set(x[~np.isnan(x)]) == {1.0}:
        # passes alone are written
        x[[not cell for cell in cells]] = 0.0
    for k in map(int, np.flatnonzero(~(np.abs(x) < _OVERLOAD))):
        if not (cells[k] == _NAN or MISSING.fullmatch(table.rows[k][place]) or math.isfinite(x[k])):
            raise _no_number(table, k, place, quantity, np.isnan(x))
        x[k] = np.nan
    return x


def _no_number(table: LoggerTable, row: int, place: int, quantity: str, without: Any) -> InputError:
    """The refusal of a cell that is no number, with the remedy for its column; some rows are `without` a number."""
    cells, unit = table.column(place), table.units[place]
    texts = [cells[k] for k in np.flatnonzero(without) if not MISSING.fullmatch(cells[k])]
    remedy = "delete this row, or write nan for a missing measurement"
    if quantity == "mark":
        remedy = "write 0 and 1, off and on, or false and true"
    elif without[row] and WITH_UNIT.fullmatch(cells[row]):
        cell_units = list(dict.fromkeys(match[2] for text in texts if (match := WITH_UNIT.fullmatch(text))))
        if any(not _fits(text, unit) for text in cell_units):
            wanted = f"in the unit of the head, {unit}" if unit else "in one unit, which stands in the head"
            remedy = f"write all numbers of this column in full, {wanted}"
        elif len(cell_units) > 1:
            remedy = (
                f"and the units differ ({', '.join(cell_units)}); write all in one, which stands in the head"
            )
        else:
            remedy = f"write [{cell_units[0]}] into the head, and take it out of all cells"
        remedy = f"alone, {remedy}"
    elif len(texts) > LOST * len(cells) and quantity == "time":
        remedy = "and no time that can be read; write it as 2023-06-19 23:59:40.024, or in seconds"
    elif len(texts) > LOST * len(cells):
        remedy = "as in most rows; write numbers, or give the column another head, so that it is left out"
    joint = " " if remedy.startswith(("alone", "and", "as")) else "; "
    return InputError(
        f"{table.place_of(row, place)}: {printable(cells[row], 40)} is no number{joint}{remedy}"
    )


def _fits(text: str, unit: str) -> bool:
    """Whether the unit in a cell can be that of a column, whose head may have a `unit`."""
    try:
        return dimension(bare_unit(text)) == dimension(unit or bare_unit(text))
    except ValueError:
        return False


def _number(cell: str, boolean: bool) -> float:
    """The number in a cell, in a `boolean` column of a word such as "on", too; NaN without one."""
    if boolean and cell.lower() in _BOOLEANS:
        return _BOOLEANS[cell.lower()]
    try:
        return float(cell)
    except ValueError:
        return math.nan


def _shapes(sign: str) -> tuple[re.Pattern[str], re.Pattern[str], re.Pattern[str]]:
    """Patterns of cells in which a `sign` is certainly a decimal one, certainly one of thousands, and maybe each."""
    s, o = re.escape(sign), re.escape("," if sign == "." else ".")
    may_be = rf"[+-]?[1-9]\d{{0,2}}{s}\d{{3}}"
    decimal = rf"^(?!{may_be}$)[+-]?(?:\d{{1,3}}(?:{o}\d{{3}})+{s}\d*|\d*{s}\d*)(?:[eE][+-]?\d+)?$"
    thousands = rf"^[+-]?[1-9]\d{{0,2}}(?:(?:{s}\d{{3}}){{2,}}(?:{o}\d*)?|{s}\d{{3}}{o}\d*)$"
    return tuple(re.compile(pattern, re.MULTILINE) for pattern in (decimal, thousands, rf"^{may_be}$"))  # type: ignore[return-value]


_SHAPES = {sign: _shapes(sign) for sign in ".,"}


def decimal_signs(cells: Sequence[str]) -> frozenset[str]:
    """The signs that cells certainly have as decimal ones, also behind the seconds of a clock."""
    text = "\n".join(cells)
    signs = {sign for sign, (decimal, _, _) in _SHAPES.items() if sign in text and decimal.search(text)}
    # a clock may have a point also where numbers have decimal commas
    if re.search(r":\d\d,\d+(?: ?[AaPp]\.?[Mm]\.?)?$", text, re.MULTILINE):
        signs.add(",")
    return frozenset(signs)


def _plain(table: LoggerTable, place: int, others: frozenset[str]) -> list[str]:
    """The cells of a column with a decimal point and without marks of thousands; `others` are the decimal signs of
    other columns."""
    text = _usual_numbers(table, place)
    decimal, has_thousands = _decimal_sign(table, place, text, others)
    if has_thousands:
        text = re.sub(r"(?<=\d)\.(?=\d{3}(?!\d))" if decimal == "," else r"(?<=\d),(?=\d{3}(?!\d))", "", text)
    text = text.replace(",", ".") if decimal == "," else text
    plain = _without_absent(text.split("\n")) if _ABSENT.search(text) else text.split("\n")
    _refuse_left_out(table, place, plain)
    _refuse_added(table, place, plain)
    return plain


def _usual_numbers(table: LoggerTable, place: int) -> str:
    """The cells of a column, line by line: signs without a blank after them, exponents by an e, negative numbers with
    their sign before them, and thousands without blanks between."""
    # Python takes an underscore for a mark of thousands
    text = "\n".join(table.column(place)).replace("_", "?")
    if " " in text:
        text = _SIGN.sub(r"\1", text)
    if "D" in text or "d" in text:
        text = _OF_FORTRAN.sub("e", text)
    if len(_OF_ACCOUNTS.findall(text)) > max(1.0, LEFT_OUT * len(table.rows)):
        text = _OF_ACCOUNTS.sub(r"-\1\2", text)
    has_groups = any(sign in text for sign in _BLANKS) and _GROUP.search(text)
    if has_groups and not re.search(r"^[+-]?\d{4}", text, re.MULTILINE):
        text = _GROUP.sub("", text)
    return text


def _decimal_sign(table: LoggerTable, place: int, text: str, others: frozenset[str]) -> tuple[str, bool]:
    """The decimal sign of the cells in `text`, empty without one, and whether they have marks of thousands. A sign
    whose cells may have either is the decimal one if `others` have it, or else if it is usual with the mark between
    columns; any other doubt is refused."""
    present = {sign: shapes for sign, shapes in _SHAPES.items() if sign in text}
    decimals = {sign for sign, (decimal, _, _) in present.items() if decimal.search(text)}
    maybe = {sign for sign, (_, _, either) in present.items() if either.search(text)}
    several = re.search(r"[.,]\d*[.,]", text)
    grouped = {sign for sign, (_, thousands, _) in present.items() if several and thousands.search(text)}
    decimals |= {"," if sign == "." else "." for sign in grouped}
    if len(decimals) > 1:
        raise _doubtful(table, place, decimals, is_mixed=True)
    if not decimals and maybe:
        # semicolons between columns come with decimal commas; commas, bars and blanks with decimal points
        usual = frozenset({";": ",", "\t": ""}.get(table.mark, "."))
        if len(maybe) > 1 or maybe != (others or usual):
            raise _doubtful(table, place, maybe)
        decimals = maybe
    if decimals and (maybe - decimals) - grouped:
        raise _doubtful(table, place, maybe - decimals)
    return next(iter(decimals), ""), bool(grouped)


def _without_absent(cells: list[str]) -> list[str]:
    """The cells with nan in place of the numbers of a missing measurement."""
    absent = {k: abs(_number(cell, False)) for k, cell in enumerate(cells) if _ABSENT.match(cell)}
    others = (abs(_number(cell, False)) for k, cell in enumerate(cells) if k not in absent)
    largest = max((x for x in others if x < _OVERLOAD), default=math.inf)
    return [_NAN if absent.get(k, 0.0) > 2.0 * largest else cell for k, cell in enumerate(cells)]


def _refuse_left_out(table: LoggerTable, place: int, cells: Sequence[str]) -> None:
    """Refuse a long number without a decimal sign where all others have one with the same number of decimals."""
    whole = [k for k, cell in enumerate(cells) if "." not in cell and _mantissa(cell).isdigit()]
    if not 0 < len(whole) <= max(1.0, LEFT_OUT * len(cells)):
        return
    decimals = {len(_mantissa(cell).partition(".")[2]) for cell in cells if "." in cell}
    for k in whole:
        if len(decimals) == 1 and len(_mantissa(cells[k])) > max(decimals) > 0:
            raise InputError(
                f"{table.place_of(k, place)}: {cells[k]} has no "
                f"decimal sign, and the other numbers have {max(decimals)} decimals: a sign is left out; mend it, or "
                "write nan"
            )


def _refuse_added(table: LoggerTable, place: int, cells: Sequence[str]) -> None:
    """Refuse a rare number with a decimal sign and the digits of a whole one, where all others are whole."""
    signed = [k for k, cell in enumerate(cells) if "." in cell]
    whole = {len(m) for cell in cells if (m := _mantissa(cell)).isdigit()} if signed else set()
    if not whole or len(signed) > max(1.0, LEFT_OUT * len(cells)):
        return
    for k in signed:
        before, _, after = _mantissa(cells[k]).partition(".")
        if after and (before + after).isdigit() and len(before + after) in whole:
            longer = f"{before or 0}.{after}" + "0" * (1 + max(whole) - len(before + after))
            raise InputError(
                f"{table.place_of(k, place)}: {cells[k]} has a "
                "decimal sign, and the other numbers are whole ones with as many digits: a sign is added; mend it, "
                f"or write {longer} if the number is right"
            )


def _mantissa(cell: str) -> str:
    return re.split("[eE]", cell)[0].lstrip("+-")


def _doubtful(table: LoggerTable, place: int, signs: Iterable[str], is_mixed: bool = False) -> InputError:
    """The refusal of a column whose numbers can be read in two ways, by its first such cell with each sign."""
    cells = table.column(place)
    first_rows = {
        sign: next(
            k for k, cell in enumerate(cells) if sign in cell and (is_mixed or _SHAPES[sign][2].match(cell))
        )
        for sign in sorted(signs)
    }
    k = next(iter(first_rows.values()))
    where = f"{table.place_of(k, place)}: {cells[k]}"
    if is_mixed:
        other = " and ".join(f"{cells[j]} (line {table.lines[j]})" for j in list(first_rows.values())[1:])
        return InputError(f"{where} and {other} have different decimal signs; write all with the same one")
    point, whole = cells[k].replace(",", "."), re.sub(r"[.,]", "", cells[k])
    return InputError(
        f"{where} may be {point} or {whole}: write the numbers of this column without a mark of thousands ({whole}), "
        f"or with another number of decimals ({cells[k]}0)"
    )


class Times(NamedTuple):
    """Rising times [s] of the `kept` rows, words on their source, and remarks; `missing` is NaN in each row of the
    file without a time, else 0."""

    time: Any
    kept: Any
    missing: Any
    source: str
    remarks: list[str]


def time_places(table: LoggerTable, place: int | None) -> list[int]:
    """The columns of the time: the one of the given `place`, and beside it one with the date or the time of the day;
    without it the columns that hold times."""
    kinds = {k: kind for k, cell in enumerate(table.rows[0]) if (kind := _kind(table, k))}
    if place is not None and place not in kinds:
        return [place]
    if place is None and not kinds:
        return _parts(table)
    wanted = {"date": "clock", "clock": "date"}
    first = place if place is not None else next(iter(kinds))
    more = [k for k, kind in kinds.items() if k != first and wanted.get(kinds[first]) == kind]
    if place is None and len(kinds) != 1 + len(more):
        return []
    places = [first, *more[:1]]
    places += [k for k in range(len(table.heads)) if _is_half(table, k)][:1]
    cells = (date_and_clock(table.rows[0][k]) for k in places)
    if any(cell and cell[1] and cell[1]["s"] and not cell[1]["f"] for cell in cells):
        places += [k for k in range(len(table.heads)) if _fraction(table, k)][:1]
    return places


def has_times(table: LoggerTable, place: int) -> bool:
    """Whether a column has dates or times of the day."""
    return bool(_kind(table, place))


def _kind(table: LoggerTable, place: int) -> str:
    """Whether a column has dates, times of the day, or both; empty for other cells."""
    cells = [row[place] for row in table.rows[:20] if not MISSING.fullmatch(row[place])]
    times = [date_and_clock(cell) for cell in cells]
    if not times or None in times:
        return ""
    first = times[0]
    assert first is not None
    return "clock" if not first[0] else "both" if first[1] else "date"


def _is_half(table: LoggerTable, place: int) -> bool:
    """Whether a column has the halves of a day of a clock of 12 hours."""
    return all(_HALF.fullmatch(row[place]) for row in table.rows[:20])


def _fraction(table: LoggerTable, place: int) -> float:
    """The unit of a column with parts of a second beside a clock [s]; 0 for another column."""
    words = re.split(r"[\s_\[\]()]+", table.heads[place].lower().replace("sub-", "sub"))
    factor = next((_FRACTIONS[word] for word in words if word in _FRACTIONS), 0.0)
    cells = table.column(place) if factor else []
    part = re.compile(r"0?\.\d+|0" if factor == 1.0 else r"\d+")
    return factor if cells and all(part.fullmatch(x) and factor * float(x) < 1.0 for x in cells) else 0.0


_PARTS = ("hour", "minute", "second", "day", "month", "year")


def _parts(table: LoggerTable) -> list[int]:
    """The columns of hour, minute and second, and of a date."""
    heads = [name_and_unit(head)[0].lower().rstrip("s") for head in table.heads]
    if not {"hour", "minute", "second"} <= set(heads):
        return []
    return [heads.index(part) for part in _PARTS if part in heads]


def times(table: LoggerTable, places: Sequence[int], others: frozenset[str]) -> Times:
    """The times of the rows by the columns at `places`; `others` are the decimal signs of other columns.

    Raises
    ------
    InputError
        for times that do not rise, and for times that do not resolve the rows.
    """
    head = table.heads[places[0]]
    if has_times(table, places[0]):
        time, source = _of_clock(table, places)
    elif len(places) > 1:
        time, source = _time_of_parts(table, places, others)
    else:
        x = numbers(table, places[0], others, "time")
        factor, source = _unit_of_time(table, head, table.units[places[0]], x)
        sizes = [size for size in WRAPS if size >= LEAST_OF_CLOCKS]
        x, wraps = unwrapped(x, sorted([*sizes, *(period / factor for period in PERIODS)]))
        time = x * factor
        if wraps:
            source += f" (the counter begins anew {wraps} {'time' if wraps == 1 else 'times'})"
    return _rising(table, time, source, head)


def _unit_of_time(table: LoggerTable, head: str, unit: str, x: Any) -> tuple[float, str]:
    """The factor from the numbers `x` of a column to seconds, and words on its unit: the `unit` of the head, or the
    one in which the numbers are dates.

    Raises
    ------
    InputError
        for numbers without a unit that are no dates.
    """
    if unit and not is_time(unit):
        return scale(unit, "s")[0], f"time in {unit}"
    for unit_text, low, high in _EPOCHS:
        if np.nanmin(x) >= low and np.nanmax(x) < high:
            return scale(unit_text, "s")[0], f"time in {unit_text} since 1970"
    steps = np.abs(np.diff(x))
    if np.nanmin(x) > 2e4 and np.nanmax(x) < 8e4 and np.nanmedian(steps) < 2e-5:
        return _DAY, "time in days of a spreadsheet"
    raise InputError(
        f"{table.file}, column {head}: has no unit; write [s] behind its name, or its own unit, such as {head} [ms]"
    )


def _time_of_parts(table: LoggerTable, places: Sequence[int], others: frozenset[str]) -> tuple[Any, str]:
    """The times from the first one on [s], shape (rows,), by columns of hour, minute and second, and of the date if
    there is one; and words on their source. Without a date, a clock that falls has passed midnight."""
    names = [name_and_unit(table.heads[k])[0].lower().rstrip("s") for k in places]
    columns = {name: numbers(table, k, others) for name, k in zip(names, places, strict=True)}
    time = 3600.0 * columns["hour"] + 60.0 * columns["minute"] + columns["second"]
    if {"year", "month", "day"} <= columns.keys():
        days = np.full(len(time), np.nan)
        for k, parts in enumerate(zip(columns["year"], columns["month"], columns["day"], strict=True)):
            if np.isfinite(parts).all():
                try:
                    days[k] = date(*map(int, parts)).toordinal()
                except ValueError as error:
                    raise _no_time(table, k, places) from error
        time = time + _DAY * (days - np.nanmin(days))
    else:
        time = _over_midnight(time, _DAY)
    return time - np.nanmin(time), f"time from {len(places)} columns"


class _ClockTime(NamedTuple):
    """A time of a clock [s], with the days that stand before it; whether it is `short`, from the full hour on, else
    it is from midnight on; and its hour, the digits of its fraction of a second, and its zone."""

    seconds: float
    short: bool
    hour: int
    digits: int
    zone: str


def _clock_time(table: LoggerTable, row: int, place: int, clock: Any, half: str) -> _ClockTime:
    """The time of a row by the match of its `clock`; `half` is the cell with the half of the day, if the clock has
    none. Refuse a time whose minutes or whose fraction may mean two things."""
    h, m, s = int(clock["h"]), int(clock["m"]), clock["s"]
    if s is None:
        h, m, s = 0, h, str(m)
        if clock["f"] is None:
            raise InputError(
                f"{table.place_of(row, place)}: {printable(clock[0], 40)} may be hh:mm or mm:ss, and does not "
                "resolve the rows; write hh:mm:ss.fff"
            )
    fraction = clock["f"] or ""
    if fraction and len(fraction) < 3 and clock[0][clock.start("f") - clock.start() - 1] == ":":
        raise InputError(
            f"{table.place_of(row, place)}: {printable(clock[0], 40)} may end with hundredths, with frames or with "
            "ms; write hh:mm:ss.fff"
        )
    if letter := clock["half"] or half[:1]:
        h = h % 12 + 12 * (letter in "pP")
    days = int(clock["days"] or clock["span"] or 0)
    seconds = _DAY * days + 3600.0 * h + 60.0 * m + int(s) + float(f"0.{fraction or 0}")
    return _ClockTime(seconds, clock["s"] is None, h, len(fraction), (clock["zone"] or "").strip())


def _of_clock(table: LoggerTable, places: Sequence[int]) -> tuple[Any, str]:
    """The times from the first row on [s], shape (rows,), by dates and times of the day; and words on their source.
    The columns at `places` have dates, times, the half of the day, and parts of a second."""
    seconds, days, clocks = np.full(len(table.rows), np.nan), list[str](), list[_ClockTime]()
    half = next((place for place in places if _is_half(table, place)), -1)
    beside = {place: factor for place in places if (factor := _fraction(table, place))}
    places = [place for place in places if place not in beside and place != half]
    shape = (False, False, False)
    for k, row in enumerate(table.rows):
        # a date may stand only where it changes
        parts = [date_and_clock(row[place]) for place in places if row[place] or not any(days)]
        day = "".join(part[0] for part in parts if part) or (days[-1] if len(parts) < len(places) else "")
        clock = next((part[1] for part in parts if part and part[1]), None)
        row_shape = bool(day), clock is not None, clock is not None and clock["s"] is None
        shape = row_shape if k == 0 else shape
        days.append(day or (days[-1] if days else ""))
        if (None in parts or not parts) and all(MISSING.fullmatch(row[place]) for place in places):
            continue
        if (
            None in parts
            or (half >= 0 and not _HALF.fullmatch(row[half]))
            or row_shape != shape
            or (clock and (int(clock["m"]) > 59 or int(clock["s"] or 0) > 60))
        ):
            raise _no_time(table, k, places)
        if clock is None:
            seconds[k] = 0.0
            continue
        clocks.append(_clock_time(table, k, places[0], clock, row[half] if half >= 0 else ""))
        seconds[k] = clocks[-1].seconds
    zones, widths = ({getattr(time, name) for time in clocks} for name in ("zone", "digits"))
    if len(zones) > 1:
        raise InputError(
            f"{table.file}, column {table.heads[places[0]]}: has times of {len(zones)} zones "
            f"({', '.join(sorted(map(repr, zones)))}); write all in one"
        )
    for place, factor in beside.items() if not any(widths) else ():
        seconds += factor * np.array([float(row[place]) for row in table.rows])
    if any(days):
        seconds += _DAY * np.array(_day_numbers(table, days, places[0]))
        zone = next(iter(zones), "")
        count = len(places) + len(beside) + (half >= 0)
        source = f"time from {count} columns" if count > 1 else "time from dates and clock"
        source += f", from {days[0]} on, as 0 s" + (f" ({zone})" if zone else "")
    else:
        seconds, source = _without_dates(seconds, clocks)
    has_time = np.isfinite(seconds)
    steps = np.diff(seconds[has_time])
    if len(widths) > 1 and np.any(steps < 0.0) and np.any(steps > 0.0):
        raise InputError(
            f"{table.file}, column {table.heads[places[0]]}: has parts of a second of {min(widths)} to {max(widths)} "
            "digits, and the times run backwards; write ms with zeros before them, such as .024, or sort the rows"
        )
    return seconds - seconds[np.flatnonzero(has_time)[0]], source


def _without_dates(seconds: Any, clocks: Sequence[_ClockTime]) -> tuple[Any, str]:
    """Times of a clock [s], shape (rows,), that go on after midnight, or after the full hour; and words on their
    source. A clock that shows the hours 1 to 12 alone begins anew at noon, too. The rows may fall from the last time
    to the first one."""
    short = bool(clocks) and clocks[-1].short
    order = -1 if np.nanmedian(np.diff(seconds)) < 0.0 else 1
    rising = _over_midnight(seconds[::order], 3600.0 if short else _DAY)
    if {time.hour for time in clocks} <= set(range(1, 13)) and not short:
        rising = _over_midnight(rising, 0.5 * _DAY)
    goes_on = rising[::order]
    source = "time from a clock, the first row as 0 s"
    if not np.array_equal(seconds, goes_on, equal_nan=True):
        source += f", over {'the full hour' if short else 'midnight'}"
    return goes_on, source


def _no_time(table: LoggerTable, row: int, places: Sequence[int]) -> InputError:
    """The refusal of a row whose cells at `places` are no time."""
    cells = " ".join(table.rows[row][place] for place in places)
    return InputError(
        f"{table.place_of(row, places[0])}: "
        f"{printable(cells, 40)} is no time as in the rows before; mend this row, or delete it"
    )


def _over_midnight(seconds: Any, period: float) -> Any:
    """Times of a clock that begins anew after a `period` [s]: it falls by most of it; if it rises by most of it, rows
    are swapped."""
    steps = np.diff(seconds, prepend=seconds[:1]) / period
    return seconds + period * np.cumsum((steps < -0.9).astype(int) - (steps > 0.9))


def _day_numbers(table: LoggerTable, days: Sequence[str], place: int) -> list[float]:
    """The days since the first one; of the orders of day and month the one with the shortest recording counts."""
    different = list(dict.fromkeys(days))
    ways: list[dict[str, int]] = []
    for order in ("ymd", "dmy", "mdy"):
        try:
            ways.append({day: _ordinal(day, order) for day in different})
        except (ValueError, OverflowError):
            continue
    spans = [way[days[-1]] - way[days[0]] for way in ways]
    if not ways:
        raise InputError(
            f"{table.place_of(0, place)}: "
            f"{printable(days[0], 40)} is no date that can be read; write it as 2023-06-19"
        )
    way = ways[min(range(len(ways)), key=lambda k: (spans[k] < 0, abs(spans[k])))]
    return [float(way[day] - way[days[0]]) for day in days]


_MONTHS = {
    name: 1 + k
    for k, names in enumerate("jan feb mar,mär,mrz apr may,mai jun jul aug sep oct,okt nov dec,dez".split())
    for name in names.split(",")
}


def _ordinal(day: str, order: str) -> int:
    """The number of a day whose date has year, month and day in this `order`; a year of four digits, and a month with
    a name, are known by themselves."""
    parts = re.split(r"[-/., ]+", day)
    if named := [part for part in parts if not part.isdigit()]:
        digits = [part for part in parts if part.isdigit()]
        if len(digits) != 2:
            raise ValueError
        last, first = digits if len(digits[0]) == 4 else digits[::-1]
        d, m, y = int(first), _MONTHS.get(named[0][:3].lower(), 0), int(last)
    else:
        if (len(parts[0]) == 4) != (order == "ymd") and max(map(len, parts)) == 4:
            raise ValueError
        y, m, d = (int(parts[order.index(part)]) for part in "ymd")
    return date(y if y > 99 else 2000 + y, m, d).toordinal()


def unwrapped(x: Any, sizes: Sequence[float] = WRAPS) -> tuple[Any, int]:
    """A counter without the falls at which it begins anew, and their number: it falls by nearly the size of a
    counter, and goes on as before."""
    steps = np.diff(x)
    falls = np.flatnonzero(steps < 0.0)
    rising = steps[steps > 0.0]
    if not len(falls) or len(falls) > 0.2 * len(steps) or not len(rising):
        return x, 0
    largest = 5.0 * float(np.median(rising))
    for size in sizes:
        inside = np.nanmin(x) >= -0.5 * size and np.nanmax(x) < size and np.nanmax(steps) < 0.5 * size
        if inside and np.all((steps[falls] + size >= 0.0) & (steps[falls] + size <= largest)):
            return x + size * np.cumsum(np.diff(x, prepend=x[:1]) < 0.0), len(falls)
    return x, 0


def _rising(table: LoggerTable, time: Any, source: str, head: str) -> Times:
    """The times of the rows in rising order, from the `time` of each row [s], shape (rows,), NaN without one. If the
    last row is the first one in time, the rows are turned round; times of a coarse clock are spread evenly; of rows
    that stand there twice one is left out. Any other times that do not rise are refused."""
    remarks: list[str] = []
    timed = np.flatnonzero(np.isfinite(time))
    if len(timed) < 2:
        raise InputError(f"{table.file}, column {head}: has no times")
    falls = time[timed[0]] > time[timed[-1]] and bool(np.all(np.diff(time[timed]) <= 0.0))
    if falls:
        remarks.append("the last row is the first one in time")
        timed = timed[::-1]
    t = time[timed]
    if falls and not source.startswith("time in"):
        t = t - t[0]
    steps = np.diff(t)
    _refuse_names(table, timed, np.flatnonzero(steps <= 0.0))
    _refuse_falls(table, timed, t)
    still = np.flatnonzero(steps == 0.0)
    share, even = len(still) / len(steps), _even(t)
    different = [k for k in still if table.rows[timed[k]] != table.rows[timed[k + 1]]]
    if share > SOME and even is not None and (different or share > COARSE):
        t = even
        longest = 1 + _longest(steps == 0.0)
        remarks.append(f"a coarse clock, up to {longest} rows at one time: spread evenly")
    elif share > COARSE:
        raise _coarse(table, t, head)
    elif different:
        k = different[0]
        raise _not_later(table, int(timed[k + 1]), t[k : k + 2], "delete one of the two rows")
    elif len(still):
        keep = np.append(True, steps > 0.0)
        remarks.append(f"{len(still)} doubled rows left out")
        timed, t = timed[keep], t[keep]
    return Times(t, timed, np.where(np.isfinite(time), 0.0, np.nan), source, remarks)


def _refuse_falls(table: LoggerTable, rows: Any, t: Any) -> None:
    """Refuse times `t` of the `rows` that fall [s]: of many falls the rows are to be sorted, of a few deleted."""
    steps = np.diff(t)
    falls = np.flatnonzero(steps < 0.0)
    if not len(falls):
        return
    remedy = "delete the rows before this line, or those from it on"
    if len(falls) > SOME * len(steps):
        remedy = f"the times run backwards at {len(falls)} rows: sort the rows by time"
    raise _not_later(table, int(rows[falls[0] + 1]), t[falls[0] : falls[0] + 2], remedy)


def _refuse_names(table: LoggerTable, rows: Any, places: Any) -> None:
    """Refuse a table in which another name stands in each row whose time does not go on: `rows` are its rows in the
    order of time, `places` the places among them after which the time does not rise."""
    for k, cell in enumerate(table.rows[rows[0]] if len(places) else []):
        if is_data(cell) or MISSING.fullmatch(cell):
            continue
        names = [(table.rows[rows[i]][k], table.rows[rows[i + 1]][k]) for i in places]
        if all(first != second for first, second in names):
            raise InputError(
                f"{table.file}, column {table.heads[k]}: changes from {printable(names[0][0], 40)} to "
                f"{printable(names[0][1], 40)} at one time; {NAMES_IN_ROWS}"
            )


def _not_later(table: LoggerTable, row: int, pair: Any, remedy: str) -> InputError:
    return InputError(
        f"{table.file}, line {table.lines[row]}: time = {pair[1]:.12g} s: must be later than {pair[0]:.12g} s of the "
        f"line before; {remedy}"
    )


def _longest(flags: Any) -> int:
    """The length of the longest series of true values among `flags`, shape (n,)."""
    ends = np.flatnonzero(np.concatenate([[True], ~flags, [True]]))
    return int(np.max(np.diff(ends))) - 1


def _even(t: Any) -> Any:
    """Even times of rows whose clock is coarse, from the times `t` [s], shape (rows,): they lie on a line through the
    rows at which the clock goes on. None for rows that are not even."""
    ticks = 1 + np.flatnonzero(np.diff(t) > 0.0)
    if len(ticks) < 3:
        return None
    even = np.polynomial.Polynomial.fit(ticks, t[ticks], 1)(np.arange(len(t)))
    step, tick = float(even[1] - even[0]), float(np.median(np.diff(t[ticks])))
    is_near = step > 0.0 and np.max(np.abs(even[ticks] - t[ticks])) <= max(step, min(tick, 3.0 * step))
    # the clock goes on up to one row before, by half a row on average
    return even + 0.5 * step if is_near else None


def _coarse(table: LoggerTable, t: Any, head: str) -> InputError:
    """The refusal of times that do not resolve the rows."""
    steps = int(np.sum(np.diff(t) > 0.0))
    cause = (
        f"the time goes on {steps} times in {len(t)} rows, and not evenly"
        if steps
        else "all rows have one time"
    )
    if t[0] > 1e9 and t[0] % 2.0**6 == 0.0:
        cause += " (a number of 32 bits does not hold a date in seconds)"
    return InputError(
        f"{table.file}, column {head}: {cause}: write the time of each row, from the first one on, to a tenth of the "
        "time between rows"
    )


def complete_rows(table: LoggerTable, columns: Mapping[int, Any]) -> tuple[Any, list[str]]:
    """Whether a row has a number in all `columns` (numbers by the place of the column), shape (rows,); and words on
    the rows that have not, if there are such.

    Raises
    ------
    InputError
        for a column in which more than a share `LOST` of the numbers is missing.
    """
    whole = np.ones(len(table.rows), bool)
    for place, x in columns.items():
        missing = np.isnan(x)
        if np.mean(missing) > LOST:
            kinds = ", ".join(_kinds_of(table, place, missing))
            raise InputError(
                f"{table.file}, column {table.heads[place]}: {missing.sum()} of {len(x)} rows have no number "
                f"({kinds}); must be <= {100.0 * LOST:.0f} %: delete these rows, or give the column another head, so "
                "that it is left out"
            )
        whole &= ~missing
    count = int(np.sum(~whole))
    if not count:
        return whole, []
    cells = [cell for place, x in columns.items() for cell in _kinds_of(table, place, np.isnan(x))]
    rows = "row" if count == 1 else "rows"
    return whole, [f"{count} {rows} without a number ({', '.join(dict.fromkeys(cells))})"]


def _kinds_of(table: LoggerTable, place: int, missing: Any) -> Iterator[str]:
    """The different cells of a column in the rows that are `missing`, shape (rows,)."""
    yield from dict.fromkeys(printable(table.rows[k][place], 20) or "empty" for k in np.flatnonzero(missing))


def decimal_words(table: LoggerTable, signs: Iterable[str], places: Iterable[int]) -> str:
    """Words on the mark between columns, and on decimal signs and marks of thousands in the columns at `places`."""
    names = {".": "decimal point", ",": "decimal comma"}
    sign_names = " and ".join(names[sign] for sign in sorted(signs, reverse=True))
    text = f"{MARKS[table.mark]} between columns{', ' if sign_names else ''}{sign_names}"
    return f"{text}, marks of thousands" if any(_has_thousands(table.column(k)) for k in places) else text


def _has_thousands(cells: Sequence[str]) -> bool:
    text = "\n".join(cells)
    if re.search(r"[.,]\d*[.,]", text) and any(shape.search(text) for _, shape, _ in _SHAPES.values()):
        return True
    return any(sign in text for sign in _BLANKS) and bool(_GROUP.search(text))
