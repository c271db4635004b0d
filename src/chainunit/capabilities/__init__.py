"""Capabilities: each folder answers one question, and its name in this list registers it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from importlib import import_module
from importlib.resources import files
from typing import Any

NAMES = (
    "sides",
    "blade",
    "random_overloads",
    "flywheels",
    "torsion",
    "optimize",
    "identification",
    "watch",
    "sweep",
)
"""The folders of the capabilities, in the order in which their tables, results and sections come."""


def commands() -> Iterator[Callable[..., Any]]:
    """The commands of the folders, as typer takes them: ``COMMAND`` of each module ``command``. Nothing else of a
    folder is imported, so that the command line answers at once."""
    for name in NAMES:
        if files(__name__).joinpath(name, "command.py").is_file():
            yield import_module(f"{__name__}.{name}.command").COMMAND
