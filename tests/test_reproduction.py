"""The papers' numbers, to the digits at which they were checked independently."""

from __future__ import annotations

import functools
import json
import re
import subprocess
import sys
import tomllib
import types
from pathlib import Path

import numpy as np
import pytest
from papers import PAPERS, paper000, paper002, paper003, reproduce
from papers.output import markdown
from papers.table import _row

from chainunit.core.engines import MATH
from chainunit.drives.cardan import Cardan, frozen_frequency

pytestmark = pytest.mark.second
EXAMPLES = Path(__file__).parents[1] / "examples"


@functools.cache
def every():
    """The rows; they take seconds, which a run that leaves them out has not to spend."""
    return reproduce()


def shown(paper, item, quantity):
    (row,) = [r for r in every() if (r.paper, r.item, r.quantity) == (paper, item, quantity)]
    return row.text


# from an independent multibody solution of the same machine, not from this package
KNOWN = [
    ("000", "1", "least mu that fits the figures", "0.595"),
    ("000", "1", "largest mu that fits the figures", "0.613"),
    ("000", "2", "zeta above which the arcsine is the wrong branch", "0.9487"),
    ("000", "2", "failure of eq. (1) at zeta = 0.97", "0.082"),
    ("000", "2", "failure of eq. (1) at zeta = 0.93", "0.000"),
    ("000", "3", "least zeta at a swing of 12 deg", "0.197"),
    ("000", "3", "largest zeta at a swing of 12 deg", "0.906"),
    ("000", "7", "error of X with eps = +psi'', in its dynamic part, at the extreme", "2.0"),
    ("000", "9", "error of X with the printed braces, in its dynamic part", "0.58"),
    ("000", "13", "R_n left at psi = 0", "0.324"),
    ("000", "13", "R_t left at psi = 0", "0.136"),
    ("000", "13", "X_A1: growth over -12..12 deg", "1.70"),
    ("000", "14", "f at psi = 0.5 deg", "16.3"),
    ("000", "14", "f at psi = 1 deg", "8.4"),
    ("000", "14", "f at psi = 3 deg", "3.1"),
    ("000", "14", "f at psi = 6 deg", "1.81"),
    ("000", "14", "f at psi = 9 deg", "1.36"),
    ("000", "14", "f at psi = 12 deg", "1.134"),
    ("000", "14b", "rocker torque, at rest", "1.36"),
    ("000", "14b", "rocker torque, at 5 rad/s", "3.1"),
    ("000", "14b", "rocker torque, at 10 rad/s", "0.50"),
    ("000", "14b", "rocker torque, at 20 rad/s", "0.63"),
    ("000", "14b", "rocker torque, at 50 rad/s", "0.66"),
    ("000", "14b", "crank torque, at rest", "1.9"),
    ("000", "14b", "crank torque, at 5 rad/s", "5.3"),
    ("000", "14b", "crank torque, at 10 rad/s", "0.80"),
    ("000", "14b", "crank torque, at 20 rad/s", "0.53"),
    ("000", "14b", "crank torque, at 50 rad/s", "0.57"),
    ("000", "15", "X: growth", "100"),
    ("000", "15", "Y_A2: growth", "12"),
    ("000", "15", "Y_A2 at psi = 0, weights in B", "0.362"),
    ("000", "15", "Y_A1 at psi = 0, weights in B", "0.638"),
    ("000", "16", "R_t left organ, left extreme, 10 rad/s", "0.28"),
    ("000", "16", "R_t left organ, left extreme, 50 rad/s", "5.50"),
    ("000", "16", "R_t left organ, right extreme, 10 rad/s", "-0.28"),
    ("000", "16", "R_t left organ, right extreme, 50 rad/s", "-12.12"),
    ("000", "16", "the same with uniform rods, left extreme, 10 rad/s", "0.31"),
    ("000", "16", "the same with uniform rods, left extreme, 50 rad/s", "6.16"),
    ("000", "16", "the same with uniform rods, right extreme, 10 rad/s", "-0.34"),
    ("000", "16", "the same with uniform rods, right extreme, 50 rad/s", "-13.63"),
    ("000", "17", "X left at 1 rad/s, least", "0.115"),
    ("000", "17", "X left at 1 rad/s, largest", "0.160"),
    ("000", "17", "Y_A2 left at 1 rad/s, least", "0.321"),
    ("000", "17", "Y_A2 left at 1 rad/s, largest", "0.337"),
    ("000", "17", "resultant for |psi| < 8 deg, least", "0.649"),
    ("000", "18", "psi at the left extreme", "-8.19"),
    ("000", "19", "inertia part equals gravity part, left extreme", "5.4"),
    ("000", "19", "inertia part equals gravity part, right extreme", "6.6"),
    ("000", "19", "inertia part to gravity part, left extreme, 10 rad/s", "3.4"),
    ("000", "19", "inertia part to gravity part, right extreme, 10 rad/s", "2.3"),
    ("000", "19", "inertia part to gravity part, left extreme, 50 rad/s", "85"),
    ("000", "19", "inertia part to gravity part, right extreme, 50 rad/s", "58"),
    ("001", "3", "largest rho, frame of rho0 = 0.3", "0.5029"),
    ("001", "4", "least theta at rho = 0.5", "-83.15"),
    ("001", "4", "largest theta at rho = 0.5", "48.8"),
    ("001", "5", "rho0 at which the frame is frozen", "0.3"),
    ("001", "6", "max |theta| at rho = 0.1", "13.57"),
    ("001", "6", "max |theta| at rho = 0.5", "83.15"),
    ("001", "6", "ratio of the two", "6.13"),
    ("001", "6", "phi_k of the peak at rho = 0.1", "55.05"),
    ("001", "6", "phi_k of the peak at rho = 0.5", "235.05"),
    ("001", "7", "max |theta| by (11) at rho = 0.1", "10.35"),
    ("001", "7", "max |theta| by (11) at rho = 0.5", "55.05"),
    ("001", "8", "rho at |theta| = 45 deg, frozen frame", "0.381"),
    ("001", "8", "rho at |theta| = 60 deg, frozen frame", "0.448"),
    ("001", "8", "rho at |theta| = 45 deg, tracking frame", "0.418"),
    ("001", "8", "rho at |theta| = 60 deg, tracking frame", "0.537"),
    ("001", "8", "max |theta| at rho = 0.4, frozen frame", "48.7"),
    ("001", "8", "max |theta| at rho = 0.4, tracking frame", "42.8"),
    ("001", "10", "K at rho = 0.1", "0.9922"),
    ("001", "10", "least K", "0.9894"),
    ("001", "10", "rho of the least K", "0.18"),
    ("001", "10", "K at rho = 0.3", "1.0000"),
    ("001", "10", "K at rho = 0.5", "1.2575"),
]


