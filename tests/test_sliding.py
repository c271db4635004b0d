"""The sliding dyads: against differences, by two routes to the torque, and in limits that are known."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from chainunit.core.engines import MATH, Dual, dual, slope
from chainunit.core.planar import Vec2
from chainunit.groups.body import Bar, Mass
from chainunit.groups.driver import Crank, Ram
from chainunit.groups.dyad import PRP, RPP, RPR, RRP, Dyad
from chainunit.groups.joints import Rail
from chainunit.groups.legs import BlockLeg, RodLeg, SlotLeg
from chainunit.groups.loads import GuideLosses, PinLosses, Push, Weight, _ends
from chainunit.groups.triad import Pose, Triad
from chainunit.mechanism.linkage import Linkage
from chainunit.mechanism.machine import MachineState, Mechanism, derived_numbers

PIN = SimpleNamespace(friction=0.1, diameter=0.05, w_smooth=0.02)
GUIDE = SimpleNamespace(friction=0.15, v_smooth=0.02)


def unit(angle):
    return Vec2(math.cos(angle), math.sin(angle))


def mass(rng):
    return Mass(*rng.uniform([1.0, -0.2, 0.01, -0.1], [20.0, 0.2, 0.5, 0.1]))


def bar(rng, name, pin, length=None, **points):
    return Bar(name, pin, length, mass(rng), {"end_" + name: tuple(rng.uniform(-0.3, 0.3, 2)), **points})


def four_bar(rng):
    """A crank-rocker, on whose links the sliding dyads of the tests hang: no rail of theirs stands still."""
    return (
        Crank(bar(rng, "crank", "O1", 0.1), "A", unit(0.3), 1.0),
        Dyad("B", bar(rng, "coupler", "A", 0.38), bar(rng, "rocker", "O2", 0.3), 1.0),
    )


ALONG_X = Rail(None, Vec2(0.0, 0.0), Vec2(1.0, 0.0))
GROUND = {"O1": Vec2(0.0, 0.0), "O2": Vec2(0.4, -0.05), "O3": Vec2(0.5, 0.6)}


def rrp(rng):
    rail = Rail("rocker", Vec2(*rng.uniform(-0.1, 0.1, 2)), unit(rng.uniform(-1.0, 1.0)))
    side = rng.choice([-1.0, 1.0])
    return RRP("C", bar(rng, "rod", "O3", 1.6), bar(rng, "slider", "", None, G=(0.05, 0.02)), rail, "G", side)


def rpr(rng):
    block, lever = bar(rng, "block", "end_coupler", None, G=(0.02, 0.03)), bar(rng, "lever", "O3")
    return RPR(block, lever, 0.02, "G", rng.choice([-1.0, 1.0]))


def prp(rng):
    rails = Rail("rocker", Vec2(0.1, 0.1), unit(0.2)), Rail("coupler", Vec2(0.0, 0.2), unit(1.7))
    first, second = bar(rng, "one", "", None, G=(0.05, 0.0)), bar(rng, "other", "", None, H=(0.0, 0.04))
    return PRP("C", first, second, *rails, ("G", "H"))


def rpp(rng):
    rail = Rail("rocker", Vec2(0.1, 0.1), unit(0.4))
    block, yoke = (
        bar(rng, "block", "end_coupler", None, G=(0.0, 0.0)),
        bar(rng, "yoke", "", None, H=(0.1, 0.05)),
    )
    return RPP(block, yoke, rail, unit(1.2), ("G", "H"))


def triad(rng):
    """On a rod, a block on a rail that turns, and a block in a slot."""
    legs = (
        RodLeg(bar(rng, "rod", "O3", 0.57), "C", Vec2(0.0, 0.38)),
        BlockLeg(bar(rng, "block", "", None, G=(0.03, 0.02)), "D", Vec2(0.25, -0.15), RAIL, "G"),
        SlotLeg(bar(rng, "sliding", "A", None, H=(0.0, 0.0)), Vec2(0.08, -0.1), unit(0.41), "H"),
    )
    return Triad("plate", mass(rng), legs, {"end_plate": (0.2, 0.1)}, Pose(0.3, 0.3, 0.0))


RAIL = Rail("rocker", Vec2(0.23, 0.29), unit(-0.18))
DYADS = {"RRP": rrp, "RPR": rpr, "PRP": prp, "RPP": rpp, "triad": triad}


def linkage(kind, seed, losses=True):
    rng = np.random.default_rng(seed)
    driver, dyad = four_bar(rng)
    group = DYADS[kind](rng)
    lengths = dict.fromkeys(list(group.guides)[:1], 0.12)
    loads = {"weight": Weight(9.81), "push": Push("end_" + group.bars[-1].name, Vec2(130.0, -270.0))}
    if losses:
        loads |= {"pins": PinLosses(PIN, 0.3), "guides": GuideLosses(GUIDE, 5.0, lengths)}
    return Linkage(GROUND, driver, (dyad, group), loads)


def mechanism(bars, q, xp=MATH):
    return Mechanism(xp, bars, q, derived_numbers(MATH, bars))


def clear(kind, seed):
    """A crank angle at which the dyad is clear of its dead positions."""
    bars = linkage(kind, seed)
    return max((0.7 + seed, 2.2 + seed), key=lambda q: min(map(abs, mechanism(bars, q).margins())))


CASES = [(kind, seed, clear(kind, seed)) for kind in DYADS for seed in range(3)]


def names_and_values(m):
    for name, motion in m.pins.items():
        yield name, (motion.p.x, motion.p.y), (motion.p1.x, motion.p1.y), (motion.p2.x, motion.p2.y)
    for name, link in m.links.items():
        yield name, (link.u.x, link.u.y), (-link.u.y * link.t1, link.u.x * link.t1), None
        yield name + " rate", (link.t1,), (link.t2,), None
    for joint, slide in m.slides.items():
        yield str(joint), (slide.s,), (slide.s1,), (slide.s2,)


@pytest.mark.parametrize(("kind", "seed", "q"), CASES)
def test_motion_has_the_derivatives_that_it_states(kind, seed, q):
    """Against central differences of higher order, and the constraints themselves at the ends."""
    bars, h = linkage(kind, seed), 1e-3
    here = list(names_and_values(mechanism(bars, q)))
    around = [list(names_and_values(mechanism(bars, q + k * h))) for k in (-2, -1, 1, 2)]

    def difference(place, order):
        a, b, c, d = (np.array(each[place][order]) for each in around)
        return (a - 8.0 * b + 8.0 * c - d) / (12.0 * h)

    for place, (name, _, first, second) in enumerate(here):
        assert difference(place, 1) == pytest.approx(np.array(first), rel=1e-8, abs=1e-8), name
        if second is not None:
            assert difference(place, 2) == pytest.approx(np.array(second), rel=1e-8, abs=1e-8), name


@pytest.mark.parametrize(("kind", "seed", "q"), CASES)
def test_third_derivatives(kind, seed, q):
    bars, h = linkage(kind, seed), 1e-3
    links, pins = mechanism(bars, q).third_derivatives()
    around = [mechanism(bars, q + k * h) for k in (-2, -1, 1, 2)]

    def difference(value):
        a, b, c, d = (np.array(value(m)) for m in around)
        return (a - 8.0 * b + 8.0 * c - d) / (12.0 * h)

    for name, (start, t3) in links.items():
        assert difference(lambda m, name=name: m.links[name].t2) == pytest.approx(t3, rel=1e-7, abs=1e-7), (
            name
        )
        p = difference(lambda m, name=name: (m.links[name].pin.p2.x, m.links[name].pin.p2.y))
        assert p == pytest.approx(np.array([start.x, start.y]), rel=1e-7, abs=1e-7), name
    for name, p3 in pins.items():
        p = difference(lambda m, name=name: (m.pins[name].p2.x, m.pins[name].p2.y))
        assert p == pytest.approx(np.array([p3.x, p3.y]), rel=1e-7, abs=1e-7), name


@pytest.mark.parametrize(("kind", "seed", "q"), CASES)
def test_the_torque_by_reactions_is_that_of_virtual_work(kind, seed, q):
    bars = linkage(kind, seed, losses=False)
    state = MachineState(MATH, mechanism(bars, q), 6.0)
    assert state.torque_by_reactions(-25.0) == pytest.approx(state.torque(-25.0), rel=1e-11)


@pytest.mark.parametrize(("kind", "seed", "q"), CASES)
def test_each_link_is_in_balance(kind, seed, q):
    """Newton's and Euler's equations of every link, from the reactions alone."""
    bars, w, a = linkage(kind, seed, losses=False), 6.0, -25.0
    m = mechanism(bars, q)
    state = MachineState(MATH, m, w)
    reactions = state.reactions(a)
    force = {name: np.zeros(2) for name in m.links}
    moment = dict.fromkeys(m.links, 0.0)

    def act(link, at, f, couple=0.0):
        force[link] += f
        c = m.bodies[link].c.p
        moment[link] += (at.x - c.x) * f[1] - (at.y - c.y) * f[0] + couple

    guides = {joint: of for group in (bars.driver, *bars.groups) for joint, of in group.guides.items()}
    for connections in bars.topology.groups:
        for joint, carrier, _ in connections.joints:
            r = reactions[joint]
            f, couple, at = np.array([r.x, r.y]), 0.0, None
            if joint in guides:
                at, couple = m.links[joint[1]].pin.p, r.moment
                # nothing but normal to the line
                assert abs(r.dot(m.slides[joint].d)) < 1e-9 * np.hypot(*f)
            else:
                at = m.pins[joint[0]].p
            act(joint[1], at, f, couple)
            if carrier is not None:
                act(carrier, at, -f, -couple)
    push = bars.loads["push"]
    act(m.carrier(push.point), m.pins[push.point].p, np.array([push.force.x, push.force.y]))
    moment["crank"] += state.torque(a)
    for name, body in m.bodies.items():
        acc = np.array([body.c.p1.x * a + body.c.p2.x * w * w, body.c.p1.y * a + body.c.p2.y * w * w + 9.81])
        assert force[name] == pytest.approx(body.m * acc, rel=1e-9, abs=1e-8), name
        link = m.links[name]
        assert moment[name] == pytest.approx(body.I * (link.t1 * a + link.t2 * w * w), rel=1e-9, abs=1e-8), (
            name
        )


@pytest.mark.parametrize(("kind", "seed", "q"), CASES)
def test_slopes_of_the_port(kind, seed, q):
    """By dual numbers through everything, losses in guides and pins included."""
    bars, w = linkage(kind, seed), 6.0
    by_angle, by_speed = MachineState(MATH, mechanism(bars, q), w).slopes()
    xp = dual(MATH)
    assert slope(MachineState(xp, mechanism(bars, Dual(q, 1.0), xp), w).bias) == pytest.approx(
        by_angle, rel=1e-9
    )
    assert slope(MachineState(xp, mechanism(bars, q, xp), Dual(w, 1.0)).bias) == pytest.approx(
        by_speed, rel=1e-9
    )


def slider_crank(first, slider, load):
    """On a rail along x through the bearing O."""
    crank = Crank(Bar("crank", "O", 0.08), "A", Vec2(1.0, 0.0), 1.0)
    group = RRP("C", first, slider, ALONG_X, "G", 1.0)
    return Linkage({"O": Vec2(0.0, 0.0)}, crank, (group,), {"push": load})


def test_slider_crank_is_the_textbooks():
    """x = r cos + sqrt(l^2 - r^2 sin^2), and its derivatives in closed form; the guide carries F tan(beta)."""
    r, l, force = 0.08, 0.3, 1000.0
    ram = Bar("ram", "", None, None, {"G": (0.0, 0.0)})
    bars = slider_crank(Bar("rod", "A", l), ram, Push("C", Vec2(-force, 0.0)))
    for q in np.linspace(0.1, 6.2, 23):
        m = mechanism(bars, q)
        s, c = math.sin(q), math.cos(q)
        root = math.sqrt(l * l - r * r * s * s)
        beta = math.asin(r * s / l)
        x1 = -r * s - r * r * s * c / root
        x2 = -r * c - r * r * (c * c - s * s) / root - r**4 * s * s * c * c / root**3
        (slide,) = m.slides.values()
        assert (slide.s, slide.s1, slide.s2) == pytest.approx((r * c + root, x1, x2), rel=1e-12)
        state = MachineState(MATH, m, 0.0)
        assert state.torque(0.0) == pytest.approx(force * x1, rel=1e-12)
        guide = state.reactions(0.0)["G", "ram"]
        # the rod, which pushes the ram, pushes it aside, too
        assert (guide.x, guide.y) == pytest.approx((0.0, force * math.tan(beta)), rel=1e-12, abs=1e-9)
        assert guide.moment == 0.0


def test_scotch_yoke_is_harmonic():
    r = 0.1
    bars = Linkage(
        {"O": Vec2(0.0, 0.0)},
        Crank(Bar("crank", "O", r), "A", Vec2(1.0, 0.0), 1.0),
        (RPP(Bar("block", "A", None), Bar("yoke", "", None), ALONG_X, Vec2(0.0, 1.0), ("A", "A")),),
        {},
    )
    for q in np.linspace(0.0, 6.0, 13):
        slot, way = mechanism(bars, q).slides.values()
        x, y = r * math.cos(q), r * math.sin(q)
        assert (way.s, way.s1, way.s2) == pytest.approx((x, -y, -x), abs=1e-15)
        assert (slot.s, slot.s1, slot.s2) == pytest.approx((y, x, -y), abs=1e-15)


def test_elliptic_trammel():
    """A ram pushes a rod between two rails: the middle of the rod moves on a circle about the corner."""
    l = 0.5
    ram = Bar("ram", "", None, Mass(3.0, 0.0, 0.0), {"P": (0.0, 0.0)})
    rod = Bar("rod", "P", l, Mass(2.0, 0.5 * l, 2.0 * l * l / 12.0))
    top = Bar("top", "", None, Mass(1.0, 0.0, 0.0), {"H": (0.0, 0.0)})
    group = RRP("C", rod, top, Rail(None, Vec2(0.0, 0.0), Vec2(0.0, 1.0)), "H", 1.0)
    bars = Linkage({}, Ram(ram, ALONG_X, "P", "P"), (group,), {"weight": Weight(9.81)})
    for q in (0.1, 0.25, 0.4):
        m = mechanism(bars, q)
        height = math.sqrt(l * l - q * q)
        assert m.pins["C"].p.y == pytest.approx(height, rel=1e-14)
        middle = m.bodies["rod"].c.p
        assert math.hypot(middle.x, middle.y) == pytest.approx(0.5 * l, rel=1e-14)
        # held against the weights: F dq + (m_rod/2 + m_top) g dy = 0, dy/dq = -q/height
        still = MachineState(MATH, m, 0.0)
        assert still.torque(0.0) == pytest.approx(-2.0 * 9.81 * q / height, rel=1e-12)
        state = MachineState(MATH, m, 0.7)
        assert state.torque_by_reactions(1.3) == pytest.approx(state.torque(1.3), rel=1e-12)
        # the rod turns at 1/height, its middle about the corner
        inertia = 2.0 * (0.5 * l) ** 2 + 2.0 * l * l / 12.0
        assert state.J == pytest.approx(3.0 + inertia / height**2 + (q / height) ** 2, rel=1e-12)


def test_the_forces_at_the_ends_of_a_block_are_its_normal_force_and_its_moment():
    length, normal, moment = 0.12, 340.0, -17.0
    ahead, behind = _ends(normal, moment, length)
    assert ahead + behind == pytest.approx(normal)
    assert 0.5 * length * (ahead - behind) == pytest.approx(moment)
