"""What commands show on the terminal: the report, the written files, and the progress of long work."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from ..core.errors import RemarkWarning, WriteError, printable
from ..core.files import write_all

if TYPE_CHECKING:
    from ..report.blocks import Report


def terminal_console(**options: Any) -> Console:
    """A console for words that may come from the user."""
    # titles and paths come from the user: they may hold text that rich would take for markup
    return Console(markup=False, highlight=False, **options)


def leave(
    report: Report, writers: Iterable[Callable[[], list[Path]]], *, remarks: bool = True
) -> WriteError | None:
    """Write all files of a report and show the report. Returns the error of the first file that the disk had
    no room for; the other files are written all the same. Without `remarks` the report is shown without its
    remarks, which the terminal then has already.
    """
    from ..report import terminal

    written, unwritten = write_all(writers)
    console = terminal_console()
    terminal.show(report, console, remarks=remarks or not console.is_terminal)
    console.print("Written: " + ", ".join(printable(str(path), 500) for path in written), soft_wrap=True)
    return unwritten


def finish(report: Report, output: Path, name: str) -> None:
    """Write and show a report whose run is complete."""
    from ..report import files

    if (unwritten := leave(report, files.writers(report, output, name))) is not None:
        raise unwritten


@contextmanager
def progress_bar(console: Console) -> Iterator[Callable[[str, float, float], None]]:
    """A progress bar that begins with the first report, so that a fault of the input is shown without a bar.
    Yields the function that reports the current task, the complete amount of work, and the total amount."""
    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        console=console,
    )
    task = bar.add_task("", total=1.0)

    def report(what: str, done: float, todo: float) -> None:
        bar.start()
        bar.update(task, description=what, completed=done, total=todo)

    try:
        yield report
    finally:
        if bar.live.is_started:
            bar.stop()


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
    for slip in loaded.slips:
        show_remark(slip.sentence)
    return loaded
