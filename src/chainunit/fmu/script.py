"""What the script of a Python FMU declares; a script in `fmu/` states no more than these."""

from __future__ import annotations

from typing import ClassVar

from ..model import Model


class Script:
    """A model, and what an FMU has of it where the usual does not suit."""

    model: ClassVar[type[Model]]
    start: ClassVar[dict[str, float]] = {}
    """Start values of parameters and inputs, by name, that replace the declared ones."""
    experiment: ClassVar[dict[str, float]] = {}
    """``step``, ``stop`` [s] or ``tolerance`` of the default experiment, where the usual do not suit the model."""
    sizes: ClassVar[dict[str, float]] = {}
    """Sizes of inputs in the reference results, by name, where the usual ones do not suit the model."""
