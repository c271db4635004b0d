"""The blocks of a report. Every section consists of blocks, and a renderer knows blocks alone.

A block, a row or a column is in the ``short`` form of a report (the terminal with ``--all``), the ``long`` one (page
and Markdown), or in both. Blocks of the form ``sheet`` stand on the sheet of a study, in place of the long ones of
their section. The terminal has one screen, as far as there is room: judgements, blocks that are `central`, and those
of the form ``screen``; if there are none, all of the short form.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Literal, TypeAlias

from ..reading.result_entries import PARTS
from ..reading.text import DEFAULT_UNITS, Units
from .figure import Figure
from .lines import Line, Number, Words
from .motion import Animation

Form = Literal["both", "short", "long", "sheet", "screen"]
Severity = Literal["good", "partly", "bad", "warning", "alarm", "remark"]
VERDICTS = ("good", "partly", "bad", "alarm")
"""Severities of the judgements that are a verdict."""
Content: TypeAlias = "Number | str"
"""The content of a given value: a number, or the text of a choice, a switch or a list."""


@dataclass(frozen=True)
class Text:
    """A paragraph. A lead stands before the block that it explains, a note stands after it; a hint tells how to use a
    page, and paper has none."""

    line: Line
    role: Literal["plain", "lead", "note", "fine", "hint"] = "plain"
    form: Form = "both"
    central: bool = False


@dataclass(frozen=True)
class Judgement:
    """A sentence that judges the study; `items` are the entries of a list below it."""

    severity: Severity
    line: Line
    items: tuple[Line, ...] = ()
    form: Form = "both"


@dataclass(frozen=True)
class Card:
    """A card: large numbers, each with its name, and lines of text below them (`also`)."""

    title: str
    numbers: tuple[tuple[Line, str], ...]
    also: tuple[Line, ...] = ()


@dataclass(frozen=True)
class Cards:
    """Cards that stand beside each other."""

    cards: tuple[Card, ...]
    form: Form = "long"


@dataclass(frozen=True)
class Column:
    """A column of a table by its head; `short` is the head where there is little room. The cells of a column
    `of_text` begin at the left in a table of numbers, too."""

    title: Line
    short: str = ""
    form: Form = "both"
    of_text: bool = False


def heads(*titles: Line) -> tuple[Column, ...]:
    """Columns with these heads."""
    return tuple(map(Column, titles))


@dataclass(frozen=True)
class Share:
    """A cell with the share of a limit that is used; `of` states the value and its limit."""

    utilisation: Number
    of: Line = ()


Cell: TypeAlias = "Line | Share"


@dataclass(frozen=True)
class TableRow:
    """A row of a table. The first cell names the row; `note` is a line that belongs to the whole row."""

    cells: tuple[Cell, ...]
    note: Line = ()
    severity: Severity | None = None
    form: Form = "both"


@dataclass(frozen=True)
class Table:
    """A table. `groups` are the places of columns that belong together: where the table is too wide, each group gets
    a table of its own, with the columns that are in no group. `note_title` is the head of the column of notes."""

    rows: tuple[TableRow, ...]
    columns: tuple[Column, ...] = ()
    title: Line = ()
    groups: tuple[tuple[int, ...], ...] = ()
    note_title: str = ""
    numeric: bool = True
    form: Form = "both"
    central: bool = False

    @property
    def width(self) -> int:
        """The number of columns."""
        return len(self.columns) or max((len(row.cells) for row in self.rows), default=0)

    def of_columns(self, places: Iterable[int]) -> Table:
        """The table with its columns at these places; a group keeps those of its columns that are there."""
        new_places = {old: new for new, old in enumerate(places)}
        return replace(
            self,
            rows=tuple(replace(row, cells=tuple(row.cells[k] for k in new_places)) for row in self.rows),
            columns=tuple(self.columns[k] for k in new_places) if self.columns else (),
            groups=tuple(tuple(new_places[k] for k in group if k in new_places) for group in self.groups),
        )

    def of_form(self, form: Form) -> Table:
        """The table with its rows and columns of the form `form`."""
        table = replace(self, rows=tuple(of_form(self.rows, form)))
        if not self.columns:
            return table
        return table.of_columns(k for k, column in enumerate(self.columns) if column.form in ("both", form))


@dataclass(frozen=True)
class Tables:
    """Small tables that stand beside each other."""

    tables: tuple[Table, ...]
    form: Form = "long"

    def of_form(self, form: Form) -> Tables:
        """The tables with their rows and columns of the form `form`."""
        return replace(self, tables=tuple(table.of_form(form) for table in self.tables))


@dataclass(frozen=True)
class GivenValue:
    """A value that the study uses, and its origin."""

    name: str
    description: str
    value: Content
    origin: str = ""
    """see `chainunit.study.given.origin_of`; empty where it is not known"""
    place: str = ""
    """file and line that give it; empty where no file does"""


@dataclass(frozen=True)
class Given:
    """The given values of a study: for each section its title and its values."""

    sections: tuple[tuple[str, tuple[GivenValue, ...]], ...]
    form: Form = "long"


@dataclass(frozen=True)
class Drawing:
    """A picture as SVG, and the name of its file; `alt` describes the picture to a reader who does not see it."""

    svg: str
    alt: str
    file: str
    caption: Line = ()
    form: Form = "long"


@dataclass(frozen=True)
class LiveMachine:
    """A live machine: the `data` of the page as JSON has it, and its `equations` as an expression of JavaScript
    (`chainunit.core.printing.javascript.program`)."""

    data: Mapping[str, Any]
    equations: str


@dataclass(frozen=True)
class Live:
    """A live machine: its reader changes numbers, and the page computes what follows. A terminal and Markdown have
    none. `make` makes it; `beside` is the noun of the thing whose values the reader changes.

    Raises
    ------
    InputError
        by `make`, for an equation with a function that has not the same bits in each browser.
    """

    make: Callable[[], LiveMachine]
    beside: str
    form: ClassVar[str] = "long"

    @property
    def lead(self) -> str:
        """The text before the machine."""
        return (
            "The equations of this machine run in this page. Move a slider, or type a number: the new results stand "
            f"beside those of {self.beside}, whose value a small mark above each slider shows."
        )


Block: TypeAlias = "Text | Judgement | Cards | Table | Tables | Given | Drawing | Figure | Animation | Live"


def of_form(parts: Iterable[Any], form: Form) -> list[Any]:
    """The blocks, or the rows of a table, of the form `form` of a report."""
    return [
        part.of_form(form) if isinstance(part, Table | Tables) else part
        for part in parts
        if part.form in ("both", form)
    ]


def _is_central(block: Block) -> bool:
    return isinstance(block, Text | Table) and (block.central or block.form == "screen")


@dataclass(frozen=True)
class Section:
    """Blocks under a heading; `name` is the address of the section on the page."""

    name: str
    heading: str
    blocks: tuple[Block, ...]
    beside: bool = False
    """whether its texts and tables stand beside each other where there is room"""


@dataclass(frozen=True)
class Report:
    """A report on a study; `result` has the numbers of the study, ready for JSON."""

    title: str
    kind: str
    """the kind of the study, in words"""
    result: Mapping[str, Any]
    opening: tuple[Block, ...]
    """the blocks before all sections"""
    sections: tuple[Section, ...]
    source: Line = ()
    failure: Line = ()
    units: Units = field(default_factory=lambda: DEFAULT_UNITS)
    opening_title: str = "The question"
    status: str = "complete"
    """the status of a report without a failure"""

    def blocks(self, form: Form) -> list[Block]:
        """The blocks of one form, in order."""
        return of_form((*self.opening, *(block for s in self.sections for block in s.blocks)), form)

    @property
    def screen(self) -> list[Block]:
        """The blocks of one screen, in order: the central ones, if any, else the blocks of the short form."""
        blocks = [*self.opening, *(block for s in self.sections for block in s.blocks)]
        if not any(_is_central(block) for block in blocks):
            return self.blocks("short")
        return [
            block.of_form("short") if isinstance(block, Table) else block
            for block in blocks
            if not isinstance(block, Text | Table) or _is_central(block)
        ]

    @property
    def drawings(self) -> list[Drawing]:
        """All drawings, in order."""
        return [block for block in self.blocks("long") if isinstance(block, Drawing)]

    @property
    def figures(self) -> list[Figure]:
        """All figures, in order."""
        return [block for block in self.blocks("long") if isinstance(block, Figure)]


# -- from a result


def found_at(result: Any, path: str) -> tuple[str, Any]:
    """The place and the entry of a result at the dotted `path`; in the result of a study the path may leave out the
    part of the result. A key may itself have dots ("machine.crank.m"); the key of an item of a list is its number.

    Raises
    ------
    KeyError
        where the result has no such entry.
    """
    for part in ("", *(f"{name}." for name in reversed(PARTS))):
        for node in _matches(result, part + path):
            return part + path, node
    raise KeyError(path)


def _matches(node: Any, path: str) -> Iterator[Any]:
    """The nodes at a path below a node; a key may have dots."""
    keys: Mapping[str, Any] = {}
    if isinstance(node, Mapping):
        keys = node
    elif isinstance(node, list):
        keys = {str(i): item for i, item in enumerate(node)}
    for key, below in keys.items():
        if path == key:
            yield below
        elif path.startswith(f"{key}."):
            yield from _matches(below, path[len(key) + 1 :])


@dataclass(frozen=True)
class Source:
    """Makes numbers and words for a report from the entries of a `result` whose places are data themselves."""

    result: Mapping[str, Any]

    def number(self, path: str, *items: int, **more: Any) -> Number:
        """The number at `path`; where an array stands there, the number at the places `items` in it. `more` are
        further fields of `Number`."""
        place, node = found_at(self.result, path)
        value = node["value"]
        for i, item in enumerate(items):
            value, place = value[item], f"{place}{'.' if i else '.value.'}{item}"
        return Number(value, node["unit"], **{"kind": node.get("kind", ""), "path": place, **more})

    def words(self, path: str) -> Words:
        """The words at `path`."""
        place, node = found_at(self.result, path)
        return Words(str(node), place)
