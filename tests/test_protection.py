"""Protection and mean loads against what can be worked out by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chainunit.studies.protection import mean_load, relay_trip, stall


def test_a_relay_of_class_10_trips_when_its_class_says():
    time = np.linspace(0.0, 12.0, 1201)
    assert relay_trip(time, np.full(1201, 7.2 * 5.0), 5.0, 0.0, 36.0) == pytest.approx(10.0, abs=0.011)
    # 1.05 times the setting never trips it, 1.2 times does
    assert relay_trip(time, np.full(1201, 5.25), 5.0, 0.0, 5.25) is None
    late = relay_trip(time, np.full(1201, 6.0), 5.0, 0.0, 6.0)
    assert late is not None and 12.0 < late < 7200.0
    # what has run before leaves it warm: sooner
    warm = relay_trip(time, np.full(1201, 36.0), 5.0, 5.0, 36.0)
    assert warm is not None and warm < 5.0


def test_a_stall_is_the_time_from_which_it_stands():
    time = np.linspace(0.0, 10.0, 1001)
    speed = np.where(time < 4.0, 3.0, 0.1)
    assert stall(time, speed, 3.0) == pytest.approx(4.0)
    assert stall(time, np.full(1001, 3.0), 3.0) is None
    assert stall(time, np.where(time < 9.5, 3.0, 0.0), 3.0) is None


def test_mean_load_by_hand():
    turned = np.linspace(0.0, 2.0 * math.pi, 100_001)
    assert mean_load(np.full(100_001, 7.0), turned) == pytest.approx(7.0)
    # F = F0 |sin a|: the mean of |sin|^3 is 4/(3 pi)
    got = mean_load(100.0 * np.abs(np.sin(turned)), turned)
    assert got == pytest.approx(100.0 * (4.0 / (3.0 * math.pi)) ** (1.0 / 3.0), rel=1e-6)
    # half the way at 1 N, half at 2 N
    force, way = np.array([1.0, 1.0, 2.0, 2.0]), np.array([0.0, 1.0, 1.0, 2.0])
    assert mean_load(force, way) == pytest.approx((0.5 * (1.0 + 8.0)) ** (1.0 / 3.0))
    assert mean_load(np.ones(3), np.zeros(3)) == 0.0
