"""The cardan shaft against points from 3-D geometry and eigenproblems, limit cases, and energy."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import eigh

from chainunit import InputError
from chainunit.core.engines import MATH, numpy_
from chainunit.drives import cardan, shafts
from chainunit.drives.cardan import Cardan, Twist

POINTS = json.loads((Path(__file__).parent / "data" / "cardan.json").read_text())["points"]


def case(point):
    values = dict(point["inputs"])
    phi2 = values.pop("phi2")
    return Cardan(**values), phi2


@pytest.mark.parametrize("point", POINTS, ids=lambda p: str(p["id"]))
def test_reference_points(point):
    p, phi2 = case(point)
    gamma2, i, _ = cardan.two_joints(MATH, p, phi2)
    assert i == pytest.approx(point["i23"], rel=1e-12)
    # an angle of a yoke is the same after half a turn
    assert math.sin(gamma2 - point["gamma2"]) == pytest.approx(0.0, abs=1e-12)
    printout = cardan.ratio_of_paper(MATH, p, point["gamma1"], point["gamma2"])
    assert printout == pytest.approx(point["i23_printed_formula"], rel=1e-12)
    assert cardan.frozen_frequency(MATH, p, i) == pytest.approx(point["k_eig"], rel=1e-12)


def frame(p):
    """Directions of the shafts, and bases in which the angles of their pins are counted (tests/data/cardan.json)."""
    s0 = np.array([1.0, 0.0, 0.0])
    s2 = np.array([math.cos(p.alpha1), math.sin(p.alpha1), 0.0])
    b = p.beta_planes
    s3 = np.array([math.cos(p.alpha2), math.sin(p.alpha2) * math.cos(b), math.sin(p.alpha2) * math.sin(b)])
    n, m = np.cross(s2, s0), np.cross(s0, s3)
    n, m = n / np.linalg.norm(n), m / np.linalg.norm(m)

    def basis(normal, shaft):
        u = np.cross(normal, shaft)
        return u, np.cross(shaft, u)

    return s0, basis(n, s2), basis(m, s3)


def pin(basis, angle):
    return math.cos(angle) * basis[0] + math.sin(angle) * basis[1]


def test_pins_of_a_cross_stay_perpendicular_in_space():
    """On random shaft lines and angles, from three-dimensional vectors, without any formula of a ratio."""
    rng = np.random.default_rng(2)
    for _ in range(200):
        p = Cardan(
            alpha1=rng.uniform(0.05, 1.4),
            alpha2=rng.uniform(0.05, 1.4),
            beta_planes=rng.uniform(-3.0, 3.0),
            delta_yokes=rng.uniform(-3.0, 3.0),
        )
        s0, on2, on3 = frame(p)
        phi2 = rng.uniform(-20.0, 20.0)
        phi3, _, _ = cardan.two_joints(MATH, p, phi2)
        first = np.cross(s0, pin(on2, phi2))  # the pin on shaft 0: perpendicular to it and to that of shaft 2
        c, s = math.cos(p.delta_yokes), math.sin(p.delta_yokes)
        second = c * first + s * np.cross(s0, first)
        assert abs(pin(on3, phi3) @ second) < 1e-12 * np.linalg.norm(second)


def test_the_ratio_is_the_derivative_and_its_mean_is_one():
    xp = numpy_()
    p = Cardan(alpha1=0.9, alpha2=0.4, beta_planes=0.7, delta_yokes=0.3)
    turn = np.linspace(0.0, 2.0 * math.pi, 2001)
    angle, i, slope = cardan.two_joints(xp, p, turn)
    assert angle[-1] - angle[0] == pytest.approx(2.0 * math.pi, rel=1e-13)
    # the mean over angle, by the trapezium rule of a periodic function
    assert np.mean(i[:-1]) == pytest.approx(1.0, rel=1e-12)
    shifted = turn + 1e-30j

    def complex_angle(bend, x):
        return np.arctan(np.tan(x) / np.cos(bend))

    middle = complex_angle(p.alpha1, shifted)
    entering = middle + p.delta_yokes - p.beta_planes - 0.5 * math.pi
    steps = complex_angle(p.alpha2, entering).imag / 1e-30
    np.testing.assert_allclose(i, steps, rtol=1e-9)
    np.testing.assert_allclose(np.gradient(i, turn)[1:-1], slope[1:-1], atol=2e-4)


def test_equal_bends_in_one_plane_run_evenly():
    p = Cardan(alpha1=0.5, alpha2=0.5)
    _, i, slope = cardan.two_joints(numpy_(), p, np.linspace(0.0, 7.0, 50))
    np.testing.assert_allclose(i, 1.0, rtol=1e-14)
    np.testing.assert_allclose(slope, 0.0, atol=1e-13)


def test_frequency_is_the_eigenvalue_of_two_masses():
    rng = np.random.default_rng(3)
    for _ in range(200):
        p = Cardan(**{n: 10.0 ** rng.uniform(-2.0, 4.0) for n in ("J1", "J4", "c2", "c3")})
        i = 10.0 ** rng.uniform(-1.0, 1.0)
        # shaft 3 and its inertia seen from shaft 2; the joint between carries no mass
        c = 1.0 / (1.0 / p.c2 + 1.0 / (i * i * p.c3))
        k2 = eigh([[c, -c], [-c, c]], np.diag([p.J1, i * i * p.J4]), eigvals_only=True)[1]
        assert cardan.frozen_frequency(MATH, p, i) ** 2 == pytest.approx(k2, rel=1e-12)


def test_the_papers_special_case():
    i = 1.0 / 3.0
    p = Cardan(c2=600.0, c3=600.0 / i, J1=2.0, J4=2.0 / i**2)
    assert cardan.frozen_frequency(MATH, p, i) ** 2 == pytest.approx(600.0 / (2.0 * 2.0), rel=1e-14)


@pytest.mark.parametrize("J1", [0.4, 80.0])
def test_the_range_has_a_condition(J1):
    """docs/papers.md, paper 002, item 3: c3/J4 <= k^2 <= c2/J1 only where J1/J4 <= c2/c3."""
    p = Cardan(J1=J1, J4=40.0, c2=8000.0, c3=8000.0, alpha1=1.2, alpha2=0.2)
    band = cardan.frequency_band(p)
    assert band.rises == (J1 < 40.0)
    low, high = sorted((band.at_zero, band.at_infinity))
    assert (low, high) == (
        (band.at_zero, band.at_infinity) if band.rises else (band.at_infinity, band.at_zero)
    )
    assert low < band.least < band.largest < high
    ends = [cardan.frozen_frequency(MATH, p, i) for i in (1e-9, 1e9)]
    assert ends == pytest.approx([band.at_zero, band.at_infinity], rel=1e-9)


def test_a_bend_near_a_right_angle_makes_it_low_or_high():
    """Item 4: 89/10 deg at gamma = 60 deg gives 3.94 rad/s, 10/89 deg 99.97; at gamma = 0 the other way round."""
    results = {}
    for a1, a2 in ((89.0, 10.0), (10.0, 89.0)):
        for gamma in (0.0, 60.0):
            p = Cardan(alpha1=math.radians(a1), alpha2=math.radians(a2), J1=1.0, J4=1000.0, c2=1e4, c3=1e4)
            g = math.radians(gamma)
            i = cardan.ratio_of_paper(MATH, p, g, g)
            results[a1, gamma] = cardan.frozen_frequency(MATH, p, i)
    assert results[89.0, 60.0] < 5.0 and results[10.0, 60.0] > 99.9
    assert results[89.0, 0.0] > 99.9 and results[10.0, 0.0] < 5.0


def test_what_raises_the_frequency():
    """docs/papers.md, item 5: with J4/J1 = 1000 and equal shafts it is J1 and the shafts, not J4."""
    p = Cardan(J1=1.0, J4=1000.0, c2=1e4, c3=1e4)
    by = cardan.sensitivity(p)
    # k is homogeneous: of degree 1/2 in the stiffnesses and -1/2 in the inertias
    assert by["c2"] + by["c3"] == pytest.approx(0.5, rel=1e-12)
    assert by["J1"] + by["J4"] == pytest.approx(-0.5, rel=1e-12)
    assert abs(by["J4"]) < 0.001 and by["J1"] < -0.49

    def gain(**values):
        import dataclasses

        moved = dataclasses.replace(p, **values)
        return cardan.frozen_frequency(MATH, moved, 1.0) / cardan.frozen_frequency(MATH, p, 1.0) - 1.0

    assert gain(J4=500.0) == pytest.approx(0.0005, abs=5e-5)
    assert gain(c3=2e4) == pytest.approx(0.155, abs=5e-4)
    assert gain(J1=0.5) == pytest.approx(0.41, abs=5e-3)


def free(p, start, stop, rtol, **options):
    """The undamped free line: states phi1, w1, phi4, w4."""

    def rates(_, x):
        line = Twist(MATH, p, *x)
        return [x[1], -line.tau1 / p.J1, x[3], line.tau4 / p.J4]

    return solve_ivp(rates, (0.0, stop), start, method="DOP853", rtol=rtol, atol=rtol * 1e-3, **options)


@pytest.mark.parametrize("point", POINTS, ids=lambda p: str(p["id"]))
def test_free_vibration_with_the_true_joint(point):
    """The period of small vibration by time integration, as in the reference (amplitude 1e-4)."""
    p, phi2 = case(point)
    phi3, i, _ = cardan.two_joints(MATH, p, phi2)
    k = point["k_eig"]
    amplitude = 1e-4
    start = [phi2 + amplitude, 0.0, phi3 - amplitude * p.J1 / (p.J4 * i), 0.0]
    turns = 20

    def passes(_, x):
        return x[1]

    passes.direction = -1.0
    solution = free(p, start, (turns + 0.5) * 2.0 * math.pi / k, 1e-10, events=passes)
    times = solution.t_events[0]
    # the start is such a pass
    times = times[times > 0.5 * math.pi / k]
    period = (times[-1] - times[0]) / (len(times) - 1)
    assert 2.0 * math.pi / period == pytest.approx(point["k_time_domain_true_joint_amp1e4"], rel=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("speed", [pytest.param(0.0, marks=pytest.mark.slow), 30.0])
def test_energy_over_a_thousand_periods(speed):
    """Undamped, with joints of 30 degrees, at rest and rotating."""
    bend = math.radians(30.0)
    p = Cardan(alpha1=bend, alpha2=bend, beta_planes=0.4, delta_yokes=0.2)
    phi3, i, _ = cardan.two_joints(MATH, p, 0.0)
    k = cardan.frozen_frequency(MATH, p, i)
    start = [2e-3, speed, phi3, speed * i]
    solution = free(p, start, 1000 * 2.0 * math.pi / k, 1e-11)
    assert solution.success
    phi1, w1, phi4, w4 = solution.y[:, :: max(1, solution.y.shape[1] // 2000)]
    springs = Twist(numpy_(), p, phi1, w1, phi4, w4).energy
    kinetic = 0.5 * (p.J1 * w1**2 + p.J4 * w4**2)
    energy = kinetic + springs
    assert np.ptp(energy) < 1e-8 * energy[0]
    assert np.ptp(springs) > 1e-3 * np.max(springs)  # it does vibrate
    # angular momentum is not kept where the ratio varies: the joints' supports take it up
    if speed:
        momentum = p.J1 * w1 + p.J4 * w4
        assert np.ptp(momentum) > 1e-5 * abs(momentum[0])


@pytest.mark.parametrize(
    ("values", "named"),
    [
        ({"alpha1": math.pi / 2}, "alpha1 = 1.5708 rad (90 deg): a Hooke joint turns only below 90 deg"),
        ({"alpha2": 2.0}, "alpha2 = 2 rad"),
        ({"c2": 0.0}, "c2 = 0 N m/rad: must be > 0 N m/rad"),
        ({"c3": -5.0}, "c3 = -5 N m/rad: must be > 0 N m/rad"),
        ({"J1": 0.0}, "J1 = 0 kg m2: must be > 0 kg m2"),
        ({"J4": math.nan}, "J4 = nan"),
    ],
)
def test_bad_cases_are_refused_in_one_line(values, named):
    with pytest.raises(InputError) as refusal:
        cardan.check(Cardan(**values))
    assert named in str(refusal.value) and "\n" not in str(refusal.value)


def test_torsion_constants():
    assert shafts.hollow(0.08) == pytest.approx(math.pi * 0.08**4 / 32.0)
    assert shafts.hollow(0.08, 0.06) == pytest.approx(shafts.hollow(0.08) - shafts.hollow(0.06))
    # Roark: 0.1406 a^4 for a square, 0.229 b^3 a at 2:1, b^3 a/3 for a long strip
    assert shafts.rectangle(0.05, 0.05) == pytest.approx(0.140577 * 0.05**4, rel=1e-5)
    assert shafts.rectangle(0.04, 0.08) == pytest.approx(0.228682 * 0.08 * 0.04**3, rel=1e-5)
    assert shafts.rectangle(10.0, 0.01) == pytest.approx(10.0 * 0.01**3 / 3.0, rel=1e-3)
    # a thin round tube and a thin square box of the same middle line differ as Bredt says
    assert shafts.box(0.1, 0.1, 1e-4) == pytest.approx(1e-4 * (0.1 - 1e-4) ** 3, rel=1e-12)
    for wrong in (
        lambda: shafts.hollow(0.05, 0.05),
        lambda: shafts.rectangle(0.0, 1.0),
        lambda: shafts.box(0.1, 0.1, 0.05),
    ):
        with pytest.raises(InputError):
            wrong()
    assert shafts.stiffness(shafts.hollow(0.05), 0.5) == pytest.approx(8e10 * math.pi * 0.05**4 / 32 / 0.5)
