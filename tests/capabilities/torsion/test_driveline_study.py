"""The driveline in rotation, against closed forms, limit cases, another integrator; its analysis in a study, words
and command."""

from __future__ import annotations

import dataclasses
import importlib.util
import json
import math
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from records import record_of
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from chainunit import InputError
from chainunit.app import cli
from chainunit.capabilities.torsion import analysis as torsion_analysis
from chainunit.capabilities.torsion import page as torsion_report
from chainunit.capabilities.torsion.analysis import TorsionAnalysis, analyse
from chainunit.capabilities.torsion.findings import Rotation
from chainunit.capabilities.torsion.page import PICTURES
from chainunit.capabilities.torsion.table import TorsionPlan, TorsionTable
from chainunit.core.engines import MATH, numpy_
from chainunit.core.quantities import Layout
from chainunit.drives import shafts, torsion
from chainunit.drives.cardan import Cardan, Twist, frozen_frequency, two_joints, with_damping_ratio
from chainunit.drives.torsion import rigid, settling_time, simulate, steady
from chainunit.reading.result_entries import ResultEntries
from chainunit.reading.results import as_data
from chainunit.reading.text import number
from chainunit.report import blocks, figure
from chainunit.study import config, parts
from chainunit.study.analysis import Work
from chainunit.study.choice import choose
from chainunit.study.drive_fmus import export_drive, with_files
from chainunit.study.line import shaft_runs
from chainunit.study.line.placed import Line
from chainunit.study.line.shaft import UNEVEN, remedies, two_masses
from chainunit.study.rig import Rig
from chainunit.system import CoSimulation

pytestmark = pytest.mark.second

SYSTEM = '[system]\nmachine = "Accelerator"\n'
EVENT = '[[event]]\ntype = "overload"\ntorque = 200\nduration = 0.05\n'
BARE = "[driveline]\nbeta_planes = 0\n"
SMALL = """
[torsion]
points = 30
slowest = 0.96
fastest = 2.1
speeds = 10
bends = 3
bend_high = "35 deg"
damping_ratios = [0.01, 0.03]
"""


def parse(text):
    return config.parse(SYSTEM + text)


def study_of(text):
    given = config.parse(text)
    drive = choose(given, Path(), lambda *_: None).drive
    return record_of(given, drive)


def findings(text):
    study = study_of(SYSTEM + ("" if "[driveline]" in text else BARE) + text)
    return TorsionAnalysis.find(
        study, Work(Rig(study.setup.config.operation, study.setup.drive, {}), lambda *_: None)
    )


def line_of(text):
    study = study_of(SYSTEM + text)
    return two_masses(study.setup.drive, float(np.mean(study.setup.statics.normal.outputs.J)))


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


@pytest.mark.slow
def test_stiff_shafts_carry_what_rigid_ones_do():
    p = bent(30.0, 15.0)
    speed = np.array([0.4, 0.6]) * frequency(p)
    stiff = with_damping_ratio(dataclasses.replace(p, c2=200.0 * p.c2, c3=200.0 * p.c3), 0.05)
    want, got = rigid(p, speed, 300.0), steady(stiff, speed, 300.0)
    np.testing.assert_allclose(got.peak2, want.peak2, rtol=0.02)
    np.testing.assert_allclose(got.peak3, want.peak3, rtol=0.02)
    elastic = steady(p, speed, 300.0)
    assert np.all(np.abs(elastic.peak2 / want.peak2 - 1.0) > 0.1)


@pytest.mark.slow
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


@pytest.mark.slow
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


@pytest.mark.slow
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
    assert parse(text).values["driveline"].c2 == pytest.approx(8e10 * shafts.rectangle(0.08, 0.04), rel=1e-3)
    for outline in ([[0, 0], [1, 1], [1, 0], [0, 1]], [[0, 0], [1, 0]]):
        with pytest.raises(InputError, match=r"^driveline\.shaft2\.outline: "):
            parse(f'[driveline]\nshaft2 = {{ section = "polygon", length = 1, outline = {outline} }}')


def test_without_the_extra_a_polygon_is_refused(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r'needs the extra sections: pip install "chainunit\[sections\]"'):
        shafts.polygon(CORNERS)


def test_a_damping_ratio_sets_both_dampings():
    p = line_of("[driveline]\nc2 = 3e4\nc3 = 7e4\ndamping_ratio = 0.07")
    assert p.d2 / p.c2 == pytest.approx(p.d3 / p.c3)
    assert torsion.damping_ratio(p) == pytest.approx(0.07, rel=1e-12)
    given = line_of("[driveline]\nd2 = 5")
    assert (given.d2, given.d3) == (5.0, 0.0)


