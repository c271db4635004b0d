"""Paper 000: statics and dynamics of the chamber (Figs 17-31).

Symbols as in the paper: ``gamma, alpha1', alpha2'`` angles of the organ (here gam, al1, al2), ``eps`` the rocker's
angular acceleration *towards decreasing psi*, lengths in l1 and forces in G1, the wall's weight. Results are divided
by the organ's weight (2 - mu) G1. `Scheme` is the paper's dynamic calculation, with its signs as switches.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from chainunit.capabilities.sides.factors import overload_factors
from chainunit.core.engines import MATH
from chainunit.machines.api import EMPTY, ChainUnitMachine
from chainunit.machines.chain_unit import Feed
from chainunit.machines.crank_rocker import half_width_range

from .table import PICK

RHO, LAM, MU, ZETA = 0.1, 2.0 / 3.0, 0.6, 0.5
L1 = 1.35  # m, inferred: see rows of item 16
G = 9.81  # m/s2
ORGAN = 2.0 - MU  # weight of an organ in G1
TURN = np.linspace(0.0, 2.0 * math.pi, 1441)
_BARE = {f"{body}.{x}": 0.0 for body in ("crank", "coupler", "rocker") for x in ("m", "I")}


@cache
def machine(rod_inertia: float = 0.0, zeta: float = ZETA, mu: float = MU) -> ChainUnitMachine:
    """The papers' machine: organs alone, uniform mass per length, no losses; point masses unless asked."""
    organ = {"wall_mass": 10.0, "web_mass": (1.0 - mu) * 10.0}
    masses = {f"{side}.{rod}": mass for side in ("left", "right") for rod, mass in organ.items()}
    others = {"rod_inertia": rod_inertia, "pin.friction": 0.0, "g": G}
    return ChainUnitMachine.from_ratios(RHO, LAM, mu, zeta, _BARE | masses | others, l1=L1)


def weight(unit: ChainUnitMachine) -> float:
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


def of_side(side: Any, hand: float, unit: ChainUnitMachine) -> Components:
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


class Angles(NamedTuple):
    """The paper's angles of the left organ at rocker angle psi, eqs. (6), (7) and those after them; in l1."""

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


class Kinematics(NamedTuple):
    """Speeds of wall and web [rad/s], and the accelerations of (41) and (42), in l1 rad/s2."""

    w1: Any
    w2: Any
    a_n: Any
    a_t: Any
    a_BA2_n: Any
    a_BA1_t: Any
    a_BA2_t: Any


def kinematics(psi: Any, w: Any, eps: Any) -> Kinematics:
    """The left organ at rocker angle, speed and acceleration by the paper; `eps` is towards decreasing psi."""
    mu, (gam, al1, al2) = MU, angles(psi)
    # (40)
    lam, theta = al1 - psi, gam - al1
    v = w * mu
    w2 = v * np.sin(lam) / np.cos(theta) / (1.0 - mu)
    w1 = np.cos(gam - psi) * v / np.cos(theta)
    # (41), (42)
    a_n, a_t = w * w * mu, eps * mu
    a_BA2_n, a_BA1_n = w2 * w2 * (1.0 - mu), w1 * w1
    a_BA2_t = (a_n * np.cos(lam) + a_t * np.sin(lam) + a_BA2_n * np.sin(theta) - a_BA1_n) / np.cos(theta)
    a_BA1_t = (a_t * np.sin(al2) - a_n * np.cos(al2) - a_BA2_n + a_BA1_n * np.sin(theta)) / np.cos(theta)
    return Kinematics(w1, w2, a_n, a_t, a_BA2_n, a_BA1_t, a_BA2_t)


def hinge_loading(psi: Any) -> Components:
    """Both weights in the hinge B, the second way of loading: two-force rods, eq. (35)."""
    _, al1, al2 = angles(psi)
    lean = al2 - psi
    s = np.sin(al1) * np.cos(lean) + np.cos(al1) * np.sin(lean)
    at_a1, at_a2 = np.sin(lean) / s, np.sin(al1) / s
    X, Y = at_a2 * np.sin(lean), at_a2 * np.cos(lean)
    return Components(X, Y, at_a1 * np.cos(al1), *on_rocker(X, Y, psi))


def on_rocker(X: Any, Y: Any, psi: Any) -> tuple[Any, Any]:
    """R^n and R^t of a load X, Y on the rocker at psi."""
    return Y * np.cos(psi) - X * np.sin(psi), X * np.cos(psi) + Y * np.sin(psi)


