"""Strokes, swings, dead centres and time ratios of linkages, and extremes between the sampled places."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from chainunit.machines.linkages.file import read_linkage
from chainunit.machines.machine import Machine
from chainunit.mechanism.sampled_quantities import largest, means, roots
from chainunit.study.linkage_turn import linkage_findings

LINKAGES = Path(__file__).parents[1] / "examples" / "linkages"


def findings(name, speed=2.0 * math.pi):
    return linkage_findings(Machine(read_linkage(LINKAGES / f"{name}.toml")), speed)


@pytest.fixture(scope="module")
def shaper():
    return findings("crank_shaper")


@pytest.mark.second
def test_the_lever_of_a_shaper_swings_between_its_tangents(shaper):
    """The slot touches the crank circle at both ends, and the crank takes 180 deg + swing for the one way. Here the
    slot passes the bearing of the lever at 15 mm."""
    r, h, aside = 0.12, math.hypot(0.01, 0.35), 0.015
    swing = math.asin((r + aside) / h) + math.asin((r - aside) / h)
    lever = shaper.swings["lever"]
    assert lever.range == pytest.approx(swing, rel=1e-10)
    assert lever.time_ratio == pytest.approx((math.pi + swing) / (math.pi - swing), rel=1e-8)
    assert lever.forth == pytest.approx(math.pi + swing, rel=1e-9)
    assert sorted([lever.least_at, lever.largest_at]) == pytest.approx(shaper.dead_centres["lever"], abs=1e-9)
    # the ram turns back with the lever, and does not turn itself
    assert shaper.dead_centres["guide"] == pytest.approx(shaper.dead_centres["lever"], abs=1e-9)
    assert "ram" not in shaper.swings and "gear" not in shaper.swings
    # the connecting link swings twice in a turn
    assert len(shaper.dead_centres["link"]) == 4


def test_a_scotch_yoke_has_its_dead_centres_at_the_ends_of_its_diameter():
    """One of them is the place at which the turn begins."""
    yoke = findings("scotch_yoke_pump")
    stroke = yoke.strokes["guide"]
    assert stroke.range == pytest.approx(0.12, rel=1e-12) and stroke.time_ratio == pytest.approx(1.0)
    assert yoke.dead_centres["guide"] == pytest.approx([0.0, math.pi], abs=1e-9)
    # an angle of rounding is none
    assert stroke.largest_at == 0.0


def test_a_driver_that_slides_has_ends_and_no_time_ratio():
    lift = findings("cylinder_lift", 0.1)
    lever, link = lift.swings["lever"], lift.swings["link"]
    assert (lever.least_at, lever.largest_at) == lift.machine.model.span and lever.time_ratio is None
    # the link turns back on the way
    (back,) = lift.dead_centres["link"]
    assert link.least_at == back and lift.machine.model.span[0] < back < lift.machine.model.span[1]


def test_the_largest_value_lies_between_the_places():
    """Of a smooth quantity, of one with a corner, and of one with a jump; the best of two peaks of nearly one size is
    not that of the best sample."""
    q = np.linspace(0.0, 2.0 * math.pi, 37)
    step = q[1]

    def values(x):
        narrow = 1.001 * np.exp(-(((x - 5.5 * step) / (0.4 * step)) ** 2))
        wide = np.exp(-(((x - 20.0 * step) / (2.0 * step)) ** 2))
        return np.array([np.cos(x - 1.234), -np.abs(x - 2.345), np.where(x < 3.456, x, 0.0), narrow + wide])

    places, sizes = largest(values, q, around=True)
    assert places == pytest.approx([1.234, 2.345, 3.456, 5.5 * step], abs=1e-7)
    assert sizes == pytest.approx([1.0, 0.0, 3.456, 1.001], abs=1e-7)
    # a turn has no ends, a way has
    place, size = largest(lambda x: np.array([np.cos(x - 6.2)]), q, around=True)
    assert abs(math.remainder(place[0] - 6.2, 2.0 * math.pi)) < 1e-6 and size[0] > 1.0 - 1e-12
    place, size = largest(lambda x: np.array([x]), q, around=False)
    assert place[0] == size[0] == q[-1]


@pytest.mark.parametrize("shift", [0.0, 1e-17, -1e-17, 0.3])
def test_roots_also_at_the_begin_of_a_turn(shift):
    q = np.linspace(0.0, 2.0 * math.pi, 361)
    (found,) = roots(lambda x: np.array([np.sin(x - shift)]), q, around=True)
    off = sorted(abs(math.remainder(x - shift, math.pi)) for x in found)
    assert len(found) == 2 and off[-1] < 1e-12
    (none,) = roots(lambda x: np.array([np.cos(x) ** 2]), q, around=True)
    assert not len(none)


@pytest.mark.parametrize("noise", [0.0, 1e-17])
def test_a_part_that_rests_across_the_begin_of_a_turn_turns_back_once_at_each_end(noise):
    """A dwell, whose speed is zero or rounding over forty degrees about the begin of the turn; the part turns back
    in it if it comes and goes on the same side, and not if it goes on."""
    q = np.linspace(0.0, 2.0 * math.pi, 361)

    def dwell(x, back):
        away = np.maximum(
            np.abs(np.remainder(x + math.pi, 2.0 * math.pi) - math.pi) - math.radians(20.0), 0.0
        )
        side = np.sign(np.sin(x)) if back else np.cos(0.5 * np.remainder(x, 2.0 * math.pi)) ** 2
        return away * side + noise * np.cos(1000.0 * x)

    (found,) = roots(lambda x: np.array([dwell(x, True)]), q, around=True)
    assert sorted(found) == pytest.approx([math.radians(20.0), math.pi], abs=1e-6)
    (none, nothing) = roots(lambda x: np.array([dwell(x, False), 0.0 * x]), q, around=True)
    assert not len(none) and not len(nothing)
    ((end,),) = roots(
        lambda x: np.array([np.maximum(x - 1.0, 0.0) - np.maximum(0.5 - x, 0.0)]), q, around=False
    )
    assert end == pytest.approx(1.0, abs=1e-6)


def test_means_are_those_of_sharp_loads():
    """Of a bell of a degree, of a corner, and of a polynomial, against closed forms."""

    def values(x):
        return np.array([np.exp(-(((x - 2.0) / 0.01) ** 2)), np.abs(x - 1.0), x**5 - x, 0.0 * x])

    found, sizes = means(values, 0.0, 3.0)
    bell, corner, polynomial = math.sqrt(math.pi) * 0.01, 2.5, 3.0**6 / 6.0 - 4.5
    assert found == pytest.approx([bell / 3.0, corner / 3.0, polynomial / 3.0, 0.0], rel=1e-9)
    # of the size, to the accuracy with which the parts of the way catch it
    assert sizes == pytest.approx([bell / 3.0, corner / 3.0, (polynomial + 2.0 / 3.0) / 3.0, 0.0], rel=0.05)


def test_a_mean_of_rounding_alone_ends():
    """A torque that the loads balance is noise all the way: no part of it agrees with its halves, and the search must
    not halve on. A load beside it keeps its accuracy."""
    places = 0

    def values(x):
        nonlocal places
        places += x.size
        bell = np.exp(-(((x - 2.0) / 0.01) ** 2))
        return np.array([np.cos(x) ** 2 + np.sin(x) ** 2 - 1.0, bell])

    (noise, found), (size, _) = means(values, 0.0, 3.0)
    assert abs(noise) <= size < 1e-15 and places < 500_000
    assert found == pytest.approx(math.sqrt(math.pi) * 0.01 / 3.0, rel=1e-9)


@pytest.mark.parametrize("middle", [1.0, 1.03, 2.7183])
def test_a_mean_has_a_load_of_a_third_of_a_degree(middle):
    width = math.radians(0.33)
    (found,), _ = means(lambda x: np.array([np.abs(x - middle) < 0.5 * width]) * 1e3, 0.0, 2.0 * math.pi)
    assert found == pytest.approx(1e3 * width / (2.0 * math.pi), rel=1e-3)


def test_a_peak_at_the_begin_of_a_turn_hides_no_higher_one():
    """The first and the last sample are one place, which takes one place among the candidates alone."""
    q = np.linspace(0.0, 2.0 * math.pi, 361)

    def values(x):
        high = 1.0002 * np.exp(-(((x - 2.0 - 0.5 * q[1]) / q[1]) ** 2))
        return np.array([np.cos(x) ** 200 * (np.cos(x) > 0.0) + high])

    places, sizes = largest(values, q, around=True)
    assert places[0] == pytest.approx(2.0 + 0.5 * q[1], abs=1e-6) and sizes[0] == pytest.approx(
        1.0002, abs=1e-9
    )


def test_the_mean_power_of_a_press_is_that_of_its_work():
    """The press works over a few degrees of the crank: a place each degree misses 0.25 % of the work."""
    f = findings("slider_crank_press")
    q = (np.arange(36000) + 0.5) * (2.0 * math.pi / 36000)
    out = f.machine.outputs(q * f.machine.ratio, f.speed * f.machine.ratio)
    lost = np.mean(out.dissipated_power)
    assert f.turn.power_mean == pytest.approx(lost, rel=1e-6) and lost > 100.0
    assert f.turn.torque_rms == pytest.approx(np.sqrt(np.mean((out.tau * f.machine.ratio) ** 2)), rel=1e-6)
    for name, joint in f.joints.items():
        force = getattr(out, f.description.variable("joint", name))
        assert joint.rms == pytest.approx(np.sqrt(np.mean(force.fx**2 + force.fy**2)), rel=1e-6), name