# the study file


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('[driveline]\nalpha1 = "90 deg"', "driveline.alpha1 = 1.5708 rad (90 deg): a Hooke joint turns only below"),
        ("[driveline]\nJ4 = nan", "driveline.J4 = nan kg m2: must be finite"),
        ("[driveline]\nJ1 = 1", "driveline.J1: unknown key; known here: alpha1"),
        ("[driveline]\nc2 = -4", "driveline.c2 = -4 N m/rad: must be > 0 N m/rad"),
        ("[driveline]\ndamping = 1", 'driveline.damping: unknown key; was "damping_ratio" meant?'),
        ('[driveline]\nJ4 = "heavy"', 'driveline.J4 = "heavy": must be a number in kg m2'),
        ('[driveline]\nJ4 = "3 m"', 'driveline.J4 = "3 m": must be a number in kg m2'),
        ("[driveline]\nc2 = 1\nshaft2 = { section = 'round', outer = 0.04, length = 1 }",
         "driveline.c2: given beside driveline.shaft2"),
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
        ('[feed]\nload = "3 N"', 'feed.load = "3 N": must be a number in N m'),
        (f"{BARE}[torsion]\nslowest = 2\nfastest = 1", "torsion.fastest = 1: must be > torsion.slowest, 2"),
        (f"{BARE}[torsion]\nslowest = 0", "torsion.slowest = 0: must be > 0"),
        (f"{BARE}[torsion]\npoints = 20.5", "torsion.points = 20.5: must be a whole number"),
        (
            f"{BARE}[torsion]\nbend_low = 0.5\nbend_high = 0.2",
            "torsion.bend_high = 0.2 rad: must be > torsion.bend_low, 0.5 rad",
        ),
        (f"{BARE}[torsion]\njoint = 'beta'", 'torsion.joint = "beta": must be "alpha1", "alpha2" or "both"'),
        (
            f"{BARE}[torsion]\ndamping_ratios = [1, 2, 3, 4, 5]",
            "torsion.damping_ratios = [1, 2, 3, 4, ...]: must be a list of at most 4, and has 5",
        ),
        (f"{BARE}[torsion]\ndamping_ratios = [0.9]", "torsion.damping_ratios = 0.9: must be >= 0 and <= 0.5"),
        (f"{BARE}[torsion]\nspeeds = 3.5", "torsion.speeds = 3.5: must be a whole number"),
        ("[torsion]\nspeeds = 3", "torsion: is of a driveline; add [driveline], or leave it out"),
    ],
)  # fmt: skip
def test_refusals(text, message):
    with pytest.raises(InputError) as refused:
        parse(text)
    assert str(refused.value).startswith(message)
    assert "\n" not in str(refused.value)


def test_a_speed_at_which_nothing_resonates_is_refused():
    with pytest.raises(InputError) as refused:
        findings(f"{BARE}[torsion]\nslowest = 0.001")
    assert str(refused.value).startswith(
        "torsion.slowest = 0.001: the shaft turns at 146.6 rad/s; must be >= 0.0357"
    )


def test_a_file_is_laid_over_the_example():
    packaged = config.parse(parts.example("driveline")).values["driveline"]
    assert parse(BARE).values["driveline"] == packaged and parse("").values["driveline"] is None
    own = parse("[driveline]\nc2 = 5000").values["driveline"]
    assert (own.c2, own.c3, own.J4) == (5000.0, packaged.c3, packaged.J4)
    line = line_of(BARE)
    assert (line.J1, line.J4) == (1.2, 60.0)
    assert torsion.damping_ratio(line) == pytest.approx(0.03)
    assert frequency(line) == pytest.approx(260.98, abs=0.01)


# the analysis and its words


@pytest.fixture(scope="module")
def study():
    return findings("[driveline]\nalpha1 = '35 deg'\ndamping_ratio = 0.015\n" + SMALL)


def said(found, beginning, severity="warning"):
    remarks = [remark for remark in found.remarks() if remark.severity == severity]
    return [remark for remark in remarks if str(remark).startswith(beginning)]


