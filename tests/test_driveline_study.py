"""The driveline in rotation, against closed forms, limit cases, another integrator; its file, words and command."""

from __future__ import annotations

import dataclasses
import importlib.util
import json
import math
import sys

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from chainunit import InputError, cli
from chainunit.drives import shafts, torsion
from chainunit.drives.cardan import Cardan, Twist, frozen_frequency, two_joints
from chainunit.drives.torsion import rigid, settling_time, simulate, steady, with_damping_ratio
from chainunit.engines import MATH
from chainunit.report.driveline import PICTURES
from chainunit.study import driveline, torsion_answers
from chainunit.study.driveline import example, load, parse, run_driveline
from chainunit.text import number


def line(damping=0.015, **given):
    p = Cardan(**{"J1": 0.4, "J4": 40.0, "c2": 8000.0, "c3": 8000.0, **given})
    return with_damping_ratio(p, damping)


def frequency(p):
    return float(frozen_frequency(MATH, p, 1.0))


def bent(first, second, **given):
    return line(alpha1=math.radians(first), alpha2=math.radians(second), **given)


def test_even_running_has_the_multipliers_of_two_damped_masses():
    p = line(alpha1=0.3, alpha2=0.3, damping=0.04, c3=2e4)
    k = frequency(p)
    c = 1.0 / (1.0 / p.c2 + 1.0 / p.c3)
    d = c * p.d2 / p.c2  # both shafts alike damped: they move as one
    A = np.zeros((4, 4))
    A[0, 1] = A[2, 3] = 1.0
    A[1] = np.array([-c, -d, c, d]) / p.J1
    A[3] = np.array([c, d, -c, -d]) / p.J4
    speed = np.array([0.15, 0.43, 0.8, 1.7]) * k
    found = steady(p, speed, 50.0)
    assert np.all(found.exists)
    np.testing.assert_allclose(found.growth, -0.04 * k, rtol=1e-3)
    np.testing.assert_allclose(found.free_growth, 0.0, atol=1e-5)
    np.testing.assert_allclose(found.frequency, k * math.sqrt(1.0 - 0.04**2), rtol=2e-4)
    scale = np.array([1.0, k, 1.0, k])
    for j, w in enumerate(speed):
        want = expm(A * math.pi / w) * scale / scale[:, None]
        np.testing.assert_allclose(found.monodromy[:, :, j] * scale / scale[:, None], want, atol=1e-4)
    # nothing shakes it: it carries the load
    for torque in (found.largest2, found.least2, found.largest3, found.least3):
        np.testing.assert_allclose(torque, 50.0, rtol=1e-8)


def rates(p, drive, load):
    def f(_, x):
        twist = Twist(MATH, p, *x)
        return [x[1], (drive - twist.tau1) / p.J1, x[3], (twist.tau4 - load) / p.J4]

    return f


def integrate(p, drive, load, start, duration, **options):
    return solve_ivp(
        rates(p, drive, load), (0.0, duration), start, method="DOP853", rtol=1e-11, atol=1e-12, **options
    )


CASES = {
    "unstable, at k": (bent(35.0, 8.0), 1.0),
    "stable, beside k": (bent(35.0, 8.0), 0.9),
    "stable, below order 2": (bent(25.0, 10.0, damping=0.03), 0.42),
}


