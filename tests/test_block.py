"""The linear system of a group: against dense matrices, in both directions, with what is known beforehand and what is
not; and that nothing divides by what vanishes outside a dead position."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from chainunit.core.engines import MATH
from chainunit.core.planar import ZERO, Link, Motion, Vec2
from chainunit.groups.block import GroupMatrix, _plan
from chainunit.groups.body import Bar
from chainunit.groups.driver import Crank, Cylinder, Elbow, Ram
from chainunit.groups.dyad import PRP, RPP, RPR, RRP, Dyad
from chainunit.groups.group import SolvedGroup
from chainunit.groups.joints import STEADY, UNKNOWNS, DrivenHinge, GuideData, Hinge, HingeData, Placed, Rail
from chainunit.groups.legs import BlockLeg, RodLeg, SlotLeg
from chainunit.groups.tetrad import Plate, Tetrad
from chainunit.groups.triad import Pose, solved_triad


def unit(angle):
    return Vec2(math.cos(angle), math.sin(angle))


def motion(rng, x, y):
    return Motion(Vec2(x, y), Vec2(*rng.uniform(-1, 1, 2)), Vec2(*rng.uniform(-1, 1, 2)))


def before(rng):
    """A linkage before the groups: pins and a link of any motion."""
    body = Link(motion(rng, 0.1, -0.2), unit(0.3), *rng.uniform(-1, 1, 2))
    pins = {"P": motion(rng, 0.0, 0.0), "Q": motion(rng, 1.0, 0.1), "O": motion(rng, 0.3, 0.8)}
    return SimpleNamespace(pins=pins, links={"body": body})


RAIL, CROSS = Rail("body", Vec2(0.4, 0.9), unit(0.4)), Rail("body", Vec2(0.1, 0.2), unit(1.9))
LEGS = {
    "rods": (
        RodLeg(Bar("a", "P", 0.7), "A", Vec2(-0.3, 0.0)),
        RodLeg(Bar("b", "Q", 0.6), "B", Vec2(0.3, 0.1)),
        RodLeg(Bar("c", "O", 0.5), "C", Vec2(0.0, 0.3)),
    ),
    "block and slot": (
        RodLeg(Bar("a", "P", 0.7), "A", Vec2(-0.3, 0.0)),
        BlockLeg(Bar("b", "", None), "B", Vec2(0.3, 0.1), RAIL, "B"),
        SlotLeg(Bar("c", "O", None), Vec2(0.0, 0.1), unit(0.4), "O"),
    ),
    "blocks": (
        BlockLeg(Bar("a", "", None), "A", Vec2(-0.3, 0.0), CROSS, "A"),
        BlockLeg(Bar("b", "", None), "B", Vec2(0.3, 0.1), RAIL, "B"),
        SlotLeg(Bar("c", "O", None), Vec2(0.0, 0.1), unit(0.4), "O"),
    ),
}
SEATS = {"A": Vec2(0.2, 0.5), "B": Vec2(-0.1, 0.6)}
RODS = (RodLeg(Bar("a", "A", 0.7), "C", Vec2(-0.2, 0.5)), RodLeg(Bar("b", "B", 0.6), "D", Vec2(0.3, 0.4)))
TETRADS = {
    "tetrad": Tetrad(
        "f",
        (
            Plate(Bar("f", "P", None), HingeData("P", "f"), SEATS),
            Plate(Bar("s", "Q", None), HingeData("Q", "s"), {}),
        ),
        RODS,
        (0.2, -0.3),
    ),
    "tetrad on rails": Tetrad(
        "f",
        (
            Plate(Bar("f", "", None), GuideData("X", "f", RAIL), SEATS),
            Plate(Bar("s", "", None), GuideData("Y", "s", CROSS), {}),
        ),
        RODS,
        (0.2, 0.6),
    ),
    "tetrad with slots": Tetrad(
        "f",
        (
            Plate(Bar("f", "P", None), HingeData("P", "f"), SEATS),
            Plate(Bar("s", "", None), GuideData("Y", "s", RAIL), {}),
        ),
        (
            BlockLeg(Bar("a", "", None), "C", Vec2(-0.2, 0.5), Rail("f", Vec2(0.1, 0.2), unit(0.7)), "C"),
            SlotLeg(Bar("b", "B", None), Vec2(0.3, 0.4), unit(2.0), "B"),
        ),
        (0.2, 0.5),
    ),
}
GROUPS = {
    "crank": Crank(Bar("a", "P", 0.2), "A"),
    "ram": Ram(Bar("a", "", None), RAIL, "G"),
    "cylinder": Cylinder(
        Bar("a", "P", None), "C", Bar("b", "", None), Bar("c", "Q", 0.9), 0.5, 0.1, 0.05, "C", 1.0
    ),
    "crank on a link": Crank(Bar("a", "P", 0.2), "A", unit(0.4), on="body"),
    "elbow": Elbow(Bar("a", "P", 0.9), "M", Bar("b", "", 0.8), "C", Bar("c", "Q", 0.9), unit(1.3), -1.0, 1.0),
    "RRR": Dyad("C", Bar("a", "P", 0.7), Bar("b", "Q", 0.8), 1.0),
    "RRP": RRP("C", Bar("a", "P", 1.2), Bar("b", "", None), RAIL, "C", 1.0),
    "RPR": RPR(Bar("a", "P", None), Bar("b", "Q", None), 0.1, "P", -1.0),
    "PRP": PRP("C", Bar("a", "", None), Bar("b", "", None), RAIL, CROSS, ("C", "C")),
    "RPP": RPP(Bar("a", "P", None), Bar("b", "", None), RAIL, unit(1.2), ("P", "P")),
}


def solved(name, rng):
    at = before(rng)
    return placed(name, at, rng.uniform(0.2, 0.6, 3))


def placed(name, at, x):
    """The group at any place, also one at which its legs do not fit: its rows are the same."""
    if name in GROUPS:
        return GROUPS[name].solve(MATH, 0.3, at, ())
    if name in TETRADS:
        return TETRADS[name].solved(MATH, TETRADS[name].at_position(at), x[:2])
    legs = [leg.at_position(k, at) for k, leg in enumerate(LEGS[name])]
    return solved_triad(MATH, legs, Pose(*x))


def dense(joints, links):
    rows = [row for joint in joints for row in joint.rows()]
    unknowns = sorted({j for row in rows for j in row})
    assert len(rows) == len(unknowns)
    matrix = np.zeros((len(rows), UNKNOWNS * links))
    for i, row in enumerate(rows):
        for j, x in row.items():
            matrix[i, j] = x
    return rows, matrix, unknowns


@pytest.mark.parametrize("name", [*GROUPS, *LEGS, *TETRADS])
@pytest.mark.parametrize("seed", range(3))
def test_each_group_is_solved_in_both_directions(name, seed):
    rng = np.random.default_rng(seed)
    group = solved(name, rng)
    rows, matrix, unknowns = dense(group._joints, len(group.links))
    block = GroupMatrix(UNKNOWNS * len(group.links), rows)
    square = matrix[:, unknowns]
    b, c = rng.uniform(-1, 1, len(matrix)), np.zeros(UNKNOWNS * len(group.links))
    x = np.array(block.solve(b))
    np.testing.assert_allclose(x[unknowns], np.linalg.solve(square, b), rtol=1e-10, atol=1e-12)
    c[unknowns] = rng.uniform(-1, 1, len(unknowns))
    y = block.solve_transposed(c)
    np.testing.assert_allclose(y, np.linalg.solve(square.T, c[unknowns]), rtol=1e-10, atol=1e-12)
    # the part for Cramer's rule has the whole determinant, and all else is divided by squares of lengths alone
    assert abs(block.det) == pytest.approx(abs(np.linalg.det(square)), rel=1e-10)
    assert all(step.per in (1, -1) or -1.0 / step.per > 1e-3 for step in block._steps)


@pytest.mark.parametrize("name", [*GROUPS, *LEGS, *TETRADS])
def test_reactions_take_no_power_but_that_of_what_moves_before_the_group(name):
    """With all that is before the group at rest, the loads take the power of the driver, and a group without one
    none."""
    rng = np.random.default_rng(7)
    moving = before(rng)
    at = SimpleNamespace(
        pins={pin: Motion(k.p) for pin, k in moving.pins.items()},
        links={link: Link(Motion(k.pin.p), k.u, 0.0, 0.0) for link, k in moving.links.items()},
    )
    group = placed(name, at, (0.4, 0.4, 0.3))
    loads = [(Vec2(*rng.uniform(-9, 9, 2)), rng.uniform(-9, 9)) for _ in group.links]
    power = sum(f.dot(k.pin.p1) + m * k.t1 for (f, m), k in zip(loads, group.links, strict=True))
    _, effort = group.reactions(loads)
    if name in ("crank", "crank on a link", "ram", "cylinder", "elbow"):
        assert effort == pytest.approx(-power, rel=1e-12) and abs(power) > 1e-3
    else:
        assert effort is None and power == 0.0
        assert all(k.t1 == 0.0 for k in group.links)


@pytest.mark.parametrize("angle", [0.0, 0.5 * math.pi, math.pi, 1.5 * math.pi])
def test_no_pivot_vanishes_outside_a_dead_position(angle):
    """Rods along x and y, where single coefficients are zero: a dyad at a right angle, and a slider-crank."""
    a, b = unit(angle), unit(angle + 0.5 * math.pi)
    at = SimpleNamespace(pins={"P": Motion(-a, Vec2(1.0, 2.0)), "Q": Motion(-b, Vec2(-3.0, 1.0))}, links={})
    group = Dyad("C", Bar("a", "P", 1.0), Bar("b", "Q", 1.0), math.copysign(1.0, a.cross(b))).solve(
        MATH, 0.0, at, ()
    )
    assert abs(group.margin) == pytest.approx(1.0)
    # C moves with the parts of the pins' speeds along the rods
    (pin,) = group.pins
    assert (pin.p1.dot(a), pin.p1.dot(b)) == pytest.approx((Vec2(1.0, 2.0).dot(a), Vec2(-3.0, 1.0).dot(b)))
    rail = Rail(None, ZERO, a)
    slider = RRP("C", Bar("a", "P", 1.0), Bar("b", "", None), rail, "C", 1.0).solve(MATH, 0.0, at, ())
    assert slider.margin == pytest.approx(1.0)
    assert slider.slides[0].s1 == pytest.approx(Vec2(1.0, 2.0).dot(a))


@pytest.mark.parametrize("along", [(1, 0), (0, 1), (-1, 0)])
def test_whole_numbers_are_numbers(along):
    """A rail whose components are integers gives what the same one in floats gives."""
    at = before(np.random.default_rng(4))

    def numbers(number):
        rail = Rail(None, Vec2(number(0), number(0)), Vec2(*map(number, along)))
        cross = Rail(None, Vec2(number(1), number(1)), Vec2(number(-along[1]), number(along[0])))
        for group in (
            RRP("C", Bar("a", "Q", 2.0), Bar("b", "", None), rail, "C", 1.0),
            PRP("C", Bar("a", "", None), Bar("b", "", None), rail, cross, ("C", "C")),
            RPP(Bar("a", "P", None), Bar("b", "", None), rail, Vec2(number(0), number(1)), ("P", "P")),
            Ram(Bar("a", "", None), rail, "G"),
        ):
            placed = group.solve(MATH, 0.3, at, ())
            forces, _ = placed.reactions([(Vec2(1.0, 2.0), 3.0)] * len(placed.links))
            yield from (x for k in placed.links for x in (k.pin.p2.x, k.pin.p2.y, k.t2))
            yield from (x for force in forces for x in (force.x, force.y))

    assert [*numbers(int)] == pytest.approx([*numbers(float)], rel=1e-14, abs=1e-15)


def test_a_plan_is_made_once_for_a_kind_of_group():
    _plan.cache_clear()
    for seed in range(5):
        for name in GROUPS:
            solved(name, np.random.default_rng(seed))
    assert _plan.cache_info().misses == len(GROUPS) - 1  # a crank has the same rows on a link that moves


def test_a_joint_is_its_rows():
    """A joint of another kind, by its rows alone: it holds the ratio of two angles, as gears do, and moves and loads
    the links as the ratio says."""

    class Ratio(Placed):
        def rows(self):
            return [{2: 1, UNKNOWNS + 2: -RATIO}]

        def right(self, rates, before):
            return [0.0]

        def force(self, multipliers):
            return next(multipliers), None

    rng, at = np.random.default_rng(2), before(np.random.default_rng(1))
    joints = [DrivenHinge(0, 1, STEADY, None, None, ZERO, at.pins["P"]), Hinge(1, base=at.pins["Q"]), Ratio()]
    poses = [(at.pins["P"], unit(0.0)), (at.pins["Q"], unit(1.0))]
    group = SolvedGroup(poses, joints)
    assert [k.t1 for k in group.links] == [1.0, pytest.approx(1.0 / RATIO)]
    loads = [(ZERO, m) for m in rng.uniform(-9, 9, 2)]
    forces, effort = group.reactions(loads)
    assert effort == pytest.approx(-(loads[0][1] + loads[1][1] / RATIO))
    assert forces[2] == pytest.approx(loads[1][1] / RATIO)


RATIO = -2.5
