"""The command that searches for the best machine."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ...report.console import AllOption, OutputFolder, PicturesOption, carry_out, study_file
from ...report.result_kind import ResultKind


def optimize(
    config: Annotated[Path, typer.Argument(help="Study file (TOML) with the table [optimize].")],
    output: OutputFolder = Path("best"),
    whole: AllOption = False,
    png: PicturesOption = False,
) -> None:
    """Search for the best machine: parameters with the least torque, load, power or energy under limits.

    Writes best.toml, report.html, result.json, result.md and pictures into the output folder.
    """
    question = study_file(config)
    from .page import TASK

    carry_out(TASK, question, output, whole=whole, png=png)


COMMANDS = (optimize,)
KINDS = {"optimize": ResultKind("a search for the best machine", key="objectives")}