@dataclass(frozen=True)
class Scheme:
    """The paper's dynamic calculation (40)-(45).

    The right signs are +1. The sign -1 is the printed one for `a_y` (the terms of a_y' in i, j and w1); for `a_C1` it
    follows from "Phi_C1 = -m1 a_C1" put literally into (43); for `eps` it takes the acceleration towards growing psi.
    `length` is l1 in the unit that stands against g = 9.81.
    """

    a_y: float = 1.0
    a_C1: float = 1.0
    eps: float = 1.0
    length: float = L1

    def forces(self, phi: Any, w_crank: Any, hand: float = 1.0) -> tuple[Any, Any, Any]:
        """X, Y_A2 and R_t of the left (`hand` = 1) or right organ, in parts of its weight."""
        rocker = machine().forces(phi, w_crank).rocker
        psi, w, eps = hand * rocker.psi, hand * rocker.w, -self.eps * hand * rocker.a
        mu, (gam, al1, al2) = MU, angles(psi)
        _, _, a_n, a_t, a_BA2_n, a_BA1_t, a_BA2_t = kinematics(psi, w, eps)
        lam1 = gam - psi
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
        return X, Y, on_rocker(X, Y, psi)[1]


CORRECTED = Scheme()
PRINTED = Scheme(a_y=-1.0)
AUTHORS = Scheme(a_y=-1.0, a_C1=-1.0, length=135.0)
"""The calculation that the authors must have made: the signs above, and 135 cm against 9.81 m/s2."""
SCHEMES = {"corrected": CORRECTED, "printed": PRINTED, "authors": AUTHORS}


def resultant(scheme: Scheme, phi: Any, w_crank: float) -> Any:
    """Load of both organs on the rocker (Fig 27), in parts of an organ's weight."""
    X, Y, _ = scheme.forces(phi, w_crank)
    Xr, Yr, _ = scheme.forces(phi, w_crank, -1.0)
    return np.hypot(X - Xr, Y + Yr)


def d2(zeta: Any, mu: float, *, grouped: bool) -> Any:
    """The zeta form of d2 = Y_A2/G1 at psi = 0: as printed, or with the factor in front of both brackets."""
    z = 2.0 * np.sqrt(1.0 - mu) * zeta
    al2 = angles(0.0, zeta, mu).al2
    S, C = np.sin(al2), np.cos(al2)
    first = 0.5 * (z - (1.0 - mu) * S)
    second = (1.0 - mu) * (z - 0.5 * (1.0 - mu) * S)
    third = 0.5 * mu * (1.0 - mu) ** 2 * S
    factor = (1.0 - mu) * C
    top = factor * (first + second) + third if grouped else factor * first + second + third
    return top / ((1.0 - mu) * (mu * S + z * C))


def b2(by: str, degrees: float) -> float:
    """Item 6b: b2 = Y_A2/G1 of the right organ, of the "model" or as "printed"."""
    psi = math.radians(degrees)
    if by == "model":
        return float(statics(psi)[1].Y_A2) * ORGAN
    gam, al1, _ = angles(-psi)
    z = 2.0 * math.sqrt(1.0 - MU) * ZETA
    brace = (1.0 - MU) * (0.5 * (1.0 - MU) * np.cos(gam) + np.sin(al1)) + 0.5 * np.sin(al1)
    top = -0.5 * (1.0 - MU) ** 2 * np.cos(gam) * MU * np.cos(psi) - brace * (1.0 - MU) * np.sin(gam)
    return float(top / ((1.0 - MU) * (z * np.sin(gam) + MU * np.cos(psi + gam))))


def zeta_range(psi: float, mu: float = MU) -> tuple[float, float]:
    """The zeta at which both organs follow a swing of +-psi [rad], l2 = l1 - e."""
    low, high = (z / (2.0 * math.sqrt(1.0 - mu)) for z in half_width_range(MATH, mu, 1.0, 1.0 - mu, psi))
    return low, high


# The functions of the table, item by item; loads act on the left organ, in parts of its weight.


def fitting_mu(end: str) -> float:
    """Item 1: the mu, in steps of 0.001, at which all five numbers printed for Figs 17-22 come out after rounding."""

    def loads(mu: float) -> Any:
        unit = machine(0.0, ZETA, mu)
        left = of_side(unit.chamber(np.radians([-12.0, 12.0])).left, 1.0, unit)
        return np.round([*left.R_n, *left.R_t, left.X[1]], 2).tolist()

    mus = np.arange(0.5, 0.7, 0.001).tolist()
    return float(PICK[end]([mu for mu in mus if loads(mu) == [0.36, 0.28, 0.03, 0.24, 0.17]]))


