"""The command line, run in this process: a tenth of the time that a process of its own takes to begin."""

from __future__ import annotations

import contextlib
import io
import os
from dataclasses import dataclass
from unittest import mock

from chainunit.app.cli import main


@dataclass(frozen=True)
class Done:
    """A command that ended."""

    returncode: int
    stdout: str
    stderr: str


REPORTS = ("study", "linkage", "sweep", "optimize", "identify", "watch", "linearize", "compare", "handover")
"""Commands that print a report."""


def chainunit(*arguments, cwd, whole=True):
    """``chainunit arguments`` in the folder `cwd`, on a terminal of 120 columns that is a file: with all figures
    as files and the `whole` report, or with one screen of 80 columns."""
    arguments = list(map(str, arguments))
    if whole and arguments[:1] and arguments[0] in REPORTS:
        arguments += ["--all", "--png"]
    out, err = io.StringIO(), io.StringIO()
    status = 0
    with (
        contextlib.chdir(cwd),
        mock.patch.dict(os.environ, COLUMNS="120" if whole else "80"),
        mock.patch("sys.argv", ["chainunit", *arguments]),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        try:
            main()
        except SystemExit as end:
            status = end.code or 0
    return Done(status, out.getvalue(), err.getvalue())
