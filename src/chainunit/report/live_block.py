"""The block of a live machine: its reader changes numbers, and the page computes what follows. It is made where a
page shows it: a terminal and Markdown have none."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

_LEAD = (
    "The equations of this machine run in this page. Move a slider, or type a number: the new results stand beside "
    "those of {}, whose value a small mark above each slider shows."
)


@dataclass(frozen=True)
class LiveMachine:
    """A live machine: the `data` of the page as JSON has it, and its `equations` as an expression of JavaScript
    (`chainunit.core.printing.javascript.program`)."""

    data: Mapping[str, Any]
    equations: str


@dataclass(frozen=True)
class Live:
    """A live machine, which `make` makes; `beside` is the noun of the thing whose values the reader changes.

    Raises
    ------
    InputError
        by `make`, for an equation with a function that has not the same bits in each browser.
    """

    make: Callable[[], LiveMachine]
    beside: str
    form: ClassVar[str] = "long"

    @property
    def lead(self) -> str:
        """The text before the machine."""
        return _LEAD.format(self.beside)
