"""The command that checks catalogues of the user, and writes templates for them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..core.errors import InputError
from ..report.console import terminal_console


def catalogue(
    files: Annotated[
        list[Path] | None,
        typer.Argument(help="Catalogues (CSV or TOML) to be checked; without one, the columns are shown."),
    ] = None,
    template: Annotated[
        bool,
        typer.Option(
            "--template", help="Write a file for motors, one for gears and one for torque limiters."
        ),
    ] = False,
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder for the templates.")] = Path(
        "catalogue"
    ),
) -> None:
    """Check catalogues of your own line by line: motors, gears, torque limiters; or write templates for them.

    Each fault is a line with file, line, column, value and allowed range. A study file names the files by
    catalogue = [...]."""
    from ..report import reference, terminal

    if template and files:
        raise InputError("--template writes new files and checks none; leave the names of files out")
    if template:
        _write_templates(output)
    else:
        report = reference.checked_catalogues(files) if files else reference.catalogue_tables()
        terminal.show(report, terminal_console())


def _write_templates(folder: Path) -> None:
    """A CSV file of each kind, with all columns and a made-up row.

    Raises
    ------
    InputError
        where one of the files is there already.
    """
    from ..core.files import write_file
    from ..drives.catalogue import KINDS

    names = {folder / f"{kind.plural.replace(' ', '_')}.csv": kind for kind in KINDS}
    if present := [str(file) for file in names if file.exists()]:
        raise InputError(f"{', '.join(present)}: is there already; name another folder by -o")
    folder.mkdir(parents=True, exist_ok=True)
    for file, kind in names.items():
        write_file(file, kind.template())
        needed = ", ".join(kind.required)
        print(f"{file}: {kind.plural}; each row needs {needed}, all else may be left out")
    print("The rows are made up: put your own in their place. chainunit catalogue FILE checks them.")
