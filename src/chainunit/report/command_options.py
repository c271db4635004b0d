"""Options that several commands have."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer


class Backend(StrEnum):
    """How an FMU computes."""

    native = "native"
    python = "python"


BackendOption = Annotated[
    Backend | None,
    typer.Option("--backend", help="FMUs in native code or in Python; native where a C compiler is found."),
]
PicturesOption = Annotated[
    bool, typer.Option("--png", help="Also write the figures of the page as PNG files.")
]
AllOption = Annotated[
    bool, typer.Option("--all", help="Print all tables, warnings and notes, in place of one screen.")
]
OutputFolder = Annotated[Path, typer.Option("-o", "--output", help="Folder for results.")]
