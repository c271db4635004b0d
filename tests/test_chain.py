"""The organ as a chain: statics against the reference and the catenary, modes against closed forms, the O(N)
recursion against dense equations and the reference's trajectories."""

from __future__ import annotations

import json
import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from chainunit import ChainUnitMachine, GeometryError, SideLoads
from chainunit.core.engines import MATH
from chainunit.core.planar import ZERO, Motion, Vec2
from chainunit.groups.body import Bar
from chainunit.groups.chain import Chain, Rods, close, end_motion
from chainunit.groups.driver import Crank
from chainunit.groups.dyad import Dyad
from chainunit.machines import hanging
from chainunit.mechanism.linkage import Linkage
from chainunit.mechanism.machine import Mechanism

DATA = json.loads((Path(__file__).parent / "data" / "chain_organ.json").read_text())
M = DATA["machine"]
G = M["g"]


def organ(number):
    counts = hanging.split((M["l1"], M["l2"]), number)
    return [
        np.repeat([x / n for x, n in zip(pair, counts, strict=True)], counts)
        for pair in ((M["l1"], M["l2"]), (M["m1"], M["m2"]))
    ]


def reach(psi):
    return np.array([M["z"] + M["e"] * math.sin(psi), -M["e"] * math.cos(psi)])


def loads(found, psi):
    x, y = found.last
    return x * math.cos(psi) + y * math.sin(psi), y * math.cos(psi) - x * math.sin(psi)


def test_the_split_is_the_references():
    assert {n: list(hanging.split((M["l1"], M["l2"]), int(n))) for n in DATA["split"]} == DATA["split"]
    assert hanging.split((1.0, 0.01), 2) == (1, 1) and hanging.split((0.01, 1.0), 5) == (1, 4)


@pytest.mark.parametrize("case", DATA["static"]["data"], ids=lambda c: f"{c['N']}-{c['psi_deg']:g}")
def test_static_reference(case):
    psi = math.radians(case["psi_deg"])
    if case["N"] == "catenary":
        result = hanging.catenary([M["l1"], M["l2"]], [M["m1"] * G, M["m2"] * G], reach(psi))
    else:
        lengths, masses = organ(case["N"])
        result = hanging.rods(lengths, masses * G, reach(psi))
        assert np.min(result.pull) == pytest.approx(case["min_mean_axial_pull"], rel=1e-8)
        if "theta" in case:
            np.testing.assert_allclose(result.theta, case["theta"], atol=1e-8)
    assert loads(result, psi) == pytest.approx((case["Rt"], case["Rn"]), rel=1e-8)


def test_rods_tend_to_the_catenary_with_the_second_order():
    """N1 : N2 fixed at 5 : 2, the ratio of the lengths, so that all rods are alike."""
    psi = math.radians(4.0)
    exact = np.array(hanging.catenary([M["l1"], M["l2"]], [M["m1"] * G, M["m2"] * G], reach(psi)).last)
    errors = []
    for k in (2, 4, 8, 16):
        lengths = np.repeat([M["l1"] / (5 * k), M["l2"] / (2 * k)], [5 * k, 2 * k])
        weights = np.repeat([M["m1"] * G / (5 * k), M["m2"] * G / (2 * k)], [5 * k, 2 * k])
        errors.append(np.hypot(*(hanging.rods(lengths, weights, reach(psi)).last - exact)) / np.hypot(*exact))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all((orders > 1.9) & (orders < 2.1)), orders
    lengths, masses = organ(64)
    sixty_four = hanging.rods(lengths, masses * G, reach(psi)).last
    assert np.hypot(*(sixty_four - exact)) < 2e-4 * np.hypot(*exact)


def test_a_catenary_is_the_textbooks():
    """Between pins at one height: H from 2 H/w sinh(w d/(2 H)) = L, V half the weight; steep ones by the same."""
    from scipy.optimize import brentq

    for distance in (0.2, 0.8, 0.99):
        H = brentq(lambda H, d=distance: 2.0 * H / 9.0 * math.sinh(9.0 * d / (2.0 * H)) - 1.0, 0.05, 1e3)
        result = hanging.catenary([0.4, 0.6], [3.6, 5.4], [distance, 0.0])
        assert result.first == pytest.approx([-H, 4.5], rel=1e-9)


