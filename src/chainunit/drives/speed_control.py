"""Tuning of a cascaded speed control.

The zero of the PI control of the current cancels the armature pole R/L, so that the open loop is w_c/s. The PI
control of the speed acts on the integrator k/(J s) behind the closed current loop; its crossover is a tenth of w_c,
its zero lies at a fifth of the crossover.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..core.errors import InputError
from ..reading.results import part, result


@result
class Tuning:
    """Gains and their margins; `parameters` names the gains as the motor's parameters."""

    parameters: dict[str, float]
    phase_margin: float = part("phase margin of the speed loop", unit="deg")
    crossover: float = part("crossover of the speed loop", unit="rad/s")
    current_crossover: float | None = part(
        "crossover of an inner current loop", unit="rad/s", optional=True, default=None
    )


def tune(armature: Any, inertia: float, bandwidth: float = 300.0, crossover_share: float = 0.1) -> Tuning:
    """Gains for a motor with this `armature` (R, L, k) on a total `inertia` at its shaft [kg m2].

    `bandwidth` is the crossover of the current loop [rad/s], `crossover_share` the ratio of the crossover of the
    speed loop to it. The phase margin belongs to the whole speed loop, including the current loop.

    Raises
    ------
    InputError
        where the loop would have less than 45 degrees of phase margin.
    """
    crossover = bandwidth * crossover_share
    kp = inertia * crossover / armature.k
    speed, current = (kp, kp * crossover / 5.0), (armature.L * bandwidth, armature.R * bandwidth)
    phase, crossover_w = _tuned_margin(crossover_share)
    if not phase > 45.0:
        raise InputError(f"speed loop: phase margin {phase:.0f} deg, must be > 45 deg; lower crossover_share")
    names = ("speed_control.kp", "speed_control.ki", "current_control.kp", "current_control.ki")
    return Tuning(
        dict(zip(names, (*speed, *current), strict=True)), phase, crossover_w * bandwidth, bandwidth
    )


def _tuned_margin(share: float) -> tuple[float, float]:
    """Phase margin [deg] and crossover, over that w_c of the current loop, of a speed loop with these gains.

    As the zero of the current control cancels the pole of the armature, the open loop is

        c (s + c/5)/s^2 w_c/(s + w_c)        c = share w_c

    whatever the motor.
    """
    return _margin([share, share**2 / 5.0], [1.0, 1.0, 0.0, 0.0])


def _margin(rise: Any, plant: Any) -> tuple[float, float]:
    """Phase margin [deg] and crossover of the open loop that is the quotient of these polynomials in s, the highest
    power first. A test has the same of python-control, whose import takes a second."""
    # |rise|^2 = |plant|^2 in X = -w^2, as a polynomial times its mirror is even
    squares = [
        np.polymul(polynomial, polynomial * (-1.0) ** np.arange(len(polynomial))[::-1])
        for polynomial in map(np.array, (rise, plant))
    ]
    roots = np.roots(np.polysub(*squares)[::2])
    crossings = [math.sqrt(-x.real) for x in roots if x.real < 0.0 and abs(x.imag) < 1e-9 * abs(x)]
    margins = ((-np.polyval(rise, 1j * w) / np.polyval(plant, 1j * w), w) for w in crossings)
    return min(
        ((float(np.degrees(np.angle(turned))), w) for turned, w in margins), key=lambda margin: abs(margin[0])
    )


@result
class Loop:
    """The linearised speed loop of a motor with one inertia at its shaft."""

    inertia: float = part("inertia at the motor's shaft", unit="kg.m2")
    phase_margin: float = part("phase margin", unit="deg")
    crossover: float = part("crossover", unit="rad/s")
    largest_deviation: float = part(
        "largest deviation of the motor speed after a step of the load torque",
        unit="rad/(N.m.s)",
        name="deviation",
    )
    settling: float = part("time until the deviation stays below a twentieth of the largest one", unit="s")
    frequency: Any
    """[rad/s], shape (n,)"""
    gain: Any
    """gain of the open loop, shape (n,)"""
    phase: Any
    """phase of the open loop [deg], shape (n,)"""
    time: Any
    """[s], shape (m,)"""
    deviation: Any
    """deviation of the motor speed after a step of the load torque [(rad/s)/(N m)], shape (m,)"""


def loop(motor: Any, inertia: float) -> Loop:
    """The speed loop of a DC motor with the parameters `motor`, without limits and friction, at a total `inertia`
    [kg m2]. With the current loop C/D the loop, cut at the measured speed, and the response to the load are

        G = k (kp s + ki) C/(J s^2 D),    w/T_load = -s D/(J s^2 D + k (kp s + ki) C)
    """
    armature, current, speed = motor.armature, motor.current_control, motor.speed_control
    current_control = np.array([current.kp, current.ki])  # C
    current_loop = np.polyadd(np.array([armature.L, armature.R, 0.0]), current_control)  # D
    rise = armature.k * np.polymul([speed.kp, speed.ki], current_control)
    plant = inertia * np.polymul([1.0, 0.0, 0.0], current_loop)
    phase_margin, crossover = _margin(rise, plant)
    time = np.linspace(0.0, 40.0 / crossover, 2001)
    deviation = _after_step(current_loop, np.polyadd(plant, rise), time)
    largest = float(np.max(np.abs(deviation)))
    outside = np.flatnonzero(np.abs(deviation) > 0.05 * largest)
    frequency = np.logspace(-2.0, 1.5, 200) * crossover
    gain = np.polyval(rise, 1j * frequency) / np.polyval(plant, 1j * frequency)
    return Loop(
        inertia=inertia,
        phase_margin=phase_margin,
        crossover=crossover,
        largest_deviation=largest,
        settling=float(time[outside[-1]]),
        frequency=frequency,
        gain=np.abs(gain),
        phase=np.degrees(np.unwrap(np.angle(gain))),
        time=time,
        deviation=deviation,
    )


def _after_step(current_loop: Any, poles: Any, time: Any) -> Any:
    """The deviation of the speed after a step of the load torque [(rad/s)/(N m)], at the even times `time` [s], shape
    (m,): the response of -s D/poles to a step, with D the `current_loop`, both as polynomials in s of the degrees 2
    and 4, the highest power first."""
    from scipy.linalg import expm

    companion = np.vstack([-poles[1:] / poles[0], np.eye(3, 4)])
    step = expm(companion * time[1])
    # a step has the transform 1/s, so that this is the response of -D/poles to an impulse
    state = np.array([1.0, 0.0, 0.0, 0.0])
    deviation = np.zeros(time.size)
    for k in range(time.size):
        deviation[k] = -(current_loop @ state[1:]) / poles[0]
        state = step @ state
    return deviation
