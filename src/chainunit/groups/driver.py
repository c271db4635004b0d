"""The driver: a crank on a fixed bearing.

The crank angle is counted from the upward vertical, positive clockwise, and it is the
coordinate q itself: the counter-clockwise angle of the crank falls at the rate -1.
"""

from __future__ import annotations

from typing import Any

from ..planar import Link, Motion, Vec2


def crank(xp: Any, bearing: Vec2, angle: Any) -> Link:
    """The crank as a link from its bearing at `angle` [rad]."""
    return Link(Motion(bearing), Vec2(xp.sin(angle), xp.cos(angle)), -1.0, 0.0)


def driving_torque(link: Link, pin: Motion, applied: tuple[Vec2, Any], pin_force: Vec2) -> tuple[Any, Vec2]:
    """Torque along the crank angle [N m] and the force on the crank at its bearing [N].

    `applied` are the crank's own weight and inertia about the bearing, `pin_force` is the force
    on the crank at its pin: the last step of the force pass, independent of virtual work.
    """
    force, moment = applied
    return moment + (pin.p - link.pin.p).cross(pin_force), -(force + pin_force)
