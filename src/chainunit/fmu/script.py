"""The declarations in the script of a Python FMU; a script in `fmu/` has no others."""

from __future__ import annotations

from typing import ClassVar

from ..core.model import Model


class Script:
    """A model, and values for its FMU in place of the usual ones."""

    model: ClassVar[type[Model]]
    start: ClassVar[dict[str, float]] = {}
    """Start values of parameters and inputs, by name, in place of the declared ones."""
    experiment: ClassVar[dict[str, float]] = {}
    """``step``, ``stop`` [s] or ``tolerance`` of the default experiment, in place of the usual ones."""
    sizes: ClassVar[dict[str, float]] = {}
    """Sizes of inputs in the reference results, by name, in place of the usual ones."""
