"""A report on the terminal: its short form. Warnings and notes come last, next to the prompt."""

from __future__ import annotations

import io
import re
from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cache, partial
from textwrap import shorten

from rich.console import Console
from rich.table import Table as Grid
from rich.text import Text as Styled

from ..core.unit_table import UNITS
from ..reading.text import DEFAULT_UNITS, Units, number
from .blocks import VERDICTS, Block, Cell, Judgement, Report, Share, Table, Text
from .lines import Aside, Line, Name, Number, Piece, Strong, pieces

_LAST = {"warning": "Warning: ", "note": "Note: "}
_BRACKETS = re.compile(r" ?\([^()]*\)")
_UNIT = re.compile(r"(?<=\d) ([^\s,;()]+(?: m[²³]?(?![\w/]))?)")
_KEPT = "\ue000"
"""The mark of a blank at which no line may end."""
_CLAUSE_END = re.compile(r"(?<=.{30})(?:[:;.] |, (?=(?:which|where|as|so that) ))")


def plain_line(line: Line, units: Units = DEFAULT_UNITS) -> str:
    """A line as plain text."""
    return "".join(_plain(piece, units) for piece in pieces(line))


def _plain(piece: Piece, units: Units) -> str:
    """A piece of a line as text."""
    match piece:
        case Number():
            digits = piece.digits or (6 if piece.as_given else 3)
            return number(
                piece.value,
                piece.unit,
                piece.kind,
                digits,
                full=not piece.as_given,
                none=piece.none,
                units=units,
            )
        case Name():
            return piece.text
        case Strong():
            return plain_line(piece.line, units)
        case Aside():
            return f" ({plain_line(piece.line, units)})"
        case _:
            return piece


def plain_cell(cell: Cell, units: Units) -> str:
    """A cell of a table as plain text."""
    return plain_line(cell.utilisation if isinstance(cell, Share) else cell, units)


def show(report: Report, console: Console, *, remarks: bool = True) -> None:
    """Print the short form. `remarks` is false where the remarks were printed before the study ran."""
    title = report.title
    closing: list[str] = []
    for block in report.blocks("short"):
        role = _role(block)
        if isinstance(block, Table):
            if title:
                console.print(title, style="bold", soft_wrap=True)
            _show_table(block, console, report.units)
            title = ""
        elif role in _LAST:
            closing += [_LAST[role] + sentence for sentence in _sentences(block, report.units)]
        elif remarks or role != "remark":
            prefix = "Remark: " if role == "remark" else ""
            for sentence in _sentences(block, report.units):
                console.print(prefix + sentence, soft_wrap=True)
    for sentence in closing:
        console.print(sentence, soft_wrap=True)


_LINES, _WARNINGS, _ROWS = 45, 5, 3
"""Lines of one screen, warnings on it, and rows up to which a table is cut to the room that is left."""
_RAGGED = 20
"""Letters of the longest word that does not fit at the end of the first line of a warning."""


def screen(report: Report, console: Console, rest: str) -> None:
    """Print one screen: judgements and the central blocks as far as there is room, warnings of up to two lines each,
    and where the rest is (`rest`)."""
    blocks = report.screen
    closing = [
        _LAST[_role(block)] + sentence
        for block in blocks
        if _role(block) in _LAST
        for sentence in _sentences(block, report.units)
    ]
    warnings = [sentence for sentence in closing if sentence.startswith(_LAST["warning"])][:_WARNINGS]
    if len(closing) > len(warnings):
        rest = f"Warnings and notes not shown: {len(closing) - len(warnings)}. {rest}"
    most = 2 * (console.width - 1) - _RAGGED
    shown = [_with_units(cut(warning, most)) for warning in warnings]
    end = [_printed(console, partial(console.print, text)).replace(_KEPT, " ") for text in shown]
    end.append(_printed(console, lambda: console.print(rest)))
    room = _LINES - sum(map(_lines, end))
    title = f"{report.title}\n" if report.title else ""
    for block in blocks:
        if _role(block) in (*_LAST, "remark"):
            continue
        if isinstance(block, Table):
            text = _first_rows(block, console, report.units, _lines, room - _lines(title), _ROWS)
            text, title = (title + text, "") if text else ("", title)
        else:
            paragraph = _with_units("\n".join(_sentences(block, report.units)))
            text = _printed(console, partial(console.print, paragraph)).replace(_KEPT, " ")
        if text.strip() and _lines(text) <= room:
            console.file.write(text)
            room -= _lines(text)
    console.file.write("".join(end))