@pytest.mark.parametrize(("paper", "item", "quantity", "text"), KNOWN, ids=lambda x: x)
def test_known_numbers(paper, item, quantity, text):
    assert shown(paper, item, quantity) == text


def test_a_table_has_only_keys_that_are_read():
    """A slip in a key would change a verdict without a message."""
    for paper in PAPERS:
        for item in tomllib.loads((EXAMPLES / "papers" / f"{paper}.toml").read_text("utf-8"))["item"]:
            assert set(item) == {"number", "where", "why", "rows"}
            for entry in item["rows"]:
                needed, known = {"quantity", "computed", "digits"}, {"printed", "rebuilt", "unit", "why"}
                assert needed <= set(entry) <= needed | known | {"below", "above", "agrees"}


def test_the_verdict_follows_from_the_print():
    def verdict(computed, **entry):
        functions = types.SimpleNamespace(value=lambda: computed)
        entry = {"quantity": "x", "computed": ["value"], "digits": 3} | entry
        return _row("000", {"number": "1", "where": "here", "why": "so"}, entry, functions).verdict

    assert verdict(0.136) == "not stated"
    assert verdict(0.136, printed="0.14") == "agrees" and verdict(0.136, printed="0.13") == "corrected"
    assert verdict(12.0, printed="12") == "agrees" and verdict(12.0, printed="substantially") == "corrected"
    assert verdict(3.0, printed="small", below=4.0) == "agrees"
    assert verdict(5.0, printed="small", below=4.0) == "corrected"
    assert verdict(0.5, printed="rises", above=1.0) == "corrected"
    assert verdict(0.14, printed="0.14", agrees=False) == "corrected"