@pytest.mark.slow
def test_numbers_are_those_of_the_former_program():
    """Its file, its line and its load; `driveline.json` is what it wrote."""
    before = json.loads((Path(__file__).parents[2] / "data" / "driveline.json").read_text())
    line = Cardan(**{name: entry["value"] for name, entry in before["driveline"].items()})
    run = {name: entry["value"] for name, entry in before["running"].items()}
    table = TorsionTable(
        slowest=run["speed_low"] / run["speed"],
        fastest=run["speed_high"] / run["speed"],
        points=30.0,
        speeds=10.0,
        bends=3.0,
        bend_high=math.radians(35.0),
    )
    rotation = Rotation(speed=run["speed"], load=run["load"])
    now = as_data(analyse(line, rotation, TorsionPlan(table, "alpha1", (0.01, 0.03))))

    def compare(old, new):
        if isinstance(old, dict):
            for key, value in old.items():
                compare(value, new[key])
        elif isinstance(old, str | None):
            assert old == new
        else:
            size = np.max(np.abs(np.array(old, float)), initial=0.0)
            np.testing.assert_allclose(
                np.array(new, float), np.array(old, float), rtol=1e-9, atol=1e-9 * size
            )

    for key in before.keys() - {"driveline", "running"}:
        compare(before[key], now[key])


@pytest.mark.slow
def test_the_orders_of_one_joint_have_a_closed_form():
    """The series of atan(tan(x)/cos(alpha)) - x."""
    found = findings("[driveline]\nalpha1 = '30 deg'\nalpha2 = 0\n[feed]\nload = 0\n" + SMALL)
    square = math.tan(math.radians(15.0)) ** 2
    assert found.excitation == {
        2: pytest.approx(square, rel=1e-9),
        4: pytest.approx(square**2 / 2.0, rel=1e-9),
    }
    # without a load there is nothing to compare the peaks with
    assert (
        not said(found, "With a motor of constant torque shaft 2 carries")
        and found.operating.static_torque2 == 0.0
    )


def test_crossings_are_where_the_orders_meet_the_band(study):
    for n, ends in study.crossings.items():
        assert [n * w for w in ends] == pytest.approx(
            [study.natural_frequency.least, study.natural_frequency.largest]
        )
    low, high = study.crossings[2]
    (warning,) = said(study, "Running at 146.6 rad/s (1400 rev/min) is")
    near = (study.rotation.speed - high) / study.rotation.speed
    ends = [number(end, "rad/s", "speed", 4) for end in (low, high)]
    assert f"is {number(near, '1', 'percent')} from where order 2" in str(warning)
    assert " to ".join(ends) in str(warning)
    assert warning.quantities["near"][0] == pytest.approx(near)


def test_lower_gains_are_no_advice_against_a_control_near_the_line():
    """Of the packaged driveline lower gains raise the peaks: the control damps the torsion."""
    study = study_of(parts.example("driveline"))
    shaft_runs.remark(study)
    (warning,) = (each.text for each in study.findings.warnings if each.code == "control-near-line")
    assert "lower the gains" not in warning and "the control also damps the torsion" in warning


SLOW_LINE = """
[driveline]
place = "crank"
alpha1 = "12 deg"
c2 = 9000
c3 = 9000
damping_ratio = 0.05
J4 = 0.5
[torsion]
slowest = 6
fastest = 10
points = 20
speeds = 4
bends = 2
damping_ratios = [0.05]
"""


@pytest.mark.slow
def test_ranges_of_the_natural_frequency_say_over_what_they_are():
    """The inertia of a chain unit varies over its turn, i23 over that of the shaft; an order meets both."""
    study = study_of(SLOW_LINE)
    found = TorsionAnalysis.find(
        study, Work(Rig(study.setup.config.operation, study.setup.drive, {}), lambda *_: None)
    )
    J = study.setup.statics.normal.outputs.J
    ratio = found.ratio
    low, high = (
        [
            pick(frozen_frequency(numpy_(), two_masses(study.setup.drive, float(x)), ratio))
            for pick in (np.min, np.max)
        ]
        for x in (np.max(J), np.min(J))
    )
    assert found.crossings[2] == pytest.approx((low[0] / 2.0, high[1] / 2.0), rel=1e-6)
    band = found.natural_frequency
    assert high[1] - low[0] > 2.0 * (band.largest - band.least)
    study.findings.by_analysis["torsion"] = found
    shown = list(torsion_report.blocks(study))
    table = next(each for each in shown if isinstance(each, blocks.Table) and "ranges" in each.title)
    rows = {row.cells[0]: [cell.value for cell in row.cells[1:]] for row in table.rows if row.cells[2]}
    assert rows["natural frequency, over a turn of the shaft"] == pytest.approx([band.least, band.largest])
    over_both = "over the turns of shaft and machine"
    assert rows[f"natural frequency, {over_both}"] == pytest.approx([low[0], high[1]], rel=1e-6)
    assert rows[f"speed at which order 2 meets the natural frequency, {over_both}"] == pytest.approx(
        [low[0] / 2.0, high[1] / 2.0], rel=1e-6
    )
    campbell = next(each for each in shown if isinstance(each, figure.Figure) and each.name == "campbell")
    (band_shown,) = (item for item in campbell.panels[0][0].items if isinstance(item, figure.Shade))
    assert (band_shown.low, band_shown.high) == found.natural_frequency.over_both_turns
    assert band_shown.name == f"natural frequency {over_both}"


