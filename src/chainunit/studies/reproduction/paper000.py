"""Paper 000: statics and dynamics of the chamber (Figs 17-31).

Symbols as in the paper: ``gamma, alpha1', alpha2'`` angles of the organ (here gam, al1, al2), ``eps`` the rocker's
angular acceleration *towards decreasing psi*, lengths in l1 and forces in G1, the wall's weight. Results are divided
by the organ's weight (2 - mu) G1. `Scheme` is the paper's dynamic calculation, with its signs as switches.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from ...engines import MATH
from ...machines.api import EMPTY, ChainUnit
from ...machines.chain_unit import half_width_range
from ..cycle import overload_factors
from .row import Row

RHO, LAM, MU, ZETA = 0.1, 2.0 / 3.0, 0.6, 0.5
L1 = 1.35  # m, inferred: see rows of item 16
G = 9.81  # m/s2
_BARE = {f"{body}.{x}": 0.0 for body in ("crank", "coupler", "rocker") for x in ("m", "I")}


@cache
def machine(rod_inertia: float = 0.0, zeta: float = ZETA, mu: float = MU) -> ChainUnit:
    """The papers' machine: organs alone, uniform mass per length, no losses; point masses unless asked."""
    wall = 10.0
    masses = {f"{side}.wall_mass": wall for side in ("left", "right")} | {
        f"{side}.web_mass": (1.0 - mu) * wall for side in ("left", "right")
    }
    return ChainUnit.from_ratios(
        RHO, LAM, mu, zeta, _BARE | masses | {"rod_inertia": rod_inertia, "pin.friction": 0.0, "g": G}, l1=L1
    )


def weight(unit: ChainUnit) -> float:
    """Weight of an organ, (2 - mu) G1 [N]."""
    return float((unit.p.left.wall_mass + unit.p.left.web_mass) * unit.p.g)


@dataclass(frozen=True)
class Components:
    """The papers' components at A2 and A1 of one organ, in parts of its weight."""

    X: Any
    Y_A2: Any
    Y_A1: Any
    R_n: Any
    R_t: Any


def of_side(side: Any, hand: float, unit: ChainUnit) -> Components:
    """The papers' components from a side of the model; `hand` is +1 on the left, -1 on the right."""
    w = weight(unit)
    return Components(
        hand * side.rocker_joint.fx / w,
        side.rocker_joint.fy / w,
        side.support.fy / w,
        side.normal_load / w,
        side.tangential_load / w,
    )


def statics(psi: Any) -> tuple[Components, Components]:
    """Weights at the middles of the rods, left and right (Figs 17-22)."""
    chamber = machine().chamber(psi)
    return of_side(chamber.left, 1.0, machine()), of_side(chamber.right, -1.0, machine())


@dataclass(frozen=True)
class Angles:
    """The paper's angles of the left organ at rocker angle psi, eqs. (6), (7) and what follows them; lengths in l1."""

    gam: Any
    al1: Any
    al2: Any


def angles(psi: Any, zeta: float = ZETA, mu: float = MU) -> Angles:
    """gamma by the two arccosines, which have no branch to miss."""
    z = 2.0 * math.sqrt(1.0 - mu) * zeta
    a = np.sqrt(z * z + mu * mu + 2.0 * z * mu * np.sin(psi))
    gam = np.arccos((a * a + (1.0 - mu) ** 2 - 1.0) / (2.0 * a * (1.0 - mu))) - np.arcsin(
        mu * np.cos(psi) / a
    )
    al1 = np.arcsin(z + mu * np.sin(psi) - (1.0 - mu) * np.cos(gam))
    return Angles(gam, al1, 0.5 * np.pi + psi - gam)


