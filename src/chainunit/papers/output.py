"""The output of ``chainunit reproduce``: reproduction.json, a table and the papers' figures."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table

from .. import __version__
from ..files import whole
from ..report.style import draw
from . import PAPERS
from .figures import FIGURES
from .table import Row


def markdown(rows: Sequence[Row]) -> str:
    """The table of a paper's rows for the documentation."""
    lines = [
        "| item | where | quantity | printed | computed | verdict | why |",
        "|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        unit = "" if row.unit == "1" else f" {row.unit}"
        shown = row.shown + unit
        if row.shown_rebuilt is not None:
            shown += f" (as the authors: {row.shown_rebuilt})"
        printed = "-" if row.printed is None else row.printed
        cells = (row.item, row.where, row.quantity, printed, shown, row.verdict, row.reason)
        lines.append("| " + " | ".join(c.replace("|", "\\|") for c in cells) + " |")
    return "\n".join(lines) + "\n"


def write(rows: Sequence[Row], folder: Path) -> list[Path]:
    """Write reproduction.json, reproduction.md and every figure; returns the files."""
    folder.mkdir(parents=True, exist_ok=True)
    numbers = folder / "reproduction.json"
    content = {"chainunit": __version__, "rows": [row.as_dict() for row in rows]}
    with whole(numbers) as part:
        part.write_text(json.dumps(content, indent=2, allow_nan=False) + "\n", "utf-8")
    table = folder / "reproduction.md"
    with whole(table) as part:
        part.write_text(
            "\n".join(
                f"## Paper {paper}\n\n{markdown([r for r in rows if r.paper == paper])}" for paper in PAPERS
            ),
            "utf-8",
        )
    return [numbers, table, *draw(FIGURES, folder)]


def show(rows: Sequence[Row], console: Console) -> None:
    """Print the rows that a paper prints, and count the rest."""
    for paper in PAPERS:
        table = Table(title=f"Paper {paper}: what it prints", title_justify="left")
        for column, side in (
            ("item", "left"),
            ("quantity", "left"),
            ("printed", "right"),
            ("computed", "right"),
        ):
            table.add_column(column, justify=side)  # type: ignore[arg-type]
        table.add_column("verdict")
        for row in rows:
            if row.paper == paper and row.printed is not None:
                unit = "" if row.unit == "1" else f" {row.unit}"
                mark = "bold" if row.verdict == "corrected" else ""
                table.add_row(row.item, row.quantity, row.printed, row.shown + unit, row.verdict, style=mark)
        console.print(table)
    verdicts = [row.verdict for row in rows]
    console.print(
        f"{verdicts.count('agrees')} agree, {verdicts.count('corrected')} corrected, "
        f"{verdicts.count('not stated')} that the papers should state."
    )
