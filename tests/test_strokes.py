"""Strokes, swings, dead centres and time ratios of linkages, and extremes between the sampled places."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from chainunit.machines.linkages.file import read_linkage
from chainunit.machines.machine import Machine
from chainunit.study.linkage_turn import linkage_findings
from chainunit.study.peaks import largest, roots

LINKAGES = Path(__file__).parents[1] / "examples" / "linkages"


def findings(name, speed=2.0 * math.pi):
    return linkage_findings(Machine(read_linkage(LINKAGES / f"{name}.toml")), speed)


@pytest.fixture(scope="module")
def shaper():
    return findings("crank_shaper")


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
