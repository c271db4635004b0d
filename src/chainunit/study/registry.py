"""The registered capabilities, as the modules of a study find them: by their names, as they stand above the study."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from typing import Any

_HOME = f"{__package__.rpartition('.')[0]}.capabilities"


@cache
def registered() -> tuple[Any, ...]:
    """All capabilities in their order, each a `chainunit.study.capability.StudyCapability`."""
    names = import_module(_HOME).NAMES
    return tuple(_capability(f"{_HOME}.{name}") for name in names)


def _capability(folder: str) -> Any:
    """The capability of a folder: of its module `capability`, where the folder itself is imported by the command line
    and must be light."""
    package = import_module(folder)
    home = package if hasattr(package, "CAPABILITY") else import_module(f"{folder}.capability")
    return home.CAPABILITY
