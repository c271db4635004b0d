"""The command that identifies a machine from recordings of its motor."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from ...report.console import AllOption, OutputFolder, PicturesOption, carry_out, study_file, terminal_console
from ...report.result_kind import ResultKind


def identify(
    config: Annotated[Path, typer.Argument(help="Study file (TOML) with a table [identify].")],
    output: OutputFolder = Path("identified"),
    whole: AllOption = False,
    png: PicturesOption = False,
) -> None:
    """Identify masses, friction and feed of a real machine from recordings of its motor.

    Says what the recordings can tell before anything is fitted. Writes identified.toml, report.html, result.json,
    result.md and pictures into the output folder. If the model does not describe the recordings, the exit status is
    1, and there is no identified.toml.
    """
    question = study_file(config)
    from .page import TASK
    from .result import sentence_before_fit

    errors = terminal_console(stderr=True)

    def before_fit(*information: Any) -> None:
        errors.print(sentence_before_fit(*information), soft_wrap=True)

    def after_reading(sentence: str) -> None:
        errors.print(f"{sentence}.", soft_wrap=True, markup=False)

    carry_out(
        TASK,
        question,
        output,
        errors,
        before_fit=before_fit,
        after_reading=after_reading,
        whole=whole,
        png=png,
    )


COMMANDS = (identify,)
KINDS = {"identify": ResultKind("an identification", key="proposals")}