def hinge_loading(psi: Any) -> Components:
    """Both weights in the hinge B, the second way of loading: two-force rods, eq. (35)."""
    o = angles(psi)
    lean = o.al2 - psi
    s = np.sin(o.al1) * np.cos(lean) + np.cos(o.al1) * np.sin(lean)
    at_a1, at_a2 = np.sin(lean) / s, np.sin(o.al1) / s
    X, Y = at_a2 * np.sin(lean), at_a2 * np.cos(lean)
    return Components(
        X, Y, at_a1 * np.cos(o.al1), Y * np.cos(psi) - X * np.sin(psi), X * np.cos(psi) + Y * np.sin(psi)
    )


@dataclass(frozen=True)
class Scheme:
    """The paper's dynamic calculation (40)-(45).

    The right signs are +1; -1 is the printed one for `a_y` (the terms of a_y' in i, j and w1) and what "Phi_C1 = -m1 a_C1" put
    literally into (43) gives for `a_C1`; `eps` is -1 where the acceleration is taken towards growing psi. `length` is
    l1 in the unit that stands against g = 9.81.
    """

    a_y: float = 1.0
    a_C1: float = 1.0
    eps: float = 1.0
    length: float = L1

    def forces(self, phi: Any, w_crank: Any, hand: float = 1.0) -> tuple[Any, Any, Any]:
        """X, Y_A2 and R_t of the left (`hand` = 1) or right organ, in parts of its weight."""
        rocker = machine().forces(phi, w_crank).rocker
        psi, w, eps = hand * rocker.psi, hand * rocker.w, -self.eps * hand * rocker.a
        mu = MU
        o = angles(psi)
        gam, al1, al2 = o.gam, o.al1, o.al2
        # (40): velocities; accelerations are in l1 rad/s2
        lam, theta = al1 - psi, gam - al1
        v = w * mu
        w2 = v * np.sin(lam) / np.cos(theta) / (1.0 - mu)
        w1 = np.cos(gam - psi) * v / np.cos(theta)
        # (41), (42)
        a_n, a_t = w * w * mu, eps * mu
        a_BA2_n, a_BA1_n = w2 * w2 * (1.0 - mu), w1 * w1
        a_BA2_t = (a_n * np.cos(lam) + a_t * np.sin(lam) + a_BA2_n * np.sin(theta) - a_BA1_n) / np.cos(theta)
        a_BA1_t = (a_t * np.sin(al2) - a_n * np.cos(al2) - a_BA2_n + a_BA1_n * np.sin(theta)) / np.cos(theta)
        lam1 = lam + theta
        per_g = self.length / G
        a_y = per_g * (a_n * np.cos(lam1) + a_t * np.sin(lam1) - 0.5 * a_BA2_t)
        a_z = per_g * (a_n * np.sin(lam1) - a_t * np.cos(lam1) + 0.5 * a_BA2_n)
        a_C1 = per_g * 0.5 * a_BA1_t
        # (43)-(45)
        eta = al1 + al2 - psi
        B = np.sin(al1) + 0.5 * (1.0 - mu) * np.cos(gam)
        i1, j1 = (1.0 - mu) * np.sin(gam), (1.0 - mu) * np.cos(gam)
        i2, j2 = mu * np.cos(psi), np.sin(al1) + (1.0 - mu) * np.cos(gam)
        arm = np.cos(al1) - 0.5 * (1.0 - mu) * np.sin(gam)
        big = (
            (1.0 - mu) * B
            + 0.5 * np.sin(al1)
            - self.a_y * (1.0 - mu) * a_y * (np.sin(gam) * arm - np.cos(gam) * B)
            + (1.0 - mu) * np.sin(eta) * a_z
            - self.a_C1 * 0.5 * a_C1
        )
        small = 0.5 * (1.0 - mu) ** 2 * (np.cos(gam) + self.a_y * a_y)
        D = i1 * j2 + i2 * j1
        X = (big * j1 - small * j2) / D / (2.0 - mu)
        Y = (small * i2 + big * i1) / D / (2.0 - mu)
        return X, Y, X * np.cos(psi) + Y * np.sin(psi)


