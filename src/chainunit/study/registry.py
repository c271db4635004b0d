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
    return tuple(import_module(f"{_HOME}.{name}").CAPABILITY for name in names)