def arcsine_limit() -> float:
    """Item 2: the zeta above which B lies above A2."""
    return 0.5 * (math.sqrt(1.0 + MU) + math.sqrt(1.0 - MU))


def branch_violation(zeta: float) -> float:
    """Item 2: the error of the second equation of (1) with the arcsine of eq. (4), in l1."""
    z = 2.0 * math.sqrt(1.0 - MU) * zeta
    al1 = float(angles(0.0, zeta).al1)
    al2 = math.asin((z - math.sin(al1)) / (1.0 - MU))
    return abs(math.cos(al1) - (1.0 - MU) * math.cos(al2) - MU)


def closing_zeta(degrees: float, end: str) -> float:
    """Item 3: an end of the range of zeta in which the organs close over that swing."""
    return float(PICK[end](zeta_range(math.radians(degrees))))


def model_d2() -> float:
    """Item 5: d2 = Y_A2/G1 of the model at psi = 0."""
    return static_load("Y_A2", 0.0) * ORGAN


def printed_d2(zeta: float) -> float:
    """Item 5: d2 by the zeta form as printed."""
    return float(d2(zeta, MU, grouped=False))


def regrouped_d2_error() -> float:
    """Item 5: relative error of the regrouped zeta form against the model."""
    return abs(float(d2(ZETA, MU, grouped=True)) / model_d2() - 1.0)


def printed_d2_error() -> float:
    """Item 5: largest error of the zeta form as printed [%]."""
    zeta = np.linspace(0.06, 0.94, 89)
    return 100.0 * float(np.max(np.abs(d2(zeta, MU, grouped=False) / d2(zeta, MU, grouped=True) - 1.0)))


def b2_sum(degrees: float) -> float:
    """Item 6b: size of the sum of both b2: 0 where they differ by their sign alone."""
    return abs(b2("printed", degrees) + b2("model", degrees))


def upward_load(by: str, degrees: float) -> float:
    """Item 6b: Y' + Y^p of both organs, with b2 of the "model" or as "printed"."""
    return static_load("Y_A2", degrees) + b2(by, degrees) / ORGAN


def loads(by: str, phi: Any, crank_speed: Any) -> Any:
    """X, Y_A2 and R_t by name: by the "model", by the model with "uniform rods", or by a scheme."""
    if by in SCHEMES:
        return dict(zip(("X", "Y_A2", "R_t"), SCHEMES[by].forces(phi, crank_speed), strict=True))
    out = machine(1.0 if by == "uniform rods" else 0.0).forces(phi, crank_speed)
    return vars(of_side(out.left, 1.0, machine()))


def motion_error(name: str) -> float:
    """Item 7: largest error of a formula of the motion of the left organ over a turn at 10 rad/s, in parts of the
    peak of the model. omega_2 counts towards decreasing angle of the web, as a_A2^t and a_BA1^t do."""
    out = machine().forces(TURN, 10.0)
    psi, left, of_paper = out.rocker.psi, out.left, kinematics(out.rocker.psi, out.rocker.w, -out.rocker.a)
    _, al1, al2 = angles(psi)
    model, formula = {
        "alpha1'": (left.wall.angle, al1),
        "alpha2'": (psi - left.web.angle, al2),
        "eta": (left.spread_angle, al1 + al2 - psi),
        "omega_1": (left.wall.w, of_paper.w1),
        "omega_2": (-left.web.w, of_paper.w2),
        "epsilon_1": (-left.wall.a, of_paper.a_BA1_t),
        "epsilon_2": (left.web.a, of_paper.a_BA2_t / (1.0 - MU)),
    }[name]
    return float(np.max(np.abs(formula - model)) / np.max(np.abs(model)))


def _dynamic_x(phi: Any) -> Any:
    """The dynamic part of X at 10 rad/s."""
    still, _ = statics(machine().forces(phi, 10.0).rocker.psi)
    return loads("model", phi, 10.0)["X"] - still.X


def error_at_extreme() -> float:
    """Item 7: error of X with eps = +psi'' at the right extreme and 10 rad/s, over its dynamic part."""
    phi = at_extreme("right")
    wrong, _, _ = Scheme(eps=-1.0).forces(phi, 10.0)
    return float(abs((wrong - loads("model", phi, 10.0)["X"]) / _dynamic_x(phi)))


def error_over_turn(by: str) -> float:
    """Items 7 and 9: largest error of X by a scheme at 10 rad/s."""
    return float(np.max(np.abs(loads(by, TURN, 10.0)["X"] - loads("model", TURN, 10.0)["X"])))