@pytest.mark.parametrize("name", CASES)
def test_steady_motion_and_multipliers_by_another_integrator(name):
    """The start that shooting found closes over half a turn, and a small torsional disturbance of it grows or dies as
    the multipliers say, in the nonlinear equations."""
    p, share = CASES[name]
    k = frequency(p)
    speed, half_turns = share * k, 12
    found = steady(p, speed, 100.0)
    assert found.exists[0]
    assert found.unstable[0] == name.startswith("unstable")
    period = math.pi / speed
    start, drive = found.start[:, 0], float(found.drive[0])
    scale = np.array([1.0, k, 1.0, k])
    once = integrate(p, drive, 100.0, start, period).y[:, -1]
    np.testing.assert_allclose((once - start - torsion.HALF_TURN) / scale, 0.0, atol=5e-6)
    of, vectors = np.linalg.eig(found.monodromy[:, :, 0])
    # the two that belong to the mean speed and to the shift along the orbit lie at 1
    torsional = np.argmax(np.abs(of - 1.0))
    mu, v = of[torsional], vectors[:, torsional]
    size = 1e-6 / np.max(np.abs(v / scale))
    ends = [
        integrate(p, drive, 100.0, start + sign * size * v.real, half_turns * period).y[:, -1]
        for sign in (1.0, -1.0)
    ]
    moved = 0.5 * (ends[0] - ends[1]) / scale
    want = size * (mu**half_turns * v).real / scale
    np.testing.assert_allclose(moved, want, atol=0.01 * size * np.max(np.abs(mu**half_turns * v / scale)))
    rate = math.log(abs(mu)) / period
    assert (rate > 0.0) == found.unstable[0]
    # with J4 a hundred times J1 it matters little what holds the common speed
    assert found.growth[0] == pytest.approx(rate, abs=0.02 * abs(rate) + 1e-3 * k * 0.015)


def test_what_holds_the_common_speed():
    """The held multipliers against the nonlinear equations with a stiff hold of the common speed; here, above order 2
    with a light J4, a constant torque would lose the speed while a held line is stable."""
    p = bent(50.0, 8.0, J4=0.4, damping=0.01)
    k = frequency(p)
    speed = 0.7 * k
    period = math.pi / speed
    found = steady(p, speed, 100.0)
    assert found.exists[0] and found.growth[0] < 0.0 < found.free_growth[0]
    start, f = found.start[:, 0], rates(p, float(found.drive[0]), 100.0)
    path = integrate(p, float(found.drive[0]), 100.0, start, period, dense_output=True).sol
    inertia, gain = p.J1 + p.J4, 30.0 * k

    def hold(t, x):
        off = x - path(t)
        angle, rate = ((p.J1 * off[i] + p.J4 * off[i + 2]) / inertia for i in (0, 1))
        pull = np.array([0.0, 1.0, 0.0, 1.0]) * (gain * rate + 0.25 * gain**2 * angle)
        return np.array(f(t, list(x))) - pull

    columns = []
    for i in (0, 1):
        off = np.zeros(4)
        off[i], off[i + 2] = p.J4 / inertia, -p.J1 / inertia
        off *= 1e-5 * (k if i else 1.0)
        ends = [
            solve_ivp(hold, (0.0, period), start + s * off, method="DOP853", rtol=1e-10, atol=1e-11).y[:, -1]
            for s in (1.0, -1.0)
        ]
        moved = (ends[0] - ends[1]) / 2e-5
        columns.append([moved[0] - moved[2], (moved[1] - moved[3]) / k])
    of = np.linalg.eigvals(np.array(columns).T)
    assert np.max(np.abs(of)) == pytest.approx(found.multiplier[0], rel=1e-3)


def test_liouville():
    """The product of all multipliers is exp of the integral of the trace of the equations along the motion."""
    p = bent(30.0, 12.0, damping=0.05, delta_yokes=0.4)
    speed = 0.37 * frequency(p)
    found = steady(p, speed, 80.0)
    period = math.pi / speed
    drive = float(found.drive[0])
    points = np.linspace(0.0, period, 301)
    path = integrate(p, drive, 80.0, found.start[:, 0], period, t_eval=points).y
    f, h, trace = rates(p, drive, 80.0), 1e-4, []
    for x in path.T:
        up, down = (np.array([f(0.0, list(x + s * h * np.eye(4)[i])) for i in range(4)]) for s in (1.0, -1.0))
        trace.append(np.trace(up - down) / (2.0 * h))
    want = math.exp(np.trapezoid(trace, points))
    assert np.linalg.det(found.monodromy[:, :, 0]) == pytest.approx(want, rel=1e-4)
    assert want < 0.9