def cut(text: str, width: int) -> str:
    """A text of at most `width` letters: if it is too long, its first clauses; a bracket is whole or left out."""
    trials = text, _BRACKETS.sub("", text)
    if whole := next((trial for trial in trials if len(trial) <= width), ""):
        return whole
    for trial in trials:
        brackets = [bracket.span() for bracket in _BRACKETS.finditer(trial)]
        ends = [place.start() for place in _CLAUSE_END.finditer(trial) if place.start() < width]
        if outside := [end for end in ends if not any(low <= end < high for low, high in brackets)]:
            return f"{trial[: outside[-1]]}."
    return shorten(text, width, placeholder=" ...")


def _with_units(text: str) -> str:
    """The text with a mark in place of each blank between a number and its unit."""

    def kept(match: re.Match[str]) -> str:
        name, *_ = re.split(r"[ /.:²³]", match[1])
        return match[0].replace(" ", _KEPT) if name in UNITS else match[0]

    return _UNIT.sub(kept, text)


def _printed(console: Console, show: Callable[[], None]) -> str:
    with console.capture() as printed:
        show()
    return printed.get()


def _lines(text: str) -> int:
    return text.count("\n")


def _first_rows(
    table: Table, console: Console, units: Units, size: Callable[[str], int], room: int, fewest: int = 1
) -> str:
    """A table as the console prints it, with as many of its first rows as have room: the `size` of the text is up to
    `room`, and a row adds 1 to it at least. Empty if less than `fewest` rows, or than all, have room."""

    @cache
    def printed(count: int) -> str:
        """The first rows of the table as they are printed, and how many are not shown."""
        part = replace(table, rows=table.rows[:count])
        text = _printed(console, partial(_show_table, part, console, units))
        lines = [line.rstrip() for line in text.splitlines()]
        lines += [f"... and {len(table.rows) - count} more rows"] if count < len(table.rows) else []
        return "".join(f"{line}\n" for line in lines)

    total = len(table.rows)
    if total <= room and size(whole := printed(total)) <= room:
        return whole
    counts = range(min(fewest, total), min(total - 1, room) + 1)
    fitting = bisect_right(counts, room, key=lambda count: size(printed(count)))
    return printed(counts[fitting - 1]) if fitting else ""


def judgements(report: Report) -> list[str]:
    """The judgements of the answer; of a report without one the first sentence."""
    blocks = report.blocks("short")
    graded = [block for block in blocks if _role(block) in VERDICTS]
    first = [block for block in blocks if _role(block) == "plain"][:1]
    return [sentence for block in graded or first for sentence in _sentences(block, report.units)]


def remarks(report: Report, role: str) -> list[str]:
    """The warnings of a report (`role` "warning") or its notes ("note"), a sentence each."""
    blocks = [block for block in report.blocks("short") if _role(block) == role]
    return [sentence for block in blocks for sentence in _sentences(block, report.units)]


_MOST_LETTERS = 1990
"""Largest length of the text for a screen of Python."""


def brief(report: Report, count: int) -> str:
    """The judgements, the texts and the tables of the short form for which there is room, as plain text, and the
    number of the warnings, `count`. A table is cut to its first rows."""
    out = io.StringIO()
    console = Console(file=out, width=100, markup=False, highlight=False, force_jupyter=False, no_color=True)
    end = f"Warnings: {count}. " if count else ""
    end += "All numbers: answers, to_json()."
    pieces = [f"The run stopped early: {plain_line(report.failure)}."] if report.failure else []
    title, room = report.title, _MOST_LETTERS - len(end) - sum(map(len, pieces))
    for block in report.blocks("short"):
        if _role(block) in (*_LAST, "remark"):
            continue
        if isinstance(block, Table):
            text = _first_rows(block, console, report.units, len, room - len(title) - 1).rstrip("\n")
            text, title = (f"{title}\n{text}".lstrip("\n"), "") if text else ("", title)
        else:
            text = "\n".join(_sentences(block, report.units))
            if _role(block) in VERDICTS:
                text = shorten(text, max(room - 1, 80), placeholder=" ...") if len(text) >= room else text
        if text.strip() and len(text) < room:
            pieces.append(text)
            room -= len(text) + 1
    return "\n".join([*pieces, end])


def _role(block: Block) -> str:
    return block.severity if isinstance(block, Judgement) else block.role if isinstance(block, Text) else ""


def _sentences(block: Block, units: Units) -> list[str]:
    """The sentences of a judgement or a text."""
    if isinstance(block, Judgement):
        return [plain_line(item, units) for item in block.items or (block.line,)]
    return [plain_line(block.line, units)] if isinstance(block, Text) else []


