"""A report as one page that needs no other file and no network.

Every number in the text of the page is an element that names its place in the result. The page contains the whole
result (``<script id="result">``). Its curves and its animation come from the time series, thinned out.
"""

from __future__ import annotations

import base64
import gzip
import json
from collections.abc import Iterable, Sequence
from functools import cache
from html import escape
from importlib import resources
from itertools import groupby
from pathlib import Path
from typing import Any

from .. import __version__
from ..core.errors import InputError
from ..core.files import write_file
from ..reading.text import Units, forms
from . import blocks as b
from . import motion
from .figure import Figure
from .lines import Aside, Line, Name, Number, Piece, Strong, Words, pieces

NAME = "report.html"
WARNINGS, FIGURES = "warnings", "figures"
"""Groups of neighbouring blocks."""

_SPACE = "\u00a0"  # before a unit
_SHORT = 16
"""Rows of a table that does not break across printed pages."""
_SHORTEST_SERIES = 8
"""Least number of numbers of a series."""
_MOST_DIGITS, _LARGEST = 12, 2**53
"""Most digits behind the point, and largest whole number, with which a page has the same number."""
_SERIES = "+"
"""Key of a series: its digits behind the point, and the differences of its numbers as whole numbers of the last
digit, from 0 on."""
_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; "
    "font-src data:"
)
_SIGN = {"good": "✓", "partly": "◐", "bad": "✗", "warning": "!"}
_ORIGIN = {
    "file": "the study file's",
    "linkage": "the linkage file's",
    "example": "the example's",
    "tuned": "tuned to the machine",
    "catalogue": "from the row of the catalogue",
}


def write(report: b.Report, folder: Path) -> Path:
    """Write the page into `folder`; returns the file."""
    (file,) = write_file(folder / NAME, render(report))
    return file


def render(report: b.Report) -> str:
    """The page as a text of HTML."""
    page = Page(report.units)
    sections = [
        (section, content)
        for section in report.sections
        if (content := page.blocks(b.of_form(section.blocks, "long")))
    ]
    title = report.title or report.kind
    figures = _figures(report)
    animation = next((block for block in report.blocks("long") if isinstance(block, motion.Animation)), None)
    result = json.dumps(report.result, allow_nan=False, ensure_ascii=False, separators=(",", ":"))
    data = {
        "figures": packed(figures),
        "pictures": packed(animation and motion.pictures(animation, report.units)),
    }
    styles, scripts = ["page.css"], ["packing.js", "picture.js", "page.js"]
    if (live := page.live) is not None:
        styles.append("live/live.css")
        program = [
            f"const liveEquations = {live.equations};",
            *map(_short, ("live/model.js", "live/live.js")),
        ]
        data |= {"live-data": packed(live.data), "live-program": packed_bytes("\n".join(program).encode())}
    if figures:
        data["plotly"] = _packed_plotly()
    return "\n".join(
        [
            "<!DOCTYPE html>",
            '<html lang="en">',
            "<head>",
            '<meta charset="utf-8">',
            f'<meta http-equiv="Content-Security-Policy" content="{escape(_POLICY)}">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            f'<meta name="generator" content="chainunit {__version__}">',
            f"<title>{escape(title)}</title>",
            '<link rel="icon" href="data:,">',
            f"<style>\n{''.join(map(_short, styles))}</style>",
            "</head>",
            "<body>",
            page.header(report, title, [section.name for section, _ in sections]),
            "<main>",
            *(
                f'<section id="{section.name}" aria-labelledby="{section.name}-title">\n'
                f'<h2 id="{section.name}-title">{section.heading}</h2>\n{_laid_out(section, content)}\n</section>'
                for section, content in sections
            ),
            "</main>",
            # without a "<" no text can end the element early
            f'<script type="application/json" id="result">{result.replace("<", chr(92) + "u003c")}</script>',
            *(
                f'<script type="application/octet-stream" id="{name}">{text}</script>'
                for name, text in data.items()
            ),
            *(f"<script>\n{_short(name)}</script>" for name in scripts),
            "</body>",
            "</html>\n",
        ]
    )


def _laid_out(section: b.Section, content: str) -> str:
    """The content of a section, in two columns where its blocks stand beside each other."""
    return f'<div class="asked">{content}</div>' if section.beside else content


def _figures(report: b.Report) -> dict[str, Any]:
    """The figures of the page by name, as plotly.js takes them."""
    figures = [figure for figure in report.figures if figure.on_page]
    if not figures:
        return {}
    # a page without figures is written at once
    from .page_figures import page_figure

    return {figure.name: page_figure(figure, report.units) for figure in figures}


