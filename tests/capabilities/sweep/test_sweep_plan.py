"""The plan of a sweep: what a file says, and its points, which are determined by their numbers alone."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import qmc

from chainunit import InputError
from chainunit.study.config import parse

R = "[[sweep.parameter]]\nname = 'machine.r'\nfrom = '130 mm'\nto = 0.17\n"
L1 = "[[sweep.parameter]]\nname = 'machine.l1'\ntolerance = '3 mm'\n"
SPEED = "[[sweep.parameter]]\nname = 'run.crank_speed'\nvalues = ['30 rev/min', 4]\n"


def plan_of(*parts, head=""):
    return parse(f"[sweep]\n{head}\n" + "".join(parts)).plans["sweep"]


def test_a_grid_has_all_combinations_in_order():
    plan = plan_of(R + "points = 3\n", SPEED, L1, head="method = 'grid'")
    assert plan.dims == ("machine.r", "run.crank_speed", "machine.l1")
    assert plan.shape == (3, 2, 3) and plan.points == 18
    axes = [[0.13, 0.15, 0.17], [np.pi, 4.0], [1.347, 1.35, 1.353]]
    wanted = [np.ravel(x) for x in np.meshgrid(*axes, indexing="ij")]
    for part, whole in zip(plan.values(0, 18).values(), wanted, strict=True):
        np.testing.assert_allclose(part, whole, rtol=1e-15)
    some = plan.values(5, 11)
    for name, whole in zip(plan.dims, wanted, strict=True):
        np.testing.assert_allclose(some[name], whole[5:11], rtol=1e-15)


@pytest.mark.parametrize("method", ["sobol", "latin_hypercube"])
def test_points_are_those_of_their_numbers(method):
    """In parts that begin anywhere and in any order, and in another process, which has another plan object."""
    head = f"method = '{method}'\npoints = 100\nseed = 7"
    whole = plan_of(R, L1, SPEED, head=head).values(0, 100)
    plan = plan_of(R, L1, SPEED, head=head)
    for begin, end in ((64, 100), (80, 81), (0, 3), (2, 3), (3, 64), (99, 100), (17, 18), (0, 100)):
        for name, values in plan.values(begin, end).items():
            np.testing.assert_array_equal(values, whole[name][begin:end])
    other = plan_of(R, L1, SPEED, head=head.replace("7", "8")).values(0, 100)
    assert not np.any(other["machine.r"] == whole["machine.r"])


def test_sobol_points_are_those_of_scipy():
    u = qmc.Sobol(2, rng=np.random.default_rng(5)).random(64)
    values = plan_of(R, L1, head="points = 50\nseed = 5").values(0, 50)
    np.testing.assert_allclose(values["machine.r"], 0.13 + 0.04 * u[:50, 0], atol=1e-10)
    np.testing.assert_allclose(values["machine.l1"], 1.347 + 0.006 * u[:50, 1], atol=1e-11)


def test_a_hypercube_has_a_point_in_each_stratum():
    values = plan_of(R, head="method = 'latin_hypercube'\npoints = 50").values(0, 50)
    strata = np.floor((values["machine.r"] - 0.13) / 0.04 * 50)
    assert sorted(strata) == list(range(50))


def test_distributions():
    """A normal tolerance is three standard deviations; values come equally often."""
    plan = plan_of(L1 + "distribution = 'normal'\n", SPEED, head="points = 4096")
    values = plan.values(0, 4096)
    deviation = (values["machine.l1"] - 1.35) / 1e-3
    assert np.mean(deviation) == pytest.approx(0.0, abs=2e-3)
    assert np.std(deviation) == pytest.approx(1.0, abs=2e-3)
    assert np.mean(np.abs(deviation) < 3.0) == pytest.approx(0.9973, abs=5e-4)
    assert np.mean(values["run.crank_speed"] == 4.0) == pytest.approx(0.5, abs=1e-3)


def test_values_of_the_study_and_the_results():
    plan = plan_of(R, L1)
    assert plan.quantities == ("peak(crank_torque)", "rms(crank_torque)") and plan.best == plan.quantities[0]
    assert plan.parameters[1].centre == 1.35 and plan.parameters[1].ends == pytest.approx(
        (1.347, 1.353), rel=1e-15
    )
    assert plan.points == 1024 and plan.angles == 720 and plan.basis.operating_hours == 4000.0
    force = "[[sweep.parameter]]\nname = 'event.jam_left.force'\nfrom = 100\nto = '2 kN'\n"
    plan = plan_of(force, head="measures = ['current_peak', 'crank_torque_peak']\nbest = 'crank_torque_peak'")
    assert plan.event == "jam_left" and plan.quantities == () and plan.best == "crank_torque_peak"
    assert parse("").plans["sweep"] is None


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[sweep]\nmethod = 'latin_hypercube'\npoints = 1e8\n", 'take method = "sobol"'),
        ("[sweep.parameter]\nname = 'machine.r'\n", "each below [[sweep.parameter]]"),
        ("[sweep]\nparameter = [3]\n", "sweep.parameter.1 = 3: must be a table"),
        ("[[sweep.parameter]]\nname = 'run.step'\nvalues = [1]\n", "must be the full name of a number"),
        ("[[sweep.parameter]]\nvalues = [1]\n", "sweep.parameter.1.name: must be given"),
        (R + "tolerance = 1\n", "take one of these ways only"),
        (R + R, 'sweep.parameter.2.name = "machine.r": stands there twice'),
        (SPEED + "distribution = 'normal'\n", "is of a tolerance"),
        (SPEED.replace("4", "'30 rpm'"), "has a value twice"),
        (SPEED.replace("4", "true"), "must be a number, or a text with a unit"),
        ("[[sweep.parameter]]\nname = 'run.crank_speed'\nvalues = []\n", "at least one value"),
        (L1.replace("3 mm", "-3 mm"), "must be > 0 m"),
        ("[sweep]\nmethod = 'grid'\n" + L1 + "distribution = 'normal'\n", "points that are no grid"),
        ("[sweep]\nmethod = 'grid'\n" + R + "points = 2.5\n", "must be a whole number"),
        ("[sweep]\nmethod = 'grid'\n" + R + "points = 1\n", "must be a whole number >= 2"),
        ("[[sweep.parameter]]\nname = 'event.jam_left.force'\nvalues = [100]\n", "add sweep.measures"),
        ("[sweep]\nevent = 'jam_left'\n" + R, "is of measures"),
        (
            "[[sweep.parameter]]\nname = 'event.jam_left.crank_angle'\nvalues = [90]\n",
            'is more than a turn; a number without a unit is in radians; was "90 deg" meant?',
        ),
        ("[sweep]\nmeasures = ['stall_time']\nevent = 'jam'\n" + R, 'sweep.event = "jam": must be one of'),
        ("[[event]]\ntype = 'start'\nside = 'left'\n[sweep]\nmeasures = ['stall_time']\n" + R, "steady running"),
        ("[system]\nmotor = 'IE3 4-pole 0.75 kW, 80M'\n" + R.replace("machine.r", "machine.ratio"), "rated speed"),
        ("organ = 'chain'\n[sweep]\nquantities = ['min(margin)']\n" + R, "are of organs with two bars"),
        (
            "[sweep]\nmethod = 'grid'\n" + "".join(R.replace("machine.r", f"machine.{x}") + "points = 1000\n" for x in
            ("r", "l", "h", "c")),
            "the grid has 1e+12 points",
        ),
    ],
)  # fmt: skip
def test_refusals(text, words):
    with pytest.raises(InputError) as error:
        parse(text)
    assert words in str(error.value)
