"""The command that watches a recording for one-sided overload."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..core.files import claim
from .console import leave, progress_bar, study_file, terminal_console


def watch(
    config: Annotated[Path, typer.Argument(help="Study file (TOML) with a table [watch].")],
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder for results.")] = Path("watched"),
) -> None:
    """Run the load observer over a recording: feed and force of each side over time, and alarms with their grounds.

    Writes report.html, result.json, result.md and pictures into the output folder.
    """
    loaded = study_file(config)
    from ..report import watch as contents
    from ..study.identification.watch import watch as watched

    with claim(output, "watch", *contents.PICTURES):
        with progress_bar(terminal_console(stderr=True)) as progress:
            found = watched(loaded, progress)
        contents.prepare(output)
        report = contents.watch_report(found)
        unwritten = leave(report, contents.writers(report, output))
    if unwritten is not None:
        raise unwritten