@cache
def _packed_plotly() -> str:
    """plotly.js, packed."""
    return packed_bytes((resources.files("plotly") / "package_data" / "plotly.min.js").read_bytes())


def packed_bytes(content: bytes) -> str:
    """Bytes, packed."""
    return base64.b64encode(gzip.compress(content, 6, mtime=0)).decode()


def packed(data: Any) -> str:
    """Data as JSON has it, packed."""
    text = json.dumps(_shortened(data), allow_nan=False, ensure_ascii=False, separators=(",", ":"))
    return packed_bytes(text.encode())


def _shortened(data: Any) -> Any:
    """Data whose long series of numbers are packed, see `_series`."""
    if isinstance(data, dict):
        return {name: _shortened(x) for name, x in data.items()}
    if isinstance(data, list | tuple):
        series = _series(data)
        return [_shortened(x) for x in data] if series is None else {_SERIES: series}
    return data


def _series(values: Any) -> list[int] | None:
    """A list of numbers as a series; None where it is none, or would not come back the same."""
    if len(values) < _SHORTEST_SERIES or any(type(x) not in (int, float) for x in values):
        return None
    digits = max(len(repr(x).partition(".")[2]) if type(x) is float else 0 for x in values)
    if digits > _MOST_DIGITS or any("e" in repr(x) for x in values):
        return None
    whole = [round(x * 10**digits) for x in values]
    if any(abs(n) > _LARGEST or n / 10**digits != x for n, x in zip(whole, values, strict=True)):
        return None
    return [digits, *(n - before for n, before in zip(whole, [0, *whole], strict=False))]


def fragment(report: b.Report) -> str:
    """Title and blocks as a piece of another page, such as a notebook; without style, and without the blocks that the
    scripts of the page draw: figures, motion, live machine."""
    page = Page(report.units)
    failure = f"<p>The run stopped early: {page.line(report.failure)}.</p>" if report.failure else ""
    drawn = (Figure, motion.Animation, b.Live)
    still = [block for block in report.blocks("long") if not isinstance(block, drawn)]
    return f"<h3>{escape(report.title or report.kind)}</h3>\n{failure}{page.blocks(still)}"


def resource(name: str) -> str:
    """A text that lies beside this module: a style, a script, a piece of the page."""
    return (resources.files(__package__) / name).read_text("utf-8")


def _short(name: str) -> str:
    """A script or a style without comments of whole lines and without spaces at the begin of lines."""
    lines = (line.strip() for line in resource(name).splitlines())
    return "".join(f"{line}\n" for line in lines if line and not line.startswith("//"))


def _origin_words(origin: str) -> str:
    """The origin of a given value in words; another origin than those of a study is the question that chose it."""
    return _ORIGIN.get(origin, "the program's default" if origin == "declared" else f"chosen by {origin}")


def marks(block: b.Given) -> str:
    """The legend of the marks that stand beside given values."""
    origins = {value.origin for _, values in block.sections for value in values} - {"", "file", "linkage"}
    others = sorted(origins - _ORIGIN.keys(), key=lambda origin: origin == "declared")
    entries = (f"{o[0]}: {_origin_words(o)}" for o in (*_ORIGIN, *others) if o in origins)
    return f'<p class="hint marks">Not in the study file: {"; ".join(entries)}.</p>' if origins else ""


def group_of(block: b.Block) -> str:
    """The name of the group that a block forms with its neighbours; empty for a block that stands alone."""
    if isinstance(block, b.Judgement) and block.severity == "warning":
        return WARNINGS
    return FIGURES if isinstance(block, Figure) else ""


