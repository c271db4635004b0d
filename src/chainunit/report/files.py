"""The files of a report. Each file appears whole or not at all."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

from ..core.files import write_file
from . import html, print_figures
from .blocks import Report
from .markdown import markdown


def writers(report: Report, folder: Path, name: str, png: bool = False) -> list[Callable[[], list[Path]]]:
    """The functions that write the numbers (``NAME.json``), the pictures, the text (``NAME.md``) and the page of a
    report, in this order; each function returns the files that it wrote. The page has all figures; they are drawn as
    pictures, too, with `png`."""
    pictures: list[Path] = []

    def numbers() -> list[Path]:
        return write_file(folder / f"{name}.json", numbers_text(report))

    def draw() -> list[Path]:
        """Write the drawings, and the figures as `png`; `text` names them after that."""
        for drawing in report.drawings:
            pictures.extend(write_file(folder / drawing.file, drawing.svg))
        if png:
            pictures.extend(print_figures.write(report.figures, folder, report.units))
        return pictures

    def text() -> list[Path]:
        return write_file(folder / f"{name}.md", markdown(report, [picture.name for picture in pictures]))

    return [numbers, draw, text, lambda: [html.write(report, folder)]]


def numbers_text(report: Report) -> str:
    """The numbers of a report as JSON."""
    return json.dumps(report.result, indent=1, allow_nan=False) + "\n"


def names(name: str, pictures: tuple[str, ...]) -> tuple[str, ...]:
    """The names of all files that a report may write."""
    return (f"{name}.json", f"{name}.md", html.NAME, *pictures)