CORRECTED = Scheme()
PRINTED = Scheme(a_y=-1.0)
AUTHORS = Scheme(a_y=-1.0, a_C1=-1.0, length=135.0)
"""What the authors must have computed: the signs above, and 135 cm against 9.81 m/s2."""


def resultant(scheme: Scheme, phi: Any, w_crank: float) -> Any:
    """Load of both organs on the rocker (Fig 27), in parts of an organ's weight."""
    X, Y, _ = scheme.forces(phi, w_crank)
    Xr, Yr, _ = scheme.forces(phi, w_crank, -1.0)
    return np.hypot(X - Xr, Y + Yr)


def d2(zeta: Any, mu: float, *, grouped: bool) -> Any:
    """The zeta form of d2 = Y_A2/G1 at psi = 0: as printed, or with the factor in front of both brackets."""
    z = 2.0 * np.sqrt(1.0 - mu) * zeta
    o = angles(0.0, zeta, mu)
    S, C = np.sin(o.al2), np.cos(o.al2)
    first = 0.5 * (z - (1.0 - mu) * S)
    second = (1.0 - mu) * (z - 0.5 * (1.0 - mu) * S)
    third = 0.5 * mu * (1.0 - mu) ** 2 * S
    factor = (1.0 - mu) * C
    top = factor * (first + second) + third if grouped else factor * first + second + third
    return top / ((1.0 - mu) * (mu * S + z * C))


def b2(psi: Any) -> Any:
    """b2 = Y_A2/G1 of the right organ, as printed."""
    o = angles(-psi)
    z = 2.0 * math.sqrt(1.0 - MU) * ZETA
    brace = (1.0 - MU) * (0.5 * (1.0 - MU) * np.cos(o.gam) + np.sin(o.al1)) + 0.5 * np.sin(o.al1)
    top = -0.5 * (1.0 - MU) ** 2 * np.cos(o.gam) * MU * np.cos(psi) - brace * (1.0 - MU) * np.sin(o.gam)
    return top / ((1.0 - MU) * (z * np.sin(o.gam) + MU * np.cos(psi + o.gam)))


def mu_range() -> tuple[float, float]:
    """The mu, in steps of 0.001, at which all five numbers printed for Figs 17-22 come out after rounding."""
    wanted = {"R_n": (0.36, 0.28), "R_t": (0.03, 0.24)}
    fits = []
    for mu in np.arange(0.5, 0.7, 0.001):
        unit = machine(0.0, ZETA, float(mu))
        left = of_side(unit.chamber(np.radians([-12.0, 12.0])).left, 1.0, unit)
        ends = all(tuple(np.round(getattr(left, n), 2)) == pair for n, pair in wanted.items())
        if ends and round(float(left.X[1]), 2) == 0.17:
            fits.append(float(mu))
    return min(fits), max(fits)


def zeta_range(psi: float, mu: float = MU) -> tuple[float, float]:
    """The zeta at which both organs follow a swing of +-psi [rad], l2 = l1 - e."""
    low, high = half_width_range(MATH, mu, 1.0, 1.0 - mu, psi)
    return low / (2.0 * math.sqrt(1.0 - mu)), high / (2.0 * math.sqrt(1.0 - mu))


def branch_violation(zeta: float) -> float:
    """By how much the second equation of (1) fails with the arcsine of eq. (4), in l1."""
    z = 2.0 * math.sqrt(1.0 - MU) * zeta
    al1 = float(angles(0.0, zeta).al1)
    al2 = math.asin((z - math.sin(al1)) / (1.0 - MU))
    return abs(math.cos(al1) - (1.0 - MU) * math.cos(al2) - MU)


def rows() -> list[Row]:
    """Every number that paper 000 prints, and those it should have."""
    return [*_statics_rows(), *_formula_rows(), *_overload_rows(), *_dynamics_rows()]