def test_what_the_authors_computed_explains_the_print():
    rebuilt = {r.quantity: r.rebuilt_text for r in every() if r.rebuilt is not None}
    for quantity, text in {
        "R_t left organ, left extreme, 10 rad/s": "-12.47",
        "R_t left organ, left extreme, 50 rad/s": "-313.40",
        "R_t left organ, right extreme, 10 rad/s": "1.62",
        "R_t left organ, right extreme, 50 rad/s": "35.37",
        "X left at 1 rad/s, least": "-0.018",
        "X left at 1 rad/s, largest": "0.202",
        "Y_A2 left at 1 rad/s, least": "0.223",
        "Y_A2 left at 1 rad/s, largest": "0.338",
        "max |theta| at rho = 0.1": "13.53",
        "max |theta| at rho = 0.5": "81.73",
    }.items():
        assert rebuilt[quantity] == text


def test_exact_identities():
    assert (
        abs(float(next(r for r in every() if r.quantity.startswith("largest |theta between")).computed))
        < 1e-13
    )
    assert next(r for r in every() if r.quantity == "regrouped: error against the model").computed < 1e-12
    assert next(r for r in every() if r.quantity == "|b2 printed + b2|, in G1").computed < 1e-13
    assert next(r for r in every() if r.quantity == "error of X with the corrected braces").computed < 1e-13


def test_the_corrected_scheme_is_the_model():
    """The paper's own equations with the right signs: a second route to the dynamic forces of the model."""
    phi = np.linspace(0.0, 2.0 * np.pi, 97)
    unit = paper000.machine()
    for speed in (1.0, 20.0):
        out = unit.forces(phi, speed)
        for side, hand in ((out.left, 1.0), (out.right, -1.0)):
            X, Y, R = paper000.CORRECTED.forces(phi, speed, hand)
            mine = paper000.of_side(side, hand, unit)
            for a, b in ((X, mine.X), (Y, mine.Y_A2), (R, mine.R_t)):
                np.testing.assert_allclose(a, b, rtol=1e-11, atol=1e-11)


def test_hinge_loading_is_the_limit_of_the_model():
    """Both weights in B: the model with a heavy processing-free hinge, by statics of two-force rods."""
    psi = np.radians([-12.0, -3.0, 0.0, 7.0, 12.0])
    got = paper000.hinge_loading(psi)
    o = paper000.angles(psi)
    # equilibrium of the pin B under its weight and the two rods, solved anew as a 2x2 system
    for k in range(len(psi)):
        rods = np.array(
            [[-np.sin(o.al1[k]), np.sin(o.al2[k] - psi[k])], [np.cos(o.al1[k]), np.cos(o.al2[k] - psi[k])]]
        )
        at_a1, at_a2 = np.linalg.solve(rods, [0.0, 1.0])
        assert got.X[k] == pytest.approx(at_a2 * np.sin(o.al2[k] - psi[k]), rel=1e-12)
        assert got.Y_A1[k] == pytest.approx(at_a1 * np.cos(o.al1[k]), rel=1e-12)


@pytest.mark.slow
def test_command_line(tmp_path):
    command = [sys.executable, "-m", "papers", tmp_path / "out"]
    process = subprocess.run(command, cwd=EXAMPLES, capture_output=True, text=True)
    assert process.returncode == 0, process.stderr
    rows = json.loads((tmp_path / "out" / "reproduction.json").read_text())["rows"]
    assert len(rows) == len(every())
    assert {r["verdict"] for r in rows} == {"agrees", "corrected", "not stated"}
    for r in rows:
        assert r["reason"] and r["unit"] and r["shown"]
        if r["printed"] is None:
            assert r["verdict"] == "not stated"
    assert len(list((tmp_path / "out").glob("*.png"))) == 11
    page, text = ((tmp_path / "out" / name).read_text() for name in ("report.html", "reproduction.md"))
    for r in rows:
        assert r["shown"] in page and r["shown"] in text
    assert all(f"({figure.name})" in text for figure in (tmp_path / "out").glob("*.png"))
    # the answer comes first
    count = "21 agree, 43 corrected, 89 that the papers should state."
    assert -1 < process.stdout.find(count) < process.stdout.find("Paper 000")
    assert -1 < page.find('id="opening"') < page.find(count) < page.find("<table")


