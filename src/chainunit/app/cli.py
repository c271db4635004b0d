"""The command line."""

from __future__ import annotations

import contextlib
import json
import os
import re
import sys
from collections.abc import Sequence
from enum import StrEnum
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Annotated, Any

import typer
import typer.core
import typer.main

from ..core.errors import InputError, InterruptedRunError, RunError, printable
from ..core.files import full, written
from ..report.console import (
    AllOption,
    BackendOption,
    OutputFolder,
    PicturesOption,
    carry_out,
    exit_status,
    show_slips,
    study_file,
    terminal_console,
)
from ..work import interrupts
from .catalogue_command import catalogue
from .export_command import ExportCommand, export


class Example(StrEnum):
    """A packaged study file."""

    chain_unit = "chain-unit"
    knife = "knife"
    driveline = "driveline"
    full = "full"


_GROUPS = {
    "Study": {
        "study": ("Run a machine with its motor; size the drive.", "chainunit study mine.toml -o mine"),
        "sweep": ("Vary parameters of a study, over many points.", "chainunit sweep map.toml -o map"),
        "optimize": ("Search for the best machine within limits.", "chainunit optimize best.toml -o best"),
        "compare": ("Show two results side by side.", "chainunit compare mine other"),
        "handover": ("Write a sized drive for other programs.", "chainunit handover mine -o files"),
        "catalogue": ("Check catalogues of your own.", "chainunit catalogue motors.csv"),
        "keys": ("Explain the keys of study files.", "chainunit keys sizing"),
    },
    "Linkages": {
        "linkage": (
            "Show motion, torque and reactions of a linkage.",
            "chainunit linkage crusher.toml -o crusher",
        ),
        "live": ("Write a page in which the machine runs.", "chainunit live crusher.toml -o crusher.html"),
    },
    "FMUs": {
        "export": (
            "Write a model as an FMU, a study as FMU or SSP.",
            "chainunit export mine.toml -o mine.fmu",
        ),
        "linearize": ("Write the linear model at a point.", "chainunit linearize mine.toml -o linear"),
        "vouch": ("Certify an FMU or SSP, verify a certified one.", "chainunit vouch certify mine.fmu"),
    },
    "Real machines": {
        "identify": (
            "Identify a machine from recordings of its motor.",
            "chainunit identify mill.toml -o mill",
        ),
        "watch": (
            "Find one-sided overloads in a recording.",
            "chainunit watch mill/identified.toml -o watched",
        ),
    },
}
"""By heading of the help, the commands, each with a line and an example. The help shows the installed ones."""


class _Commands(typer.core.TyperGroup):
    """The group of all commands. Those of capabilities are imported if the base has none of the name that is asked
    for. It turns an interrupt into an error of this package, as typer would turn a KeyboardInterrupt into a bare exit
    status."""

    def list_commands(self, ctx: Any) -> list[str]:
        """The names of all commands, with those of capabilities."""
        self._take_all()
        return super().list_commands(ctx)

    def _take_all(self) -> None:
        self.commands = {**_commands_of_capabilities(), **self.commands}

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The command of that name; None if there is none."""
        if cmd_name not in self.commands:
            self._take_all()
        return super().get_command(ctx, cmd_name)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the installed commands into the help by group, each with a line and below it an example."""
        self._take_all()
        listed = [name for group in _GROUPS.values() for name in group]
        others = {
            name: (command.get_short_help_str(), f"chainunit {name} --help")
            for name, command in self.commands.items()
            if name not in listed and not command.hidden
        }
        for heading, group in (_GROUPS | ({"Others": others} if others else {})).items():
            rows = []
            for name, (purpose, example) in group.items():
                if name in self.commands:
                    rows += [(name, purpose), ("", example)]
            with formatter.section(heading):
                formatter.write_dl(rows)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """As typer does; a wrong name suggests no hidden command."""
        if args and args[0] not in self.commands:
            self._take_all()
        commands = self.commands
        if args and args[0] not in commands:
            self.commands = {name: command for name, command in commands.items() if not command.hidden}
        try:
            return super().resolve_command(ctx, args)
        finally:
            self.commands = commands

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            raise InterruptedRunError(_INTERRUPTED) from None


app = typer.Typer(
    cls=_Commands,
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="Forces in a chain unit, and in any other machine that a crank drives: FMUs, co-simulation with motors, "
    "drive torque, overloads.",
)


def _version(choice: bool) -> None:
    if choice:
        from .. import __version__

        print(f"chainunit {__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and stop.")
    ] = False,
    no_cache: Annotated[
        bool, typer.Option("--no-cache", help="Compile FMUs anew, and keep no compiled code.")
    ] = False,
) -> None:
    if no_cache:
        from ..core.native.cache import OFF, VARIABLE

        os.environ[VARIABLE] = OFF


