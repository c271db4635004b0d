"""A sheet with its annex as PDF on A4, for people who sign paper: a title block, contents, page numbers.

It has the blocks of the page, with printed figures in place of moving ones. The library makes
PDF/A-3u, which archives keep.
"""

from __future__ import annotations

import base64
import logging
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from html import escape
from itertools import groupby, starmap, zip_longest
from operator import itemgetter
from pathlib import Path
from typing import Any

from ..core.errors import InputError
from ..reading.text import Units
from . import blocks as b
from .figure import Figure
from .html import FIGURES, WARNINGS, Page, group_of, marks, resource
from .motion import Animation

NAME = "sheet.pdf"
_BEGIN = re.compile(r'(<(?:th|h3|span class="said")\b[^>]*>(?:<[^>]+>)*)([a-z])')
"""The first letter of a heading, of a row's title, and of a warning: a capital on paper. (`::first-letter` would do
it, as on the screen, but WeasyPrint nests such a box again each time that it lays out a column or a page.)"""
MOST_PAGES = 8
"""Pages beyond which the annex is set closer."""
_SETS = ("", "close", "close closer")
"""Ways to set the annex, from wide to close: classes of the page."""
_BARS = 2
"""Shares in a row up to which they have bars."""
_SIGNED = ("Prepared", "Checked", "Released")
_MISSING = (
    "--pdf: needs the library WeasyPrint and the text engine Pango ({}); pip install 'chainunit[pdf]', and Pango by "
    "the system's packages (Debian: libpango-1.0-0 libpangoft2-1.0-0; macOS: brew install pango; Windows: MSYS2)"
)


@dataclass(frozen=True)
class Sheet:
    """A sheet: its title, the rows of its title block, its `sections`, and the sections of the `annex`."""

    title: str
    block: Mapping[str, str]
    sections: tuple[b.Section, ...]
    annex: tuple[b.Section, ...]
    units: Units


class _PrintedPage(Page):
    """The blocks of a page on paper; `pictures` are the files of the printed figures."""

    def __init__(self, units: Units, pictures: Mapping[str, Path]) -> None:
        super().__init__(units)
        self._pictures = pictures

    def block(self, block: b.Block) -> str:
        """One block; nothing for one that moves, and for a figure that has no file. Given values run on."""
        if isinstance(block, Animation | b.Live) or (isinstance(block, b.Text) and block.role == "hint"):
            return ""
        if isinstance(block, b.Given):
            groups = "".join(
                f"<p><strong>{escape(title)}:</strong> {'; '.join(map(self._value, values))}.</p>"
                for title, values in block.sections
                if values
            )
            return f'{marks(block)}<div class="run-on">{groups}</div>'
        if isinstance(block, Figure):
            return self._printed(block)
        return super().block(block)

    def blocks(self, blocks: Sequence[b.Block]) -> str:
        """Blocks in order, with capitals where a line begins; consecutive warnings form one list, and of consecutive
        figures the narrow ones stand in two columns after those with panels beside each other."""
        parts = []
        for kind, neighbours in groupby(blocks, group_of):
            group, narrow = list(neighbours), list[Figure]()
            if kind == FIGURES:
                figures = [block for block in group if isinstance(block, Figure)]
                narrow = [figure for figure in figures if len(figure.panels[0]) == 1]
                # the flattest first: it fits on the page that has begun
                group = [*sorted((figure for figure in figures if figure not in narrow), key=self._height)]
            texts = list(filter(None, map(self.block, group)))
            parts += [f'<ul class="verdicts">{"".join(texts)}</ul>'] if kind == WARNINGS and texts else texts
            if prints := "".join(map(self.block, narrow)):
                parts.append(f'<div class="prints">{prints}</div>')
        return _BEGIN.sub(lambda match: match[1] + match[2].upper(), "\n".join(parts))

    def _value(self, value: b.GivenValue) -> str:
        """A given value in running text."""
        name = escape(value.description)
        return (
            f'<span title="{escape(value.name)}">{name}</span> {self.line(value.value)}{self.origin(value)}'
        )

    def _table(self, table: b.Table) -> str:
        """A table; one with many shares has the numbers alone, as paper has no room for their bars."""
        # the page has the rows that a terminal leaves out
        rows = tuple(row for row in table.rows if row.form != "long")
        table = replace(table, rows=rows or table.rows).of_form("long")
        if sum(isinstance(cell, b.Share) for cell in table.rows[0].cells) > _BARS:
            cells = (
                [x.utilisation if isinstance(x, b.Share) else x for x in row.cells] for row in table.rows
            )
            rows = tuple(replace(row, cells=tuple(x)) for row, x in zip(table.rows, cells, strict=True))
            table = replace(table, rows=rows)
        return super()._table(table)

    def _height(self, figure: Any) -> float:
        """The height of a printed figure over its width; 0 without a file."""
        file = self._pictures.get(figure.file or "")
        if file is None:
            return 0.0
        from PIL import Image

        with Image.open(file) as picture:
            return float(picture.height / picture.width)

    def _printed(self, figure: Figure) -> str:
        """A figure as a picture within the page; empty without its file."""
        file = self._pictures.get(figure.file or "")
        if file is None:
            return ""
        picture = base64.b64encode(file.read_bytes()).decode()
        shape = "printed flat" if self._height(figure) < _FLAT else "printed"
        return (
            f'<figure class="{shape}"><img src="data:image/png;base64,{picture}" alt="{escape(figure.alt)}">'
            f"<figcaption>{escape(figure.title)}. {self.line(figure.caption)}</figcaption></figure>"
        )


