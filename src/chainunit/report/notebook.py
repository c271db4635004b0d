"""The progress of a task in a notebook: a bar."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from html import escape
from time import monotonic
from typing import Any

from ..core.errors import check_kind, printable
from ..work.progress import TaskProgress, quiet

_EVERY = 0.2
"""Least time between two changes of the bar [s]."""


@contextmanager
def shown_progress(progress: TaskProgress | None) -> Iterator[TaskProgress]:
    """The function for the progress of a task: the `progress` of the caller; without one a bar in a notebook, and
    nothing elsewhere. The bar is removed at the end.

    Raises
    ------
    InputError
        for a `progress` that is no function.
    """
    check_kind("progress", progress, Callable | None, "a function of task, work done and total work")
    shell = _notebook()
    if progress is not None or shell is None:
        yield progress or quiet
        return
    bar = ProgressBar(shell)
    try:
        yield bar
    finally:
        bar.close()


def _notebook() -> Any:
    """The shell of IPython that runs in a notebook; None elsewhere."""
    # a program outside IPython has not imported it
    module = sys.modules.get("IPython")
    shell = None if module is None else module.get_ipython()
    return shell if getattr(shell, "kernel", None) is not None else None


class ProgressBar:
    """A bar below the cell of a notebook with the task and its share; it begins with the first report."""

    def __init__(self, shell: Any) -> None:
        self._display, self._id = shell.display_pub, f"chainunit-{id(self)}"
        self._begin, self._last = monotonic(), -_EVERY
        self._is_shown, self._task = False, ""

    def __call__(self, what: str, done: float, total: float) -> None:
        """Show the share of a task, see `TaskProgress`."""
        now = monotonic() - self._begin
        if now - self._last < _EVERY and done < total and what == self._task:
            return
        self._last, self._task = now, what
        share = min(max(done / total, 0.0), 1.0) if total > 0.0 else 0.0
        title = printable(what)
        self._publish(
            f"{title}: {share:.0%}",
            f'<progress max="1" value="{share:.4f}" style="width: 20em"></progress> {escape(title)}, {now:.0f} s',
        )

    def close(self) -> None:
        """Remove the bar."""
        if self._is_shown:
            self._publish("", "")

    def _publish(self, text: str, html: str) -> None:
        data = {"text/plain": text, "text/html": html}
        self._display.publish(data, transient={"display_id": self._id}, update=self._is_shown)
        self._is_shown = True