def error_share(by: str) -> float:
    """Item 9: the same over the largest dynamic part of X."""
    return error_over_turn(by) / float(np.max(np.abs(_dynamic_x(TURN))))


def static_load(name: str, degrees: float) -> float:
    """Item 13: a load at rest at a rocker angle."""
    return float(getattr(statics(math.radians(degrees))[0], name))


def spread_angle(degrees: float) -> float:
    """Item 13: the spread angle of the left organ at a rocker angle [deg]."""
    return math.degrees(machine().chamber(math.radians(degrees)).left.spread_angle)


def growth_of_x() -> float:
    """Item 13: X at 12 deg over X at -12 deg."""
    return static_load("X", 12.0) / static_load("X", -12.0)


def growth_at_a1() -> float:
    """Item 13: X_A1, on the support, at 12 deg over X_A1 at -12 deg."""
    low, high = machine().chamber(np.radians([-12.0, 12.0])).left.support.fx
    return float(high / low)


def mean_load(name: str) -> float:
    """Item 13: the mean of a load over -12..12 deg."""
    left, _ = statics(np.radians(np.linspace(-12.0, 12.0, 241)))
    return float(np.mean(getattr(left, name)))


def both_sides(degrees: float) -> float:
    """Item 13: R_t of both organs on the rocker at rest."""
    left, right = statics(math.radians(degrees))
    return float(left.R_t - right.R_t)


def overload_at_rest(degrees: float) -> float:
    """Item 14: the papers' overload factor, R_t of the left organ over that of both."""
    return static_load("R_t", degrees) / both_sides(degrees)


def cycle_factor(torque: str, crank_speed: float) -> float:
    """Item 14b: ratio of the maxima of a torque over a turn, left organ alone to both."""
    return float(getattr(_factors(crank_speed), torque))


@cache
def _factors(crank_speed: float) -> Any:
    return overload_factors(machine(1.0), crank_speed, Feed(left=EMPTY, right=EMPTY))


def crossing(torque: str) -> float:
    """Item 14b: crank speed above which both sides together need more than the left alone [rad/s]."""
    from scipy.optimize import brentq

    return float(brentq(lambda w: cycle_factor(torque, w) - 1.0, 5.0, 10.0, xtol=1e-3))


def hinge_load(name: str) -> float:
    """Item 15: a load at psi = 0 with both weights in B."""
    return float(getattr(hinge_loading(0.0), name))


def hinge_growth(name: str) -> float:
    """Item 15: its growth by that way of loading [%]."""
    return 100.0 * (hinge_load(name) / static_load(name, 0.0) - 1.0)


def extreme(place: str) -> tuple[float, float]:
    """psi and phi at the left or right extreme of the rocker [rad]."""
    return dict(zip(("right", "left"), machine().rocker_extremes(), strict=True))[place]


def at_extreme(place: str) -> float:
    """The crank angle phi at an extreme of the rocker [rad]."""
    return extreme(place)[1]


def load_at_extreme(by: str, place: str, crank_speed: float) -> float:
    """Item 16: R_t at an extreme."""
    return float(loads(by, at_extreme(place), crank_speed)["R_t"])


def load_in_turn(by: str, name: str, end: str) -> float:
    """Item 17: the least or largest X or Y_A2 in a turn at 1 rad/s."""
    return float(PICK[end](loads(by, TURN, 1.0)[name]))


def resultant_in_middle(by: str, pick: str) -> float:
    """Item 17: least, largest or mean resultant of both organs at 1 rad/s where abs(psi) is below 8 deg."""
    near = np.abs(np.degrees(machine().forces(TURN, 1.0).rocker.psi)) < 8.0
    return float(PICK[pick](resultant(SCHEMES[by], TURN, 1.0)[near]))


def angle_at_extreme(name: str, place: str) -> float:
    """Item 18: "psi" or "phi" at an extreme [deg]."""
    return math.degrees(extreme(place)[("psi", "phi").index(name)])


def inertia_to_gravity(place: str, crank_speed: float) -> float:
    """Item 19: the inertia part of R_t over its gravity part."""
    still = load_at_extreme("model", place, 0.0)
    return abs((load_at_extreme("model", place, 1.0) - still) * crank_speed**2 / still)


def speed_of_equal_parts(place: str) -> float:
    """Item 19: crank speed at which both parts are equal [rad/s]."""
    return 1.0 / math.sqrt(inertia_to_gravity(place, 1.0))
