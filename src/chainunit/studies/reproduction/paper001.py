"""Paper 001: existence of the crank, pressure angle (Fig 7), speed-change coefficient (Fig 9).

Lengths in l. Two frames: *tracking*, where b^2 = 1 - rho^2 + lam^2 follows rho (crank and rocker parallel at the start), and
*frozen*, where b stays at its value for rho0 = 0.3 while r alone changes: that is what Figs 7 and 9 show.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...engines import MATH, numpy_
from ...machines.crank_rocker import (
    longest_crank,
    parallel_frame,
    pressure_angle,
    pressure_angle_extremes,
    speed_change,
)
from .row import Row

LAM, RHO0 = 2.0 / 3.0, 0.3
FROZEN = parallel_frame(MATH, RHO0, 1.0, LAM)


def frame(rho: Any, *, tracking: bool, lam: Any = LAM) -> Any:
    """|O1 C|/l."""
    return parallel_frame(numpy_(), rho, 1.0, lam) if tracking else FROZEN


def pressure(rho: float, phi_k: Any, *, tracking: bool) -> Any:
    """The pressure angle [rad] at the crank angle `phi_k` counted as in the paper (phi = phi_k - phi_0 before eq. (11))."""
    b = frame(rho, tracking=tracking)
    start = 0.5 * math.pi - math.atan2(LAM, math.sqrt(b * b - LAM * LAM))
    a2 = rho * rho + b * b - 2.0 * rho * b * np.cos(phi_k - start)
    return pressure_angle(numpy_(), 1.0, LAM, a2)


def worst(rho: float, *, tracking: bool) -> float:
    """The largest pressure angle in size [deg]."""
    b = float(frame(rho, tracking=tracking))
    return math.degrees(max(map(abs, pressure_angle_extremes(MATH, rho, 1.0, LAM, b))))


def rho_at(limit: float, *, tracking: bool) -> float:
    """The rho at which the pressure angle reaches `limit` [deg] in size."""
    from scipy.optimize import brentq

    return float(
        brentq(lambda rho: worst(rho, tracking=tracking) - limit, 0.05, 0.5028 if not tracking else 0.66)
    )


def K(rho: Any, *, tracking: bool = False, lam: Any = LAM) -> Any:
    """The speed-change coefficient."""
    return speed_change(numpy_(), rho, 1.0, lam, frame(rho, tracking=tracking, lam=lam))


def rows() -> list[Row]:
    """Every number that paper 001 prints, and those it should have."""
    deg = math.degrees
    third = "a third condition is missing for lam > 1: rho <= b/l - lam + 1"
    bound = "with b^2 = l^2 - r^2 + h^2 it is simply rho <= lam; in the frozen frame rho = 0.5 is 0.6 % from the limit"
    signed = "theta is signed: |theta| < theta_adm; at rho = 0.5 the maximum is on the negative branch"
    fixed = "the frame is frozen at rho0 = 0.3, which the paper does not say; only it gives 13.5 and the range of K"
    grid = "the peak lies between the points of a 10 deg grid, whose largest value is the printed one"
    follows = "(11) lets b follow rho; Fig 7 does not"
    wide = "the upper admissible limit of 60 deg admits more than rho = 0.1..0.3"
    even = "b^2 - h^2 = (l + r)(l - r): both extreme B lie on one line through O1, so K = 1 for every rho and lam"
    minimum = "K has a minimum near rho = 0.18: it does not rise from 0.99 throughout"
    near, far = pressure_angle_extremes(MATH, 0.5, 1.0, LAM, FROZEN)
    low = math.degrees(float(pressure_angle_extremes(MATH, 0.1, 1.0, LAM, FROZEN)[0]))
    b = FROZEN
    start = 0.5 * math.pi - math.atan2(LAM, math.sqrt(b * b - LAM * LAM))
    coarse = np.radians(np.arange(0.0, 360.0, 10.0))
    on_grid = {rho: deg(float(np.max(np.abs(pressure(rho, coarse, tracking=False))))) for rho in (0.1, 0.5)}
    two = 0.25 <= 2.0 - (1.2 - 1.0) and 0.25 <= 2.0 + (1.2 - 1.0)
    case = np.linspace(0.05, 0.6, 23)
    theta_max = max(
        float(np.max(np.abs((k - 1.0) / (k + 1.0) * math.pi)))
        for k in (K(case * lam, tracking=True, lam=lam) for lam in (0.4, 2.0 / 3.0, 1.0, 1.5))
    )
    rho = np.linspace(0.1, 0.5, 4001)
    k = K(rho)
    lowest = int(np.argmin(k))
    return [
        Row("001", "2", "(5), (6)", "largest rho at lam = 2, b/l = 1.2, by (5) and (6)", None,
            min(2.0 - 0.2, 2.0 + 0.2), "1", 1, third + ("; rho = 0.25 meets both" if two else "")),
        Row("001", "2", "(5), (6)", "largest rho at lam = 2, b/l = 1.2, by all three", None,
            float(longest_crank(MATH, 1.0, 2.0, 1.2)), "1", 1, third + "; rho = 0.25 cannot turn"),
        Row("001", "3", "existence", "largest rho, frame of rho0 = 0.3", None,
            float(longest_crank(MATH, 1.0, LAM, FROZEN)), "1", 4, bound),
        Row("001", "4", "(10), (11)", "least theta at rho = 0.5", None, deg(far), "deg", 2, signed),
        Row("001", "4", "(10), (11)", "largest theta at rho = 0.5", None, deg(near), "deg", 1, signed),
        Row("001", "5", "Fig 7", "rho0 at which the frame is frozen", None, _rho0(), "1", 1, fixed),
        Row("001", "6", "Fig 7", "max |theta| at rho = 0.1", "13.5", low, "deg", 2, grid, on_grid[0.1]),
        Row("001", "6", "Fig 7", "max |theta| at rho = 0.5", "81.7", -deg(far), "deg", 2, grid, on_grid[0.5]),
        Row("001", "6", "Fig 7", "ratio of the two", "6", -deg(far) / low, "1", 2, "printed as more than 6 times"),
        Row("001", "6", "Fig 7", "phi_k of the peak at rho = 0.1", None, deg(start), "deg", 2, grid),
        Row("001", "6", "Fig 7", "phi_k of the peak at rho = 0.5", None, deg(start) + 180.0, "deg", 2, grid),
        Row("001", "7", "(11)", "max |theta| by (11) at rho = 0.1", "13.5", worst(0.1, tracking=True), "deg", 2, follows),
        Row("001", "7", "(11)", "max |theta| by (11) at rho = 0.5", "81.7", worst(0.5, tracking=True), "deg", 2, follows),
        Row("001", "8", "text after Fig 7", "rho at |theta| = 45 deg, frozen frame", "0.3", rho_at(45.0, tracking=False), "1", 3, wide),
        Row("001", "8", "text after Fig 7", "rho at |theta| = 60 deg, frozen frame", "0.3", rho_at(60.0, tracking=False), "1", 3, wide),
        Row("001", "8", "text after Fig 7", "rho at |theta| = 45 deg, tracking frame", None, rho_at(45.0, tracking=True), "1", 3, wide),
        Row("001", "8", "text after Fig 7", "rho at |theta| = 60 deg, tracking frame", None, rho_at(60.0, tracking=True), "1", 3, wide),
        Row("001", "8", "text after Fig 7", "max |theta| at rho = 0.4, frozen frame", None, worst(0.4, tracking=False), "deg", 1, wide),
        Row("001", "8", "text after Fig 7", "max |theta| at rho = 0.4, tracking frame", None, worst(0.4, tracking=True), "deg", 1, wide),
        Row("001", "8", "text after Fig 7", "max |theta| at rho = 0.5, tracking frame", None, worst(0.5, tracking=True), "deg", 2, wide),
        Row("001", "9", "(16)-(19)", "largest |theta between couplers|, tracking frame, 92 cases", None, theta_max, "rad", -1, even),
        Row("001", "10", "Fig 9", "K at rho = 0.1", "0.99", float(K(0.1)), "1", 4, minimum),
        Row("001", "10", "Fig 9", "least K", None, float(k[lowest]), "1", 4, minimum),
        Row("001", "10", "Fig 9", "rho of the least K", None, float(rho[lowest]), "1", 2, minimum),
        Row("001", "10", "Fig 9", "K at rho = 0.3", None, float(K(0.3)), "1", 4, minimum),
        Row("001", "10", "Fig 9", "K at rho = 0.5", "1.26", float(K(0.5)), "1", 4, minimum),
    ]  # fmt: skip


def _rho0() -> float:
    """The rho0, in steps of 0.1, whose frozen frame gives the printed 13.5 on a 10 deg grid and K from 0.99 to 1.26."""
    coarse = np.radians(np.arange(0.0, 360.0, 10.0))
    fits = []
    for rho0 in (0.1, 0.2, 0.3, 0.4, 0.5):
        b = parallel_frame(MATH, rho0, 1.0, LAM)
        start = 0.5 * math.pi - math.atan2(LAM, math.sqrt(b * b - LAM * LAM))
        a2 = 0.01 + b * b - 0.2 * b * np.cos(coarse - start)
        peak = math.degrees(float(np.max(np.abs(pressure_angle(numpy_(), 1.0, LAM, a2)))))
        ks = [
            float(speed_change(MATH, r, 1.0, LAM, b))
            for r in (0.1, 0.5)
            if r < longest_crank(MATH, 1.0, LAM, b)
        ]
        if len(ks) == 2 and f"{peak:.1f}" == "13.5" and [f"{x:.2f}" for x in ks] == ["0.99", "1.26"]:
            fits.append(rho0)
    (only,) = fits
    return only
