"""The triad: all its assembly modes, its motion, its forces; also with C, D and E on one line."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from chainunit.core.engines import MATH, Dual, dual, slope
from chainunit.core.planar import Motion, Vec2
from chainunit.groups.legs import PLATE as LEGS
from chainunit.groups.legs import rods_at
from chainunit.groups.triad import Pose, assembly_modes, correct_pose, solved_triad


def random_triad(rng, collinear=False):
    """Outer pins, lengths and arms that close in at least one mode, built from a pose."""
    arms = tuple(Vec2(*rng.uniform(-0.7, 0.7, 2)) for _ in range(LEGS))
    if collinear:
        arms = tuple(Vec2(x, 0.2 * x + 0.1) for x in (-0.5, 0.1, 0.6))
    theta, legs = rng.uniform(-math.pi, math.pi), []
    c, s = math.cos(theta), math.sin(theta)
    for _ in arms:
        legs.append(Vec2(*rng.uniform(-1.0, 1.0, 2)))
    origin = Vec2(*rng.uniform(-0.5, 0.5, 2))
    pins = tuple(
        origin + Vec2(c * a.x - s * a.y, s * a.x + c * a.y) - leg for a, leg in zip(arms, legs, strict=True)
    )
    lengths = tuple(math.sqrt(leg.squared()) for leg in legs)
    return pins, lengths, arms, Pose(origin.x, origin.y, theta)


def scanned(pins, lengths, arms, points=400_000):
    """Angles theta of all modes, by another way: the four-bar of the last two legs is turned through, on both its
    branches, and the places are bisected where the first leg has its length."""
    (p1, p2, p3), (l1, l2, l3) = pins, lengths
    c, e = arms[0] - arms[1], arms[2] - arms[1]
    span, bend = math.sqrt(e.squared()), math.atan2(e.y, e.x)

    def excess(t, sign):
        d = Vec2(p2.x + l2 * np.cos(t), p2.y + l2 * np.sin(t))
        gap = p3 - d
        g2 = gap.squared()
        along = (span * span - l3 * l3 + g2) / (2.0 * g2)
        with np.errstate(invalid="ignore"):
            to_e = gap * along + gap.turned() * (sign * np.sqrt(span * span / g2 - along * along))
        theta = np.arctan2(to_e.y, to_e.x) - bend
        cos, sin = np.cos(theta), np.sin(theta)
        at_c = d + Vec2(c.x * cos - c.y * sin, c.x * sin + c.y * cos)
        return np.sqrt((at_c - p1).squared()) - l1, theta

    results = []
    grid = np.linspace(0.0, 2.0 * math.pi, points + 1)
    # near the ends of a branch, where the four-bar is stretched, the angle goes with the root of the distance
    closes = np.isfinite(excess(grid, 1.0)[0])
    for k in np.flatnonzero(closes[:-1] != closes[1:]):
        inside, outside = (grid[k], grid[k + 1]) if closes[k] else (grid[k + 1], grid[k])
        for _ in range(60):
            middle = 0.5 * (inside + outside)
            inside, outside = (middle, outside) if np.isfinite(excess(middle, 1.0)[0]) else (inside, middle)
        way = math.copysign(1.0, inside - outside)
        grid = np.append(grid, [inside, *(inside + way * np.logspace(-14, -5, 200))])
    grid = np.sort(grid)
    for sign in (1.0, -1.0):
        values, _ = excess(grid, sign)
        for k in np.flatnonzero(values[:-1] * values[1:] < 0.0):
            t = brentq(lambda t, sign=sign: float(excess(t, sign)[0]), grid[k], grid[k + 1], xtol=1e-14)
            results.append(float(excess(t, sign)[1]))
    return sorted(math.remainder(theta, 2.0 * math.pi) for theta in results)


def still(pins, lengths, arms):
    return rods_at([Motion(p) for p in pins], lengths, arms)


@pytest.mark.parametrize("seed", range(10))
def test_all_assembly_modes(seed):
    """Of a random triad each, against the scan of the four-bar's two branches."""
    pins, lengths, arms, built = random_triad(np.random.default_rng(seed))
    modes = assembly_modes(pins, lengths, arms)
    assert 2 <= len(modes) <= 6 and len(modes) % 2 == 0
    assert [mode.theta for mode in modes] == pytest.approx(scanned(pins, lengths, arms), abs=1e-8)
    assert min(abs(math.remainder(mode.theta - built.theta, 2.0 * math.pi)) for mode in modes) < 1e-9


