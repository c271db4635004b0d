"""Losses in pins: Coulomb friction that the reaction sets, smoothed near rest, and viscous damping."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ..planar import Vec2

# A pin that carries nothing has no direction: without a floor the slope of |R| is 0/0 there.
_NO_FORCE = 1e-60  # N2


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
        size = xp.sqrt(force.squared() + _NO_FORCE)
        lost = lost + k2 * (per_newton * size / xp.sqrt(k2 * w2 + smooth2) + damping)
    return lost * w