def test_two_bars_are_the_machines_statics():
    """With two rods the chain is the dyad of the chain unit, at any rocker angle, with material on it."""
    machine, feed = ChainUnitMachine(), SideLoads(material_mass=30.0, processing_force=0.0)
    for psi in np.radians([-12.0, 0.0, 7.0]):
        chamber = machine.chamber(psi, left=feed, right=feed)
        for side, hand in (("left", 1.0), ("right", -1.0)):
            result = machine.hanging(side, float(psi), feed, 2)
            expected = getattr(chamber, side).rocker_joint
            assert result.last == pytest.approx([hand * float(expected.fx), float(expected.fy)], rel=1e-9)


@pytest.mark.second
def test_random_chains_hang_or_are_refused():
    """2,000 of them: each closes and is in balance with all rods pulled, or is stretched or folded, which is
    shown."""
    rng = np.random.default_rng(11)
    hung = 0
    for _ in range(2000):
        N = int(rng.integers(2, 65))
        lengths = rng.uniform(0.2, 1.0, N) * rng.uniform(0.5, 3.0) / N
        weights = rng.uniform(0.1, 5.0, N) * rng.choice([1.0, 100.0])
        angle = rng.uniform(-np.pi, np.pi)
        to = lengths.sum() * rng.uniform(0.02, 0.999) * np.array([np.cos(angle), np.sin(angle)])
        try:
            result = hanging.rods(lengths, weights, to)
        except GeometryError as refused:
            assert "would lie across between two parts that hang straight" in str(refused)
            assert abs(to[0]) <= np.max(lengths)
            continue
        hung += 1
        at = np.array([np.sin(result.theta), -np.cos(result.theta)]) @ lengths
        np.testing.assert_allclose(at, to, atol=1e-10 * lengths.sum())
        assert result.first + result.last == pytest.approx([0.0, weights.sum()], rel=1e-12, abs=1e-9)
    assert hung > 1500
    with pytest.raises(GeometryError, match=r"length of the chain = 2 m: must be > 2.5 m"):
        hanging.rods([1.0, 1.0], [1.0, 1.0], [1.5, 2.0])


def test_modes_of_a_taut_chain_are_a_strings():
    """Nearly straight: antisymmetric modes at n pi/L sqrt(H/mu), n even; the symmetric ones, which would stretch it,
    where tan x = x (Irvine's limit of a stiff cable)."""
    N, length = 300, 1.0001
    lengths, weights = np.full(N, length / N), np.full(N, G / N)
    rest = hanging.rods(lengths, weights, [1.0, 0.0])
    per_length = math.sqrt(abs(rest.first[0]) / 1.0)
    result = hanging.modes(lengths, weights, rest, G).frequency[:4] / per_length
    symmetric = [2.0 * x for x in (4.493409457909064, 7.725251836937707)]
    assert result == pytest.approx([2 * math.pi, symmetric[0], 4 * math.pi, symmetric[1]], rel=2e-3)


def test_modes_are_those_of_the_recursion():
    """A small vibration in the first mode's shape, by the dynamics of the chain with its ends held, has its
    period."""
    lengths, masses = organ(8)
    rest = hanging.rods(lengths, masses * G, reach(0.0))
    modes = hanging.modes(lengths, masses * G, rest, G)
    rods = Rods(lengths, masses, np.zeros(9))
    end = end_motion(rods, list(rest.theta), [0.0] * 8, MATH)
    theta, omega, _ = close(MATH, rods, list(rest.theta + 1e-4 * modes.shape[0]), [0.0] * 8, end)

    def rates(_, y):
        return [*y[8:], *Chain(MATH, rods, list(y[:8]), list(y[8:]), G, 0.0, ZERO).rates]

    period = 2.0 * math.pi / modes.frequency[0]
    after = solve_ivp(rates, (0.0, 3.0 * period), [*theta, *omega], method="DOP853", rtol=1e-10, atol=1e-12).y
    np.testing.assert_allclose(after[:8, -1] - rest.theta, np.array(theta) - rest.theta, atol=2e-7)
    half = solve_ivp(rates, (0.0, 0.5 * period), [*theta, *omega], method="DOP853", rtol=1e-10, atol=1e-12).y
    np.testing.assert_allclose(half[:8, -1] - rest.theta, -(np.array(theta) - rest.theta), atol=2e-7)