@pytest.mark.second
def test_many_triads_find_the_mode_they_were_built_in():
    """Also six modes, and pins on one line."""
    rng = np.random.default_rng(3)
    counts = set()
    for k in range(500):
        pins, lengths, arms, built = random_triad(rng, collinear=k % 5 == 0)
        modes = assembly_modes(pins, lengths, arms)
        counts.add(len(modes))
        nearest = min(
            abs(math.remainder(m.theta - built.theta, 2.0 * math.pi))
            + abs(m.x - built.x)
            + abs(m.y - built.y)
            for m in modes
        )
        assert nearest < 1e-6, k
    assert {2, 4, 6} <= counts


def searched(pins, lengths, arms, tries=600):
    """All poses that Newton's method finds from as many random starts."""
    rng, result = np.random.default_rng(31), []
    for _ in range(tries):
        try:
            start = Pose(*rng.uniform(-2.0, 3.0, 2), rng.uniform(-math.pi, math.pi))
            pose = correct_pose(MATH, still(pins, lengths, arms), start, 40)
            triad = solved_triad(MATH, still(pins, lengths, arms), pose)
        except (ArithmeticError, ValueError):
            continue
        gaps = [math.sqrt((k.p - p).squared()) - l for k, p, l in zip(triad.pins, pins, lengths, strict=True)]
        same = [
            p for p in result
            if abs(math.remainder(p.theta - pose.theta, 2.0 * math.pi)) + abs(p.x - pose.x) + abs(p.y - pose.y) < 1e-6
        ]  # fmt: skip
        if max(map(abs, gaps)) < 1e-9 and not same:
            result.append(pose)
    return result


ARMS = (Vec2(-0.06, -0.14), Vec2(0.0, 0.0), Vec2(0.8, 0.0))
SPECIAL = {
    "parallel equal hangers": ((Vec2(0.43, -0.11), Vec2(0.86, 0.36), Vec2(1.66, 0.36)), (0.62, 0.39, 0.39), ARMS),
    "nearly so": ((Vec2(0.43, -0.11), Vec2(0.86, 0.36), Vec2(1.66, 0.36 + 1e-7)), (0.62, 0.39, 0.39), ARMS),
    "C in D": ((Vec2(0.4, 0.0), Vec2(0.86, 0.36), Vec2(1.6, 0.3)), (0.62, 0.39, 0.45), (ARMS[1], *ARMS[1:])),
    "all on two lines": (
        (Vec2(0.0, 0.0), Vec2(0.5, 0.0), Vec2(1.1, 0.0)), (0.5, 0.45, 0.6), (Vec2(-0.4, 0.0), ARMS[1], Vec2(0.5, 0.0))
    ),
}  # fmt: skip


@pytest.mark.stages(first=1)
@pytest.mark.parametrize("name", SPECIAL)
def test_modes_of_special_triads(name):
    """Where two of the three equations for D are dependent, as with parallel hangers: against a search."""
    modes, reference = assembly_modes(*SPECIAL[name]), searched(*SPECIAL[name])
    assert len(modes) == len(reference) and len(modes) % 2 == 0
    for mode in modes:
        assert min(math.hypot(mode.x - p.x, mode.y - p.y) for p in reference) < 1e-6


def test_a_triad_that_cannot_close_has_no_mode():
    far = (Vec2(0.0, 0.0), Vec2(10.0, 0.0), Vec2(0.0, 10.0))
    assert assembly_modes(far, (1.0, 1.0, 1.0), (Vec2(0.1, 0.0), Vec2(0.0, 0.0), Vec2(0.0, 0.1))) == []


def moved(rng, pins):
    """Outer pins with random motion, and where they are at the coordinate t."""
    motion = tuple(Motion(p, Vec2(*rng.uniform(-1, 1, 2)), Vec2(*rng.uniform(-1, 1, 2))) for p in pins)
    return motion, lambda t: tuple(m.p + m.p1 * t + m.p2 * (0.5 * t * t) for m in motion)


