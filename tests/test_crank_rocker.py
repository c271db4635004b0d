"""The crank-rocker tool, against brute force."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chainunit import GeometryError
from chainunit.machines.crank_rocker import CrankRocker


def brute_force(m: CrankRocker, n: int = 200_001):
    """Swing, worst pressure angle and K from the positions over a turn."""
    phi = np.linspace(0.0, 2.0 * math.pi, n)
    # O1 at the origin, C at (b, 0), crank clockwise, B below the line
    ax, ay = m.r * np.cos(-phi), m.r * np.sin(-phi)
    dx, dy = m.b - ax, -ay
    d2 = dx * dx + dy * dy
    along = 0.5 * (1.0 + (m.l**2 - m.h**2) / d2)
    across = -np.sqrt(m.l**2 / d2 - along**2)
    bx, by = ax + dx * along - dy * across, ay + dy * along + dx * across
    rocker = np.unwrap(np.arctan2(by, bx - m.b))
    high, low = int(np.argmax(rocker)), int(np.argmin(rocker))
    cosine = ((bx - ax) * (bx - m.b) + (by - ay) * by) / (m.l * m.h)
    forward = (phi[high] - phi[low]) % (2.0 * math.pi)
    return rocker[high] - rocker[low], np.max(np.abs(np.arcsin(cosine))), forward / (2.0 * math.pi - forward)


def random_mechanisms(count: int):
    rng = np.random.default_rng(3)
    results = []
    while len(results) < count:
        try:
            results.append(CrankRocker(*rng.uniform([0.05, 0.5, 0.3, 0.4], [0.6, 1.5, 2.0, 2.0])))
        except GeometryError:
            continue
    return results


@pytest.mark.parametrize("m", random_mechanisms(12), ids=str)
def test_against_brute_force(m):
    swing, worst, K = brute_force(m)
    assert m.swing == pytest.approx(swing, abs=1e-7)
    assert m.worst_pressure_angle == pytest.approx(worst, abs=1e-7)
    assert m.K == pytest.approx(K, rel=1e-3)


@pytest.mark.parametrize("swing", [5.0, 17.25, 60.0, 120.0])
@pytest.mark.parametrize("lam", [0.2, 0.667, 1.0])
def test_design_for_a_swing_has_it_and_k_of_one(swing, lam):
    m = CrankRocker.for_swing(math.radians(swing), lam)
    assert math.degrees(m.swing) == pytest.approx(swing, rel=1e-9)
    assert m.K == pytest.approx(1.0, abs=1e-12)
    s, c = math.sin(math.radians(swing) / 2), math.cos(math.radians(swing) / 2)
    assert math.sin(m.worst_pressure_angle) == pytest.approx(s * math.sqrt(1.0 + (lam * c) ** 2), rel=1e-9)
    assert m.pressure_angles[0] == pytest.approx(-m.pressure_angles[1])


def test_no_other_frame_pushes_better_at_the_same_swing_and_k_of_one():
    """The least pressure angle falls with lam towards half the swing."""
    wanted = math.radians(60.0)
    angles = [CrankRocker.for_swing(wanted, lam).worst_pressure_angle for lam in (1.0, 0.5, 0.1, 0.01)]
    assert angles == sorted(angles, reverse=True)
    assert angles[-1] == pytest.approx(wanted / 2, rel=1e-3)


@pytest.mark.parametrize(
    ("lengths", "message"),
    [
        ((0.25, 1.0, 2.0, 1.2), r"r = 0\.25 m: the crank cannot turn .* must be > 0 and < 0\.2 m"),
        ((0.7, 1.0, 0.667, 1.0), r"must be > 0 and < 0\.667 m"),
        ((0.1, 1.0, 0.5, 2.0), r"no value fits"),
        ((-0.1, 1.0, 0.5, 1.0), r"r = -0\.1 m: must be finite, > 0 m"),
        ((0.1, math.nan, 0.5, 1.0), r"l = nan m"),
    ],
)
def test_refusals(lengths, message):
    with pytest.raises(GeometryError, match=message):
        CrankRocker(*lengths)
    with pytest.raises(GeometryError, match="swing = 200 deg"):
        CrankRocker.for_swing(math.radians(200.0), 0.5)
    with pytest.raises(GeometryError, match=r"lam = 3: for a swing of 90 deg"):
        CrankRocker.for_swing(math.radians(90.0), 3.0)
