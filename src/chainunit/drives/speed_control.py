"""Tuning of a cascaded speed control, checked with python-control.

Current loop: PI whose zero cancels the armature pole R/L, so that its open loop is w_c/s. Speed loop: PI on
the integrator k/(J s) behind the closed current loop; crossover a tenth of w_c, zero at a fifth of that.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..errors import InputError


@dataclass(frozen=True)
class Tuning:
    """Gains and what they give; `parameters` names the gains as the motor's parameters."""

    parameters: dict[str, float]
    phase_margin: float
    """[deg]"""
    crossover: float
    """of the speed loop [rad/s]"""
    current_crossover: float
    """[rad/s]"""


def tune(armature: Any, inertia: float, bandwidth: float = 300.0, crossover_share: float = 0.1) -> Tuning:
    """Gains for a motor with this `armature` (R, L, k) on a total `inertia` at its shaft [kg m2].

    `bandwidth` is the crossover of the current loop [rad/s], `crossover_share` that of the speed loop in
    relation to it. The phase margin is that of the whole speed
    loop, the current loop included.

    Raises
    ------
    InputError
        where the loop would have less than 45 degrees of phase margin.
    """
    import control

    s = control.tf("s")
    R, L, k = armature.R, armature.L, armature.k
    current_kp, current_ki = L * bandwidth, R * bandwidth
    # the feed-forward of the back-EMF leaves the armature circuit alone as plant
    current_open = control.minreal((current_kp + current_ki / s) / (L * s + R), verbose=False)
    current = control.feedback(current_open, 1)
    crossover = bandwidth * crossover_share
    kp = inertia * crossover / k
    ki = kp * crossover / 5.0
    opened = (kp + ki / s) * current * k / (inertia * s)
    _, phase, _, at = control.margin(opened)
    if not phase > 45.0:
        raise InputError(f"speed loop: phase margin {phase:.0f} deg, must be > 45 deg; lower crossover_share")
    gains = {
        "speed_control.kp": kp,
        "speed_control.ki": ki,
        "current_control.kp": current_kp,
        "current_control.ki": current_ki,
    }
    return Tuning(gains, float(phase), float(at), bandwidth)
