"""The figures of a result as objects: a notebook shows them, and they are saved as files."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

from ..core.files import atomic_file, named_file
from ..reading.text import Units
from . import print_figures
from .figure import Figure
from .style import styled

FORMATS = ("png", "svg", "pdf")


class ResultFigure:
    """A figure of a result. A notebook shows it as PNG; `save` writes it into a file.

    `title` and `alt` describe it. Its axes are in the units of the study.
    """

    def __init__(self, figure: Figure, units: Units) -> None:
        self._figure, self._units = figure, units

    @property
    def title(self) -> str:
        """What the figure shows, in a line."""
        return self._figure.title

    @property
    def alt(self) -> str:
        """A description for a reader who does not see the figure."""
        return self._figure.alt

    def to_matplotlib(self) -> Any:
        """A new figure of matplotlib, to be changed by the caller."""
        return print_figures.drawn(self._figure, self._units)

    def save(self, file: str | Path) -> Path:
        """Write the figure into a file whose name ends in .png, .svg or .pdf; returns the file.

        Raises
        ------
        InputError
            for another ending.
        WriteError
            for a file that cannot be written.
        """
        path = named_file(file, *(f".{kind}" for kind in FORMATS))
        with atomic_file(path) as part:
            part.write_bytes(self._bytes(path.suffix.lower().removeprefix(".")))
        return path

    def _bytes(self, kind: str) -> bytes:
        out = io.BytesIO()
        # without the date the same figure is the same file
        metadata = {"png": {}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}[kind]
        drawn = self.to_matplotlib()
        with styled({"svg.hashsalt": self._figure.name}):
            drawn.savefig(out, format=kind, metadata=metadata)
        return out.getvalue()

    def _repr_png_(self) -> bytes:
        return self._bytes("png")

    def __repr__(self) -> str:
        return f"<Figure {self._figure.name!r}: {self.title}>"