@app.command()
def study(
    config: Annotated[
        Path | None, typer.Argument(help="Study file (TOML); without one, the packaged example.")
    ] = None,
    output: OutputFolder = Path("results"),
    check: Annotated[
        bool, typer.Option("--check", help="Also compare every run with the monolithic solution.")
    ] = False,
    backend: BackendOption = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            "--scheduler",
            help="Address of a Dask scheduler whose workers make the random overloads: tcp://10.0.0.5:8786.",
        ),
    ] = None,
    pdf: Annotated[
        bool,
        typer.Option(
            "--pdf", help="Also write sheet.pdf: the sheet to be signed, with the report as its annex."
        ),
    ] = False,
    example: Annotated[
        Example | None,
        typer.Option("--example", help="Print a packaged study file, as a start for your own, and stop."),
    ] = None,
    whole: AllOption = False,
    png: PicturesOption = False,
) -> None:
    """Run a machine with its motor: start-up, steady running, overloads.

    Writes report.html, result.json, result.md, result.nc and the FMUs into the output folder.
    """
    from ..study import parts

    if example:
        from ..study.commented import commented
        from ..study.schema import FILE

        text = parts.example(example.value)
        print(commented(text) if example is Example.full else f"#:schema {FILE}\n{text}", end="")
        return
    question = study_file(config)
    from ..report.study_task import SHEET_TASK, TASK

    task = SHEET_TASK if pdf else TASK
    carry_out(
        task,
        question,
        output,
        whole=whole,
        png=png,
        check=check,
        backend=backend and backend.value,
        scheduler=scheduler,
    )


@cache
def _commands_of_capabilities() -> dict[str, Any]:
    """The commands that capabilities bring, by name."""
    from ..study.registry import modules

    commands = typer.Typer(rich_markup_mode=None)
    for module in modules("command"):
        if (group := getattr(module, "GROUP", None)) is not None:
            below = typer.Typer(rich_markup_mode=None, no_args_is_help=True)
            commands.add_typer(below, name=group, help=module.__doc__)
            for command in module.COMMANDS:
                below.command()(command)
        for command in module.COMMANDS:
            commands.command(hidden=group is not None)(command)
    return dict(typer.main.get_group(commands).commands)


app.command(cls=ExportCommand)(export)
app.command()(catalogue)


@app.command()
def keys(
    table: Annotated[
        str | None, typer.Argument(help="Table of a study file, type of event, machine or motor; or a key.")
    ] = None,
    schema: Annotated[
        bool, typer.Option("--schema", help="Write chainunit.schema.json, by which an editor completes keys.")
    ] = False,
) -> None:
    """Show the keys of study files and catalogues: meaning, allowed values, default."""
    from ..report import reference, terminal

    if schema:
        from ..core.files import write_file
        from ..study.schema import FILE, json_schema

        write_file(Path(FILE), json.dumps(json_schema(), indent=1, ensure_ascii=False) + "\n")
        print(f"{FILE}: schema of study files")
        return
    terminal.show(reference.keys_of(table) if table else reference.overview(), terminal_console())


@app.command("linkage")
def linkage_command(
    source: Annotated[
        str,
        typer.Argument(help="Linkage file (TOML); or a drawing: of Linkage, Pyslvs, or an address of PMKS+."),
    ],
    output: OutputFolder = Path("linkage"),
    speed: Annotated[
        str | None,
        typer.Option("--speed", help='Speed of the driver with its unit; "60 rpm" by default, or "0.1 m/s".'),
    ] = None,
    to: Annotated[
        Path | None, typer.Option("--to", help="Of a drawing: write it as this linkage file, and stop.")
    ] = None,
    density: Annotated[
        str | None, typer.Option("--density", help='Of a drawing: mass of its links, such as "20 kg/m".')
    ] = None,
    scale: Annotated[
        str | None, typer.Option("--scale", help='Of a drawing: its unit of length, such as "mm".')
    ] = None,
    whole: AllOption = False,
    png: PicturesOption = False,
) -> None:
    """Show a linkage: its groups, drawing, motion, torque, inertia and reactions over a turn, or over its range.

    Writes report.html, linkage.json, linkage.md and pictures into the output folder.
    """
    from ..core.files import write_file
    from ..core.inputs import TOML, file_text
    from ..machines.linkages.file import linkage_in
    from ..machines.linkages.imports.source import imported
    from ..machines.machine import Machine
    from ..report.linkage_report import TASK, LinkageQuestion
    from ..study.linkage_turn import speed_of_driver
    from ..study.study_file import toml_text

    drawn = imported(source, density, scale)
    text = "".join(f"# {remark}\n" for remark in drawn.remarks) + toml_text(drawn.tables) if drawn else ""
    if to is not None:
        if drawn is None or to.suffix != ".toml" or Path(source).resolve() == to.resolve():
            raise InputError(
                f"--to {to}: writes a drawing of another program as a linkage file, such as machine.toml"
            )
        write_file(to, text)
        print(f"{to}: the linkage file; {', '.join(drawn.remarks)}")
        linkage_in(to)
        return
    model, unusual = drawn.machine() if drawn else linkage_in(Path(source))
    text = text or file_text(Path(source), TOML)
    show_slips(unusual)
    machine, remarks = Machine(model), drawn.remarks if drawn else ()
    name = drawn.name if drawn else source
    question = LinkageQuestion(machine, speed_of_driver(machine, speed), name, unusual, remarks, text)
    carry_out(TASK, question, output, whole=whole, png=png)


