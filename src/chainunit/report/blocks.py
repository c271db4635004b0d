"""The blocks of a report. Every section consists of blocks, and a renderer knows blocks alone.

A block, a row or a column is in the ``short`` form of a report (the terminal with ``--all``), the ``long`` one (page
and Markdown), or in both. Blocks of the form ``sheet`` stand on the sheet of a study, in place of the long ones of
their section. The terminal has one screen, as far as there is room: judgements, blocks that are `central`, and those
of the form ``screen``; if there are none, all of the short form.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias

from ..core.descriptions import USUAL_DRIVER, of_driver
from ..core.quantities import Layout
from ..reading.result_entries import PARTS
from ..reading.text import DEFAULT_UNITS, Units
from .figure import Figure
from .lines import Aside, Line, Number, Piece, Words, capital, line, pieces
from .live_block import Live
from .motion import Animation

Form = Literal["both", "short", "long", "sheet", "screen"]
Severity = Literal["good", "partly", "bad", "warning", "alarm", "remark"]
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
    """A sentence that judges the study, or its run `run`; `items` are the entries of a list below it."""

    severity: Severity
    line: Line
    run: str = ""
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


@dataclass(frozen=True)
class Tables:
    """Small tables that stand beside each other."""

    tables: tuple[Table, ...]
    form: Form = "long"


@dataclass(frozen=True)
class GivenValue:
    """A value that the study uses, and its origin."""

    name: str
    description: str
    value: Content
    origin: str = ""
    """see `chainunit.study.origins.origin_of`; empty where it is not known"""
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


Block: TypeAlias = "Text | Judgement | Cards | Table | Tables | Given | Drawing | Figure | Animation | Live"


def of_form(blocks: Iterable[Block], form: Form) -> list[Block]:
    """The blocks of the form `form` of a report."""
    return [block for block in blocks if block.form in ("both", form)]


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
        return [block for block in blocks if not isinstance(block, Text | Table) or _is_central(block)]

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


def at(result: Any, path: str) -> Any:
    """The entry of a result at the dotted `path`, see `found_at`."""
    return found_at(result, path)[1]


def _matches(node: Any, path: str) -> Iterator[Any]:
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
    """Makes numbers, words and lines for a report from the entries of a `result`, on a machine with the noun `driver`
    for the link that the motor turns."""

    result: Mapping[str, Any]
    driver: str = USUAL_DRIVER

    def number(self, path: str, *items: int, **more: Any) -> Number:
        """The number at `path`; where an array stands there, the number at the places `items` in it. `more` are
        further fields of `Number`."""
        place, node = found_at(self.result, path)
        value = node["value"]
        for i, item in enumerate(items):
            value, place = value[item], f"{place}{'.' if i else '.value.'}{item}"
        return Number(value, node["unit"], **{"kind": node.get("kind", ""), "path": place, **more})

    def value(self, path: str) -> float | None:
        """The value of the number at `path`, without its unit."""
        value: float | None = at(self.result, path)["value"]
        return value

    def line(self, template: str, **parts: Line) -> tuple[Piece, ...]:
        """A line from a template. A path in braces stands for the entry of the result at that path: ``{run.turns}``
        shows it as a result, ``{=run.turns}`` as a given value, ``{ratio:4}`` with 4 digits. A name of `parts` in
        braces stands for that part, ``{driver}`` for the noun of the driver, see `of_driver`."""
        text: tuple[Piece, ...] = ()
        for i, part in enumerate(re.split(r"\{([^}]*)\}", of_driver(template, self.driver))):
            if i % 2 == 0:
                text += (part,) if part else ()
            elif part in parts:
                text += pieces(parts[part])
            else:
                path, _, digits = part.removeprefix("=").partition(":")
                as_given = part.startswith("=")
                node = at(self.result, path)
                is_text = isinstance(node, str)
                text += (
                    self.words(path)
                    if is_text
                    else self.number(path, as_given=as_given, digits=int(digits or 0)),
                )
        return text

    def estimate(
        self,
        path: str,
        low: str = "_from",
        high: str = "_to",
        *,
        unknown: str = "starts differ",
        certain: float | None = None,
    ) -> Line:
        """The number at `path` and, where the result has one, its interval, whose ends stand at `path` + `low` and
        `path` + `high`; the number alone where the interval is no wider than the share `certain` of it. Where the
        starts or runs differ too much for an interval, the line is `unknown`."""
        try:
            least, most = self.value(path + low), self.value(path + high)
        except KeyError:
            return self.number(path)
        if least is None or most is None:
            return unknown
        if certain is not None and most - least <= certain * abs(self.value(path) or 0.0):
            return self.number(path)
        ends = line(self.number(path + low), " to ", self.number(path + high))
        return line(self.number(path), Aside(ends))

    def words(self, path: str) -> Words:
        """The words at `path`."""
        place, node = found_at(self.result, path)
        return Words(str(node), place)

    def source_line(self) -> Line:
        """Project, author, date and revision, where the file gives them; the study file, and the version."""
        labels = [
            self.line(f"{capital(name)}: {{report.{name}}} · ") for name in self.result.get("report", ())
        ]
        return line(*labels, self.line("Study file: {source} · chainunit {chainunit}"))

    def lines(self, path: str) -> list[Words]:
        """The sentences of the list at `path`; an item that is a mapping has its sentence at the key ``text``."""
        items = enumerate(at(self.result, path))
        return [self.words(f"{path}.{i}.text" if isinstance(x, Mapping) else f"{path}.{i}") for i, x in items]

    def rows(self, declaration: type, path: str, only: str = "", **more: Any) -> tuple[TableRow, ...]:
        """A row (description, number) for each declared quantity that the result has at `path`, or for `only` one."""
        entries = at(self.result, path)
        return tuple(
            TableRow((v.described(self.driver), self.number(f"{path}.{v.name}", **more)))
            for v in Layout(declaration).variables
            if v.name in entries and only in ("", v.name)
        )

    def given_values(self, declaration: Any, name: str, path: str = "") -> Iterator[GivenValue]:
        """Given values: the quantities that an instance or class declares and the result has at `path` (by default
        at `name`). A range gives two values, its ends."""
        path = path or name
        # findings may have the name of the table to which they belong, and the numbers that follow from its values
        entries = at(self.result, f"{PARTS[0]}.{path}" if PARTS[0] in self.result else path)
        cls = declaration if isinstance(declaration, type) else type(declaration)
        for v in Layout(cls).variables:
            if v.name in entries:
                full = f"{name}.{v.name}"
                origin = self.origin(full), self.place(full)
                description = v.described(self.driver)
                if isinstance(entries[v.name]["value"], list):
                    for i, end in enumerate(("least", "most")):
                        value = self.number(f"{path}.{v.name}", i, as_given=True)
                        yield GivenValue(full, f"{description}, {end}", value, *origin)
                else:
                    value = self.number(f"{path}.{v.name}", as_given=True, none="none")
                    yield GivenValue(full, description, value, *origin)

    def origin(self, path: str) -> str:
        """The origin of the given value at `path`; empty where the result has no origins."""
        if "origins" not in self.result:
            return ""
        origin: str = self.result["origins"].get(path, "declared")
        return origin

    def place(self, path: str) -> str:
        """File and line of the given value at `path`; empty where no file gives it."""
        place: str = self.result.get("places", {}).get(path, "")
        return place
