"""The command that runs a sweep."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ...report.console import AllOption, OutputFolder, PicturesOption, carry_out, study_file
from ...report.result_kind import ResultKind


def sweep(
    config: Annotated[Path, typer.Argument(help="Study file (TOML) with a table [sweep].")],
    output: OutputFolder = Path("sweep"),
    workers: Annotated[
        int | None,
        typer.Option(
            "--workers", min=1, help="Threads, or with measures processes; one for each processor by default."
        ),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            "--scheduler",
            help="Address of a Dask scheduler whose workers make the points: tcp://10.0.0.5:8786.",
        ),
    ] = None,
    engine: Annotated[
        str,
        typer.Option(
            "--engine", help="Engine of the quantities of a turn: native, numpy, or cuda (a GPU of NVIDIA)."
        ),
    ] = "native",
    whole: AllOption = False,
    png: PicturesOption = False,
) -> None:
    """Vary parameters of a study: quantities of a turn, and measures of runs with an event, at many points.

    Writes report.html, result.json, result.md, plots and the store of all points into the output folder. A sweep that
    was killed goes on from its store.
    """
    question = study_file(config)
    from .page import TASK

    carry_out(
        TASK,
        question,
        output,
        workers=workers,
        scheduler=scheduler,
        engine=engine,
        whole=whole,
        png=png,
    )


COMMANDS = (sweep,)
KINDS = {"sweep": ResultKind("a sweep", key="best_by")}
