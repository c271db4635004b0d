"""The command that writes the files for others from the result of a study."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ...report.command_options import AllOption, OutputFolder, PicturesOption
from ...report.console import carry_out
from ...report.result_kind import ResultKind


def handover(
    results: Annotated[Path, typer.Argument(help="Folder of a study.")],
    aasx: Annotated[
        bool,
        typer.Option(help="Write the package sizing.aasx, too, which needs pip install 'chainunit[aas]'."),
    ] = True,
    output: OutputFolder = Path("handover"),
    whole: AllOption = False,
    png: PicturesOption = False,
) -> None:
    """Write the files of a sized drive for other programs, from the folder of a study: no run is made.

    Writes sizing.aasx and sizing.json (IDTA 02021, Sizing of Power Drive Trains), the load of the motor's shaft as
    CSV, the candidates of sizing and the checks by clause as CSV, and a page that lists what the files say and what
    they leave open."""
    from .page import TASK, HandoverQuestion

    carry_out(TASK, HandoverQuestion(results, aasx), output, whole=whole, png=png)


COMMANDS = (handover,)
KINDS = {"handover": ResultKind("a handover", "handover.json")}