class Page:
    """Renders blocks as HTML, with numbers in the units `units`."""

    def __init__(self, units: Units) -> None:
        self.units = units
        self.live: b.LiveMachine | None = None
        """the live machine among the blocks so far"""

    # -- pieces

    def number(self, n: Number) -> str:
        """A number as an element that holds its place in the result and its value there."""
        if n.value is None:
            text = f'<span class="none">{escape(n.none)}</span>'
        else:
            digits = n.digits or (6 if n.as_given else 3)
            first, *others = forms(n.value, n.unit, n.kind, digits, full=not n.as_given, units=self.units)
            text = ("▲ " if n.over else "") + self._form(*first)
            text += "".join(f' <span class="beside">{self._form(*other)}</span>' for other in others)
        exact = "no value" if n.value is None else f"{n.value:.9g}" + ("" if n.unit == "1" else f" {n.unit}")
        element = (
            f'<data class="n" data-path="{escape(n.path)}" value="{json.dumps(n.value)}" '
            f'title="{escape(f"{n.path}: {exact}")}">{text}</data>'
        )
        return f"<strong>{element}</strong>" if n.over else element

    def _form(self, text: str, unit: str) -> str:
        gap = "" if unit in ("", "°") else _SPACE
        return escape(text) + (f'{gap}<span class="u">{escape(unit)}</span>' if unit else "")

    def line(self, line: Line) -> str:
        """A line of text."""
        return "".join(map(self._piece, pieces(line)))

    def _piece(self, piece: Piece) -> str:
        """A piece of a line."""
        match piece:
            case Number():
                return self.number(piece)
            case Words():
                return f'<span class="t" data-path="{escape(piece.path)}">{escape(piece)}</span>'
            case Name():
                return f'<span class="as-is">{escape(piece.text)}</span>'
            case Strong():
                return f"<strong>{self.line(piece.line)}</strong>"
            case Aside():
                return f' <span class="of">{self.line(piece.line)}</span>'
            case _:
                return escape(piece)

    # -- blocks

    def blocks(self, blocks: Sequence[b.Block]) -> str:
        """Blocks in order; consecutive warnings form one list, consecutive figures one grid."""
        parts = []
        for kind, together in groupby(blocks, group_of):
            html = [self.block(block) for block in together]
            if kind == WARNINGS:
                html = [f'<ul class="verdicts">{"".join(html)}</ul>']
            elif kind == FIGURES and any(html):
                html = [_PLOTS.format("".join(html))]
            parts += [text for text in html if text]
        return "\n".join(parts)

    def block(self, block: b.Block) -> str:
        """One block."""
        match block:
            case b.Text():
                return f'<p class="{block.role}">{self.line(block.line)}</p>'
            case b.Judgement():
                return self._verdict(block)
            case b.Cards():
                few = " four" if len(block.cards) == 4 else ""
                return f'<div class="cards{few}">{"".join(map(self._card, block.cards))}</div>'
            case b.Table():
                return self._table(block)
            case b.Tables():
                return f'<div class="given whole">{"".join(map(self._table, block.tables))}</div>'
            case b.Given():
                tables = "".join(self._given(title, values) for title, values in block.sections if values)
                return f'{marks(block)}<div class="given">{tables}</div>'
            case b.Drawing():
                caption = f"<figcaption>{self.line(block.caption)}</figcaption>" if block.caption else ""
                return f'<figure class="drawing">{block.svg}{caption}</figure>'
            case Figure():
                return self._figure(block) if block.on_page else ""
            case motion.Animation():
                return resource("motion.html").replace("<!-- caption -->", self.line(block.caption))
            case b.Live():
                return self._live(block)

    def _live(self, block: b.Live) -> str:
        try:
            self.live = block.make()
        except InputError as error:
            return f'<p class="note">This machine cannot run in a page: {escape(str(error))}.</p>'
        return f'<p class="lead">{escape(block.lead)}</p>\n{resource("live/live.html")}'

    def _verdict(self, verdict: b.Judgement) -> str:
        """A judgement, with its sign; a warning is an entry of a list."""
        text = self.line(verdict.line)
        items = "".join(f"<li>{self.line(item)}</li>" for item in verdict.items)
        if verdict.severity in ("alarm", "remark"):
            return f'<div class="alarm">{text}{f"<ul>{items}</ul>" if items else ""}</div>'
        sign = f'<span class="sign" aria-hidden="true">{_SIGN[verdict.severity]}</span>'
        if verdict.severity == "warning":
            return f'<li>{sign} <span class="said">{text}</span></li>'
        return f'<p class="judged {verdict.severity}">{sign} {text}</p>'

    def _card(self, card: b.Card) -> str:
        """A card: large numbers with their nouns, and further lines."""
        figures = "".join(
            f'<div class="figure"><span class="large{"" if isinstance(value, Number) else " name"}">'
            f'{self.line(value)}</span><span class="which">{escape(which)}</span></div>'
            for value, which in card.numbers
        )
        return (
            f'<article class="card"><h3>{escape(card.title)}</h3><div class="figures">{figures}</div>'
            + "".join(f'<p class="also">{self.line(line)}</p>' for line in card.also)
            + "</article>"
        )

    def _table(self, table: b.Table) -> str:
        """A table, which a narrow screen scrolls."""
        marks = [' class="text"' if column.of_text else "" for column in table.columns] or [""] * table.width
        heads = "".join(
            f'<th scope="col"{mark}>{self.line(column.title)}</th>'
            for column, mark in zip(table.columns, marks, strict=False)
        )
        is_noted = any(row.note for row in table.rows)
        body = "".join(self._row(row, marks) for row in table.rows)
        css = "candidates" if is_noted else "numbers" if table.numeric else "words"
        # on paper a short table stays on one page
        whole = " data-short" if len(table.rows) <= _SHORT else ""
        return (
            f'<div class="wide"><table class="{css}"{whole}>'
            + (f"<caption>{self.line(table.title)}</caption>" if table.title else "")
            + (f"<thead><tr>{heads}</tr></thead>" if heads else "")
            + (body if is_noted else f"<tbody>{body}</tbody>")
            + "</table></div>"
        )

    def _row(self, row: b.TableRow, marks: Sequence[str]) -> str:
        """A row; one with a note has it in a second row."""
        first, *others = row.cells
        span = ' rowspan="2"' if row.note else ""
        cells = (
            f'<th scope="row"{span}>{self._inside(first)}</th>{"".join(map(self._cell, others, marks[1:]))}'
        )
        if not row.note:
            return f"<tr>{cells}</tr>"
        note = f'<tr><td class="why" colspan="{len(others)}">{self.line(row.note)}</td></tr>'
        return f'<tbody class="{row.severity or "plain"}"><tr>{cells}</tr>{note}</tbody>'

    def _cell(self, cell: b.Cell, mark: str) -> str:
        css = mark
        if isinstance(cell, b.Share):
            css = ' class="check over"' if cell.utilisation.over else ' class="check"'
        return f"<td{css}>{self._inside(cell)}</td>"

    def _inside(self, cell: b.Cell) -> str:
        """The content of a cell; a share has a bar."""
        if not isinstance(cell, b.Share):
            return self.line(cell)
        share = cell.utilisation.value or 0.0
        width = 100.0 * min(max(share, 0.0), 1.5) / 1.5
        bar = f'<span class="bar" aria-hidden="true"><span style="width:{width:.1f}%"></span></span>'
        suffix = f'<span class="of">{self.line(cell.of)}</span>' if cell.of else ""
        return self.number(cell.utilisation) + bar + suffix

    def _given(self, title: str, values: Iterable[b.GivenValue]) -> str:
        """A section of given values."""
        rows = ""
        for value in values:
            name_and_line = f"{value.name}: {value.place}" if value.place else value.name
            rows += f'<tr><th scope="row" title="{escape(name_and_line)}">{escape(value.description)}</th>'
            rows += f"<td>{self.line(value.value)}{self.origin(value)}</td></tr>"
        return (
            f'<div class="wide"><table class="numbers"><caption>{escape(title)}</caption>'
            f"<tbody>{rows}</tbody></table></div>"
        )

    def origin(self, value: b.GivenValue) -> str:
        """A mark at a value that the study file does not give; one of another file has its place there."""
        if value.origin in ("", "file"):
            return ""
        mark = value.place or value.origin[0]
        return f'<abbr class="from" title="{escape(_origin_words(value.origin))}">{escape(mark)}</abbr>'

    def _figure(self, figure: Figure) -> str:
        """The box in which the script of the page draws a figure."""
        from .page_figures import height

        return (
            f'<figure class="plot-box{" half" if figure.half else ""}">'
            f'<h3 id="{figure.name}-title">{escape(figure.title)}</h3>'
            f'<div class="plot" id="plot-{figure.name}" data-figure="{figure.name}" role="img" '
            f'aria-label="{escape(figure.alt)}" style="height:{height(figure)}px"></div>'
            f"<figcaption>{self.line(figure.caption)}</figcaption></figure>"
        )

    # -- the head of the page

    def header(self, report: b.Report, title: str, names: Iterable[str]) -> str:
        """Title, source, status, navigation, and the blocks before all sections."""
        status = ""
        if report.failure:
            status = '<p class="alarm"><strong>The run stopped early:</strong> '
            status += f"{self.line(report.failure)}. The page shows the results up to there.</p>"
        headings = {section.name: section.heading for section in report.sections}
        links = "".join(f'<a href="#{name}">{headings[name]}</a>' for name in names)
        opening = self.blocks(b.of_form(report.opening, "long"))
        source = self.line(report.source)
        return (
            f'<header>\n<p class="kind">{escape(report.kind)}</p>\n<h1>{escape(title)}</h1>\n'
            f'<p class="from">{source}{" · " if source else ""}status: '
            f"{'stopped early' if status else report.status}</p>\n"
            f'{status}\n<nav aria-label="Sections">{links}</nav>\n'
            + (f'<h2 id="opening">{report.opening_title}</h2>\n{opening}\n' if opening else "")
            + "</header>"
        )


_PLOTS = (
    "<noscript><p>The plots and the animation need JavaScript; the numbers of this page do not.</p></noscript>"
    '<div class="plots">{}</div>'
    '<p class="hint">Drag to zoom, double-click to zoom out, click a name in a legend to hide its line.</p>'
)