@pytest.mark.parametrize("collinear", [False, True])
def test_motion_is_that_of_the_followed_pose(collinear):
    """The first derivative against dual numbers through Newton's method, the second against differences of those."""
    rng = np.random.default_rng(4)
    checked = 0
    while checked < 40:
        pins, lengths, arms, pose = random_triad(rng, collinear)
        outer, at = moved(rng, pins)
        triad = solved_triad(MATH, rods_at(outer, lengths, arms), pose)
        if abs(triad.margin) < 0.1:
            continue
        checked += 1
        h = 1e-5

        def rates(t, outer=outer, at=at, lengths=lengths, arms=arms, pose=pose):
            here = correct_pose(MATH, still(at(t), lengths, arms), pose, 12)
            pins = tuple(
                Vec2(Dual(p.x, m.p1.x + m.p2.x * t), Dual(p.y, m.p1.y + m.p2.y * t))
                for p, m in zip(at(t), outer, strict=True)
            )
            return np.array([slope(v) for v in correct_pose(dual(MATH), still(pins, lengths, arms), here, 2)])

        *legs, link = triad.links
        np.testing.assert_allclose([link.pin.p1.x, link.pin.p1.y, link.t1], rates(0.0), rtol=1e-9, atol=1e-9)
        second = (rates(h) - rates(-h)) / (2.0 * h)
        scale = np.max(np.abs(second))
        np.testing.assert_allclose(
            [link.pin.p2.x, link.pin.p2.y, link.t2], second, rtol=1e-4, atol=1e-5 * scale
        )
        for leg, pin, length in zip(legs, triad.pins, lengths, strict=True):
            end = leg.at(length)
            for a, b in ((end.p, pin.p), (end.p1, pin.p1), (end.p2, pin.p2)):
                assert abs(a.x - b.x) + abs(a.y - b.y) < 1e-10 * (1.0 + abs(b.x) + abs(b.y))


@pytest.mark.parametrize("collinear", [False, True])
def test_forces_keep_every_link_in_balance(collinear):
    """Against a plain solution of all nine equations of balance of the four links."""
    rng = np.random.default_rng(5)
    for _ in range(60):
        pins, lengths, arms, pose = random_triad(rng, collinear)
        triad = solved_triad(MATH, still(pins, lengths, arms), pose)
        if abs(triad.margin) < 1e-2:
            continue
        legs = tuple((Vec2(*rng.uniform(-9, 9, 2)), rng.uniform(-9, 9)) for _ in range(LEGS))
        knife = (Vec2(*rng.uniform(-9, 9, 2)), rng.uniform(-9, 9))
        forces, _ = triad.reactions((*legs, knife))
        outer, inner = forces[:LEGS], forces[LEGS:]
        # unknowns: forces at the inner pins on the legs, six; of each leg the moment, of the knife three equations
        matrix, right = np.zeros((6, 6)), np.zeros(6)
        for i, (p, pin) in enumerate(zip(pins, triad.pins, strict=True)):
            r, a = pin.p - p, pin.p - triad.links[-1].pin.p
            matrix[i, 2 * i : 2 * i + 2] = -r.y, r.x
            right[i] = -legs[i][1]
            matrix[3, 2 * i], matrix[4, 2 * i + 1] = 1.0, 1.0
            matrix[5, 2 * i : 2 * i + 2] = -a.y, a.x
        right[3:] = knife[0].x, knife[0].y, knife[1]
        reference = np.linalg.solve(matrix, right).reshape(3, 2)
        result = np.array([[f.x, f.y] for f in inner])
        np.testing.assert_allclose(result, reference, rtol=1e-9, atol=1e-9 * np.max(np.abs(reference)))
        for (force, _), at_outer, at_inner in zip(legs, outer, inner, strict=True):
            rest = force + at_outer + at_inner
            assert abs(rest.x) + abs(rest.y) < 1e-10 * np.max(np.abs(reference))


def test_three_moments_are_singular_on_a_line_and_this_is_not():
    """docs/papers.md, paper 003, item 6: the paper's three moment equations about C, D, E against ours."""
    rng = np.random.default_rng(6)
    pins, lengths, arms, pose = random_triad(rng, collinear=True)
    triad = solved_triad(MATH, still(pins, lengths, arms), pose)
    at = [pin.p for pin in triad.pins]
    pull = [leg.u for leg in triad.links[:LEGS]]
    moments = np.array([[(at[k] - at[i]).cross(pull[k]) for k in range(3)] for i in range(3)])
    assert np.linalg.cond(moments) > 1e12 and abs(triad.margin) > 1e-2
    forces, _ = triad.reactions((*((Vec2(0.0, 0.0), 0.0),) * LEGS, (Vec2(3.0, -40.0), 2.0)))
    inner = forces[LEGS:]
    assert all(math.isfinite(f.x) and math.isfinite(f.y) for f in inner)


def test_the_margin_vanishes_where_the_legs_meet():
    """Legs whose lines go through one point hold no moment about it."""
    arms = (Vec2(-0.5, 0.0), Vec2(0.5, 0.0), Vec2(0.0, 0.4))
    meet = Vec2(0.3, 2.0)
    pins = tuple(a + (meet - a) * 0.5 for a in arms)
    lengths = tuple(math.sqrt((p - a).squared()) for p, a in zip(pins, arms, strict=True))
    nearly = pins[0], pins[1], pins[2] + Vec2(1e-9, 0.0)
    triad = solved_triad(MATH, still(nearly, lengths, arms), Pose(0.0, 0.0, 0.0))
    assert abs(triad.margin) < 1e-8
