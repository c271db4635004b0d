"""The table [flywheel] of a study file: declarations only."""

from __future__ import annotations

from ...core.quantities import Value, declaration, quantity


@declaration
class FlywheelTable:
    """A flywheel on the motor's shaft, and the fluctuation for which the least one is searched."""

    J: Value = quantity("kg.m2", "inertia of the flywheel, on the motor shaft", default=0.0, min=0.0, max=1e6)
    fluctuation: Value = quantity(
        "1",
        "permitted fluctuation of the speed, (largest - least)/mean",
        default=0.05,
        min=1e-4,
        max=1.0,
        kind="percent",
    )