def test_recursion_is_the_dense_solution():
    """Angular accelerations and the force at A2 against mass matrix and multipliers, on random chains."""
    rng = np.random.default_rng(12)
    for N in (2, 3, 7, 24):
        l, m, c = rng.uniform(0.2, 0.5, N), rng.uniform(1.0, 9.0, N), rng.uniform(0.0, 1.0, N + 1)
        theta, omega = rng.uniform(-1.5, 1.5, N), rng.uniform(-2.0, 2.0, N)
        end, spin = Vec2(*rng.uniform(-3.0, 3.0, 2)), 0.7
        chain = Chain(MATH, Rods(l, m, c), list(theta), list(omega), G, spin, end)
        n, u = np.stack([np.cos(theta), np.sin(theta)]), np.stack([np.sin(theta), -np.cos(theta)])
        mass, right = np.zeros((N, N)), np.zeros(N)
        for k in range(N):
            to_middle = l * (np.arange(N) < k) + 0.5 * l * (np.arange(N) == k)
            jacobian, bias = n * to_middle, -(u * to_middle) @ omega**2
            mass += m[k] * jacobian.T @ jacobian
            mass[k, k] += m[k] * l[k] ** 2 / 12.0
            right += jacobian.T @ (np.array([0.0, -m[k] * G]) - m[k] * bias)
        speeds = np.array([0.0, *omega, spin])
        moments = c * np.diff(speeds)
        right += moments[1:] - moments[:-1]
        along = n * l
        system = np.block([[mass, -along.T], [along, np.zeros((2, 2))]])
        solution = np.linalg.solve(system, [*right, *(np.array([end.x, end.y]) + (u * l) @ omega**2)])
        np.testing.assert_allclose(chain.rates, solution[:N], rtol=1e-9, atol=1e-9)
        last = chain.forces[-1]
        np.testing.assert_allclose([last.x, last.y], solution[N:], rtol=1e-9, atol=1e-9)


def test_projection_closes_and_is_nearest():
    """The end comes to the given place; the change is the smallest in the metric of the masses: a second projection
    from a point moved along the constraint comes back to no nearer one."""
    rng = np.random.default_rng(13)
    lengths, masses = organ(8)
    rods = Rods(lengths, masses, np.zeros(9))
    theta = list(hanging.rods(lengths, masses * G, reach(0.1)).theta)
    omega = list(rng.uniform(-1.0, 1.0, 8))
    to = Motion(Vec2(*reach(0.1)), Vec2(0.3, -0.2))
    off = [a + 1e-3 * x for a, x in zip(theta, rng.uniform(-1.0, 1.0, 8), strict=True)]
    result, speeds, _ = close(MATH, rods, off, omega, to)
    end = end_motion(rods, result, speeds, MATH)
    assert math.hypot(end.p.x - to.p.x, end.p.y - to.p.y) < 1e-12
    assert math.hypot(end.p1.x - to.p1.x, end.p1.y - to.p1.y) < 1e-12
    again, _, _ = close(MATH, rods, result, speeds, to)
    np.testing.assert_allclose(again, result, atol=1e-13)


def rocker(phi, w):
    """Angle, speed and acceleration of the rocker at a crank that turns evenly."""
    ground = {"O1": Vec2(-M["c_frame"], -M["hy"]), "O2": ZERO}
    dyad = Dyad("B", Bar("coupler", "A", M["l"]), Bar("rocker", "O2", M["h"]), -1.0)
    bars = Linkage(ground, Crank(Bar("crank", "O1", M["r"]), "A"), (dyad,), {})
    driven = Mechanism(MATH, bars, phi).links["rocker"]
    return math.asin(driven.u.x), driven.t1 * w, driven.t2 * w * w


def acceleration(psi, speed, rate):
    s, c = math.sin(psi), math.cos(psi)
    return Vec2(c, s) * (M["e"] * rate) + Vec2(-s, c) * (M["e"] * speed * speed)