def test_forced_vibration_of_small_bends_has_a_closed_form():
    """A heavy J4 turns evenly; the joints shake J1 by an angle of order 2: amplitude r^2/|1 - r^2 + 2 i zeta r|."""
    zeta = 0.04
    p = bent(4.0, 2.0, damping=zeta, J4=4e5, c3=1.6e4)
    phi = np.linspace(0.0, math.pi, 400, endpoint=False)
    phi3, _, _ = two_joints(np, p, phi)
    amplitude = 2.0 * abs(np.mean((phi3 - phi) * np.exp(-2j * phi)))
    c = 1.0 / (1.0 / p.c2 + 1.0 / p.c3)
    r = np.array([0.3, 0.7, 1.0, 1.4, 2.6])
    found = steady(p, 0.5 * r * frequency(p), 0.0)
    want = c * amplitude * r**2 / np.abs(1.0 - r**2 + 2j * zeta * r)
    np.testing.assert_allclose(found.peak2, want, rtol=5e-3)
    np.testing.assert_allclose(found.peak3, want, rtol=5e-3)


def test_stiff_shafts_carry_what_rigid_ones_do():
    p = bent(30.0, 15.0)
    speed = np.array([0.4, 0.6]) * frequency(p)
    stiff = with_damping_ratio(dataclasses.replace(p, c2=200.0 * p.c2, c3=200.0 * p.c3), 0.05)
    want, got = rigid(p, speed, 300.0), steady(stiff, speed, 300.0)
    np.testing.assert_allclose(got.peak2, want.peak2, rtol=0.02)
    np.testing.assert_allclose(got.peak3, want.peak3, rtol=0.02)
    elastic = steady(p, speed, 300.0)
    assert np.all(np.abs(elastic.peak2 / want.peak2 - 1.0) > 0.1)


def test_time_simulation_finds_the_steady_motion_where_it_is_stable():
    p = bent(35.0, 8.0, damping=0.03)
    k = frequency(p)
    speed = np.array([0.25, 0.42, 0.7, 0.9, 1.2]) * k
    seen = simulate(p, speed, 100.0, settling_time(p))
    np.testing.assert_allclose(seen.speed, speed, rtol=1e-3)
    found = steady(p, seen.speed, 100.0)
    assert not np.any(found.unstable)
    np.testing.assert_allclose(seen.peak2, found.peak2, rtol=3e-3)
    np.testing.assert_allclose(seen.peak3, found.peak3, rtol=3e-3)


def test_time_simulation_leaves_an_unstable_motion():
    p = bent(35.0, 8.0)
    speed = np.array([1.0]) * frequency(p)
    found = steady(p, speed, 100.0)
    assert found.unstable[0]
    seen = simulate(p, speed, 100.0, 12.0 / float(found.growth[0]))
    assert seen.peak2[0] > 3.0 * found.peak2[0]


def test_undamped_multipliers_lie_on_the_circle_but_for_tongues():
    p = bent(12.0, 4.0, damping=0.0)
    k = frequency(p)
    found = steady(p, np.array([0.3, 0.7, 0.9, 1.0, 1.2]) * k, 10.0)
    assert list(found.unstable) == [False, False, False, True, False]
    np.testing.assert_allclose(found.multiplier[[0, 1, 2, 4]], 1.0, atol=1e-4)
    # power balance: nothing is lost
    np.testing.assert_allclose(found.drive, 10.0, rtol=1e-6)


def test_steps_are_fine_enough(monkeypatch):
    p = bent(45.0, 10.0, damping=0.02)
    speed = np.array([0.2, 0.9, 1.5]) * frequency(p)
    coarse = steady(p, speed, 100.0)
    monkeypatch.setattr(torsion, "STEPS_PER_PERIOD", 100)
    monkeypatch.setattr(torsion, "STEPS_PER_HARMONIC", 40)
    fine = steady(p, speed, 100.0)
    np.testing.assert_allclose(coarse.growth, fine.growth, rtol=2e-3)
    np.testing.assert_allclose(coarse.frequency, fine.frequency, rtol=1e-4)
    np.testing.assert_allclose(coarse.peak2, fine.peak2, rtol=3e-3)


