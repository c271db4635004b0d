"""The parameter of the internal integrators."""

from __future__ import annotations

from .quantities import Value, declaration, quantity


@declaration
class Solver:
    """Limits of the internal integrator, a parameter of each model with states."""

    max_steps: Value = quantity(
        "1",
        "most steps of its own that a communication step may take; the step is discarded where it takes more",
        default=500_000,
        min=1,
        max=1_000_000_000,
        type="Integer",
    )