@app.command()
def live(
    file: Annotated[
        Path | None,
        typer.Argument(help="Study file or linkage file (TOML); without one, the packaged example."),
    ] = None,
    output: Annotated[Path, typer.Option("-o", "--output", help="The page.")] = Path("live.html"),
    speed: Annotated[
        str | None,
        typer.Option("--speed", help='Speed of the driver of a linkage; "60 rpm" by default, or "0.1 m/s".'),
    ] = None,
) -> None:
    """Write a page in which the machine runs: sliders for its numbers, and at once what follows from them.

    Makes no run: the page computes by itself, in any browser, without a network.
    """
    from ..core.files import scratch, write_file
    from ..report.html import render
    from ..report.live.page import live_page

    if file is not None and file.resolve() == output.resolve():
        raise InputError(f"-o {output}: is the file that is shown; name another file for the page")
    with scratch() as folder:
        page = render(live_page(file, speed, folder))
    write_file(output, page)
    print(f"{output}: the live page")


def main() -> None:
    """Run the command line. The exit status is 2 for bad input, with one line for each fault, 1 for a run
    that failed or a file that could not be written, 130 for Ctrl-C, 143 for SIGTERM, and 129 for SIGHUP."""
    written.clear()
    with interrupts.remembered():
        status, message = interrupts.status(), _INTERRUPTED
        try:
            status, message = _outcome()
        except KeyboardInterrupt:  # a second one, while the first was told
            pass
        except Exception:
            if interrupts.received() is None:
                raise
        interrupts.hold()
        if interrupts.received() is not None and status != interrupts.status():
            # a library has turned the interrupt into its own error, or has lost it
            status, message = interrupts.status(), _INTERRUPTED
        if message and status == interrupts.status():
            message = f"{message}; {_told(written)}"
        _tell(message)
    sys.exit(status)


_INTERRUPTED = "interrupted"


def _told(files: Sequence[Path]) -> str:
    """The files that were written before an interrupt, in words."""
    written = list(dict.fromkeys(printable(str(file), 500) for file in files if file.exists()))
    if not written:
        return "nothing was written"
    shown, more = written[:_MOST_FILES], len(written) - _MOST_FILES
    return f"written: {', '.join(shown)}{f' and {more} more' if more > 0 else ''}"


_MOST_FILES = 12
"""Largest number of files that are named after an interrupt."""


def _outcome() -> tuple[int, str]:
    """Run the command; returns the exit status and the last words, a line for each fault."""
    try:
        status = app(sys.argv[1:] or ["--help"], standalone_mode=False) or 0
        # typer makes a bare status of an interrupt that comes before the command begins
        return status, _INTERRUPTED if status == interrupts.status() else ""
    except SystemExit as end:
        return int(end.code or 0), ""
    except (InputError, RunError) as error:
        return exit_status(error), str(error)
    except (typer.Abort, KeyboardInterrupt):
        return interrupts.status(), _INTERRUPTED
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1, ""
    except OSError as error:
        where = error.filename or ("the output or the folder for temporary files" if full(error) else "")
        return 1 if full(error) else 2, f"{where}: {error.strerror or error}"
    except ModuleNotFoundError as error:
        if not (package := _declared(error.name or "")):
            raise
        return 2, f"this needs the package {package}, which is not installed: pip install {package}"
    except Exception as error:
        # wrong usage: an unknown command or option, a missing argument
        if not hasattr(error, "format_message"):
            raise
        if type(error).__name__ == "NoArgsIsHelpError":  # a group without a command, as chainunit itself
            print(error.ctx.get_help())  # type: ignore[attr-defined]
            return 0, ""
        return 2, _usage(error)


def _declared(module: str) -> str:
    """The package of a missing module, where it is one that this package requires; it may be installed without them,
    as to check a certified file. Empty for any other module, which is missing by a fault of ours."""
    package = module.partition(".")[0].lower()
    package = {"pil": "pillow"}.get(package, package)
    required = (re.match(r"[\w-]+", line) for line in metadata.requires("chainunit") or ())
    return package if any(match and match[0].lower() == package for match in required) else ""


def _usage(error: Any) -> str:
    """The message of a wrong usage, with the command whose help shows the right one."""
    context, command = getattr(error, "ctx", None), ""
    while context and context.parent:
        command = f" {context.info_name}{command}"
        context = context.parent
    command = f"chainunit{command}"
    missing = error.param if hasattr(error, "param_type") else None
    if missing is not None and missing.param_type_name == "argument":
        message = f"{missing.name.upper()} is missing: {missing.help}"
    else:
        message = error.format_message().replace("Value error, ", "")
    message = message.removesuffix(".")
    return f"{message} ({command} --help shows {'its options' if ' ' in command else 'the commands'})"


def _tell(message: str) -> None:
    with contextlib.suppress(OSError):
        for line in message.splitlines():
            print("chainunit: " + printable(" ".join(line.split()), 2000), file=sys.stderr)


if __name__ == "__main__":
    main()
