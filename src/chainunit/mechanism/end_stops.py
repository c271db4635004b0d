"""The end stops of a driver that slides by itself. Standard library only: FMUs carry this file."""

from __future__ import annotations

from typing import Any

from ..quantities import Value, declaration, quantity
from .curves import positive, step

CONTACT = 1e-4
"""Part of the range over which the force of a stop begins."""
GIVES = 0.01
"""Part of the range by which a stop gives way to the energy of the largest holding force over the whole range."""


@declaration
class EndStops:
    """End stops: springs with dampers behind both ends of the range."""

    stiffness: Value = quantity("N/m", "stiffness of each", default=1e8, above=0.0, tunable=True)
    damping: Value = quantity("N.s/m", "damping of each", default=0.0, min=0.0, tunable=True)


def usual_stops(force: float, mass: float, length: float) -> EndStops:
    """Stops for a driver with the largest holding force [N], the largest reflected mass [kg] and the range [m].

    The energy force * length compresses them by `GIVES` of the range; their damping is half of the critical one.
    """
    stiffness = 2.0 * force / (GIVES * GIVES * length)
    return EndStops(stiffness=stiffness, damping=(stiffness * mass) ** 0.5)


def stop_force(xp: Any, law: EndStops, span: tuple[float, float], q: Any, w: Any) -> Any:
    """The force against the driver at the way `q` and the speed `w` [N]: 0 within the `span`, above 0 behind its
    upper end, below 0 before its lower one; it never pulls."""
    low, high = span
    width = CONTACT * (high - low)

    def one(depth: Any, speed: Any) -> Any:
        depth = depth - 0.5 * width
        push = law.stiffness * positive(xp, depth, width) + law.damping * speed * step(xp, depth, width)
        soft = law.stiffness * width
        return positive(xp, push - 0.5 * soft, soft)

    return one(q - high, w) - one(low - q, -w)
