"""The command line: ``chainunit study``, ``chainunit reproduce``, ``chainunit export``."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from . import __version__
from .errors import InputError

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="Forces in a chain unit: FMUs, co-simulation with motor models, drive torque and one-sided overload.",
)


def _version(wanted: bool) -> None:
    if wanted:
        print(f"chainunit {__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and stop.")
    ] = False,
) -> None:
    pass


@app.command()
def study(
    config: Annotated[
        Path | None, typer.Argument(help="Study file (TOML); without one, the packaged example.")
    ] = None,
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder for results.")] = Path("results"),
    check: Annotated[
        bool, typer.Option("--check", help="Also compare with the monolithic solution.")
    ] = False,
    example: Annotated[
        bool, typer.Option("--example", help="Print the packaged study file, to start one's own, and stop.")
    ] = False,
) -> None:
    """Run the machine with its motor: start-up, steady running, one-sided overloads.

    Writes result.json, result.nc, plots and the FMUs into the output folder.
    """
    from . import config as configuration

    if example:
        print(configuration.example(), end="")
        return
    loaded = configuration.load(config)
    if output.exists() and not output.is_dir():
        raise InputError(f"-o {output}: is a file; name a folder")

    from .report import files, plots, table
    from .studies.overload import run_study

    console, errors = Console(), Console(stderr=True)
    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        console=errors,
    )
    with bar:
        task = bar.add_task("exporting FMUs", total=1.0)

        def report(what: str, done: float, todo: float) -> None:
            bar.update(task, description=what, completed=done, total=todo)

        result = run_study(loaded, output, report, check=check)
    written = [*files.write(result, output), *plots.write(result, output)]
    table.show(result, console)
    console.print("Written: " + ", ".join(str(path) for path in written), soft_wrap=True)
    if result.failure:
        errors.print(
            f"The run stopped early: {result.failure}. What was computed before is in {output}.",
            soft_wrap=True,
        )
        raise typer.Exit(1)


@app.command()
def reproduce(
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder for results.")] = Path(
        "reproduction"
    ),
) -> None:
    """Compute every number that the papers print, right or wrong, with the reason; draw their figures.

    Writes reproduction.json, reproduction.md and the figures into the output folder.
    """
    if output.exists() and not output.is_dir():
        raise InputError(f"-o {output}: is a file; name a folder")

    from .report import reproduction
    from .studies.reproduction import reproduce as compute

    console = Console()
    with Console(stderr=True).status("computing"):
        rows = compute()
        written = reproduction.write(rows, output)
    reproduction.show(rows, console)
    console.print("Written: " + ", ".join(str(path) for path in written), soft_wrap=True)


@app.command()
def export(
    name: Annotated[str, typer.Argument(help="ChamberForces or DcMotor.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="FMU file; NAME.fmu by default.")
    ] = None,
    config: Annotated[
        Path | None,
        typer.Option("--config", help="Study file whose machine, feed or motor gives the start values."),
    ] = None,
) -> None:
    """Write a model as an FMU (FMI 2.0 co-simulation, by pythonfmu)."""
    from . import config as configuration
    from .fmu.export import export as write
    from .models import MODELS

    if name not in MODELS:
        raise InputError(f"{name}: no such model; there are {', '.join(MODELS)}")
    start = configuration.start_values(configuration.load(config), MODELS[name]) if config else {}
    file = output or Path(f"{name}.fmu")
    if file.is_dir():
        raise InputError(f"-o {file}: is a folder; name a file")
    write(MODELS[name], file, start)
    print(f"{file}: {name}, FMI 2.0 co-simulation, by pythonfmu (needs Python in the importing process)")


def main() -> None:
    """Run the command line: exit status 2 for bad input, in one line; 1 for a run that failed."""
    try:
        app()
    except InputError as error:
        print(f"chainunit: {error}", file=sys.stderr)
        sys.exit(2)
    except OSError as error:
        print(f"chainunit: {error.filename or ''}: {error.strerror or error}", file=sys.stderr)
        sys.exit(2)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)


if __name__ == "__main__":
    main()
