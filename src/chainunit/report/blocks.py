"""The blocks of a report. A study is told in them; renderers know nothing but them.

A block, a row or a column is in the ``short`` form of a report (the terminal), the ``long`` one (page and Markdown),
or in both.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias

from ..quantities import Layout
from ..text import DEFAULT_UNITS, Units
from .figure import Figure
from .lines import Aside, Line, Number, Piece, Words, line, pieces
from .motion import Animation

Form = Literal["both", "short", "long"]
Severity = Literal["good", "partly", "bad", "warning", "alarm", "remark"]
Shown: TypeAlias = "Number | Words | str"
"""A given value: a number, words of the result, or what a switch or a list says."""
Origin = Literal["", "file", "example", "declared", "tuned", "catalogue", "sizing"]


@dataclass(frozen=True)
class Text:
    """A paragraph; a lead comes before the block that it explains, a note after it."""

    line: Line
    role: Literal["plain", "lead", "note", "fine"] = "plain"
    form: Form = "both"


@dataclass(frozen=True)
class Judgement:
    """A judgement, of the run `run` where it belongs to one."""

    severity: Severity
    line: Line
    run: str = ""
    items: tuple[Line, ...] = ()
    form: Form = "both"


@dataclass(frozen=True)
class Card:
    """Numbers that are shown large, each with what it is, and lines below them."""

    title: str
    numbers: tuple[tuple[Line, str], ...]
    also: tuple[Line, ...] = ()


@dataclass(frozen=True)
class Cards:
    """Cards beside each other."""

    cards: tuple[Card, ...]
    form: Form = "long"


@dataclass(frozen=True)
class Column:
    """The head of a column; `short` is its head where there is little room."""

    title: Line
    short: str = ""
    form: Form = "both"


def heads(*titles: Line) -> tuple[Column, ...]:
    """Columns with these heads."""
    return tuple(map(Column, titles))


@dataclass(frozen=True)
class Share:
    """A cell: how much of a limit is used, and of which."""

    used: Number
    of: Line = ()


Cell: TypeAlias = "Line | Share"


@dataclass(frozen=True)
class TableRow:
    """Cells of a table, the first of which names the row; `note` is a line that belongs to the whole row."""

    cells: tuple[Cell, ...]
    note: Line = ()
    severity: Severity | None = None
    form: Form = "both"


@dataclass(frozen=True)
class Table:
    """A table. `groups` are columns that belong together: where there is no room for all, each group has a table of
    its own beside the columns that are in none. `note_title` heads the notes of rows where they are a column."""

    rows: tuple[TableRow, ...]
    columns: tuple[Column, ...] = ()
    title: Line = ()
    groups: tuple[tuple[int, ...], ...] = ()
    note_title: str = ""
    numeric: bool = True
    form: Form = "both"


@dataclass(frozen=True)
class Tables:
    """Small tables beside each other."""

    tables: tuple[Table, ...]
    form: Form = "long"


@dataclass(frozen=True)
class GivenValue:
    """A value that the study rests on, and where it is from."""

    name: str
    description: str
    value: Shown
    origin: Origin = ""


@dataclass(frozen=True)
class Given:
    """Values that were given, by section."""

    sections: tuple[tuple[str, tuple[GivenValue, ...]], ...]
    form: Form = "long"


@dataclass(frozen=True)
class Drawing:
    """A picture as SVG, with its file's name; `alt` tells it to a reader who does not see it."""

    svg: str
    alt: str
    file: str
    caption: Line = ()
    form: Form = "long"


Block: TypeAlias = "Text | Judgement | Cards | Table | Tables | Given | Drawing | Figure | Animation"


def of_form(blocks: Iterable[Block], form: Form) -> list[Block]:
    """The blocks that are in that form of a report."""
    return [block for block in blocks if block.form in ("both", form)]


@dataclass(frozen=True)
class Section:
    """Blocks under a heading; `name` is its address on the page."""

    name: str
    heading: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True)
class Report:
    """A report on a study whose numbers are `result`, ready for JSON."""

    title: str
    kind: str
    """of study"""
    result: Mapping[str, Any]
    opening: tuple[Block, ...]
    """what was asked"""
    sections: tuple[Section, ...]
    source: Line = ()
    failure: Line = ()
    units: Units = field(default_factory=lambda: DEFAULT_UNITS)

    def blocks(self, form: Form) -> list[Block]:
        """The blocks of one form, in order."""
        return of_form((*self.opening, *(block for s in self.sections for block in s.blocks)), form)

    @property
    def drawings(self) -> list[Drawing]:
        """All drawings, in order."""
        return [block for block in self.blocks("long") if isinstance(block, Drawing)]

    @property
    def figures(self) -> list[Figure]:
        """All figures, in order."""
        return [block for block in self.blocks("long") if isinstance(block, Figure)]