def _statics_rows() -> list[Row]:
    at = np.radians([-12.0, 0.0, 12.0])
    left, _ = statics(at)
    hinge = hinge_loading(at)
    low, high = mu_range()
    found = "mu is never stated; only this range gives all of 0.36, 0.28, 0.03, 0.24, 0.17 after rounding"
    ends = "the range of psi is -12..+12 deg, not 0..12"
    table = [
        Row("000", "1", "Figs 17-31", "least mu that fits the figures", None, low, "1", 3, found),
        Row("000", "1", "Figs 17-31", "largest mu that fits the figures", None, high, "1", 3, found),
    ]
    for name, printed in (
        ("X", ("0.1", None, "0.17")),
        ("Y_A2", (None, None, None)),
        ("Y_A1", (None, None, None)),
        ("R_n", ("0.36", None, "0.28")),
        ("R_t", ("0.03", None, "0.24")),
    ):
        for angle, text, value in zip((-12, 0, 12), printed, getattr(left, name), strict=True):
            reason = ends if name.startswith("R") and text else "the corrected model gives the printed figure"
            if text is None:
                reason = "not printed at this angle"
            table.append(
                Row(
                    "000",
                    "13",
                    "Figs 17-22",
                    f"{name} left at psi = {angle} deg",
                    text,
                    float(value),
                    "1",
                    4,
                    reason,
                )
            )
    fine = np.radians(np.linspace(-12.0, 12.0, 241))
    whole, mirrored = statics(fine)
    two_sided = float(whole.R_t[-1] - mirrored.R_t[-1])
    flat = "it falls from 0.348 to 0.324 and rises to 0.326; the printed level is its value at the left end"
    table += [
        Row(
            "000",
            "13",
            "Fig 17",
            "X: growth over -12..12 deg",
            "1.7",
            float(left.X[2] / left.X[0]),
            "1",
            2,
            "as printed",
        ),
        Row("000", "13", "Fig 18", "Y_A2: mean level", "0.34", float(np.mean(whole.Y_A2)), "1", 3, flat),
        Row(
            "000",
            "13",
            "Fig 20",
            "Y_A1: mean level",
            "0.67",
            float(np.mean(whole.Y_A1)),
            "1",
            3,
            "as printed",
        ),
        Row(
            "000",
            "13",
            "text after Fig 22",
            "R_t of both sides at 12 deg",
            "0.21",
            two_sided,
            "1",
            3,
            "as printed",
        ),
    ]
    start = "printed as the value at 0 deg; it belongs to -12 deg"
    table += [
        Row(
            "000", "13", "text after Fig 22", "R_n left at psi = 0", "0.36", float(left.R_n[1]), "1", 3, start
        ),
        Row(
            "000", "13", "text after Fig 22", "R_t left at psi = 0", "0.03", float(left.R_t[1]), "1", 3, start
        ),
    ]
    sums = "Y_A1 + Y_A2 is the organ's weight both ways: only X grows, by a factor of exactly 2"
    for name, digits in (("X", 3), ("Y_A2", 3), ("Y_A1", 3)):
        a, b = float(getattr(left, name)[1]), float(getattr(hinge, name)[1])
        table += [
            Row(
                "000",
                "15",
                "second way of loading",
                f"{name} at psi = 0, weights at the middles",
                None,
                a,
                "1",
                digits,
                sums,
            ),
            Row(
                "000",
                "15",
                "second way of loading",
                f"{name} at psi = 0, weights in B",
                None,
                b,
                "1",
                digits,
                sums,
            ),
            Row(
                "000",
                "15",
                "second way of loading",
                f"{name}: growth",
                "substantially",
                100.0 * (b / a - 1.0),
                "%",
                0,
                sums,
            ),
        ]
    return table


