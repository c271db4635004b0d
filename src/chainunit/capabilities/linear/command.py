"""The command that writes the linear model of a drive, a linkage or a model at a point."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ...report.console import AllOption, OutputFolder, PicturesOption, carry_out
from ...report.result_kind import ResultKind


def linearize(
    name: Annotated[
        str,
        typer.Argument(
            help="A study file or a linkage file (.toml), or a model that chainunit export writes."
        ),
    ],
    at: Annotated[
        str | None,
        typer.Option(
            "--at",
            help='Point: of a study a run and its time, "jam_left:9.5 s", steady running by default; of a linkage '
            '"equilibrium", or "equilibrium:2" by its number; or values of states and inputs, '
            '"phi=30 deg, w=60 rpm".',
        ),
    ] = None,
    pairs: Annotated[
        str | None,
        typer.Option(
            "--pairs", help='Pairs for Bode plots: "motor.w_ref:motor.w, machine.stop.psi:motor.w".'
        ),
    ] = None,
    config: Annotated[
        Path | None,
        typer.Option("--config", help="Study file whose machine, feed or motor gives the values of a model."),
    ] = None,
    inverse: Annotated[
        bool,
        typer.Option("--inverse", help="Of a linkage file: motion in and forces out, in place of torque in."),
    ] = False,
    output: OutputFolder = Path("linear"),
    whole: AllOption = False,
    png: PicturesOption = False,
) -> None:
    """Write the linear model at a point: A, B, C, D with names and units, the poles, Bode plots.

    Writes linear.json, linear.npz, report.html, linear.md and plots into the output folder.
    """
    from .page import TASK
    from .result import LinearQuestion

    carry_out(TASK, LinearQuestion(name, at, pairs, config, inverse), output, whole=whole, png=png)


COMMANDS = (linearize,)
KINDS = {"linearize": ResultKind("a linear model", "linear.json")}
