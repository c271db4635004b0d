"""The table in the text of a logger: the mark between its columns, its heads with units, and its rows of cells."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from ..core.errors import InputError, printable
from ..core.inputs import lines_of_table
from ..core.units import dimension

FEWEST = 100
"""Fewest rows of a recording."""
MARKS = {"\t": "tabs", ";": "semicolons", "|": "bars", ",": "commas", "  ": "blanks", " ": "blanks"}
"""By mark between columns, its name; two blanks stand for two or more, one for one or more. Of marks that fit alike
the first counts."""
MISSING = re.compile(
    r"|[+-]?(?:nan|1\.#\w+)|n/?a|none|null|[+-]?(?:ol|0l|over(?:load|flow|range|flw)?|inf(?:inity)?)|-+|\*+|\?+|#+"
    r"|#(?:n/a|value!|div/0!|num!|ref!|null!|wert!|nv)|err(?:or)?|invalid|bad|---?\.-*|\++|n\.a\.|[<(]null[>)]|o\.l\.?"
    r"|ovld|ovfl|under(?:load|flow|range)?|burn-?out|open|undefined|fault|time-?out|no[ _-]?(?:data|signal|value)"
    r"|(?:out[ _]of|over)[ _]range|bad[ _](?:input|value|data)|comm?[ _](?:fail|err)(?:ure|or)?",
    re.IGNORECASE,
)
"""Cells without a measurement, and of a meter whose range is exceeded."""
CLOCK = re.compile(
    r"(?:(?P<days>\d+) days? |(?P<span>\d+)\.(?=\d\d:\d\d:\d\d))?"
    r"(?P<h>\d{1,3}):(?P<m>\d{2}|\d(?=:))(?::(?P<s>\d{1,2}))?(?:[.,:](?P<f>\d+))?"
    r"(?: ?(?P<half>[AaPp])\.?[Mm]\.?)?(?P<zone> ?(?:[A-Z]{1,5}|[+-]\d\d:?(?:\d\d)?))?"
)
"""A time of the day, or one that has passed, such as 23:59:40.024, 11:59:40 PM, 59:40.0 and 0 days 00:00:00.024."""
DATE = re.compile(
    r"\d{1,4}([-/.])\d{1,2}\1\d{1,4}|\d{1,4}[-/. ]+[^\W\d_]{3,9}\.?[-/., ]+\d{2,4}"
    r"|[^\W\d_]{3,9}\.? \d{1,2},? \d{4}"
)
_COMPACT = re.compile(r"(\d{4})(\d\d)(\d\d)[T_ ](\d\d)(\d\d)(\d\d)(?=\D|$)")
_NUMBER = re.compile(
    r"[+-]?\s*(?:\d+(?:[.,' \u00a0\u2009\u202f’]\d{3})*(?:[.,]\d*)?|[.,]\d+)(?:[eEdD][+-]?\d+)?"
)
WITH_UNIT = re.compile(rf"({_NUMBER.pattern}) ?([^\W\d_][\w/%]{{0,5}}|%)")
"""A number with its unit in one cell."""
_COMMENTS = ("#", "%", "//", "!")
_REMARK = re.compile(r"\s#(?!N/A|NV|VALUE|DIV|NUM|REF|NULL|WERT).*$", re.IGNORECASE)
_SAMPLE, _FOOTER, _ABOVE, _PREAMBLE, _LONGEST = 400, 50, 12, 5000, 50_000
"""Lines by which mark and head are found, most lines of a footer, most lines above the rows that may be heads, most
lines above the head, and most characters of a line."""
_WORDS = {
    "volts": "V", "amps": "A", "amperes": "A", "watts": "W", "msec": "ms", "millisecond": "ms", "milliseconds": "ms",
    "usec": "µs", "microseconds": "µs", "sek": "s", "secs": "s", "sekunden": "s", "newton meter": "N m",
    "newton-meter": "N m", "n-m": "N m", "lb-ft": "lbf ft", "lbf-ft": "lbf ft", "ft-lb": "lbf ft", "ft-lbf": "lbf ft",
    "lb ft": "lbf ft", "ft lb": "lbf ft", "ft lbs": "lbf ft", "ft-lbs": "lbf ft", "in lb": "lbf in",
    "in-lb": "lbf in", "in lbs": "lbf in", "in-lbs": "lbf in", "in-lbf": "lbf in", "lb in": "lbf in",
    "lb-in": "lbf in", "lbf-in": "lbf in",
    "newtonmeter": "N m", "newton-metre": "N m", "rev per min": "rev/min", "rpm": "rpm", "upm": "rev/min",
    "tr/min": "rev/min", "umdr./min": "rev/min", "rps": "rev/s", "dps": "deg/s", "sek.": "s",
}  # fmt: skip
"""Units as loggers write them, and as `chainunit.core.units` reads them."""
NAMES_IN_ROWS = "a table with the name of the quantity in each row needs a column for each quantity instead"
"""The remedy for a table that has the quantities below one another."""


@dataclass(frozen=True)
class LoggerTable:
    """The heads of a table with their units ("" where there is none), its rows of cells with the numbers of their
    lines, and words on what was left out."""

    file: Path
    mark: str
    heads: list[str]
    units: list[str]
    rows: list[list[str]]
    lines: list[int]
    left_out: list[str]

    def column(self, place: int) -> list[str]:
        """The cells of a column."""
        return [cells[place] for cells in self.rows]

    def has_numbers(self, place: int) -> bool:
        """Whether the first row of a column has a number, and no time."""
        cell = self.rows[0][place]
        return is_data(cell) and not is_time(cell)

    def place_of(self, row: int, place: int) -> str:
        """The file, line, column and head of a cell, in words."""
        return f"{self.file}, line {self.lines[row]}, column {place + 1}, {self.heads[place]}"


def read_table(file: Path, text: str, names: Iterable[str]) -> LoggerTable:
    """The table in the `text` of a file; a head has the columns of most of these `names`.

    Raises
    ------
    InputError
        for a text that is no table, and for rows that do not fit the head.
    """
    lines = _joined(file, lines_of_table(file, text.replace("\u2212", "-")))
    long = next((number for number, line in lines if len(line) > _LONGEST), 0)
    if long:
        raise InputError(f"{file}, line {long}: has more than {_LONGEST} characters, the most that are read")
    if not any(line.strip() for _, line in lines):
        raise InputError(f"{file}: is empty; must have a head and >= {FEWEST} rows")
    stated = re.fullmatch(r'"?sep=(.)"?', lines[0][1].strip("\r\n"))
    lines = lines[1:] if stated else lines
    names = list(names)
    likely = _likely_head(lines[:_PREAMBLE], names)
    sample = [numbered for numbered in lines[likely : likely + 2 * _SAMPLE] if numbered[1].strip()]
    longest = max((len(line) for _, line in sample), default=1)
    sample = sample[: max(20, min(_SAMPLE, _SAMPLE * 1000 // longest))]
    mark = stated[1] if stated and stated[1] in MARKS else _mark_of([line for _, line in sample])
    begin, filled = _first_row(sample, mark)
    if begin < 0:
        raise InputError(
            f"{file}: is no table: its first line must be the heads of the columns, such as time [s],motor.i [A], "
            "and the next ones must have a number for each of them, with commas, semicolons, tabs, bars or blanks "
            "between them"
        )
    first = cells_of_line(sample[begin][1], mark)
    head, heads = _head_of(file, sample[:begin], first, mark, names)
    while not heads[-1]:
        heads.pop()
    # no tab stands in a head, and some writers have a head for remarks of which no row has a cell
    unfilled = heads[len(first) :] if mark == "\t" else []
    heads = heads[: len(heads) - len(unfilled)]
    if len(first) < len(heads):
        raise InputError(
            f"{file}, line {sample[head][0]}: the head has {len(heads)} cells, and the rows {len(first)}: put a head "
            f"with {MARKS[mark]} in it into quotation marks, or add the cells that are missing"
        )
    below = [cells_of_line(line, mark) for _, line in sample[head + 1 : begin]]
    units = next((row for row in below if _is_of_units(row, len(heads))), [])
    named = [name_and_unit(head_cell, names) for head_cell in heads]
    units = [unit or bare_unit(units[k]) if k < len(units) else unit for k, (_, unit) in enumerate(named)]
    start = next(k for k, (number, _) in enumerate(lines) if number == sample[begin][0])
    rows, numbers, left_out = _body(file, lines[start:], mark, [heads, *below], filled, first)
    if unfilled:
        left_out.append(f"the head {printable(', '.join(unfilled))} without cells")
    if (above := head + likely) > 0:
        left_out.insert(0, f"{above} {'line' if above == 1 else 'lines'} before the head")
    if len(rows) < FEWEST:
        raise InputError(f"{file}: has {len(rows)} rows behind its head; must have >= {FEWEST}")
    return LoggerTable(file, mark, heads, units, rows, numbers, left_out)


def is_time(cell: str) -> bool:
    """Whether a cell is a date, a time of the day, or both."""
    return bool(date_and_clock(cell))


def date_and_clock(cell: str) -> tuple[str, re.Match[str] | None] | None:
    """The date in a cell and its time of the day, of which one may be missing; None for another cell."""
    cell = _COMPACT.sub(r"\1-\2-\3 \4:\5:\6", cell.strip())
    if clock := CLOCK.fullmatch(cell):
        return "", clock
    date = DATE.match(cell)
    if date is None:
        return None
    rest = cell[date.end() :].lstrip("T ,-_")
    clock = CLOCK.fullmatch(rest)
    return None if rest and clock is None else (date[0], clock)


def name_and_unit(head: str, names: Iterable[str] = ()) -> tuple[str, str]:
    """The name of a column and its unit, as its head has them; the unit may be missing. Behind one of the `names` it
    may stand in brackets, or after a stroke, a comma, an underscore or "in"."""
    for name in sorted(names, key=len, reverse=True):
        begin, rest = head[: len(name)], head[len(name) :].strip()
        if begin.lower() != name.lower():
            continue
        if not rest:
            inside = re.search(r"[\[(]([^\])]*)[\])]$|[_/]([^_/ ]+)$", begin)
            unit = bare_unit(inside[1] or inside[2] or "") if inside else ""
            return begin, unit if _is_unit(unit) or "[" in begin else ""
        if not re.match(r"[\[(/,_<:{;]|in ", rest) or (rest[0] == "_" and not _unit_behind(rest)):
            continue
        if unit := _unit_behind(rest):
            return begin, unit
    name, bracket, rest = head.partition("[")
    if not bracket:
        name, bracket, rest = head.partition("(")
    return name.strip(), bare_unit(re.split(r"[\])]", rest)[0])


def _unit_behind(rest: str) -> str:
    """The unit in the `rest` of a head behind its name; empty if there is none."""
    if rest[0] in "[(<{" and (inside := re.findall(r"[\[(<{]([^\])>}]*)[\])>}]", rest)):
        units = [bare_unit(text) for text in inside]
        return next((unit for unit in units if _is_unit(unit)), units[0])
    plain = re.sub(r"^(?:[/,_:;]|in )\s*", "", rest)
    for text in (plain, plain.partition("(")[0], plain.replace("_", "/"), plain.replace("_", " ")):
        if (unit := bare_unit(text)) and _is_unit(unit):
            return unit
    return ""


def bare_unit(text: str) -> str:
    """A unit without brackets, as `chainunit.core.units` reads it."""
    text = re.sub("[·∙•⋅*]", " ", text.strip().strip("[](){}<>").strip())
    return _WORDS.get(text.lower(), text)


def _is_unit(text: str) -> bool:
    try:
        dimension(text)
    except ValueError:
        return text in ("1", "-")
    return True


def _joined(file: Path, lines: list[str]) -> list[tuple[int, str]]:
    """The lines with their numbers; lines in one pair of quotation marks are one."""
    if not any('"' in line for line in lines):
        return list(enumerate(lines, 1))
    joined: list[tuple[int, str]] = []
    opened = 0
    for number, line in enumerate(lines, 1):
        if opened:
            joined[-1] = (opened, f"{joined[-1][1]} {line}")
        else:
            joined.append((number, line))
        if line.count('"') % 2:
            opened = 0 if opened else number
        if opened and number - opened > 5:
            break
    if opened:
        raise InputError(f'{file}, line {opened}: a quotation mark (") opens and does not close; take it out')
    return joined


def cells_of_line(line: str, mark: str) -> list[str]:
    """The cells of a line, with quotation marks by RFC 4180."""
    if mark in (" ", "  "):
        return [cell for cell in re.split(r"\s+" if mark == " " else r"\s{2,}|\t", line.strip()) if cell]
    return [cell.strip() for cell in next(csv.reader([line], delimiter=mark, skipinitialspace=True), [])]


def is_data(cell: str) -> bool:
    """Whether a cell has a number, with a unit or without one, or a time."""
    return bool(_NUMBER.fullmatch(cell) or WITH_UNIT.fullmatch(cell)) or is_time(cell)


def _is_row(cells: Sequence[str]) -> bool:
    """Whether cells are a row of measurements: at least half of the cells that are not empty are numbers."""
    filled = [cell for cell in cells if not MISSING.fullmatch(cell)]
    return len(cells) > 1 and 2 * sum(map(is_data, filled)) >= max(1, len(filled))


def _likely_head(lines: Sequence[tuple[int, str]], names: Iterable[str]) -> int:
    """The place of the first line with two of the `names`, and at least half as many as another line; 0 without one.
    Tables of channels and settings stand above it."""
    lower = [name.lower() for name in names]
    counts = [sum(name in text for name in lower) for text in (line.lower() for _, line in lines)]
    return next((k for k, count in enumerate(counts) if count >= max(2.0, 0.5 * max(counts))), 0)


def _mark_of(lines: Sequence[str]) -> str:
    """The mark with which most lines of the latter half are rows of one length: above the head, and below the rows,
    marks may stand within cells."""

    def fitting(mark: str) -> int:
        counts = Counter(
            len(row) for line in lines[len(lines) // 2 :] if _is_row(row := cells_of_line(line, mark))
        )
        return max(counts.values(), default=0)

    counts = {mark: fitting(mark) for mark in MARKS}
    return next(mark for mark in MARKS if counts[mark] >= 0.95 * max(counts.values()))


def _first_row(sample: Sequence[tuple[int, str]], mark: str) -> tuple[int, tuple[bool, ...]]:
    """The place of the first row of measurements in a `sample` of lines, each with its number, and by column whether
    it has data; -1 and nothing without such a row. Columns with data are those of most rows: the first row has data
    in each of them, or the sign of a missing number."""
    rows = [cells_of_line(line, mark) for _, line in sample]
    shapes = [
        tuple(map(is_data, row)) if _is_row(row) and not row[0].startswith(_COMMENTS) else () for row in rows
    ]
    usual = Counter(shape for shape in shapes if shape).most_common(1)
    if not usual:
        return -1, ()
    columns = usual[0][0]

    def is_first(row: Sequence[str], shape: Sequence[bool]) -> bool:
        if len(shape) != len(columns):
            return False
        pairs = zip(row, shape, columns, strict=True)
        return all(has or not needs or MISSING.fullmatch(cell) for cell, has, needs in pairs)

    pairs = zip(rows, shapes, strict=True)
    return next(k for k, (row, shape) in enumerate(pairs) if is_first(row, shape)), columns


def _head_of(
    file: Path, above: Sequence[tuple[int, str]], first: Sequence[str], mark: str, names: Sequence[str]
) -> tuple[int, list[str]]:
    """The place of the head among the lines above the first row, and its cells: the line with most of the `names`, or
    else the last one that is not of units."""
    best, place, heads = -1, -1, list[str]()
    for k in reversed(range(max(0, len(above) - _ABOVE), len(above))):
        line = above[k][1].strip()
        for comment in _COMMENTS:
            line = line.removeprefix(comment)
        cells = _heads_in(line, mark, len(first))
        matching = sum(
            bool(cell) and any(name_and_unit(cell, [name])[0].lower() == name.lower() for name in names)
            for cell in cells
        )
        if not any(cells) or len(cells) < 2 or (matching == 0 and _is_row(cells)):
            continue
        if matching > best and not (matching == 0 and _is_of_units(cells, len(cells))):
            best, place, heads = matching, k, cells
    if not heads:
        more = ""
        if any(not is_data(cell) for cell in first) and any(map(is_time, first)):
            more = f"; {NAMES_IN_ROWS}"
        raise InputError(
            f"{file}: has no head: its first row has values; write the heads of the columns into a line above it, "
            f"such as time [s],motor.i [A]{more}"
        )
    return place, heads


def _heads_in(line: str, mark: str, count: int) -> list[str]:
    """The heads in a line; between blanks those of as many columns, if blanks within heads allow it."""
    if mark not in (" ", "  "):
        return cells_of_line(line, mark)
    outside = [part.strip() for part in re.split(r"\s+(?![^\[(]{0,99}[\])])(?![\[(])", line.strip())]
    ways = [cells_of_line(line, "  "), cells_of_line(line, " "), outside]
    return next((way for way in ways if len(way) == count), outside)


def _is_of_units(cells: Sequence[str], count: int) -> bool:
    filled = [bare_unit(cell) for cell in cells if cell]
    return 0 < len(cells) <= count and bool(filled) and 2 * sum(map(_is_unit, filled)) > len(filled)


def _body(
    file: Path,
    lines: Sequence[tuple[int, str]],
    mark: str,
    above: Sequence[Sequence[str]],
    filled: Sequence[bool],
    first: Sequence[str],
) -> tuple[list[list[str]], list[int], list[str]]:
    """The rows of measurements, the numbers of their lines, and what was left out, in words. The lines `above` the
    `first` row, from the head on, may be repeated on each page; most rows have data where they are `filled`."""
    heads, pages = above[0], {tuple(map(str.lower, cells)) for cells in above}
    width = len(heads)
    key = next((k for k, is_filled in enumerate(filled[:width]) if is_filled), -1)
    if key < 0:
        raise InputError(f"{file}: no column with numbers has a head; write a head for each column")
    # a date and a clock between blanks are one cell under one head
    parted = mark == " " and len(first) == width + 1 and bool(DATE.fullmatch(first[key]))
    rows, numbers, strange = list[list[str]](), list[int](), list[tuple[int, list[str]]]()
    repeated = remarks = 0
    for number, line, cells in _cells(file, lines, mark):
        if parted and len(cells) > key + 1:
            cells[key : key + 2] = [f"{cells[key]} {cells[key + 1]}"]
        # one test suffices for nearly all rows of a file
        if len(cells) != width or not cells[key][-1:].isdigit():
            if not any(cells):
                continue
            if cells[0].startswith(_COMMENTS):
                remarks += 1
                continue
            if _REMARK.search(line) and len(cut := cells_of_line(_REMARK.sub("", line), mark)) == width:
                cells, remarks = cut, remarks + 1
            if len(cells) > width and not any(cells[width:]):
                cells = cells[:width]
            if tuple(map(str.lower, cells)) in pages:
                repeated += 1
                # the title of the page
                while strange and (not rows or strange[-1][0] > numbers[-1]):
                    strange.pop()
                    repeated += 1
                continue
            if len(cells) != width or not (is_data(cells[key]) or MISSING.fullmatch(cells[key])):
                strange.append((number, cells))
                continue
        elif "#" in cells[-1] and (last := _REMARK.sub("", f" {cells[-1]}").strip()) != cells[-1]:
            cells[-1], remarks = last, remarks + 1
        rows.append(cells)
        numbers.append(number)
    wrong = [
        (number, cells)
        for number, cells in strange
        if (rows and number < numbers[-1]) or not _may_end(cells, key, width, number == strange[-1][0])
    ]
    if strange and (wrong or len(strange) > _FOOTER or not rows):
        number, cells = (wrong or strange)[0]
        raise InputError(f"{file}, line {number}: {_words(cells, heads, mark)}")
    counts = ((repeated, "line", " of repeated heads"), (remarks, "comment", ""))
    left_out = [f"{count} {noun}{'s' if count > 1 else ''}{more}" for count, noun, more in counts if count]
    if strange:
        noun, verb = ("line", "is no row") if len(strange) == 1 else ("lines", "are no rows")
        left_out.append(f"{len(strange)} {noun} at the end that {verb}")
    return rows, numbers, left_out


def _may_end(cells: Sequence[str], key: int, width: int, is_last: bool) -> bool:
    """Whether a line that is no row may stand below all rows: a footer, without a number in the column `key`, or the
    last row, which is cut."""
    has_number = key < len(cells) and is_data(cells[key])
    return not has_number or (is_last and len(cells) < width)


def _cells(file: Path, lines: Sequence[tuple[int, str]], mark: str) -> Iterator[tuple[int, str, list[str]]]:
    """Each line with its number and its cells: between blanks, or as CSV with quotation marks."""
    if mark in (" ", "  "):
        yield from ((number, line, cells_of_line(line, mark)) for number, line in lines)
        return
    has_quotes = any('"' in line for _, line in lines)
    reader = csv.reader(
        (line for _, line in lines),
        delimiter=mark,
        skipinitialspace=True,
        quoting=csv.QUOTE_MINIMAL if has_quotes else csv.QUOTE_NONE,
    )
    number = 0
    try:
        for (number, line), cells in zip(lines, reader, strict=True):
            yield number, line, [cell.strip() for cell in cells] if " " in line or "\t" in line else cells
    except csv.Error as error:
        raise InputError(f"{file}, line {number}: no valid CSV ({error})") from error


def _words(cells: Sequence[str], heads: Sequence[str], mark: str) -> str:
    """Words on a row that does not fit the head."""
    count = f"has {len(cells)} {'cell' if len(cells) == 1 else 'cells'}, and the head {len(heads)}"
    if len(cells) > len(heads):
        if mark == ",":
            return (
                f"{count}: a comma stands within a number or a text, or a head is missing; put semicolons between "
                "the columns, write decimal points, put the cell in quotation marks, or, if no number has a comma, "
                "write a head for each column"
            )
        return (
            f"{count}: {MARKS[mark]} stand within a cell, or a head is missing; put the cell in quotation marks, or "
            "write a head for each column"
        )
    if len(cells) < len(heads):
        return f"{count}: a mark between columns is left out, or a cell; mend this row, or delete it"
    return f"{printable(cells[0], 40) or 'a text'}: is no row of measurements; delete it, or begin it with #"