def _formula_rows() -> list[Row]:
    limit = 0.5 * (math.sqrt(1.0 + MU) + math.sqrt(1.0 - MU))
    branch = "above the limit B lies above A2 and alpha2 = pi - arcsin; the gamma form (6) has no such branch"
    low, high = zeta_range(math.radians(12.0))
    ends = "both ends of l in [e, l1 + l2] are singular; over a swing of 12 deg the organs close only between these"
    table = [
        Row(
            "000",
            "2",
            "eq. (4)",
            "zeta above which the arcsine is the wrong branch",
            None,
            limit,
            "1",
            4,
            branch,
        ),
        Row(
            "000",
            "2",
            "eq. (4)",
            "failure of eq. (1) at zeta = 0.97",
            None,
            branch_violation(0.97),
            "l1",
            3,
            branch,
        ),
        Row(
            "000",
            "2",
            "eq. (4)",
            "failure of eq. (1) at zeta = 0.93",
            None,
            branch_violation(0.93),
            "l1",
            3,
            branch,
        ),
        Row(
            "000",
            "3",
            "text after eq. (5)",
            "least zeta at a swing of 12 deg",
            "0 (l = e)",
            low,
            "1",
            3,
            ends,
        ),
        Row(
            "000",
            "3",
            "text after eq. (5)",
            "largest zeta at a swing of 12 deg",
            "1 (l = l1 + l2)",
            high,
            "1",
            3,
            ends,
        ),
    ]
    unit = machine()
    exact = float(of_side(unit.chamber(0.0).left, 1.0, unit).Y_A2) * (2.0 - MU)
    zeta = np.linspace(0.06, 0.94, 89)
    wide = float(np.max(np.abs(d2(zeta, MU, grouped=False) / d2(zeta, MU, grouped=True) - 1.0)))
    grouping = "(1 - mu) cos alpha2 must multiply the sum of both brackets"
    table += [
        Row("000", "5", "zeta form of d2", "d2 at zeta 0.5", f"{d2(0.5, MU, grouped=False):.4f}", exact, "G1", 4, grouping),
        Row("000", "5", "zeta form of d2", "regrouped: error against the model", None,
            abs(float(d2(0.5, MU, grouped=True)) / exact - 1.0), "1", -1, grouping),
        Row("000", "5", "zeta form of d2", "as printed: largest error for zeta 0.06..0.94", None, 100.0 * wide, "%", 0, grouping),
    ]  # fmt: skip
    psi = math.radians(8.0)
    chamber = unit.chamber(psi)
    right = float(of_side(chamber.right, -1.0, unit).Y_A2) * (2.0 - MU)
    left = float(of_side(chamber.left, 1.0, unit).Y_A2) * (2.0 - MU)
    minus = "the minus of the denominator of (38) was lost: b2 has the wrong sign, and so has beta"
    printed_b2 = float(b2(psi))
    per_weight = 1.0 / (2.0 - MU)
    table += [
        Row("000", "6b", "b2", "b2 at psi = 8 deg", f"{printed_b2:.4f}", right, "G1", 4, minus),
        Row("000", "6b", "b2", "|b2 printed + b2|, in G1", None, abs(printed_b2 + right), "G1", -1, minus),
        Row("000", "6b", "b2", "Y' + Y^p = c2 + b2 at psi = 8 deg", f"{(left + printed_b2) * per_weight:.2f}",
            (left + right) * per_weight, "1", 2, minus + "; Fig 27 was plotted with the right one"),
    ]  # fmt: skip
    return table + _sign_rows()


