"""The block of a live machine: its reader changes numbers, and the page computes what follows. It is made where a
page shows it: a terminal and Markdown have none."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

LEAD = (
    "The equations of this machine run in this page. Move a slider, or type a number: the new results stand beside "
    "those of {}, whose value a small mark above each slider shows."
)
"""The text before a live machine, with a slot for the noun of the file."""


@dataclass(frozen=True)
class LiveMachine:
    """A live machine: the `data` of the page as JSON has it, and by name the bytes of its modules of WebAssembly."""

    data: Mapping[str, Any]
    modules: Mapping[str, bytes]


@dataclass(frozen=True)
class Live:
    """A live machine, which `make` makes.

    Raises
    ------
    InputError
        by `make`, where an equation has a function that WebAssembly has not.
    """

    make: Callable[[], LiveMachine]
    form: ClassVar[str] = "long"
