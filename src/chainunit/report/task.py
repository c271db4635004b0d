"""A task: what a command computes, reports and leaves in a folder.

The command line (`chainunit.report.console`) and Python (`chainunit.report.reported_result`) take the same steps by
it: they claim the folder, clear it, compute, report and write.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from ..core.errors import InputError, RunError, WriteError
from ..core.files import claim, clear
from ..study import provenance
from ..study.config import Config
from ..study.registry import modules
from ..work.progress import TaskProgress
from . import files
from .blocks import Report
from .result_kind import ResultKind

Question = TypeVar("Question")
"""What a task is asked: the configuration of a study, or the content of other files."""
Outcome = TypeVar("Outcome")
"""What a task computes."""
Writer = Callable[[], list[Path]]
"""A function that writes files, and returns them."""


_OF_BASE = {"study": ResultKind("a study", key="answers"), "linkage": ResultKind("a linkage", "linkage.json")}


def result_kinds() -> Mapping[str, ResultKind]:
    """The kinds of results that commands leave in a folder, by command: of the base and of the capabilities."""
    return _OF_BASE | {name: kind for module in modules("command") for name, kind in module.KINDS.items()}


def no_check(question: Any, **options: Any) -> None:
    """Accept a question that was checked before."""


@dataclass(frozen=True)
class Task(Generic[Question, Outcome]):
    """A command with a report in a folder."""

    name: str
    """name of the command, one of `result_kinds`; the folder is claimed for it"""
    compute: Callable[..., Outcome]
    """gets the question, the folder (None without one), the function for the progress, and options by their names"""
    report: Callable[[Outcome], Report]
    files: tuple[str, ...] = ()
    """names of the files beside the numbers, the text and the page. One with * stands for all files of such a name:
    it is cleared, and not claimed."""
    accept: Callable[..., object] | None = None
    """gets the question and the options, and refuses what is wrong. With it the files of an earlier result are
    removed before the computation; without it after the computation, which then refuses."""
    writers: Callable[[Outcome, Report, Path, list[Writer]], list[Writer]] = (
        lambda outcome, report, folder, of_report: of_report
    )
    """gets the outcome, its report, the folder and the writers of the report: numbers, pictures, text, page. Gives
    all writers in their order."""
    replaced: Callable[[Question], tuple[str, ...]] = lambda question: ()
    """names of the files that the computation replaces by itself: they are claimed, and not cleared"""
    kept: Callable[[Outcome, Path], Iterable[Path]] | None = None
    """the files and folders that the computation left in its folder; a task without it computes without a folder"""
    failure: Callable[[Outcome], RunError | None] = lambda outcome: None
    """the error that ended the computation early; what was computed before this error is reported and written"""
    shortfall: Callable[[Outcome], str | None] = lambda outcome: None
    """None where the outcome is what was sought, else a sentence for the terminal, or "": the exit status is 1"""
    alarmed: Callable[[Outcome], bool] = lambda outcome: False
    """whether the outcome, as it was sought, is an alarm: the exit status is 3"""
    sources: Callable[[Question], Iterable[Path]] = lambda question: ()
    """the files behind the outcome; those of a study follow from its tables"""
    content: type | None = None
    """the declared content of its result.json"""
    tells_remarks: bool = False
    """whether a terminal has the remarks of the report already, as those on the study file"""

    @property
    def _stem(self) -> str:
        return result_kinds()[self.name].file.removesuffix(".json")

    def claimed(self, question: Question, folder: Path) -> AbstractContextManager[Path]:
        """The folder, for this process alone.

        Raises
        ------
        InputError
            for a folder with a result of another kind; see also `chainunit.core.files.claim`.
        """
        other = next(
            (kind for name, kind in result_kinds().items() if name != self.name and kind.is_in(folder)), None
        )
        if other is not None:
            raise InputError(
                f"{folder}: has the result of {other.words}, which would be lost; name another folder"
            )
        names = files.names(self._stem, tuple(name for name in self.files if "*" not in name))
        of_study = [provenance.COPY] if isinstance(question, Config) else []
        return claim(folder, *names, provenance.FILE, *of_study, *self.replaced(question))

    def clear(self, folder: Path | None) -> None:
        """Remove the files of an earlier result from a folder, if there is one, see `chainunit.core.files.clear`."""
        if folder is None:
            return
        names: list[str] = [provenance.FILE, provenance.COPY]
        for name in self.files:
            names += sorted(file.name for file in folder.glob(name)) if "*" in name else [name]
        clear(folder, *files.names(self._stem, tuple(names)))

    def outcome(
        self, question: Question, folder: Path | None, progress: TaskProgress, **options: Any
    ) -> Outcome:
        """Compute in a claimed folder, or without one. The files of an earlier result are removed once the question
        is accepted.

        Raises
        ------
        InputError
            for a question that is refused, which begins with the name of its study file; an earlier result stays.
        RunError
            see the task.
        """
        with question.file.refusals() if isinstance(question, Config) else nullcontext():
            if self.accept is not None:
                self.accept(question, **options)
                self.clear(folder)
            outcome = self.compute(question, folder, progress, **options)
        if self.accept is None:
            self.clear(folder)
        return outcome

    def write(
        self, question: Question, outcome: Outcome, report: Report, folder: Path, png: bool = False
    ) -> tuple[list[Path], WriteError | None]:
        """Write all files, figures as PNG with `png`, and their provenance; of a study also a copy of its file.
        Returns the files, and the first error of a file that could not be written, or None."""
        of_task = self.writers(outcome, report, folder, files.writers(report, folder, self._stem, png))
        if isinstance(question, Config):
            of_sources = provenance.writers(question, folder)
        else:
            of_sources = provenance.writers_without_study(self.sources(question), folder)
        paths: list[Path] = []
        failure = None
        for write in (*of_task, *of_sources):
            try:
                paths += write()
            except WriteError as error:
                failure = failure or error
        return paths, failure
