"""The common part of results from Python: their report as text, page and files."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import ClassVar, Self

from ..core.errors import WriteError
from ..core.files import claim, write_all
from ..report import files, html, terminal
from ..report.blocks import Report


class ReportedResult:
    """A result with a report. Its `repr` shows the report as text."""

    @cached_property
    def _report(self) -> Report:
        raise NotImplementedError

    def to_json(self) -> str:
        """All numbers with their units, as the text of result.json."""
        return files.numbers_text(self._report)

    def __repr__(self) -> str:
        return terminal.plain(self._report)

    def _repr_html_(self) -> str:
        """The same as HTML, for notebooks."""
        return html.fragment(self._report)


class WrittenResult(ReportedResult):
    """A result whose files can be written into any folder."""

    _command: ClassVar[str]
    """the command that writes the same files"""
    _names: ClassVar[tuple[str, ...]] = ()
    """of further files that it writes, see `claim`"""

    def save(self, folder: str | Path) -> list[Path]:
        """Write the files of the command of the same name with ``-o``; returns the files.

        Raises
        ------
        InputError
            for a folder with another kind of result, and one in which a process writes.
        WriteError
            for a file that cannot be written; the others are written.
        """
        with claim(Path(folder), self._command, *self._names) as place:
            self._clear(place)
            return self._write(place)

    @classmethod
    def _made(cls, make: Callable[[], Self], folder: str | Path | None) -> Self:
        """The result of `make`, with its files in a `folder`, which is claimed before the work."""
        if folder is None:
            return make()
        with claim(Path(folder), cls._command, *cls._names) as place:
            result = make()
            result._clear(place)
            result._write(place)
        return result

    def _write(self, folder: Path) -> list[Path]:
        paths, failure = write_all(self._writers(folder))
        if failure is not None:
            raise WriteError(str(failure)) from failure
        return paths

    def _clear(self, folder: Path) -> None:
        """Remove the files of an earlier result."""
        raise NotImplementedError

    def _writers(self, folder: Path) -> list[Callable[[], list[Path]]]:
        raise NotImplementedError
