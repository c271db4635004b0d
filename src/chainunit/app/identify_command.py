"""The command that identifies a machine from recordings of its motor."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..core.files import claim
from .console import leave, progress_bar, study_file, terminal_console


def identify(
    config: Annotated[Path, typer.Argument(help="Study file (TOML) with a table [identify].")],
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder for results.")] = Path("identified"),
) -> None:
    """Identify masses, friction and feed of a real machine from recordings of its motor.

    Says what the recordings can tell before anything is fitted. Writes identified.toml, report.html, result.json,
    result.md and pictures into the output folder. The exit status is 1 where the model does not describe the
    recordings.
    """
    loaded = study_file(config)
    from ..report import identification as contents
    from ..study.identification.identification import identify as identified
    from ..study.identification.result import outlook

    console = terminal_console(stderr=True)
    with claim(output, "identify", contents.FILE):
        with progress_bar(console) as progress:
            found = identified(loaded, progress, lambda *told: console.print(outlook(*told), soft_wrap=True))
        contents.prepare(output)
        report = contents.identification_report(found)
        unwritten = leave(report, contents.writers(found, report, output))
    if unwritten is not None:
        raise unwritten
    if not found.is_described:
        raise typer.Exit(1)