@pytest.mark.stages(first=3)
@pytest.mark.parametrize("hand", [1.0, -1.0], ids=["left", "right"])
@pytest.mark.parametrize("case", DATA["dynamic"]["data"], ids=lambda c: f"{c['label']}-{c['N']}")
def test_dynamic_reference(case, hand):
    """Forces at each stored state, in parts of the peak; and the stored trajectory over the last turn."""
    N, w, data = case["N"], case["Omega"], case["L" if hand > 0.0 else "R"]
    lengths, masses = organ(N)
    damping = case["damping"]
    assert damping["kind"] == "const"
    rods = Rods(lengths, masses, [damping["value"]] * (N + 1))
    walls, _ = hanging.split((M["l1"], M["l2"]), N)
    peak = max(np.max(np.abs(data[name])) for name in ("A1", "A2"))
    for k, phi in enumerate(data["phi"]):
        psi, speed, rate = (hand * x for x in rocker(phi, w))
        assert psi == pytest.approx(data["psi_s"][k], abs=1e-12)
        end = acceleration(psi, speed, rate)
        chain = Chain(MATH, rods, data["theta"][k], data["omega"][k], G, speed, end)
        f = chain.forces
        for name, x, y in (
            ("A2", f[-1].x, -f[-1].y), ("A1", -f[0].x, f[0].y), ("B", f[walls].x, -f[walls].y)
        ):  # fmt: skip
            np.testing.assert_allclose([x, y], data[name][k], atol=1e-12 * peak)
        assert chain.moment_at_end == pytest.approx(data["mA2"][k], abs=1e-10)

    def rates(t, y):
        psi, speed, rate = (hand * x for x in rocker(data["phi"][0] + w * t, w))
        theta, omega = list(y[:N]), list(y[N:])
        return [*omega, *Chain(MATH, rods, theta, omega, G, speed, acceleration(psi, speed, rate)).rates]

    times = np.array(data["t"]) - data["t"][0]
    start = [*data["theta"][0], *data["omega"][0]]
    solution = solve_ivp(
        rates, (0.0, times[-1]), start, method="DOP853", rtol=1e-9, atol=1e-9, t_eval=times
    ).y
    for k in range(0, 20, 4):
        psi, speed, rate = (hand * x for x in rocker(data["phi"][k], w))
        state = list(solution[:N, k]), list(solution[N:, k])
        f = Chain(MATH, rods, *state, G, speed, acceleration(psi, speed, rate)).forces
        np.testing.assert_allclose([f[-1].x, -f[-1].y], data["A2"][k], atol=1e-6 * peak)


def test_two_rods_in_motion_are_the_two_bar_machine():
    """The dyad's reactions on a rocker that moves anyhow, with material on the organ: the same forces, another
    route."""
    from chainunit.core.planar import Link
    from chainunit.machines.chain_unit import Inputs, organ

    machine, feed = ChainUnitMachine(), SideLoads(material_mass=30.0, processing_force=0.0)
    p = machine.p
    lengths, masses = machine.organ_rods("left", feed, 2)
    rods = Rods(lengths, masses, [0.0] * 3)
    rng = np.random.default_rng(14)
    for _ in range(50):
        psi, speed, rate = rng.uniform(-0.15, 0.15), rng.uniform(-3.0, 3.0), rng.uniform(-20.0, 20.0)
        link = Link(Motion(ZERO), Vec2(math.sin(psi), -math.cos(psi)), 1.0, 0.0)
        at = SimpleNamespace(pins={"A1 left": Motion(Vec2(-p.z, 0.0)), "A2": link.at(p.e)}, links={})
        wall, web = organ(p, Inputs(left=feed, right=feed), "left").solve(MATH, 0.0, at, ()).links
        theta = [math.atan2(wall.u.x, -wall.u.y), math.atan2(-web.u.x, web.u.y)]
        omega = [wall.t1 * speed, web.t1 * speed]
        s, c = math.sin(psi), math.cos(psi)
        end = Vec2(c, s) * (p.e * rate) + Vec2(-s, c) * (p.e * speed * speed)
        chain = Chain(MATH, rods, theta, omega, p.g, speed, end)
        left = machine.chamber(psi, speed, rate, feed, feed).left
        for force, expected, sign in (
            (chain.forces[0], left.support, -1.0), (chain.forces[1], left.hinge, 1.0), (chain.forces[2],
            left.rocker_joint, 1.0)
        ):  # fmt: skip
            reference = [float(expected.fx), float(expected.fy)]
            assert [sign * force.x, sign * force.y] == pytest.approx(reference, rel=1e-9, abs=1e-8)
        assert chain.rates[0] == pytest.approx(wall.t1 * rate + wall.t2 * speed * speed, rel=1e-9, abs=1e-9)