def test_an_array_of_lines_is_each_line_by_itself():
    speed, bends, ratios = (
        np.array([40.0, 90.0, 60.0]),
        np.array([0.1, 0.3, 0.2]),
        np.array([0.02, 0.05, 0.03]),
    )
    base = line(1.0, alpha2=0.15)
    together = steady(
        dataclasses.replace(base, alpha1=bends, d2=base.d2 * ratios, d3=base.d3 * ratios), speed, 20.0
    )
    for j in range(3):
        alone = steady(line(float(ratios[j]), alpha1=float(bends[j]), alpha2=0.15), speed[j], 20.0)
        assert together.peak2[j] == pytest.approx(alone.peak2[0], rel=3e-3)
        assert together.growth[j] == pytest.approx(alone.growth[0], rel=1e-3)


# shafts from geometry

CORNERS = [(0.0, 0.0), (0.08, 0.0), (0.08, 0.04), (0.0, 0.04)]


@pytest.mark.parametrize(
    ("table", "constant"),
    [
        ({"section": "round", "outer": 0.06}, math.pi * 0.06**4 / 32.0),
        ({"section": "hollow", "outer": 0.09, "inner": 0.07}, math.pi * (0.09**4 - 0.07**4) / 32.0),
        ({"section": "rectangle", "a": 0.08, "b": 0.04}, 0.228682 * 0.08 * 0.04**3),
        ({"section": "box", "a": 0.1, "b": 0.1, "wall": 0.002}, 0.002 * 0.098**3),
    ],
)
def test_stiffness_from_geometry(table, constant):
    assert shafts.stiffness_of({**table, "length": 0.5}) == pytest.approx(8e10 * constant / 0.5, rel=1e-5)
    soft = shafts.stiffness_of({**table, "length": 2.0, "shear_modulus": 2.6e10})
    assert soft == pytest.approx(2.6e10 * constant / 2.0, rel=1e-5)


@pytest.mark.skipif(
    importlib.util.find_spec("sectionproperties") is None, reason="extra sections is not installed"
)
def test_finite_elements_agree_with_closed_forms():
    assert shafts.polygon(CORNERS) == pytest.approx(shafts.rectangle(0.08, 0.04), rel=1e-3)
    turn = np.linspace(0.0, 2.0 * math.pi, 181)[:-1]
    ring = [np.stack([r * np.cos(turn), r * np.sin(turn)], axis=1) for r in (0.045, 0.035)]
    assert shafts.polygon(ring[0], [ring[1]]) == pytest.approx(shafts.hollow(0.09, 0.07), rel=3e-3)

    def square(h):
        return [(-h, -h), (h, -h), (h, h), (-h, h)]

    # Bredt's formula leaves out the wall's own twist and the corners: 1 % here
    assert shafts.polygon(square(0.05), [square(0.048)]) == pytest.approx(
        shafts.box(0.1, 0.1, 0.002), rel=0.015
    )
    text = f'[driveline]\nshaft2 = {{ section = "polygon", outline = {[list(c) for c in CORNERS]}, length = "1 m" }}'
    assert parse(text).line.c2 == pytest.approx(8e10 * shafts.rectangle(0.08, 0.04), rel=1e-3)
    for outline in ([[0, 0], [1, 1], [1, 0], [0, 1]], [[0, 0], [1, 0]]):
        with pytest.raises(InputError, match=r"^driveline\.shaft2\.outline: "):
            parse(f'[driveline]\nshaft2 = {{ section = "polygon", length = 1, outline = {outline} }}')


def test_without_the_extra_a_polygon_is_refused(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r'needs the extra sections: pip install "chainunit\[sections\]"'):
        shafts.polygon(CORNERS)


def test_a_damping_ratio_sets_both_dampings():
    p = parse("[driveline]\nc2 = 3e4\nc3 = 7e4\ndamping_ratio = 0.07").line
    assert p.d2 / p.c2 == pytest.approx(p.d3 / p.c3)
    assert torsion.damping_ratio(p) == pytest.approx(0.07, rel=1e-12)
    assert (parse("[driveline]\nd2 = 5").line.d2, parse("[driveline]\nd2 = 5").line.d3) == (5.0, 0.0)


