"""The command that compares two results."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ...report.console import AllOption, OutputFolder, PicturesOption, carry_out
from ...report.result_kind import ResultKind


def compare(
    first: Annotated[Path, typer.Argument(help="Folder of a study, or its result.json.")],
    second: Annotated[Path, typer.Argument(help="Folder of the other study, or its result.json.")],
    output: OutputFolder = Path("comparison"),
    whole: AllOption = False,
    png: PicturesOption = False,
) -> None:
    """Show two results side by side: the given values that differ, and every measure of each run of both.

    Writes report.html, comparison.json and comparison.md into the output folder.
    """
    from ...study.stored_result import read_result
    from .page import TASK

    carry_out(TASK, (read_result(first), read_result(second)), output, whole=whole, png=png)


COMMANDS = (compare,)
KINDS = {"compare": ResultKind("a comparison", "comparison.json")}