def test_the_tongue_lies_at_the_natural_frequency(study):
    ((low, high),) = study.resonance.unstable
    assert low < study.natural_frequency.even < high < 1.1 * low
    (warning,) = said(study, "Unstable from")
    assert "damping ratio 0.0150" in str(warning) and warning.quantities["low"][0] == low
    # more bend and less damping widen it
    wide = (study.map.unstable * np.gradient(study.map.speed)).sum(axis=2)
    assert wide[0, 0] == wide[1, 0] == wide[1, 1] == 0.0 and wide[0, 2] > 0.0 and wide[0, 2] >= wide[1, 2]


def test_peaks_are_compared_with_the_load_alone(study):
    (warning,) = said(study, "With a motor of constant torque shaft 2 carries")
    peak = float(study.operating.motion.peak2[0])
    # the brake of the machine is smoothed near rest
    assert study.operating.static_torque2 == pytest.approx(375.0 * np.max(study.ratio), rel=1e-7)
    assert number(peak, "N.m", digits=4) in str(warning)
    assert f"{number(peak / study.operating.static_torque2, '1')} times" in str(warning)
    assert said(study, "With a motor of constant torque the torque of shaft 2 falls to")


def test_what_would_even_the_joints():
    assert remedies(Cardan(alpha1=math.radians(35.0), alpha2=math.radians(8.0))) == [
        "make the bends equal (alpha1 = 35.0 deg, alpha2 = 8.00 deg)"
    ]
    off = Cardan(alpha1=0.2, alpha2=0.2, beta_planes=0.1, delta_yokes=0.3)
    assert remedies(off) == ["turn the yokes of the middle shaft by -11.5 deg (delta_yokes = beta_planes)"]
    mended = dataclasses.replace(off, delta_yokes=off.delta_yokes - math.radians(11.459156))
    assert remedies(mended) == []
    _, ratio, _ = two_joints(np, mended, np.linspace(0.0, math.pi, 50))
    assert np.ptp(ratio) < UNEVEN


def test_an_even_line_has_nothing_to_warn_of():
    found = findings("[driveline]\nalpha1 = '8 deg'\n" + SMALL + "joint = 'both'\n")
    assert not said(found, "") and found.resonance.unstable == []
    assert not np.any(found.map.unstable) and np.all(np.isfinite(found.map.growth))
    np.testing.assert_allclose(found.resonance.motion.peak2, 375.0, rtol=1e-6)


def test_without_damping_it_says_so():
    found = findings("[driveline]\nd2 = 0\n" + SMALL)
    assert found.simulation is None and found.damping_ratio == 0.0
    assert said(found, "Without damping no transient dies", "note")


# the analysis in a study


def only_line(line, rotation, *_):
    return SimpleNamespace(line=line, rotation=rotation)


def test_the_line_is_that_of_the_study(monkeypatch):
    """On the other side of a gear, with a flywheel, it is the same system seen from another shaft."""
    monkeypatch.setattr(torsion_analysis, "analyse", only_line)
    text = "[machine]\nratio = 3\n[driveline]\nplace = '{}'\nJ4 = 0.4\n[flywheel]\nJ = 0.3\n" + SMALL
    crank, motor = (findings(text.format(place)) for place in ("crank", "motor"))
    assert (crank.line.J1, crank.line.J4) == pytest.approx((1.5 * 9.0, 59.9))
    assert (motor.line.J1, motor.line.J4) == pytest.approx((1.5, 0.4 + 59.5 / 9.0))
    assert motor.rotation.speed == pytest.approx(3.0 * crank.rotation.speed)
    assert motor.rotation.load == pytest.approx(crank.rotation.load / 3.0)


