"""The command that watches a recording for one-sided overload."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ...report.console import AllOption, OutputFolder, PicturesOption, carry_out, study_file
from ...report.result_kind import ResultKind


def watch(
    config: Annotated[Path, typer.Argument(help="Study file (TOML) with a table [watch].")],
    output: OutputFolder = Path("watched"),
    whole: AllOption = False,
    png: PicturesOption = False,
) -> None:
    """Run the load observer over a recording: feed and force of each side over time, and alarms with their grounds.

    Writes report.html, result.json, result.md and pictures into the output folder. The exit status is 0 without an
    alarm, 3 with one, and 1 if the machine of the study does not describe the beginning of the recording.
    """
    question = study_file(config)
    from .page import TASK

    carry_out(TASK, question, output, whole=whole, png=png)


COMMANDS = (watch,)
KINDS = {"watch": ResultKind("a watched recording", key="learned")}
