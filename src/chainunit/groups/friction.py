"""Losses in pins: Coulomb friction that the reaction sets, smoothed near rest, and viscous damping."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ..planar import Vec2


def pin_losses(xp: Any, pin: Any, damping: Any, w: Any, pins: Iterable[tuple[Vec2, Any]]) -> Any:
    """Torque at the coordinate that overcomes the losses of all `pins` [N m].

    A pin with the relative speed Dw and the reaction R dissipates friction * diameter/2 * |R| * Dw^2/sqrt(Dw^2 +
    w_smooth^2) + damping * Dw^2; the torque is that power over w, written so that w = 0 is regular.

    Parameters
    ----------
    pin : with `friction`, `diameter` [m], `w_smooth` [rad/s]
    damping : viscous damping of each pin [N m s/rad]
    w : speed of the coordinate [rad/s]
    pins : reaction [N] and relative rotation per rotation of the coordinate, of each
    """
    per_newton = 0.5 * pin.friction * pin.diameter
    smooth2 = pin.w_smooth * pin.w_smooth
    w2 = w * w
    lost = 0.0
    for force, turn in pins:
        k2 = turn * turn
        lost = lost + k2 * (per_newton * force.length(xp) / xp.sqrt(k2 * w2 + smooth2) + damping)
    return lost * w
