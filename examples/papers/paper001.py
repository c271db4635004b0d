"""Paper 001: existence of the crank, pressure angle (Fig 7), speed-change coefficient (Fig 9).

Lengths in l. Two frames: *tracking*, where b^2 = 1 - rho^2 + lam^2 follows rho (crank and rocker parallel at the
start), and *frozen*, where b stays at its value for rho0 = 0.3 while r alone changes: the frame of Figs 7 and 9.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from chainunit.core.engines import MATH, numpy_
from chainunit.machines.api import ChainUnitMachine
from chainunit.machines.crank_rocker import (
    longest_crank,
    parallel_frame,
    pressure_angle,
    pressure_angle_extremes,
    speed_change,
)

LAM, RHO0 = 2.0 / 3.0, 0.3
FROZEN = parallel_frame(MATH, RHO0, 1.0, LAM)
COARSE = np.radians(np.arange(0.0, 360.0, 10.0))


def frame(rho: Any, kind: str = "frozen", lam: Any = LAM) -> Any:
    """|O1 C|/l in a frame, "frozen" or "tracking"."""
    return {"frozen": FROZEN, "tracking": parallel_frame(numpy_(), rho, 1.0, lam)}[kind]


def start_angle(b: float) -> float:
    """phi_0 of the paper, before eq. (11) [rad]."""
    return 0.5 * math.pi - math.atan2(LAM, math.sqrt(b * b - LAM * LAM))


def pressure(rho: float, phi_k: Any, b: float) -> Any:
    """The pressure angle [rad] at the crank angle `phi_k` counted as in the paper (phi = phi_k - phi_0)."""
    a2 = rho * rho + b * b - 2.0 * rho * b * np.cos(phi_k - start_angle(b))
    return pressure_angle(numpy_(), 1.0, LAM, a2)


def two_conditions(lam: float, b: float) -> float:
    """Item 2: the largest rho by (5) and (6)."""
    return min(lam - (b - 1.0), lam + (b - 1.0))


def largest_rho(lam: float = LAM, b: float = FROZEN) -> float:
    """Items 2 and 3: the largest rho by all three conditions."""
    return float(longest_crank(MATH, 1.0, lam, b))


def signed_extreme(rho: float, end: str) -> float:
    """Item 4: largest or least pressure angle in the frozen frame [deg]."""
    largest, least = pressure_angle_extremes(MATH, rho, 1.0, LAM, FROZEN)
    return math.degrees({"largest": largest, "least": least}[end])


def error_of_parts() -> float:
    """Item 4: largest error of R^n and R^t by (7)-(9) with the signed theta, over a turn at 10 rad/s of the packaged
    machine with a coupler without mass and pins without friction, in parts of the peak of R."""
    unit = ChainUnitMachine.from_ratios(
        0.1, LAM, 0.6, 0.5, {"coupler.m": 0.0, "coupler.I": 0.0, "pin.friction": 0.0}, l1=1.35
    )
    p, out = unit.p, unit.forces(np.linspace(0.0, 2.0 * math.pi, 721), 10.0)
    rocker, arm = out.rocker, p.rocker.m * p.rocker.s
    inertia = (p.rocker.I + arm * p.rocker.s) * rocker.a
    R = (rocker.tau + inertia + p.g * arm * np.sin(rocker.psi)) / (p.h * np.cos(out.pressure_angle))
    parts = R * np.sin(out.pressure_angle), R * np.cos(out.pressure_angle)
    model = rocker.coupler_normal, rocker.coupler_tangential
    return float(np.max(np.abs(np.subtract(parts, model))) / np.max(np.abs(R)))


def fitting_rho0() -> float:
    """Item 5: the rho0, in steps of 0.1, whose frozen frame gives the printed 13.5 on a 10 deg grid and K from 0.99
    to 1.26."""
    fits = []
    for rho0 in (0.1, 0.2, 0.3, 0.4, 0.5):
        b = parallel_frame(MATH, rho0, 1.0, LAM)
        peak = math.degrees(float(np.max(np.abs(pressure(0.1, COARSE, b)))))
        ks = [float(speed_change(MATH, rho, 1.0, LAM, b)) for rho in (0.1, 0.5) if rho < largest_rho(LAM, b)]
        if len(ks) == 2 and f"{peak:.1f}" == "13.5" and [f"{x:.2f}" for x in ks] == ["0.99", "1.26"]:
            fits.append(rho0)
    (only,) = fits
    return only


def worst(rho: float, kind: str = "frozen") -> float:
    """Items 6 to 8: the largest pressure angle in size [deg]."""
    b = float(frame(rho, kind))
    return math.degrees(max(map(abs, pressure_angle_extremes(MATH, rho, 1.0, LAM, b))))


def worst_on_grid(rho: float) -> float:
    """Item 6: the same in the frozen frame on a grid of 10 deg [deg]."""
    return math.degrees(float(np.max(np.abs(pressure(rho, COARSE, FROZEN)))))


def worst_ratio() -> float:
    """Item 6: the angle at rho = 0.5 over that at rho = 0.1."""
    return worst(0.5) / worst(0.1)


def peak_angle(rho: float) -> float:
    """Item 6: phi_k of the largest pressure angle in size [deg]: crank and ground in line, stretched or folded."""
    near, far = (abs(signed_extreme(rho, end)) for end in ("largest", "least"))
    return math.degrees(start_angle(FROZEN)) + (180.0 if far > near else 0.0)


def rho_at(limit: float, kind: str) -> float:
    """Item 8: the rho at which the pressure angle reaches `limit` [deg] in size."""
    from scipy.optimize import brentq

    highest = {"frozen": 0.5028, "tracking": 0.66}[kind]
    return float(brentq(lambda rho: worst(rho, kind) - limit, 0.05, highest))


def largest_theta() -> float:
    """Item 9: the largest angle between the couplers at the extremes, tracking frame, 23 rho by 4 lam [rad]."""
    case = np.linspace(0.05, 0.6, 23)
    ks = np.array([K(case * lam, "tracking", lam) for lam in (0.4, LAM, 1.0, 1.5)])
    return float(np.max(np.abs((ks - 1.0) / (ks + 1.0) * math.pi)))


def K(rho: Any, kind: str = "frozen", lam: Any = LAM) -> Any:
    """Item 10: the speed-change coefficient."""
    return speed_change(numpy_(), rho, 1.0, lam, frame(rho, kind, lam))


def least_K() -> float:
    """Item 10: the least K over rho = 0.1..0.5."""
    return float(np.min(K(_FINE)))


def rho_of_least_K() -> float:
    """Item 10: the rho at which K is least."""
    return float(_FINE[np.argmin(K(_FINE))])


_FINE = np.linspace(0.1, 0.5, 4001)
