"""A report on the terminal: its short form, what is wrong and what it rests on last, next to the prompt."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console
from rich.table import Table as Grid
from rich.text import Text as Styled

from ..text import DEFAULT_UNITS, Units, number
from .blocks import Block, Cell, Judgement, Report, Share, Table, Text
from .lines import Aside, Line, Number, Piece, Strong, Words, pieces

_LAST = {"warning": "Warning: ", "note": "Note: "}


def plain_line(line: Line, units: Units = DEFAULT_UNITS) -> str:
    """A line in plain letters."""
    return "".join(_plain(piece, units) for piece in pieces(line))


def _plain(piece: Piece, units: Units) -> str:
    match piece:
        case Number():
            digits = piece.digits or (6 if piece.given else 3)
            return number(
                piece.value,
                piece.unit,
                piece.kind,
                digits,
                full=not piece.given,
                none=piece.none,
                units=units,
            )
        case Words():
            return piece.text
        case Strong():
            return plain_line(piece.line, units)
        case Aside():
            return f" ({plain_line(piece.line, units)})"
        case _:
            return piece


def plain_cell(cell: Cell, units: Units) -> str:
    """A cell of a table in plain letters."""
    return plain_line((cell.used,) if isinstance(cell, Share) else cell, units)


def show(report: Report, console: Console, *, remarks: bool = True) -> None:
    """Print the short form; without `remarks` where they were printed before the study ran."""
    title = report.title
    last: list[str] = []
    for block in report.blocks("short"):
        if isinstance(block, Table):
            if title:
                console.print(title, style="bold", soft_wrap=True)
            _show_table(block, console, report.units)
            title = ""
        elif (prefix := _LAST.get(_role(block))) is not None:
            last += [prefix + words for words in _sentences(block, report.units)]
        elif remarks or _role(block) != "remark":
            prefix = "Remark: " if _role(block) == "remark" else ""
            for words in _sentences(block, report.units):
                console.print(prefix + words, soft_wrap=True)
    for words in last:
        console.print(words, soft_wrap=True)


def _role(block: Block) -> str:
    return block.severity if isinstance(block, Judgement) else block.role if isinstance(block, Text) else ""


def _sentences(block: Block, units: Units) -> list[str]:
    if isinstance(block, Judgement):
        return [plain_line(each, units) for each in block.items or (block.line,)]
    return [plain_line(block.line, units)] if isinstance(block, Text) else []


def _show_table(table: Table, console: Console, units: Units) -> None:
    """One table; where that is too wide, one for each group of columns beside those that are in none."""
    widest = console.options.update(width=10_000)
    title = plain_line(table.title, units)
    count = len(table.columns) or len(table.rows[0].cells)
    whole = _grid(table, range(count), units, title)
    if console.measure(whole, options=widest).maximum <= console.width or len(table.groups) < 2:
        console.print(whole)
        return
    grouped = {i for group in table.groups for i in group}
    for group in table.groups:
        console.print(_grid(table, [i for i in range(count) if i not in grouped or i in group], units, title))


def _grid(table: Table, places: Sequence[int], units: Units, title: str) -> Grid:
    if table.columns:
        places = [i for i in places if table.columns[i].form != "long"]
    grid = Grid(title=Styled(title) if title else None, title_justify="left", show_header=bool(table.columns))
    for i in places:
        head = (table.columns[i].short or plain_line(table.columns[i].title, units)) if table.columns else ""
        # a column of names that rich makes as narrow as it can loses the ends of long words
        grid.add_column(head, justify="right" if i and table.numeric else "left", min_width=None if i else 14)
    notes = bool(table.note_title)
    if notes:
        grid.add_column(table.note_title)
    for row in table.rows:
        if row.form != "long":
            note = [plain_line(row.note, units)] if notes else []
            grid.add_row(*(plain_cell(row.cells[i], units) for i in places), *note)
    return grid
