"""What every electric motor shares: the surroundings, and where resistances are given."""

from __future__ import annotations

from ..quantities import Value, declaration, quantity

T_RATED = 293.15
"""Temperature at which resistances are given [K]."""


@declaration
class Ambient:
    """The surroundings."""

    T: Value = quantity(
        "K", "temperature, also the winding's at the start", default=T_RATED, min=200.0, max=500.0
    )