# the driveline file


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('[driveline]\nalpha1 = "90 deg"', "driveline.alpha1 = 1.5708 rad (90 deg): a Hooke joint turns only below"),
        ("[driveline]\nJ1 = 0", "driveline.J1 = 0 kg.m2: must be > 0 kg.m2"),
        ("[driveline]\nJ4 = nan", "driveline.J4 = nan kg.m2: must be finite"),
        ("[driveline]\nc2 = -4", "driveline.c2 = -4 N.m/rad: must be > 0 N.m/rad"),
        ("[driveline]\ndamping = 1", "driveline.damping: unknown key; known here: alpha1"),
        ("[drive]\nJ1 = 1", "drive: unknown key; known here: title, driveline, running, stability"),
        ('[driveline]\nJ1 = "heavy"', 'driveline.J1 = "heavy": must be a number in kg.m2'),
        ('[driveline]\nJ1 = "3 m"', 'driveline.J1 = "3 m": must be a number in kg.m2'),
        ("[driveline]\nc2 = 1\nshaft2 = { section = 'round' }", "driveline.c2: given beside driveline.shaft2"),
        ("[driveline]\nd3 = 1\ndamping_ratio = 0.1", "driveline.d3: given beside driveline.damping_ratio"),
        ("[driveline]\ndamping_ratio = -0.1", "driveline.damping_ratio = -0.1: must be >= 0 and <= 0.5"),
        ("[driveline]\nshaft2 = { section = 'tube' }", 'driveline.shaft2.section = "tube": must be "round"'),
        ("[driveline]\nshaft2 = { outer = 1 }", "driveline.shaft2.section: missing; one of round, hollow"),
        ("[driveline]\nshaft3 = { section = 'round', outer = 1 }", "driveline.shaft3.length: missing"),
        (
            "[driveline]\nshaft3 = { section = 'round', outer = 1, length = 1, wall = 0.1 }",
            'driveline.shaft3.wall: not of section "round", which takes outer, length',
        ),
        (
            "[driveline]\nshaft3 = { section = 'hollow', outer = '50 mm', inner = '60 mm', length = 1 }",
            "driveline.shaft3.inner = 0.06 m: must be >= 0 and < the outer diameter, 0.05 m",
        ),
        ("[driveline]\nshaft3 = 4", "driveline.shaft3 = 4: must be a table"),
        ("[running]\nspeed_low = 200\nspeed_high = 100", "running.speed_high = 100 rad/s: must be > 200 rad/s"),
        ("[running]\nspeed_low = 0.1", "running.speed_low = 0.1 rad/s: must be >= 5.227 rad/s, a fiftieth"),
        ("[running]\nspeed = 0", "running.speed = 0 rad/s: must be > 0 rad/s"),
        ("[running]\npoints = 20.5", "running.points = 20.5: must be a whole number"),
        ('[running]\nload = "3 N"', 'running.load = "3 N": must be a number in N.m'),
        ("[stability]\nbend_low = 0.5\nbend_high = 0.2", "stability.bend_high = 0.2 rad: must be > 0.5 rad"),
        ("[stability]\njoint = 'beta'", 'stability.joint = "beta": must be "alpha1", "alpha2" or "both"'),
        ("[stability]\ndamping_ratios = []", "stability.damping_ratios = []: list should have at least 1 item"),
        ("[stability]\ndamping_ratios = [0.9]", "stability.damping_ratios = 0.9: must be >= 0 and <= 0.5"),
        ("[stability]\nspeeds = 3.5", "stability.speeds = 3.5: must be a whole number"),
        ("x =", "no valid TOML"),
    ],
)  # fmt: skip
def test_refusals(text, message):
    with pytest.raises(InputError) as refused:
        parse(text)
    assert str(refused.value).startswith(message)
    assert "\n" not in str(refused.value)


