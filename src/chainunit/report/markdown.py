"""A report as Markdown: its long form, with links to the pictures in the same folder."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator

from ..reading.text import Units
from .blocks import Block, Cards, Drawing, Given, Judgement, Report, Table, Tables, Text, of_form
from .figure import Figure
from .lines import Line, capital
from .terminal import plain_cell, plain_line

_SIGNS = {"good": "✓ ", "partly": "◐ ", "bad": "✗ ", "warning": "", "alarm": "▲ ", "remark": ""}


def markdown_text(text: str) -> str:
    """A text of the user with its special characters escaped: Markdown makes no link, cell or HTML of it."""
    return re.sub(r"([\\`*_\[\]<>#!|~&$])", r"\\\1", text)


def markdown(report: Report, pictures: Collection[str]) -> str:
    """The long form of a report; a figure appears where its file is among the `pictures`."""
    units = report.units
    lines = [f"# {markdown_text(report.title or report.kind)}", ""]
    if report.failure:
        lines += [f"The run stopped early: {_line(report.failure, units)}.", ""]
    if report.source:
        lines += [_line(report.source, units), ""]
    for heading, blocks in (("", report.opening), *((s.heading, s.blocks) for s in report.sections)):
        inside = [text for block in of_form(blocks, "long") for text in block_lines(block, units, pictures)]
        lines += [f"## {heading}", ""] if heading and inside else []
        lines += inside
    return "\n".join(lines).rstrip("\n") + "\n"


def _line(line: Line, units: Units) -> str:
    return markdown_text(plain_line(line, units))


def _grid(rows: Iterable[Iterable[str]], head: Iterable[str]) -> Iterator[str]:
    """The lines of a table in Markdown."""
    heads = list(head)
    yield f"| {' | '.join(heads)} |"
    yield "|---" * len(heads) + "|"
    for row in rows:
        yield f"| {' | '.join(row)} |"
    yield ""


def block_lines(block: Block, units: Units, pictures: Collection[str] = ()) -> list[str]:
    """The lines of one block."""
    match block:
        case Text():
            return [_line(block.line, units), ""]
        case Judgement():
            text = f"- {_SIGNS[block.severity]}{_line(block.line, units)}"
            return [text, *(f"  - {_line(item, units)}" for item in block.items), ""]
        case Cards():
            rows = [
                (markdown_text(capital(card.title)), _line(value, units), markdown_text(which))
                for card in block.cards
                for value, which in card.numbers
            ]
            heads = [markdown_text(capital(card.title)) for card in block.cards]
            also = [
                f"- {head}: {_line(line, units)}"
                for head, card in zip(heads, block.cards, strict=True)
                for line in card.also
            ]
            return [*_grid(rows, ("", "", "")), *also, *([""] if also else [])]
        case Table():
            return _table(block, units)
        case Tables():
            return [text for table in block.tables for text in _table(table, units)]
        case Given():
            entries = [
                (
                    value.name,
                    _line(value.value, units),
                    markdown_text(value.description),
                    value.place or value.origin,
                )
                for _, values in block.sections
                for value in values
            ]
            return list(_grid(entries, ("name", "value", "meaning", "from")))
        case Drawing(alt=text, file=file) | Figure(title=text, file=file) if file in pictures:
            return [f"![{text}]({file})", ""]
        case _:
            return []


def _table(table: Table, units: Units) -> list[str]:
    """The lines of a table, with its title and its notes."""
    heads = [_line(column.title, units) for column in table.columns] or [
        "quantity",
        *[""] * (table.width - 1),
    ]
    rows = [[markdown_text(plain_cell(cell, units)) for cell in row.cells] for row in table.rows]
    if any(row.note for row in table.rows):
        heads.append(table.note_title)
        rows = [[*cells, _line(row.note, units)] for cells, row in zip(rows, table.rows, strict=True)]
    title = [f"**{_line(table.title, units)}**", ""] if table.title else []
    return [*title, *_grid(rows, heads)]
