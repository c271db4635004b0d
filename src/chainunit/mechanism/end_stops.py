"""The end stops of a driver that moves by itself within a range."""

from __future__ import annotations

from typing import Any, NamedTuple

from ..core.quantities import Value, declaration, quantity
from .curves import ROUNDED, positive, positive_integral, step

CONTACT = 1e-4
"""Part of the range over which the force of a stop begins."""
GIVES = 0.01
"""Part of the range by which a stop gives way to the energy of the largest holding force over the whole range."""


@declaration
class EndStops:
    """End stops: springs with dampers behind both ends of the range."""

    stiffness: Value = quantity("N/m", "stiffness of each", default=1e8, above=0.0, tunable=True)
    damping: Value = quantity("N.s/m", "damping of each", default=0.0, min=0.0, tunable=True)


@declaration
class SwingStops(EndStops):
    """End stops of a driver that swings."""

    stiffness: Value = quantity(
        "N.m/rad", "torsional stiffness of each", default=1e8, above=0.0, max=1e15, tunable=True
    )
    damping: Value = quantity(
        "N.m.s/rad", "torsional damping of each", default=0.0, min=0.0, max=1e15, tunable=True
    )


def usual_stops(force: float, mass: float, length: float, kind: type[EndStops] = EndStops) -> EndStops:
    """Stops for a driver with the largest holding force [N], the largest reflected mass [kg] and the range [m]; of
    one that swings, the torque [N m], the inertia [kg m2] and the range [rad].

    The energy force * length compresses them by `GIVES` of the range; their damping is half of the critical one.
    """
    stiffness = 2.0 * force / (GIVES * GIVES * length)
    return kind(stiffness=stiffness, damping=(stiffness * mass) ** 0.5)


class StopAction(NamedTuple):
    """The action of the end stops: the `force` (of a driver that swings the torque) against the driver [N, N m], 0
    within the range, above 0 behind its upper end and below 0 before its lower one; the `energy` in their springs
    [J]; and the part of the force that their dampers take, `lost` [N, N m]."""

    force: Any
    energy: Any
    lost: Any


def stop_action(xp: Any, law: EndStops, span: tuple[float, float], q: Any, w: Any) -> StopAction:
    """The action of the stops at both ends of the `span` [m, rad] at place `q` [m, rad] and speed `w` [m/s, rad/s] of
    the driver.

    A stop never pulls on the driver: as the driver leaves it, its damper takes away at most the force of its spring.
    So the spring alone is conservative, and `lost` times `w` is never negative.
    """
    low, high = span
    width = CONTACT * (high - low)

    def action_of_stop(depth: Any, speed: Any) -> StopAction:
        """Force, energy and loss of one stop, `depth` [rad, m] beyond its end of the range."""
        # the force begins smoothly, over the width beyond the end of the range
        depth = depth - 0.5 * width
        spring = law.stiffness * positive(xp, depth, width)
        damper = law.damping * speed * step(xp, depth, width)
        # force of spring and damper over that of the spring
        share = positive(xp, 1.0 + damper / (spring + law.stiffness * width), ROUNDED)
        energy = law.stiffness * positive_integral(xp, depth, width)
        return StopAction(force=spring * share, energy=energy, lost=spring * (share - 1.0))

    upper, lower = action_of_stop(q - high, w), action_of_stop(low - q, -w)
    return StopAction(upper.force - lower.force, upper.energy + lower.energy, upper.lost - lower.lost)