def test_a_file_is_laid_over_the_example():
    assert parse("").line == load().line == parse(example()).line
    own = parse("[driveline]\nc2 = 5000").line
    assert (own.c2, own.c3, own.J1) == (5000.0, load().line.c3, load().line.J1)
    k = frequency(load().line)
    assert torsion.damping_ratio(load().line) == pytest.approx(0.03)
    assert k == pytest.approx(260.98, abs=0.01)


# the study and its words

SMALL = """
[running]
points = 30
speed_low = "1350 rev/min"
[stability]
speeds = 10
bends = 3
bend_high = "35 deg"
damping_ratios = [0.01, 0.03]
"""


def small(text="", running="", stability=""):
    return parse(text + SMALL.replace("[stability]", running + "\n[stability]") + stability)


@pytest.fixture(scope="module")
def study():
    return run_driveline(small("[driveline]\nalpha1 = '35 deg'\ndamping_ratio = 0.015\n")).analysis


def test_the_orders_of_one_joint_have_a_closed_form():
    """The series of atan(tan(x)/cos(alpha)) - x."""
    study = run_driveline(small("[driveline]\nalpha1 = '30 deg'\nalpha2 = 0\n", "load = 0\n")).analysis
    square = math.tan(math.radians(15.0)) ** 2
    assert study.excitation == {
        2: pytest.approx(square, rel=1e-9),
        4: pytest.approx(square**2 / 2.0, rel=1e-9),
    }
    # without a load there is nothing to compare the peaks with
    assert not said(study, "Shaft 2 carries") and study.static2 == 0.0


def said(study, beginning):
    return [line for line in torsion_answers.warnings(study) if line.startswith(beginning)]


def test_crossings_are_where_the_orders_meet_the_band(study):
    for n, ends in study.crossings().items():
        assert [n * w for w in ends] == pytest.approx([study.band.least, study.band.largest])
    low, high = study.crossings()[2]
    (warning,) = said(study, "Running at 146.6 rad/s (1400 rev/min) is")
    near = (study.rotation.speed - high) / study.rotation.speed
    ends = [number(end, "rad/s", "speed", 4) for end in (low, high)]
    assert f"is {number(near, '1', 'percent')} from where order 2" in warning and " to ".join(ends) in warning


def test_the_tongue_lies_at_the_natural_frequency(study):
    ((low, high),) = study.unstable_ranges()
    assert low < study.at_even < high < 1.1 * low
    assert said(study, "Unstable from") and "damping ratio 0.0150" in said(study, "Unstable from")[0]
    # more bend and less damping widen it
    wide = (study.map.unstable * np.gradient(study.map.speed)).sum(axis=2)
    assert wide[0, 0] == wide[1, 0] == wide[1, 1] == 0.0 and wide[0, 2] > 0.0 and wide[0, 2] >= wide[1, 2]


def test_peaks_are_compared_with_the_load_alone(study):
    (warning,) = said(study, "Shaft 2 carries")
    peak = float(study.operating.peak2[0])
    assert study.static2 == pytest.approx(375.0 * np.max(study.ratio))
    assert number(peak, "N.m", digits=4) in warning
    assert f"{number(peak / study.static2, '1')} times" in warning
    assert said(study, "The torque of shaft 2 falls to")


def test_what_is_uneven_is_named(study):
    (warning,) = said(study, "Shaft 3 does not run evenly")
    assert "make the bends equal (alpha1 = 35.0 deg, alpha2 = 8.00 deg)" in warning
    off = Cardan(alpha1=0.2, alpha2=0.2, beta_planes=0.1, delta_yokes=0.3)
    _, ratio, _ = two_joints(np, off, np.linspace(0.0, math.pi, 50))
    (line,) = torsion_answers._even_running(off, ratio)
    assert "turn the yokes of the middle shaft by -11.5 deg" in line and "equal" not in line
    mended = dataclasses.replace(off, delta_yokes=off.delta_yokes - math.radians(11.459156))
    _, ratio, _ = two_joints(np, mended, np.linspace(0.0, math.pi, 50))
    assert torsion_answers._even_running(mended, ratio) == []


