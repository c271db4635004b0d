"""The common part of results from Python: a task is run, and its report is shown as text, page and files."""

from __future__ import annotations

import io
import shutil
import tempfile
import weakref
from collections.abc import Iterator, Mapping
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Self

from ..core.errors import WriteError, check_kind
from ..core.files import atomic_file, named_file
from ..core.named import Named
from ..reading.text import Units
from ..work.progress import TaskProgress
from . import files, html, print_figures, terminal
from .blocks import Report
from .figure import Figure
from .notebook import shown_progress
from .style import styled
from .task import Outcome, Question, Task

if TYPE_CHECKING:
    import pandas as pd


class ReportedResult(Generic[Question, Outcome]):
    """The result of a task. Its `repr` shows the report as text."""

    _task: ClassVar[Task[Any, Any]]
    """the task of the command of the same name"""

    def __init__(self, question: Question, outcome: Outcome, folder: Path | None) -> None:
        self._question, self._outcome, self._folder = question, outcome, folder

    @classmethod
    def made(
        cls, question: Question, folder: str | Path | None, progress: TaskProgress | None, **options: Any
    ) -> Self:
        """The result of the task, with its files in a `folder` where one is named.

        Raises
        ------
        InputError
            for a question that is refused, and for a folder that cannot be claimed.
        RunError
            of a computation that ended early; its `partial` is the result up to there.
        WriteError
            for a file that cannot be written; the others are written.
        """
        check_kind("folder", folder, str | Path | None, "the path of a folder")
        task = cls._task
        with shown_progress(progress) as shown:
            compute = partial(task.outcome, question, progress=shown, **options)
            if folder is not None:
                with task.claimed(question, Path(folder)) as place:
                    result = cls(question, compute(folder=place), place)
                    result._write(place)
            elif task.kept is None:
                result = cls(question, compute(folder=None), None)
            else:
                place = Path(tempfile.mkdtemp(prefix="chainunit_"))
                try:
                    result = cls(question, compute(folder=place), place)
                except BaseException:
                    shutil.rmtree(place, ignore_errors=True)
                    raise
                weakref.finalize(result, shutil.rmtree, place, ignore_errors=True)
        failure = task.failure(result._outcome)
        if failure is not None:
            failure.partial = result
            raise failure
        return result

    @cached_property
    def _report(self) -> Report:
        return self._task.report(self._outcome)

    @property
    def _shown(self) -> Report:
        """The report that `repr` shows."""
        return self._report

    @cached_property
    def answers(self) -> pd.DataFrame:
        """The numbers of the answer, a row each, in SI units: the column "unit", and columns of numbers, NaN for one
        that is none."""
        import pandas as pd

        table = {}
        for name, row in self._answer_rows().items():
            unit = next(iter(row.values()))["unit"]
            values = {column: entry["value"] for column, entry in row.items()}
            table[name] = {"unit": unit} | {k: float("nan") if x is None else x for k, x in values.items()}
        return pd.DataFrame.from_dict(table, orient="index")

    def _answer_rows(self) -> Mapping[str, Mapping[str, Any]]:
        """By row and column, the entries of result.json that `answers` has; by default all of its single numbers."""
        return {name: {"value": entry} for name, entry in _single_numbers(self._report.result)}

    @property
    def verdict(self) -> str:
        """The judgements of the report, a line each; of a result that judges nothing its first sentence."""
        return "\n".join(terminal.judgements(self._report))

    @property
    def warnings(self) -> list[str]:
        """The warnings, a text each."""
        return terminal.remarks(self._report, "warning")

    @property
    def notes(self) -> list[str]:
        """The assumptions behind the numbers, a text each."""
        return terminal.remarks(self._report, "note")

    @cached_property
    def figures(self) -> Mapping[str, ResultFigure]:
        """The figures of the report by name: a notebook shows one, and its `save` writes it into a file."""
        report = self._report
        return Named({figure.name: ResultFigure(figure, report.units) for figure in report.figures})

    def to_json(self) -> str:
        """All numbers with their units, as the text of the file of numbers."""
        return files.numbers_text(self._shown)

    def save(self, folder: str | Path, png: bool = False) -> list[Path]:
        """Write the files of the command of the same name with ``-o``, and with `png` the figures as pictures;
        returns the files.

        Raises
        ------
        InputError
            for a folder with another kind of result, and one in which a process writes.
        WriteError
            for a file that cannot be written; the others are written.
        """
        check_kind("folder", folder, str | Path, "the path of a folder")
        task = self._task
        with task.claimed(self._question, Path(folder)) as place:
            if task.kept is None or self._folder is None:
                task.clear(place)
            elif place.resolve() != self._folder.resolve():
                task.clear(place)
                for file in task.kept(self._outcome, self._folder):
                    target = place / file.relative_to(self._folder)
                    target.parent.mkdir(parents=True, exist_ok=True)
                    with atomic_file(target) as part:
                        shutil.copyfile(file, part)
            return self._write(place, png)

    def _write(self, folder: Path, png: bool = False) -> list[Path]:
        """Write all files into a folder, and return them."""
        paths, failure = self._task.write(self._question, self._outcome, self._report, folder, png)
        if failure is not None:
            raise WriteError(str(failure)) from failure
        return paths

    def __repr__(self) -> str:
        return terminal.brief(self._shown, len(self.warnings))

    def _repr_html_(self) -> str:
        """The same as HTML, for notebooks."""
        return html.fragment(self._shown)


def _single_numbers(node: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """By its path, each single number with a unit below a node of the result."""
    for name, below in node.items():
        if isinstance(below, Mapping) and "unit" in below and "value" in below:
            if not isinstance(below["value"], list | str | bool):
                yield prefix + name, below
        elif isinstance(below, Mapping):
            yield from _single_numbers(below, f"{prefix}{name}.")


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
        path = named_file(file, ".png", ".svg", ".pdf")
        with atomic_file(path) as part:
            part.write_bytes(self._bytes(path.suffix.lower().removeprefix(".")))
        return path

    def _bytes(self, kind: str) -> bytes:
        """The figure as a file of this kind: png, svg or pdf."""
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