@pytest.mark.parametrize(("speed", "made"), [("300 rev/min", False), ("450 rev/min", True)])
def test_a_slow_line_is_not_analysed(monkeypatch, speed, made):
    monkeypatch.setattr(torsion_analysis, "analyse", only_line)
    text = f"{SYSTEM}{BARE}[run]\ncrank_speed = '{speed}'\n"
    # a table of its own asks for it
    for more in ("", "[torsion]\n", "[torsion]\nspeeds = 2\n"):
        study = study_of(text + more)
        found = TorsionAnalysis.find(
            study, Work(Rig(study.setup.config.operation, study.setup.drive, {}), lambda *_: None)
        )
        assert (found is not None) == (made or bool(more))
        assert [remark.code for remark in study.findings.remarks] == [] if found else ["torsion-left-out"]


@pytest.mark.slow
def test_the_co_simulation_finds_the_steady_motion_of_the_analysis(tmp_path):
    """A motor that gives a constant torque, as the analysis takes it, in the FMUs of the study."""
    found = findings(SMALL)
    study = study_of(f"{SYSTEM}{BARE}")
    w = found.rotation.speed
    drive = study.setup.drive
    motor = Layout(type(drive.parameters)).from_names(
        {"speed_control.kp": 1e-6, "speed_control.ki": 0.0, "w_start": w}, drive.parameters
    )
    (part,) = drive.line
    part = dataclasses.replace(part, parameters=dataclasses.replace(part.parameters, w_start=w))
    drive = dataclasses.replace(drive, parameters=motor, line=Line((part,)))
    files, _ = export_drive(drive, tmp_path)
    load = found.rotation.load
    signals = {"motor.w_ref": w, "motor.tau_ff": 0.0, "machine.load": study.setup.config.feed.load}
    with CoSimulation(with_files(drive, files), signals | {"motor.tau_ff": load}) as simulation:
        run = simulation.run(2.5, 2.5e-4).sel(time=slice(2.2, None))
    assert float(run["motor.w"].mean()) == pytest.approx(w, rel=0.01)
    reached = float(run["motor.w"].mean())
    want = steady(found.line, reached, load)
    assert float(np.abs(run["driveline.tau2"]).max()) == pytest.approx(float(want.peak2[0]), rel=0.02)


# the command


def run(monkeypatch, capsys, *arguments):
    monkeypatch.setattr(sys, "argv", ["chainunit", "study", *map(str, arguments), "--all", "--png"])
    with pytest.raises(SystemExit) as left:
        cli.main()
    return left.value.code, *capsys.readouterr()


@pytest.mark.slow
def test_the_command_writes_everything(monkeypatch, capsys, tmp_path):
    file, folder = tmp_path / "mine.toml", tmp_path / "out dir"
    start = "[run]\nramp = 1\nsettle_turns = 10\nturns = 1\n"
    file.write_text('title = "A [bold] line"\n' + SYSTEM + start + EVENT + BARE + SMALL)
    status, out, _ = run(monkeypatch, capsys, file, "-o", folder)
    assert not status
    assert (
        "A [bold] line" in out
        and "Warning: The joints turn unevenly, as shaft 3 turns 0.99449 to 1.0055" in out
    )
    for name in PICTURES:
        assert (folder / name).read_bytes().startswith(b"\x89PNG")
    numbers = ResultEntries(json.loads((folder / "result.json").read_text()))
    torsion = numbers["torsion"]
    assert torsion["natural_frequency"]["even"] == {
        "value": pytest.approx(260.98, abs=0.01),
        "unit": "rad/s",
        "kind": "frequency",
    }
    assert len(torsion["resonance"]["peak_torque2"]["value"]) >= 30
    assert torsion["line"]["J4"] == {"value": pytest.approx(60.0), "unit": "kg.m2"}
    assert numbers["status"] == "complete" and numbers["answers"]["overload"] and numbers["shaft"]["steady"]
    kinds = {remark["code"] for remark in (*numbers["warnings"], *numbers["notes"])}
    assert {"order-near-line", "peak-of-a-shaft", "natural-frequency", "uneven-joints"} <= kinds
    text = (folder / "result.md").read_text()
    assert (
        "| torsion.bend_high | 35 deg | largest bend of the map | mine.toml, line 21 |" in text
        and "](campbell.png)" in text
    )
    page = (folder / "report.html").read_text()
    assert "Torsion of the driveline in rotation" in page and "shaft 3 turns" in page


def test_the_example_is_printed(monkeypatch, capsys):
    status, out, _ = run(monkeypatch, capsys, "--example", "driveline")
    assert not status and out == f"#:schema chainunit.schema.json\n{parts.example('driveline')}"
