"""The report on the papers: a table of each paper and its figures."""

from __future__ import annotations

from collections.abc import Sequence
from types import ModuleType

from chainunit import __version__
from chainunit.reading.results import as_data
from chainunit.reading.text import DEFAULT_UNITS
from chainunit.report.blocks import Column, Report, Section, Table, TableRow, Text
from chainunit.report.markdown import block_lines

from . import PAPERS
from .figures import FIGURES
from .table import PaperNumber

COLUMNS = (
    Column(("item",)),
    Column(("where",), form="long"),
    Column(("quantity",)),
    Column(("printed",)),
    Column(("computed",)),
    Column(("verdict",)),
    Column(("why",), form="long"),
)


def table(rows: Sequence[PaperNumber], title: str = "") -> Table:
    """The table of a paper's rows; its short form has only the rows that the paper prints."""
    return Table(tuple(_cells(row) for row in rows), COLUMNS, (title,) if title else (), numeric=False)


def _cells(row: PaperNumber) -> TableRow:
    unit = "" if row.unit == "1" else f" {row.unit}"
    authors = "" if row.rebuilt_text is None else f" (as the authors: {row.rebuilt_text})"
    cells = (
        row.item,
        row.where,
        row.quantity,
        "-" if row.printed is None else row.printed,
        f"{row.text}{unit}{authors}",
        row.verdict,
        row.reason,
    )
    return TableRow(tuple((cell,) for cell in cells), form="long" if row.printed is None else "both")


def markdown(rows: Sequence[PaperNumber]) -> str:
    """The table for the documentation."""
    return "\n".join(block_lines(table(rows), DEFAULT_UNITS)).rstrip("\n") + "\n"


def title(functions: ModuleType) -> str:
    """The title of a paper: the first line of its module."""
    return (functions.__doc__ or "").partition("\n")[0].rstrip(".")


def report(rows: Sequence[PaperNumber]) -> Report:
    """The report."""
    verdicts = [row.verdict for row in rows]
    count = (
        f"{verdicts.count('agrees')} agree, {verdicts.count('corrected')} corrected, "
        f"{verdicts.count('not stated')} that the papers should state."
    )
    sections = tuple(
        Section(
            f"paper-{paper}",
            title(functions),
            (
                table([row for row in rows if row.paper == paper], f"Paper {paper}"),
                *(make() for make in FIGURES.get(paper, ())),
            ),
        )
        for paper, functions in PAPERS.items()
    )
    return Report(
        "The papers, reproduced and corrected",
        "Every number that the papers print, beside the computed one",
        {"chainunit": __version__, "rows": as_data(rows)},
        (Text((count,)),),
        sections,
        opening_title="The answer",
    )