_FLAT = 0.5
"""Height over width below which two figures stand beside each other in a long annex."""


def check_library() -> None:
    """Refuse where the library or its text engine is missing.

    Raises
    ------
    InputError
        with the way to have them.
    """
    try:
        import weasyprint  # type: ignore[import-untyped]  # noqa: F401
    except (ImportError, OSError) as error:
        raise InputError(_MISSING.format(str(error).splitlines()[0])) from None


def write(sheet: Sheet, pictures: Mapping[str, Path], file: Path) -> Path:
    """Write a sheet; `pictures` are the files of its figures by name. Returns the file.

    Raises
    ------
    InputError
        see `check_library`.
    """
    check_library()
    import weasyprint

    # it names every property of a screen that paper does not have
    logging.getLogger("weasyprint").setLevel(logging.ERROR)
    text, variant = page_text(sheet, pictures), {"pdf_variant": "pdf/a-3u"}
    for way in _SETS:
        page = text.replace("<body>", f'<body class="{way}">', 1)
        document = weasyprint.HTML(string=page, base_url=str(file.parent)).render(**variant)
        if len(document.pages) <= MOST_PAGES:
            break
    document.write_pdf(file, **variant)
    return file


def page_text(sheet: Sheet, pictures: Mapping[str, Path]) -> str:
    """The sheet as a page of HTML, from which the PDF is made."""
    page = _PrintedPage(sheet.units, pictures)
    sheet_sections = [*_numbered(page, sheet.sections, ("both", "long", "sheet"))]
    annex = [*_numbered(page, sheet.annex, ("both", "long"), "A")]
    contents = "".join(
        f'<li><a href="#{_place(number)}"><span>{number}</span> {escape(section.heading)}</a></li>'
        for number, section, _ in (*sheet_sections, *annex)
    )
    sections = (
        f'<div class="on-sheet">{"".join(starmap(_section, sheet_sections))}</div>'
        f'<div class="annex">{"".join(starmap(_section, annex))}</div>'
    )
    labels = [f"<th>{escape(name)}</th><td>{escape(value)}</td>" for name, value in sheet.block.items()]
    half = (len(labels) + 1) // 2
    rows = "".join(f"<tr>{a}{z}</tr>" for a, z in zip_longest(labels[:half], labels[half:], fillvalue=""))
    signed = "".join(f"<td><span>{role}</span></td>" for role in _SIGNED)
    return (
        f'<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>{escape(sheet.title)}</title>'
        f"<style>{resource('page.css')}{resource('pdf.css')}</style></head><body>"
        f'<header class="titles"><h1>{escape(sheet.title)}</h1><table class="of-title">{rows}</table>'
        f'<table class="signed"><tr>{signed}</tr></table></header>'
        f'<nav class="contents"><ol>{contents}</ol></nav>{sections}</body></html>'
    )


def _numbered(
    page: Page, sections: Iterable[b.Section], forms: Collection[str], letter: str = ""
) -> Iterator[tuple[str, b.Section, str]]:
    """The sections that are not empty on paper, with their blocks of these `forms`: each with its number before it
    and its text behind it."""
    texts = ((section, page.blocks([x for x in section.blocks if x.form in forms])) for section in sections)
    for n, (section, text) in enumerate(filter(itemgetter(1), texts), 1):
        yield f"{letter}{n}", section, text


def _place(number: str) -> str:
    return f"section-{number}"


def _section(number: str, section: b.Section, text: str) -> str:
    return (
        f'<section id="{_place(number)}"><h2><span class="no">{number}</span> {escape(section.heading)}</h2>'
        f"{text}</section>"
    )