def test_an_even_line_has_nothing_to_warn_of():
    study = run_driveline(small("[driveline]\nalpha1 = '8 deg'\n", stability="joint = 'both'\n")).analysis
    assert torsion_answers.warnings(study) == [] and study.unstable_ranges() == []
    assert not np.any(study.map.unstable) and np.all(np.isfinite(study.map.growth))
    np.testing.assert_allclose(study.steady.peak2, 375.0, rtol=1e-6)


def test_without_damping_it_says_so():
    study = run_driveline(small("[driveline]\nd2 = 0\n")).analysis
    assert study.simulated is None and study.damping_ratio == 0.0
    assert any(note.startswith("Without damping no transient dies") for note in torsion_answers.notes(study))


# the command


def run(monkeypatch, capsys, *arguments):
    monkeypatch.setattr(sys, "argv", ["chainunit", "driveline", *map(str, arguments)])
    with pytest.raises(SystemExit) as left:
        cli.main()
    return left.value.code, *capsys.readouterr()


def test_the_command_writes_everything(monkeypatch, capsys, tmp_path):
    file, folder = tmp_path / "mine.toml", tmp_path / "out dir"
    file.write_text('title = "A [bold] line"\n' + SMALL)
    folder.mkdir()
    for stale in ("driveline.json", "ratio.png"):
        (folder / stale).write_text("of an earlier run")
    status, out, _ = run(monkeypatch, capsys, file, "-o", folder)
    assert not status
    assert "A [bold] line" in out and "Warning: Shaft 3 does not run evenly" in out
    names = {"report.html", "driveline.json", "driveline.md", *PICTURES}
    assert {p.name for p in folder.iterdir()} == names
    for name in names:
        assert name in out
        if name.endswith(".png"):
            assert (folder / name).read_bytes().startswith(b"\x89PNG")
    numbers = json.loads((folder / "driveline.json").read_text())
    assert numbers["natural_frequency"]["even"] == {
        "value": pytest.approx(260.98, abs=0.01),
        "unit": "rad/s",
        "kind": "frequency",
    }
    assert len(numbers["resonance"]["peak_torque2"]["value"]) == 30
    assert numbers["driveline"]["J4"] == {"value": 60.0, "unit": "kg.m2"}
    text = (folder / "driveline.md").read_text()
    assert "| driveline.J4 | 60 kg m2 | driven inertia |" in text and "](campbell.png)" in text


def test_the_command_refuses_in_one_line(monkeypatch, capsys, tmp_path):
    file, folder = tmp_path / "mine.toml", tmp_path / "out"
    folder.mkdir()
    (folder / "driveline.json").write_text("of an earlier run")
    file.write_text("[driveline]\nJ1 = -1")
    status, out, err = run(monkeypatch, capsys, file, "-o", folder)
    assert (status, out) == (2, "")
    allowed = "must be > 0 kg.m2 and <= 1e+09 kg.m2 (inertia of the rotor)"
    assert err == f"chainunit: {file}: driveline.J1 = -1 kg.m2: {allowed}\n"
    assert (folder / "driveline.json").read_text() == "of an earlier run"
    status, _, err = run(monkeypatch, capsys, tmp_path / "none.toml")
    assert status == 2 and "cannot be read" in err


def test_interrupted_it_leaves_nothing(monkeypatch, capsys, tmp_path):
    def stop(*_):
        raise KeyboardInterrupt

    (tmp_path / "driveline.json").write_text("of an earlier run")
    monkeypatch.setattr(driveline, "run_driveline", stop)
    status, _, err = run(monkeypatch, capsys, "-o", tmp_path)
    assert status == 130 and err.endswith("chainunit: interrupted before all was written\n")
    assert list(tmp_path.iterdir()) == []


def test_the_example_is_printed(monkeypatch, capsys):
    status, out, _ = run(monkeypatch, capsys, "--example")
    assert not status and out == example()
