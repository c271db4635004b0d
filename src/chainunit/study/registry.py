"""The registered capabilities and parts of the line, as the modules of a study find them: by their names, as they
stand above the study, or import from it."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from importlib import import_module
from typing import Any

_PACKAGE = __package__.rpartition(".")[0]


def _all_of(home: str, attribute: str) -> tuple[Any, ...]:
    return tuple(_registered(f"{home}.{name}", attribute) for name in import_module(home).NAMES)


def _registered(module: str, attribute: str) -> Any:
    """The part or capability of a module, or of `capability` in that folder, where the folder itself is imported by
    the command line and must be light."""
    home = import_module(module)
    return getattr(home if hasattr(home, attribute) else import_module(f"{module}.capability"), attribute)


@cache
def parts_of_line() -> tuple[Any, ...]:
    """All parts of the line from the motor to the machine, each a `chainunit.study.line.part.PartOfLine`."""
    return _all_of(f"{__package__}.line", "PART")


@cache
def capabilities() -> tuple[Any, ...]:
    """All capabilities in their order, each a `chainunit.study.capability.StudyCapability`."""
    return _all_of(f"{_PACKAGE}.capabilities", "CAPABILITY")


def command_modules() -> Iterator[Any]:
    """The modules of the commands of the capabilities, without the rest of their folders: a command answers at
    once."""
    modules: Iterator[Any] = import_module(f"{_PACKAGE}.capabilities").modules("command")
    return modules


@cache
def registered() -> tuple[Any, ...]:
    """The parts of the line, then the capabilities: all that has tables, rules, plans and analyses."""
    return (*parts_of_line(), *capabilities())
