"""The extremes of a motion: against closed forms and a fine search, in every engine."""

from __future__ import annotations

import itertools
import math

import casadi
import numpy as np
import pytest

from chainunit.core.engines import MATH, casadi_, numpy_
from chainunit.mechanism.extremes import extreme

TURN = [2.0 * math.pi * k / 48 for k in range(48)]


def guided(r, l, e):
    """The way of a slider on a line at the distance `e` from the bearing of its crank, with its derivatives."""

    def course(xp):
        def at(q):
            s, c = xp.sin(q), xp.cos(q)
            across = r * s - e
            root = xp.sqrt(l * l - across * across)
            first = -across * r * c / root
            second = (-((r * c) ** 2) + across * r * s - first * first) / root
            return r * c + root, -r * s + first, -r * c + second

        return at

    return course


@pytest.mark.parametrize("r", [0.02, 0.08, 0.13])
@pytest.mark.parametrize("engine", [MATH, numpy_()])
def test_the_dead_centres_of_a_slider_crank(engine, r):
    """They lie where crank and rod are in one line: the ways there are sqrt((l +- r)^2 - e^2)."""
    l = 0.36
    for sense, e in itertools.product((1.0, -1.0), np.linspace(-0.11, 0.11, 23)):
        place, value = extreme(engine, guided(r, l, e)(engine), TURN, sense)
        assert float(value) == pytest.approx(math.sqrt((l + sense * r) ** 2 - e * e), rel=1e-14)
        assert math.sin(float(place) - math.asin(e / (l + sense * r))) == pytest.approx(0.0, abs=1e-9)


def test_symbols_and_arrays_give_the_same_extremes():
    xp, r = casadi_(), casadi.SX.sym("r")
    lengths = np.array([0.05, 0.08, 0.11])
    value = casadi.Function("f", [r], [extreme(xp, guided(r, 0.36, 0.025)(xp), TURN, -1.0)[1]])
    _, several = extreme(numpy_(), guided(lengths, 0.36, 0.025)(numpy_()), TURN, -1.0)
    wanted = np.sqrt((0.36 - lengths) ** 2 - 0.025**2)
    assert [float(value(each)) for each in lengths] == pytest.approx(wanted, rel=1e-14)
    assert several == pytest.approx(wanted, rel=1e-14)


def test_a_range_with_ends_has_its_extremes_there_or_between():
    places = list(np.linspace(0.2, 1.2, 49))
    cube = lambda q: (q**3, 3.0 * q**2, 6.0 * q)  # noqa: E731
    bow = lambda q: ((q - 0.7123) ** 2, 2.0 * (q - 0.7123), 2.0)  # noqa: E731
    assert extreme(MATH, cube, places, 1.0, ends=True) == pytest.approx((1.2, 1.2**3), rel=1e-15)
    assert extreme(MATH, cube, places, -1.0, ends=True) == pytest.approx((0.2, 0.2**3), rel=1e-15)
    assert extreme(MATH, bow, places, -1.0, ends=True) == pytest.approx((0.7123, 0.0), abs=1e-15)
    assert extreme(MATH, bow, places, 1.0, ends=True)[0] == pytest.approx(0.2)


def test_of_two_peaks_the_higher_one_counts():
    """They differ by less than the places miss of a peak."""
    a = 2.0 * math.pi / 48 * 0.5

    def course(q):
        # peaks near a and a + pi; at the place nearest to the higher one the lower one seems higher
        return (
            math.cos(2.0 * q) + 1e-3 * math.cos(q - a), -2.0 * math.sin(2.0 * q) - 1e-3 * math.sin(q - a),
            -4.0 * math.cos(2.0 * q) - 1e-3 * math.cos(q - a),
        )  # fmt: skip

    fine = max(course(q)[0] for q in np.linspace(0.0, 2.0 * math.pi, 200001))
    assert extreme(MATH, course, TURN, 1.0)[1] == pytest.approx(fine, abs=1e-8)


def test_flat_extremes_and_constants_have_a_value():
    dwell = lambda q: (  # noqa: E731
        -((1.0 - math.cos(q - 1.0)) ** 2),
        -2.0 * (1.0 - math.cos(q - 1.0)) * math.sin(q - 1.0),
        -2.0 * (math.sin(q - 1.0) ** 2 + (1.0 - math.cos(q - 1.0)) * math.cos(q - 1.0)),
    )
    assert extreme(MATH, dwell, TURN, 1.0)[1] == pytest.approx(0.0, abs=1e-8)
    assert extreme(MATH, lambda q: (0.3, 0.0, 0.0), TURN, -1.0)[1] == 0.3
