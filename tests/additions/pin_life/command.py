"""The command that finds the rating life of a pin."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from chainunit.report.console import OutputFolder, carry_out, study_file
from chainunit.report.result_kind import ResultKind


def pin_life(
    config: Annotated[Path, typer.Argument(help="Study file (TOML) with a table [pin_life].")],
    output: OutputFolder = Path("pin-life"),
) -> None:
    """Rating life of a rolling bearing in place of a pin, at the load and speed of steady running.

    Writes report.html, pin_life.json and pin_life.md into the output folder.
    """
    question = study_file(config)
    from .task import TASK

    carry_out(TASK, question, output)


COMMANDS = (pin_life,)
KINDS = {"pin-life": ResultKind("the rating life of a pin", "pin_life.json")}
