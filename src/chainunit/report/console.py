"""What commands share: options, and what they show on the terminal: the report, the written files, and the progress
of long work."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from ..core.errors import InputError, InterruptedRunError, RemarkWarning, printable
from ..work import interrupts

if TYPE_CHECKING:
    from ..reading.tables import UnusualValue
    from .task import Outcome, Question, Task


class Backend(StrEnum):
    """How an FMU computes."""

    native = "native"
    python = "python"


BackendOption = Annotated[
    Backend | None,
    typer.Option("--backend", help="FMUs in native code or in Python; native where a C compiler is found."),
]
PicturesOption = Annotated[
    bool, typer.Option("--png", help="Also write the figures of the page as PNG files.")
]
AllOption = Annotated[
    bool, typer.Option("--all", help="Print all tables, warnings and notes, in place of one screen.")
]
OutputFolder = Annotated[Path, typer.Option("-o", "--output", help="Folder for results.")]


def terminal_console(**options: Any) -> Console:
    """A console for words that may come from the user."""
    # titles and paths come from the user: they may hold text that rich would take for markup
    return Console(markup=False, highlight=False, **options)


def carry_out(
    task: Task[Question, Outcome],
    question: Question,
    output: Path,
    errors: Console | None = None,
    *,
    whole: bool = True,
    png: bool = False,
    **options: Any,
) -> None:
    """Run a task in the folder `output`, show its report on one screen or as a `whole`, and name the files. `errors`
    is the console of the standard error, for the progress. With `png` the figures are files, too. The task has
    these options.

    Raises
    ------
    InputError, RunError
        see the task.
    WriteError
        of the first file that could not be written; the other files are written.
    typer.Exit, SystemExit
        with the exit status, where the outcome is not what was sought, and where the computation ended early.
    """
    errors = errors or terminal_console(stderr=True)
    with task.claimed(question, output):
        with progress_bar(errors) as progress:
            outcome = task.outcome(question, output, progress, **options)
        report = task.report(outcome)
        written, unwritten = task.write(question, outcome, report, output, png)
        from . import terminal

        console = terminal_console()
        has_remarks = task.tells_remarks and errors.is_terminal and console.is_terminal
        if whole:
            terminal.show(report, console, remarks=not has_remarks)
            paths = ", ".join(printable(str(path), 500) for path in written)
            console.print(f"Written: {paths}", soft_wrap=True)
        else:
            names = ", ".join(printable(str(path.relative_to(output)), 500) for path in written[:_MOST_NAMES])
            names += f" and {len(written) - _MOST_NAMES} more" if len(written) > _MOST_NAMES else ""
            more = f"All numbers here: --all. Written to {printable(str(output), 500)}: {names}"
            terminal.screen(report, console, more)
    if (failure := task.failure(outcome)) is not None:
        sentence = f"The run stopped early: {failure}. What was computed before is in {output}."
        errors.print(printable(sentence, 2000), soft_wrap=True)
        sys.exit(exit_status(failure))
    if unwritten is not None:
        raise unwritten
    if (shortfall := task.shortfall(outcome)) is not None:
        if shortfall:
            errors.print(shortfall)
        raise typer.Exit(1)
    if task.alarmed(outcome):
        raise typer.Exit(ALARM)


ALARM = 3
"""Exit status of a command whose outcome is an alarm."""
_MOST_NAMES = 8
"""Largest number of files that one screen names."""


def exit_status(error: BaseException) -> int:
    """Exit status of a command that failed with `error`."""
    if isinstance(error, InterruptedRunError):
        return interrupts.status()
    return 2 if isinstance(error, InputError) else 1


@contextmanager
def progress_bar(console: Console) -> Iterator[Callable[[str, float, float], None]]:
    """A progress bar that begins with the first report, so that a fault of the input is shown without a bar. Work
    that takes longer than a minute is told with its forecast, also where the console is no terminal and shows no bar.
    Yields the function that reports the current task, the complete amount of work, and the total amount."""
    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        console=console,
    )
    task = bar.add_task("", total=1.0)
    forecast = Forecast()

    def report(what: str, done: float, todo: float) -> None:
        bar.start()
        bar.update(task, description=what, completed=done, total=todo)
        if sentence := forecast.words(monotonic(), what, done, todo):
            console.print(printable(sentence, 500), soft_wrap=True)

    try:
        yield report
    finally:
        if bar.live.is_started:
            bar.stop()


class Forecast:
    """The time that work will take, from the reports of its progress."""

    def __init__(self) -> None:
        self._todo, self._begin, self._first, self._end = -1.0, 0.0, 0.0, 0.0

    def words(self, now: float, what: str, done: float, todo: float) -> str:
        """The forecast at the time `now` [s] in a sentence, the first time that it is sure enough and above a minute
        for this amount of work, and again at the end that it named; else empty."""
        if todo != self._todo:
            self._todo, self._begin, self._first, self._end = todo, now, done, 0.0
        spent, progress = now - self._begin, done - self._first
        if now < self._end or spent < _SURE or progress <= 0.0:
            return ""
        left = spent * (todo - done) / progress
        if left < _LONG:
            return ""
        self._end = now + left
        return f"About {left / 60.0:.0f} min more: {what}."


_SURE, _LONG = 5.0, 60.0
"""Time [s] after which a forecast is made, and from which on it is told."""


def show_only_remarks() -> None:
    """Show warnings as remarks. Those of libraries are for programmers: they are not shown, except where the user
    asks Python for them (``python -W``)."""
    if sys.warnoptions:
        return
    warnings.simplefilter("ignore")
    warnings.simplefilter("default", RemarkWarning)
    warnings.showwarning = lambda message, *_: show_remark(str(message))


def show_remark(sentence: str) -> None:
    """Show a remark beside the result."""
    terminal_console(stderr=True).print(f"Remark: {printable(sentence, 2000)}", soft_wrap=True)


def study_file(file: Path | None) -> Any:
    """The study of a file; a value that looks like a slip of a unit is named before any run."""
    from ..study import config as configuration

    loaded = configuration.load(file)
    show_slips(loaded.file.unusual)
    return loaded


def show_slips(unusual: Iterable[UnusualValue]) -> None:
    """Show the unusual values of a file whose unit is likely mistaken."""
    from ..reading.tables import slips_of

    for value in slips_of(unusual):
        show_remark(value.sentence)