# -- from a result


def at(result: Any, path: str) -> Any:
    """What stands at the dotted `path` in a result; a key may itself hold dots ("machine.crank.m"), and the items
    of a list have their number.

    Raises
    ------
    KeyError
        where there is nothing.
    """
    for node in _matches(result, path):
        return node
    raise KeyError(path)


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
    """Makes numbers and words of the entries of a `result`."""

    result: Mapping[str, Any]

    def number(self, path: str, *items: int, **more: Any) -> Number:
        """The number at `path`, or of the numbers that stand there the one at the places `items`; `more` as of
        `Number`."""
        node = at(self.result, path)
        value, place = node["value"], path
        for i, item in enumerate(items):
            value, place = value[item], f"{place}{'.' if i else '.value.'}{item}"
        return Number(value, node["unit"], **{"kind": node.get("kind", ""), "path": place, **more})

    def value(self, path: str) -> float | None:
        """The bare value of the number at `path`."""
        value: float | None = at(self.result, path)["value"]
        return value

    def line(self, template: str, **parts: Line) -> tuple[Piece, ...]:
        """A line with what stands at the paths that the template has in brackets: ``{run.turns}`` is shown as a
        result, ``{=run.turns}`` as it was given, ``{ratio:4}`` with that many digits; `parts` stand for their
        names."""
        text: tuple[Piece, ...] = ()
        for i, part in enumerate(re.split(r"\{([^}]*)\}", template)):
            if i % 2 == 0:
                text += (part,) if part else ()
            elif part in parts:
                text += pieces(parts[part])
            else:
                path, _, digits = part.removeprefix("=").partition(":")
                given = part.startswith("=")
                node = at(self.result, path)
                words = isinstance(node, str)
                text += (
                    self.words(path) if words else self.number(path, given=given, digits=int(digits or 0)),
                )
        return text

    def estimate(self, path: str, low: str = "_from", high: str = "_to") -> Line:
        """The number at `path`, with the interval whose ends stand at `path` and `low` or `high`, if there is one;
        starts or runs that differ too much do not tell it."""
        try:
            least = self.value(path + low)
        except KeyError:
            return self.number(path)
        if least is None:
            return "starts differ"
        ends = line(self.number(path + low), " to ", self.number(path + high))
        return line(self.number(path), Aside(ends))

    def words(self, path: str) -> Words:
        """The words at `path`."""
        return Words(str(at(self.result, path)), path)

    def lines(self, path: str) -> list[Words]:
        """The sentences of the list at `path`; what has more than a text has it below that name."""
        items = enumerate(at(self.result, path))
        return [self.words(f"{path}.{i}.text" if isinstance(x, Mapping) else f"{path}.{i}") for i, x in items]

    def conclusions(self) -> Iterator[Text | Judgement]:
        """The warnings and the notes."""
        yield from (Judgement("warning", each) for each in self.lines("warnings"))
        yield from (Text(each, "note") for each in self.lines("notes"))

    def rows(self, declared: type, path: str, only: str = "", **more: Any) -> tuple[TableRow, ...]:
        """A row for each declared quantity that stands at `path`, or for `only` that one: description and number."""
        have = at(self.result, path)
        return tuple(
            TableRow((v.description, self.number(f"{path}.{v.name}", **more)))
            for v in Layout(declared).variables
            if v.name in have and only in ("", v.name)
        )

    def given(self, declared: Any, name: str, path: str = "") -> Iterator[GivenValue]:
        """Given values: the declared quantities of an instance or class that stand at `path`, by default at `name`;
        of a range both ends."""
        path = path or name
        have = at(self.result, path)
        cls = declared if isinstance(declared, type) else type(declared)
        for v in Layout(cls).variables:
            if v.name in have:
                full, origin = f"{name}.{v.name}", self.origin(f"{name}.{v.name}")
                if isinstance(have[v.name]["value"], list):
                    for i, end in enumerate(("least", "most")):
                        value = self.number(f"{path}.{v.name}", i, given=True)
                        yield GivenValue(full, f"{v.description}, {end}", value, origin)
                else:
                    value = self.number(f"{path}.{v.name}", given=True, none="none")
                    yield GivenValue(full, v.description, value, origin)

    def origin(self, path: str) -> Origin:
        """Where a given value is from, if the result says it."""
        if "origins" not in self.result:
            return ""
        origin: Origin = self.result["origins"].get(path, "declared")
        return origin
