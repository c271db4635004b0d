"""The command that writes the files for other programs from the result of a study."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ...report.console import AllOption, OutputFolder, PicturesOption, carry_out
from ...report.result_kind import ResultKind


def handover(
    results: Annotated[Path, typer.Argument(help="Folder of a study.")],
    output: OutputFolder = Path("handover"),
    whole: AllOption = False,
    png: PicturesOption = False,
) -> None:
    """Write the files of a sized drive for other programs, from the folder of a study: no run is made.

    Writes sizing.json with the numbers of the drive by its parts, the load of the motor's shaft as CSV, the
    candidates of sizing and the checks by clause as CSV, and a page that lists what the files say and what they leave
    open."""
    from .page import TASK

    carry_out(TASK, results, output, whole=whole, png=png)


COMMANDS = (handover,)
KINDS = {"handover": ResultKind("a handover", "sizing.json")}