def _show_table(table: Table, console: Console, units: Units) -> None:
    """Print a table. Where it is too wide, print a table for each group of columns, with the columns of no group; a
    group whose words do not fit is parted into further tables."""
    grids = [_grid(table, units)]
    widest = console.options.update(width=10_000)
    if console.measure(grids[0], options=widest).maximum > console.width:
        parts = (part for group in _grouped(table) for part in _parted(group, units, console.width))
        grids = [_grid(part, units, console.width) for part in parts]
    for grid in grids:
        if table.title:
            console.print(Styled(plain_line(table.title, units), "italic"))
        console.print(grid)


def _grouped(table: Table) -> Iterator[Table]:
    """A table for each group of columns, with the columns of no group; the table itself if it has no two groups."""
    if len(table.groups) < 2:
        yield table
        return
    grouped = {k for group in table.groups for k in group}
    for group in table.groups:
        yield table.of_columns(k for k in range(table.width) if k in group or k not in grouped)


def _parted(table: Table, units: Units, room: int) -> list[Table]:
    """The table in parts that fit into the width `room`, each with the first column, where the words of all columns
    are too wide for it; a table with notes stays whole."""
    columns = _columns(table)
    word_sizes = sum(max(len(word) for cell in column for word in _words(cell, units)) for column in columns)
    if (
        table.note_title
        or not table.columns
        or not table.numeric
        or word_sizes + 3 * len(columns) + 1 <= room
    ):
        return [table]
    widths = [max(len(part) for cell in column for part in _parts(cell, units)) + 3 for column in columns]
    parts = [[0]]
    for k in range(1, len(columns)):
        if len(parts[-1]) > 1 and sum(widths[place] for place in (*parts[-1], k)) + 1 > room:
            parts.append([0])
        parts[-1].append(k)
    return [table.of_columns(part) for part in parts]


def _columns(table: Table) -> list[list[Cell]]:
    """The cells of each column, the first of which is its head, and after them the cells of the notes."""
    heads: list[Cell] = [column.short or column.title for column in table.columns] or [""] * table.width
    columns = [[head, *(row.cells[k] for row in table.rows)] for k, head in enumerate(heads)]
    return [*columns, [table.note_title, *(row.note for row in table.rows)]] if table.note_title else columns


def _grid(table: Table, units: Units, room: int | None = None) -> Grid:
    """The table, narrowed to the width `room` [letters] if there is one."""
    columns = _columns(table)
    grid = Grid(show_header=bool(table.columns))
    widths = _widths(columns, units, room) if room else [None] * len(columns)
    for k, (column, width) in enumerate(zip(columns, widths, strict=True)):
        is_note = k == table.width
        right = table.numeric and k > 0 and not is_note and not (table.columns and table.columns[k].of_text)
        grid.add_column(plain_cell(column[0], units), justify="right" if right else "left", width=width)
    for cells in zip(*(column[1:] for column in columns), strict=True):
        grid.add_row(*(plain_cell(cell, units) for cell in cells))
    return grid


def _widths(columns: Sequence[Sequence[Cell]], units: Units, room: int) -> list[int]:
    """The widths of columns in a table of the width `room`; the first cell of a column is its head. Heads wrap first,
    then words in cells. Only where that is not enough, numbers are parted from their units. The widest column is
    narrowed first."""
    texts = [[plain_cell(cell, units) for cell in column] for column in columns]
    widths = [max(map(len, column)) for column in texts]
    whole = [max(len(part) for cell in column for part in _parts(cell, units)) for column in columns]
    word_sizes = [max(len(word) for cell in column for word in _words(cell, units)) for column in columns]
    heads = [max(len(piece) for piece in (*column[0].split(), *column[1:], "")) for column in texts]
    borders = 3 * len(columns) + 1
    for least in (heads, whole, word_sizes):
        while sum(widths) + borders > room:
            wide = [k for k, width in enumerate(widths) if width > least[k]]
            if not wide:
                break
            widths[max(wide, key=lambda k: widths[k])] -= 1
    return widths


def _words(cell: Cell, units: Units) -> list[str]:
    return plain_cell(cell, units).split() or [""]


def _parts(cell: Cell, units: Units) -> list[str]:
    """The parts of a cell that stay on one line: words, and numbers with their units."""
    parts = [""]
    for piece in pieces(cell.utilisation if isinstance(cell, Share) else cell):
        if isinstance(piece, Number):
            parts += _plain(piece, units).replace(" (", "\n(").split("\n")
        elif isinstance(piece, Strong | Aside):
            parts += _parts(piece.line, units)
        else:
            parts += plain_line(piece, units).split()
    return parts