def _sign_rows() -> list[Row]:
    """Items 7 and 9: what the sign slips do, in parts of the dynamic part of X over a turn."""
    unit = machine()
    phi = np.linspace(0.0, 2.0 * math.pi, 1441)
    out = unit.forces(phi, 10.0)
    truth = of_side(out.left, 1.0, unit).X
    dynamic = truth - of_side(unit.chamber(out.rocker.psi).left, 1.0, unit).X
    size = float(np.max(np.abs(dynamic)))

    def error(scheme: Scheme) -> float:
        return float(np.max(np.abs(scheme.forces(phi, 10.0)[0] - truth))) / size

    sign = "a_A2^t = eps e is positive towards decreasing psi, eps = -psi''; the paper does not say so"
    braces = "both contributions of a_y' change sign: -a_y' sin gamma [..], +a_y' cos gamma B, w1 with cos gamma + a_y'/g"
    (_, at_right), _ = unit.rocker_extremes()
    o = unit.forces(at_right, 10.0)
    still = of_side(unit.chamber(o.rocker.psi).left, 1.0, unit).X
    wrong, _, _ = Scheme(eps=-1.0).forces(at_right, 10.0)
    exact = of_side(o.left, 1.0, unit).X
    return [
        Row("000", "7", "(42)", "error of X with eps = +psi'', in its dynamic part, at the extreme", None,
            float(abs(wrong - exact) / abs(exact - still)), "1", 1, sign),
        Row("000", "7", "(42)", "error of X with eps = -psi'' over a turn", None, error(CORRECTED) * size, "1", -1, sign),
        Row("000", "9", "i, j", "error of X with the printed braces, in its dynamic part", None,
            error(PRINTED), "1", 2, braces),
        Row("000", "9", "i, j", "error of X with the corrected braces", None, error(CORRECTED) * size, "1", -1, braces),
    ]  # fmt: skip


def _overload_rows() -> list[Row]:
    table = []
    diverges = (
        "R_L/(R_L - R_R) grows without bound as psi goes to 0; 12 deg gives its least value, not its largest"
    )
    for degrees, digits in ((0.5, 1), (1, 1), (3, 1), (6, 2), (9, 2), (12, 3)):
        left, right = statics(math.radians(degrees))
        factor = float(left.R_t / (left.R_t - right.R_t))
        printed = "1.14" if degrees == 12 else None
        table.append(
            Row(
                "000",
                "14",
                "overload factor",
                f"f at psi = {degrees} deg",
                printed,
                factor,
                "1",
                digits,
                diverges,
            )
        )
    wanted = ((1e-6, "at rest", 2, 1), (5.0, "at 5 rad/s", 1, 1), (10.0, "at 10 rad/s", 2, 2),
              (20.0, "at 20 rad/s", 2, 2), (50.0, "at 50 rad/s", 2, 2))  # fmt: skip
    cycles = "ratio of cycle maxima, left alone to both; uniform rods, no drive masses: no single factor serves a motor"
    for speed, text, on_rocker, on_crank in wanted:
        f = overload_factors(machine(1.0), speed, EMPTY, EMPTY)
        table += [
            Row(
                "000",
                "14b",
                "overload factor",
                f"rocker torque, {text}",
                None,
                f.rocker_torque,
                "1",
                on_rocker,
                cycles,
            ),
            Row(
                "000",
                "14b",
                "overload factor",
                f"crank torque, {text}",
                None,
                f.crank_torque,
                "1",
                on_crank,
                cycles,
            ),
        ]
    for name in ("rocker_torque", "crank_torque"):
        table.append(
            Row("000", "14b", "overload factor", f"{name.replace('_', ' ')}: both sides heavier above", None,
                _crossing(name), "rad/s", 1, cycles)
        )  # fmt: skip
    return table


def _crossing(name: str) -> float:
    """Crank speed above which both sides together ask more than the left alone [rad/s]."""
    from scipy.optimize import brentq

    return float(
        brentq(
            lambda w: getattr(overload_factors(machine(1.0), w, EMPTY, EMPTY), name) - 1.0,
            5.0,
            10.0,
            xtol=1e-3,
        )
    )