def test_the_documentation_shows_these_rows():
    text = (Path(__file__).parents[1] / "docs" / "papers.md").read_text()
    for paper in PAPERS:
        (block,) = re.findall(rf"<!-- rows of paper {paper} -->\n(.*?)<!-- end -->", text, re.S)
        # the last digit of a rounding error is the machine's own
        reference = markdown([r for r in every() if r.paper == paper])
        assert re.sub(r"\d\.\de-\d\d", "tiny", block) == re.sub(r"\d\.\de-\d\d", "tiny", reference)


def test_the_slips_of_print_of_paper_002():
    """Its equations in four unknowns, phi1 to phi4: the determinant is zero at the k^2 of either list of constraints.
    With the printed one the free line has no turning, k = 0, and one k^2 is negative below i23 = 1."""
    rng = np.random.default_rng(2)
    for J1, J4, c2, c3, i in rng.uniform(0.2, 0.9, (20, 5)):
        line = Cardan(J1=J1, J4=J4, c2=c2, c3=c3)
        for constraint, torques in (
            ("right", [c2, -c2, -c3 * i, c3 * i]),
            ("printed", [c2, 0.0, -c2 - c3 * i, c3 * i]),
        ):
            squares = paper002.squares(line, i, constraint)
            for square in squares:
                motion = [[c2 - J1 * square, -c2, 0.0, 0.0], [0.0, 0.0, -c3, c3 - J4 * square]]
                equations = np.array([*motion, [0.0, -i, 1.0, 0.0], torques])
                assert abs(np.linalg.det(equations)) < 1e-12 * max(1.0, square) ** 2
            if constraint == "right":
                assert squares == pytest.approx([0.0, frozen_frequency(MATH, line, i) ** 2], rel=1e-12)
            else:
                assert squares[0] < -0.01
    rows = {r.quantity: r for r in every() if r.paper == "002"}
    least = rows["least k^2 at i23 = 1/3, J4 = 1000 J1, equal shafts"]
    assert least.text == "0" and float(least.printed) < 0.0 and least.verdict == "corrected"
    ratio = rows["i23 at bends of 20 and 40 deg, yoke at 30 deg"]
    assert paper002.joint_ratio("by formula") == pytest.approx(ratio.computed, rel=1e-14)
    assert abs(float(ratio.printed) / ratio.computed - 1.0) > 0.1


def test_the_scheme_of_paper_003_is_the_model_once_corrected():
    """The paper's nine equations without the constant, with the cut: a second route to the forces of the triad,
    around the whole turn; with the constant they depend on the unit of length."""
    p = paper003.machine()
    for angle in np.radians(np.arange(0.0, 360.0, 15.0)):
        s = paper003.state(p, float(angle), cut=paper003.CUT)
        reference = paper003.ours(s)
        size = np.max(np.abs(reference))
        np.testing.assert_allclose(paper003.as_the_paper(s, 0.0), reference, atol=1e-12 * size)
        metres, millimetres = (paper003.as_the_paper(s, line) - reference for line in (1.0, 1000.0))
        np.testing.assert_allclose(millimetres, 1000.0 * metres, atol=1e-8 * size)
        assert np.max(np.abs(metres)) > 1e-4 * size


def test_paper_003_shows_what_each_slip_does():
    results = {r.quantity: r for r in every() if r.paper == "003"}
    metres = results["largest error of R_C, R_D, R_E in a turn, lengths in m"].computed
    assert metres == pytest.approx(0.4386, abs=1e-4)
    assert results["largest error in a turn, lengths in mm"].computed == pytest.approx(
        1000.0 * metres, rel=1e-9
    )
    assert results["largest error in a turn without the constant"].computed < 1e-10
    arm = results["force across O4E at E, crank angle 0"]
    assert float(arm.printed) > 4.0 * arm.computed > 0.0
    assert results["rank of the three moments with C, D, E on one line"].computed == 2.0
    assert results["margin of the same triad, two forces and one moment"].computed > 0.1
