"""Capabilities: each folder answers one question, and its name in this list registers it."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from importlib.resources import files
from typing import Any

NAMES = (
    "chains",
    "sizing",
    "static_inertia",
    "energy",
    "sides",
    "blade",
    "random_overloads",
    "flywheels",
    "torsion",
    "checks",
    "optimize",
    "identification",
    "watch",
    "sweep",
    "comparison",
    "linear",
    "handover",
    "vouching",
)
"""The folders of the capabilities, in the order in which their tables, results and sections come."""


def modules(name: str) -> Iterator[Any]:
    """The module of this name of each folder that has one: ``command``, whose ``COMMANDS`` typer takes, with the
    kinds of results that they leave (``KINDS``, by command); and ``study_method``, with a method of
    `chainunit.Study` (``METHOD``) and the class of its result (``RESULT``). Nothing else of a folder is imported, so
    that the command line answers at once."""
    for folder in NAMES:
        if files(__name__).joinpath(folder, f"{name}.py").is_file():
            yield import_module(f"{__name__}.{folder}.{name}")
