"""The registered capabilities and parts of the line, as the modules of a study find them: by their entry points, as
they stand above the study, in another package, or import from the study."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from importlib import import_module
from importlib.machinery import PathFinder
from importlib.util import find_spec
from types import ModuleType
from typing import Any

from ..core.register import Register, entries

CAPABILITIES = "chainunit.capabilities"
"""Group of the entry points of capabilities; each is a folder with the module `capability`, or with its contents, and
with the modules `command` and `study_method` if it has these. One with a command alone adds nothing to a study."""


def _in_order(things: Iterator[Any]) -> tuple[Any, ...]:
    return tuple(sorted(things, key=lambda thing: (thing.order, thing.name)))


@cache
def parts_of_line() -> tuple[Any, ...]:
    """All parts of the line from the motor to the machine, each a `chainunit.study.line.part.PartOfLine`."""
    return _in_order(iter(Register[Any]("chainunit.line").values()))


@cache
def organ_models() -> Mapping[str, Any]:
    """All models of the organs by name in their order, each a `chainunit.study.organs.OrganModel`."""
    return {model.name: model for model in _in_order(iter(Register[Any]("chainunit.organs").values()))}


@cache
def capabilities() -> tuple[Any, ...]:
    """All capabilities in their order, each a `chainunit.study.capability.StudyCapability`."""
    folders = Register[ModuleType](CAPABILITIES).values()
    return _in_order(capability for folder in folders for capability in _capability(folder))


def _capability(folder: ModuleType) -> Iterator[Any]:
    """The capability of a folder: in the folder itself, or in its module `capability`, if the folder has a command
    and must be light; none of a folder with a command alone."""
    if hasattr(folder, "CAPABILITY"):
        yield folder.CAPABILITY
    elif find_spec(f"{folder.__name__}.capability") or not find_spec(f"{folder.__name__}.command"):
        yield import_module(f"{folder.__name__}.capability").CAPABILITY


def modules(name: str) -> Iterator[ModuleType]:
    """The module of this name of each capability that has one: ``command``, whose ``COMMANDS`` typer takes, with the
    kinds of results that they leave (``KINDS``, by command); and ``study_method``, with a method of
    `chainunit.Study` (``METHOD``) and the class of its result (``RESULT``). Nothing else of a folder is imported, so
    that the command line answers at once."""
    for entry in entries(CAPABILITIES).values():
        module = f"{entry.value}.{name}"
        folder = find_spec(entry.value)
        # of the places of the folder: a search by its name would import it
        places = folder.submodule_search_locations if folder is not None else None
        if places is not None and PathFinder.find_spec(module, places) is not None:
            yield import_module(module)


@cache
def registered() -> tuple[Any, ...]:
    """The parts of the line, then the capabilities: all that has tables, rules, plans and analyses."""
    return (*parts_of_line(), *capabilities())
