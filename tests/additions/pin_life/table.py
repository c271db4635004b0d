"""The table [pin_life] of a study file: declarations only."""

from __future__ import annotations

from dataclasses import dataclass

from chainunit.core.quantities import Value, declaration, quantity


@declaration
class PinLifeTable:
    """A rolling bearing in place of a pin, and the life that is wanted of it."""

    C: Value = quantity("N", "dynamic load rating of the bearing", default=50e3, above=0.0, max=1e8)
    p: Value = quantity(
        "1", "exponent of the load: 3 for balls, 10/3 for rollers", default=3.0, min=1.0, max=10.0
    )
    wanted: Value = quantity(
        "s", "rating life that is wanted", default=7.2e7, min=0.0, max=1e11, kind="hours"
    )


@dataclass(frozen=True)
class LifePlan:
    """The `pin` by its title, and the values of the table."""

    pin: str
    table: PinLifeTable