def _dynamics_rows() -> list[Row]:
    (psi_right, at_right), (psi_left, at_left) = machine().rocker_extremes()
    slips = "l1 = 135 (cm) against g = 9.81 m/s2, and three of four inertia terms with the wrong sign"
    table = [
        Row("000", "18", "Fig 30", "psi at the left extreme", "8.19", math.degrees(psi_left), "deg", 2,
            "the left extreme is at negative psi; the sign was dropped, as that of its R_t"),
        Row("000", "18", "text before Fig 23", "psi at the right extreme", "9.06", math.degrees(psi_right), "deg", 2, "as printed"),
        Row("000", "18", "text before Fig 23", "phi_k at the left extreme", "269.6", math.degrees(at_left), "deg", 2, "as printed"),
        Row("000", "18", "text before Fig 23", "phi_k at the right extreme", "89.6", math.degrees(at_right), "deg", 2, "as printed"),
    ]  # fmt: skip
    for place, phi, figure, prints in (
        ("left", at_left, "30", ("12.5", "313.4")),
        ("right", at_right, "31", ("1.6", "35.4")),
    ):
        for speed, printed in zip((10.0, 50.0), prints, strict=True):
            values = {
                i: float(machine(i).forces(phi, speed).left.tangential_load) / weight(machine())
                for i in (0.0, 1.0)
            }
            rebuilt = float(AUTHORS.forces(phi, speed)[2])
            table += [
                Row("000", "16", f"Fig {figure}", f"R_t left organ, {place} extreme, {speed:g} rad/s", printed, values[0.0],
                    "1", 2, slips, rebuilt),
                Row("000", "16", f"Fig {figure}", f"the same with uniform rods, {place} extreme, {speed:g} rad/s", None,
                    values[1.0], "1", 2, "rotary inertia of the rods adds 12 % to the dynamic part"),
            ]  # fmt: skip
    turn = np.linspace(0.0, 2.0 * math.pi, 1441)
    slow = of_side(machine().forces(turn, 1.0).left, 1.0, machine())
    X, Y, _ = AUTHORS.forces(turn, 1.0)
    for name, mine, theirs, prints in (
        ("X", slow.X, X, ("-0.02", "0.2")),
        ("Y_A2", slow.Y_A2, Y, ("0.22", "0.34")),
    ):
        for what, pick, printed in zip(("least", "largest"), (np.min, np.max), prints, strict=True):
            table.append(
                Row("000", "17", "Figs 23, 24", f"{name} left at 1 rad/s, {what}", printed, float(pick(mine)), "1", 3, slips,
                    float(pick(theirs)), agrees=False)
            )  # fmt: skip
    near = np.abs(np.degrees(machine().forces(turn, 1.0).rocker.psi)) < 8.0
    both, rebuilt = resultant(CORRECTED, turn, 1.0)[near], resultant(AUTHORS, turn, 1.0)[near]
    for what, pick in (("least", np.min), ("largest", np.max)):
        table.append(
            Row("000", "17", "Fig 27", f"resultant for |psi| < 8 deg, {what}", "0.63", float(pick(both)), "1", 3, slips,
                float(pick(rebuilt)))
        )  # fmt: skip
    table.append(
        Row("000", "17", "Fig 27", "resultant for |psi| < 8 deg, mean of the rebuilt curve", "0.63", float(np.mean(rebuilt)),
            "1", 2, "the printed figure is the mean of what the authors' scheme gives")
    )  # fmt: skip
    ignored = "gravity may be ignored only near 50 rad/s; at 10 rad/s inertia is a few times gravity, and of opposite sign on the right"
    for place, phi_e in (("left", at_left), ("right", at_right)):
        unit = machine()
        still = float(unit.forces(phi_e, 0.0).left.tangential_load)
        inertia = float(unit.forces(phi_e, 1.0).left.tangential_load) - still
        table.append(
            Row("000", "19", "text after Fig 31", f"inertia part equals gravity part, {place} extreme", None,
                math.sqrt(abs(still / inertia)), "rad/s", 1, ignored)
        )  # fmt: skip
        for speed, digits in ((10.0, 1), (50.0, 0)):
            table.append(
                Row("000", "19", "text after Fig 31", f"inertia part to gravity part, {place} extreme, {speed:g} rad/s", None,
                    abs(inertia * speed**2 / still), "1", digits, ignored)
            )  # fmt: skip
    return table
