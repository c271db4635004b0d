"""The search for the best machine, against other routes: differences, perturbed problems, and sweeps."""

from __future__ import annotations

import json
import math
import signal
import sys
import tomllib
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from command import chainunit
from linkage_files import pressed_both_ways
from reports import plain

from chainunit import Study
from chainunit.batch import native
from chainunit.capabilities.optimize import checks, program
from chainunit.capabilities.optimize.best import find_best, machine_at
from chainunit.capabilities.optimize.conflict import Conflict, nearest
from chainunit.capabilities.optimize.page import OptimizedStudy
from chainunit.capabilities.optimize.result import best_machine, units_of
from chainunit.capabilities.optimize.rows import grid
from chainunit.capabilities.optimize.search import Search
from chainunit.capabilities.optimize.table import wishes_of
from chainunit.capabilities.optimize.wishes import TurnLimit
from chainunit.capabilities.optimize.words import bindings, conflict_sentences
from chainunit.core.files import LIST
from chainunit.reading.result_entries import ResultEntries
from chainunit.reading.results import as_data
from chainunit.study import config as study_files
from chainunit.study.cycle_quantities import cycle_quantity, evaluate
from chainunit.study.organ_limits import ROCKER_GOOD
from chainunit.study.parts import EXAMPLES, example
from chainunit.study.provenance import Heading
from chainunit.study.study_file import toml_text

LINKAGES = Path(__file__).parents[3] / "examples" / "linkages"
TABLE = """
title = "A lighter drive"
[optimize]
objectives = ["peak(crank_torque)"]
slack_free_speed = "4 rad/s"
starts = 4
[optimize.free]
r = { min = "100 mm", max = "200 mm" }
h = { min = "0.8 m", max = "1.3 m" }
crank.m = { min = 10, max = 200 }
crank.s = { min = -0.3, max = 0.3 }
[optimize.limits]
"range(rocker.psi)" = { min = "16 deg", max = "20 deg" }
"min(margin)" = { min = 0.3 }
"max(force(crank_bearing))" = { max = "4 kN" }
"""


OF_STUDY = ("provenance.json", "study_copy.toml")


def wishes(text=TABLE, **changes):
    for before, after in changes.items():
        assert before in text
        text = text.replace(before, after)
    return wishes_of(study_files.parse(text).plans)


def test_extremes_between_the_angles():
    """An extreme from few angles is that of very many, and a mean too."""
    search = Search(wishes())
    q = np.linspace(0.0, 2.0 * math.pi, 50_000, endpoint=False)
    torque = search.columns.whole("crank_torque")
    tau = search.columns.values(search.base, q, 3.0, [torque])[0, 0]
    machine, feed = search.wishes.machine, search.wishes.feed
    outputs = machine.outputs(q * machine.ratio, 3.0 * machine.ratio, 0.0, feed)
    np.testing.assert_allclose(tau, outputs.tau * machine.ratio, rtol=1e-11, atol=1e-9)
    most, least = np.max(tau), np.min(tau)
    sizes = {"max": most, "min": least, "peak": max(most, -least), "rms": np.sqrt(np.mean(tau**2))}
    for reduction, size in sizes.items():
        value = search.value(
            cycle_quantity(f"{reduction}(crank_torque)", search.wishes.machine.model), search.base
        )
        assert value == pytest.approx(size, rel=1e-8), reduction
        if reduction != "rms":
            assert abs(value) >= abs(size)


# -- the search


@pytest.fixture(scope="module")
def best():
    return find_best(wishes())


def test_the_best_machine(best):
    assert best.met and best.starts == 4 and best.feasible == 4 and best.agree >= 3
    assert best.found["peak(crank_torque)"] < 0.6 * best.today["peak(crank_torque)"]
    assert best.neighbours.better == 0 and best.neighbours.feasible > 10
    # by another route in Python, and by the machine's own refusals
    machine = best.machine
    table = evaluate(machine, list(best.quantities.values()), 3.0, best.wishes.feed, engine="numpy")
    for name, value in best.found.items():
        # the angles of the table are a grid
        assert float(table[name]) == pytest.approx(value, rel=1e-4), name
    assert math.degrees(best.found["range(rocker.psi)"]) >= 16.0 - 1e-6
    # as the verdict on two bars has it
    assert machine.slack_speed(best.wishes.feed.left, best.wishes.feed.right) >= 4.0 - 1e-6


def least_mean(machine, feed, speeds, points=720):
    """The least mean pull along a web at these crank speeds, over the turn [N]."""
    webs = len(machine.loaded_sides(feed))
    return np.min(machine.mean_pulls(speeds, feed.left, feed.right, points)[:webs])


@pytest.mark.slow
def test_the_slack_free_speed_counts_in_what_is_shown(best):
    """The pulls beside the machines' own route, and among the neighbours only machines that keep them."""
    feed = best.wishes.feed
    for machine, pull in zip((best.wishes.machine, best.machine), best.pulls, strict=True):
        assert pull == pytest.approx(least_mean(machine, feed, np.linspace(0.01, 4.0, 200)), rel=1e-4)
    # a speed at which some of the neighbours lose their pull
    speed = best.machine.slack_speed(feed.left, feed.right) - 1e-3
    counts = []
    for limit in (0.01, speed):  # near rest no web loses its pull
        own = _with(best.wishes, table=_with(best.wishes.table, slack_free_speed=limit))
        search, value = Search(own), best.answer.value
        own_limits = own.objectives[0], own.limits
        counts.append(checks.neighbours(search, best.answer.x, *own_limits, value).feasible)
        if limit == speed:
            points = checks.around(search, best.answer.x)
            quick = [machine_at(own, x) for x in points]
            crank = np.linspace(0.0, speed, 30)
            keeps = [least_mean(each, feed, crank, 180) >= 0.0 for each in quick]
            assert 0 < sum(keeps) < len(points)
    assert counts[1] <= min(counts[0], sum(keeps)) and counts[1] < counts[0]


@pytest.mark.second
def test_sensitivities_are_those_of_perturbed_problems(best):
    """Each limit and bound that binds, moved a little: the least value moves as its multiplier says."""
    search, objective = Search(best.wishes), best.wishes.objectives[0]
    value, binding = best.answer.value, bindings(best)
    assert {(each.name, each.side) for each in binding} >= {("range(rocker.psi)", "min"), ("crank.m", "min")}
    for each in binding:
        if each.name == "slack_free_speed":
            continue
        step = 1e-3 * abs(each.value)
        text = TABLE
        if each.name in best.wishes.free:
            free = dict(best.wishes.free)
            low, high = free[each.name]
            free[each.name] = (low + step, high) if each.side == "min" else (low, high + step)
            moved = Search(_with(best.wishes, free=free)).solve(best.answer.x, objective)
        else:
            limits = tuple(_moved(limit, each, step) for limit in best.wishes.limits)
            moved = search.solve(best.answer.x, objective, limits)
        assert moved.feasible, text
        assert (moved.value - value) / step == pytest.approx(each.slope, rel=0.02), each.name


@pytest.mark.second
def test_a_search_compiles_nothing_and_refines_each_end_once(monkeypatch):
    def compiled(*_):
        raise AssertionError("the search needs no compiler")

    monkeypatch.setattr(native, "compile_code", compiled)
    search = Search(wishes())
    starts = search.starts(4)[0]
    answers = [search.solve(x, search.wishes.objectives[0]) for x in starts]
    assert all(answer.feasible for answer in answers)
    assert np.ptp([answer.value for answer in answers]) < 1e-9
    # a rough program from each start, and further ones for one of them alone
    assert search.effort.programs <= len(starts) + 6


@pytest.mark.second
def test_an_exact_limit():
    """A limit with one value for both sides, and its sensitivity."""
    search = Search(wishes(**{'"16 deg", max = "20 deg"': '"17 deg", max = "17 deg"'}))
    objective, swing = search.wishes.objectives[0], search.wishes.limits[0]
    values = []
    for step in (-1e-3, 0.0, 1e-3):
        wanted = swing.low + step
        limits = (TurnLimit(swing.quantity, wanted, wanted), *search.wishes.limits[1:])
        answer = search.solve(search.base, objective, limits)
        assert answer.feasible
        assert search.value(swing.quantity, answer.x) == pytest.approx(wanted, rel=1e-8)
        values.append(answer.value)
        if not step:
            slope = answer.sensitivities["range(rocker.psi)", "min"]
    assert (values[2] - values[0]) / 2e-3 == pytest.approx(slope, rel=1e-3)


TEN = """
[optimize]
slack_free_speed = "4 rad/s"
starts = 2
[optimize.free]
r = { min = "100 mm", max = "200 mm" }
h = { min = "0.8 m", max = "1.3 m" }
l = { min = "1.3 m", max = "1.7 m" }
z = { min = 0.7, max = 1.0 }
crank.m = { min = "10 kg", max = "200 kg" }
crank.s = { min = "-0.3 m", max = "0.3 m" }
coupler.m = { min = "15 kg", max = "40 kg" }
coupler.s = { min = "0.4 m", max = "1.0 m" }
rocker.m = { min = "50 kg", max = "80 kg" }
rocker.s = { min = "0.3 m", max = "0.7 m" }
[optimize.limits]
"range(rocker.psi)" = { min = "16 deg", max = "20 deg" }
"min(margin)" = { min = 0.3 }
"max(force(crank_bearing))" = { max = "450 N" }
"rms(power)" = { max = "200 W" }
"""
SIX_BAR = """
[system]
machine = "FILE"
[run]
crank_speed = "60 rpm"
[optimize]
starts = 3
[optimize.free]
r = { min = "40 mm", max = "60 mm" }
l = { min = "200 mm", max = "230 mm" }
shank = { min = "280 mm", max = "320 mm" }
coupler.mass = { min = "1 kg", max = "2 kg" }
[optimize.limits]
"range(y(F))" = { min = "45 mm" }
"range(x(F))" = { max = "157 mm" }
"max(force(O2))" = { max = "400 N" }
"min(margin)" = { min = 0.3 }
"""


@pytest.mark.second
def test_ten_free_parameters():
    """The value that the same search reached with values and derivatives in compiled code."""
    search = Search(wishes(TEN))
    for x in search.starts(2)[0]:
        answer = search.solve(x, search.wishes.objectives[0])
        assert answer.feasible and answer.value == pytest.approx(6.850502593177637, rel=1e-8)
        assert answer.sensitivities["range(rocker.psi)", "min"] == pytest.approx(28.16788, rel=1e-5)


@pytest.mark.second
def test_a_six_bar_linkage_with_limits_of_both_kinds():
    """The conflict that the same search found with values and derivatives in compiled code."""
    file = (LINKAGES / "watt_six_bar.toml").as_posix()
    own = find_best(wishes(SIX_BAR, FILE=file))
    assert not own.met and set(own.conflict.alone) == {"max(force(O2))"}
    assert set(own.conflict.together) == {"range(x(F))", "range(y(F))"}
    assert own.conflict.nearest.value == pytest.approx(0.8073977446642715, rel=1e-8)
    assert own.conflict.nearest.x == pytest.approx([0.04, 0.23, 0.28, 2.0], rel=1e-8)


def _with(own, **changes):
    import dataclasses

    return dataclasses.replace(own, **changes)


def _moved(limit, each, step):
    if limit.name != each.name:
        return limit
    return _with(limit, **{"low" if each.side == "min" else "high": each.value + step})


@pytest.mark.slow
def test_one_parameter_without_limits():
    """A counterweight alone: the RMS torque is a smooth function of one number."""
    text = '[optimize]\nobjectives = ["rms(crank_torque)"]\n[optimize.free.crank]\ns = { min = -1, max = 1 }'
    own = wishes(text)
    search = Search(own)
    answers = [search.solve(x, own.objectives[0]) for x in search.starts(1)[0]]
    lengths = np.linspace(-1.0, 1.0, 401)
    table = evaluate(
        own.machine, own.objectives, 3.0, own.feed, {"crank.s": lengths}, angles=90, engine="numpy"
    )
    values = table["rms(crank_torque)"].values
    for answer in answers:
        assert answer.feasible and answer.x[0] == pytest.approx(lengths[np.argmin(values)], abs=6e-3)
        assert np.min(values) * (1.0 - 1e-3) < answer.value <= np.min(values) * (1.0 + 1e-6)


def test_no_parameter_has_an_effect(tmp_path):
    """The torque at the crank does not depend on the gear."""
    (tmp_path / "mine.toml").write_text("[optimize.free]\nratio = { min = 10, max = 60 }\n")
    done = chainunit("optimize", "mine.toml", "-o", "none", cwd=tmp_path)
    words = "mine.toml:1: optimize.free: ratio has no effect on peak(crank_torque); free a parameter on which"
    assert done.returncode == 2 and words in done.stderr


@pytest.mark.parametrize(
    ("changes", "names", "held"),
    [
        ({'"16 deg", max = "20 deg"': '"40 deg"'}, {"range(rocker.psi)"}, {("r", "max"), ("h", "min")}),
        pytest.param(
            {'"4 kN"': '"250 N"', "crank.m = { min = 10": "crank.m = { min = 60"},
            {"max(force(crank_bearing))"},
            {("r", "min"), ("crank.m", "min")},
            marks=pytest.mark.slow,
        ),
    ],
)
def test_an_impossible_wish(changes, names, held):
    own = find_best(wishes(**changes, **{"starts = 4": "starts = 2"}))
    assert not own.met and set(own.conflict.names) == names
    assert held <= set(own.conflict.bounds)
    words = " ".join(conflict_sentences(own))
    assert "No machine within the bounds has" in words and all(
        f"{name}.{side} =" in words for name, side in held
    )


@pytest.mark.second
def test_each_impossible_wish_is_named():
    pair = {'"16 deg", max = "20 deg"': '"40 deg"', '"4 kN"': '"1 N"', "starts = 4": "starts = 1"}
    text = TABLE
    for before, after in pair.items():
        assert before in text
        text = text.replace(before, after)
    config = study_files.parse(text)
    own = find_best(wishes_of(config.plans))
    assert set(own.conflict.alone) == {"range(rocker.psi)", "max(force(crank_bearing))"}
    assert not own.conflict.together
    # each alone comes as near as it comes without the other
    search = Search(own.wishes)
    for limit in own.wishes.limits:
        if limit.name in own.conflict.alone:
            others = frozenset(each.name for each in own.wishes.limits) - {limit.name}
            answer, met = nearest(search, search.starts(1)[0], others | {"slack_free_speed", "clearance"})
            value = search.value(limit.quantity, answer.x)
            assert not met and own.conflict.alone[limit.name] == pytest.approx(value, rel=1e-4)
    page = OptimizedStudy(config, own).report
    assert page.title == "A lighter drive: no machine found" and page.status == "no machine found"
    shown = " ".join(plain(page).split())
    assert (
        "range(rocker.psi) of at least 40 deg; none has max(force(crank_bearing)) of at most 1 N. Each"
        in shown
    )
    assert shown.count(" missed ") == 2 and "1 start over the bounds: none ended at a machine that" in shown
    quantities = page.result["quantities"]
    assert {name for name, q in quantities.items() if q["missed"]} == set(own.conflict.alone)


def test_words_of_both_kinds_of_conflict(best):
    alone, pair = {"max(force(crank_bearing))": 235.0}, ("range(rocker.psi)", "slack_free_speed")
    own = _with(best, answer=None, conflict=Conflict(alone, pair, best.answer, (("r", "min"),)))
    first, second, third, fourth = conflict_sentences(own)
    assert first == "No machine within the bounds has max(force(crank_bearing)) of at most 4000 N."
    assert second.startswith(
        "Beside that, no machine has range(rocker.psi) from 16 deg to 20 deg and webs that keep"
    )
    assert third.endswith("the first of these limits alone has max(force(crank_bearing)) = 235 N.")
    assert fourth == "The bounds that hold the nearest to all of them: r.min = 0.1 m."


def test_small_powers_are_in_watts(best):
    power = cycle_quantity("installed_power", best.machine.model)
    limits = (*best.wishes.limits, TurnLimit(power, None, 1.0))
    values = {"installed_power": 70.0}
    own = _with(
        best,
        wishes=_with(best.wishes, limits=limits),
        found={**best.found, **values},
        today={**best.today, **values},
    )
    plain_file = study_files.parse(TABLE)
    assert units_of(own, plain_file.file.tables, plain_file.units)["power"] == ("W",)
    chosen = study_files.parse(f'{TABLE}[report.units]\npower = "kW"\n')
    for found in (own, best):
        assert units_of(found, chosen.file.tables, chosen.units)["power"] == ("kW",)


@pytest.mark.slow
def test_two_wishes_that_conflict():
    """A swing and a speed of slack, each of which can be met alone."""
    pair = {'"16 deg"': '"19 deg"', "4 rad/s": "8 rad/s", "starts = 4": "starts = 2"}
    own = find_best(wishes(**pair))
    assert set(own.conflict.names) == {"range(rocker.psi)", "slack_free_speed"}
    search = Search(own.wishes)
    for name in own.conflict.names:
        _, met = nearest(search, search.starts(2)[0], frozenset({name}))
        assert met, name


# -- other machines, other objectives, more starts


PRESS = """
machine.linkage = "PRESS"
run.crank_speed = "60 rpm"
[optimize]
objectives = ["rms(crank_torque)"]
starts = 2
pareto_points = 4
[optimize.free]
r = { min = "70 mm", max = "90 mm" }
l = { min = "300 mm", max = "420 mm" }
offset = { min = "-40 mm", max = "40 mm" }
[optimize.limits]
"max(force(A))" = { max = "100 kN" }
"range(ram.C.y)" = { min = "150 mm" }
"""


@pytest.fixture
def press(tmp_path):
    """Its force never changes: a mean over even angles is then exact."""
    return PRESS.replace('"PRESS"', f'"{pressed_both_ways(tmp_path).as_posix()}"')


@pytest.mark.slow
def test_a_linkage_file(press):
    """The best of three parameters is that of a map over all of them; a fourth one, on which nothing depends, keeps
    its value."""
    config = study_files.parse(
        press.replace("[optimize.free]", "[optimize.free]\nratio = { min = 10, max = 60 }")
    )
    own = find_best(wishes_of(config.plans))
    assert own.idle == {"ratio": (10.0, 60.0)} and own.wishes.names == ("r", "l", "offset")
    assert own.machine.ratio == own.wishes.machine.ratio
    page = OptimizedStudy(config, own).report
    assert "ratio has no effect on rms(crank_torque) and the limits: it keeps its value of today." in plain(
        page
    )
    ratio = page.result["parameters"]["ratio"]
    assert page.result["without_effect"] == ["ratio"] and ratio["best"] == ratio["today"]
    assert own.met and own.agree == 2 and own.neighbours.better == 0
    quantities = list(own.quantities.values())
    fine = [np.linspace(low, high, 21) for low, high in own.wishes.free.values()]
    values = dict(zip(own.wishes.names, fine, strict=True))
    given = own.wishes.machine, quantities, own.wishes.crank_speed, own.wishes.feed, values
    table = evaluate(*given, angles=60, engine="numpy")
    met = table["range(ram.C.y)"] >= 0.15
    least = float(table["rms(crank_torque)"].where(met).min())
    assert own.answer.value <= least * (1.0 + 1e-6) and own.answer.value == pytest.approx(least, rel=0.01)


@pytest.mark.slow
def test_two_objectives(press):
    """No machine of the front is better than another in both; its ends are the best of each objective."""
    text = press.replace('["rms(crank_torque)"]', '["rms(crank_torque)", "max(force(A))"]')
    own = find_best(wishes(text))
    values = np.array([point.values for point in own.front])
    assert len(values) == 4 and np.all(np.diff(values[:, 0]) > 0.0) and np.all(np.diff(values[:, 1]) < 0.0)
    search, objectives = Search(own.wishes), own.wishes.objectives
    for k, end in enumerate((0, -1)):
        alone = min(search.solve(x, objectives[k]).value for x in search.starts(2)[0])
        assert values[end, k] == pytest.approx(alone, rel=2e-6)
    for point in own.front:
        assert [search.value(q, point.x) for q in objectives] == pytest.approx(point.values, rel=1e-9)
        assert search.value(own.wishes.limits[1].quantity, point.x) >= 0.15 * (1.0 - 1e-6)
    assert own.neighbours.better == 0
    page = OptimizedStudy(study_files.parse(text), own).report
    words = plain(page)
    assert (
        "meet all limits and have no more max(force(A)), and 0 of these are better in rms(crank_torque)"
        in words
    )
    (chosen,) = (point for point in page.result["front"] if point["chosen"])
    assert chosen["values"]["max(force(A))"]["value"] == pytest.approx(own.found["max(force(A))"], rel=1e-6)
    assert all(", with max(force(A)) held at" in each["text"] for each in page.result["bindings"])
    assert page.result["bindings"] and words.count("best.toml") == 1


MANY = TABLE.replace("starts = 4", "starts = 32").replace(
    "[optimize.free]", "[optimize.free]\nz = { min = 0.7, max = 1.0 }\nrocker.m = { min = 50, max = 80 }"
)


@pytest.mark.slow
@pytest.mark.parametrize("objective", ["peak(crank_torque)", "installed_power", "energy_per_year"])
def test_many_starts_find_the_same(objective):
    own = find_best(wishes(MANY, **{"peak(crank_torque)": objective}))
    assert own.agree >= 20 and own.neighbours.better == 0


@pytest.mark.slow
def test_a_genetic_search_finds_nothing_better():
    """NSGA-II with a hundred times the evaluations of all starts together."""
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.problem import Problem
    from pymoo.optimize import minimize

    own = find_best(wishes(MANY.replace("starts = 32", "starts = 20")))
    search, n = Search(own.wishes), len(own.wishes.names)
    columns, q = search.columns, grid(180)
    torque, force, psi = (
        columns.whole(name) for name in ("crank_torque", "force(crank_bearing)", "rocker.psi")
    )
    margin = list(columns.pieces("margin", "FMIN"))
    places = [torque, force, psi, *margin]
    limits = np.radians([16.0, 20.0])

    class Drive(Problem):
        def __init__(self):
            bounds = {"xl": columns.low, "xu": columns.low + columns.span}
            super().__init__(n_var=n, n_obj=1, n_ieq_constr=5, **bounds)

        def _evaluate(self, x, out, *_, **__):
            rows = [self.of_machine(each) for each in x]
            out["F"] = np.nan_to_num([row[:1] for row in rows], nan=1e9)
            out["G"] = np.nan_to_num([row[1:] for row in rows], nan=1e9)

        def of_machine(self, x):
            values = columns.values(x, q, 3.0, places)[0]
            pulls = columns.values(x, q, 4.0, search.pulls)
            swing = np.ptp(values[2])
            return [np.max(np.abs(values[0])), limits[0] - swing, swing - limits[1],
                    0.3 - np.min(values[3:]), np.max(values[1]) - 4000.0, -np.min(pulls)]  # fmt: skip

    wanted = 100 * own.effort.evaluations
    found = minimize(Drive(), NSGA2(pop_size=200), ("n_eval", wanted), seed=1)
    print(f"{own.answer.value:.9g} with {own.effort.evaluations}; NSGA-II {found.F[0]:.9g} with {wanted}")
    # at the angles of a grid its peaks and pulls are a little too small
    assert float(found.F[0]) > own.answer.value * (1.0 - 1e-4)


# -- the table, the files and the command


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        (
            {'["peak(crank_torque)"]': '["peak(torque)"]'},
            'mine.toml:4: optimize.objectives: "peak(torque)": the ChamberForces has no output torque',
        ),
        ({"r = {": "rr = {"}, "mine.toml:8: optimize.free.rr: no such parameter of the machine"),
        (
            {'max = "200 mm"': 'max = "200 kg"'},
            'mine.toml:8: optimize.free.r.max = "200 kg": must be a number in m',
        ),
        ({', max = "200 mm"': ""}, "mine.toml:8: optimize.free.r = { min = "),
        (
            {'min = "0.8 m"': 'min = "1.4 m"'},
            "mine.toml:9: optimize.free.h: max = 1.3 m must be > min = 1.4 m",
        ),
        ({"[optimize.limits]": '[optimize.limits]\n"min(margn)" = { min = 1 }'}, 'was "margin" meant?'),
        ({'{ max = "4 kN" }': "3000"}, "must be a table with min, max, or both"),
        ({"16 deg": "21 deg"}, "must be >= min"),
        (
            {'"20 deg"': "14"},
            "range(rocker.psi).max: is more than a turn; a number without a unit is in radians; "
            'was "14 deg" meant?',
        ),
        ({"starts = 4": "starts = 0.5"}, "mine.toml:6: optimize.starts = 0.5: must be a whole number >= 1"),
    ],
)
def test_refusals(changes, line, tmp_path):
    text = TABLE
    for before, after in changes.items():
        assert before in text
        text = text.replace(before, after)
    (tmp_path / "mine.toml").write_text(text)
    done = chainunit("optimize", "mine.toml", cwd=tmp_path)
    assert done.returncode == 2 and line in done.stderr, done.stderr


FAULTS = """[optimize]
objectives = ["peak(crank_torqe)"]
starts = 0.5
[optimize.free]
machine.r = { min = 0.1, max = 0.2 }
crank.m = 3
crank.s = { min = -0.3, max = 0.3, step = 0.1 }
z = { min = 0.1 }
[optimize.limits]
"range(rocker.psi)" = { min = "40 kg", max = "20 N" }
[[sweep.parameter]]
name = "machine.h"
from = 1
to = 0.5
"""


@pytest.mark.parametrize("command", ["optimize", "export"])
def test_all_faults_at_once(command, tmp_path):
    (tmp_path / "mine.toml").write_text(FAULTS)
    done = chainunit(command, "mine.toml", cwd=tmp_path)
    assert done.returncode == 2
    lines = [
        '2: optimize.objectives: "peak(crank_torqe)": the ChamberForces has no output',
        "3: optimize.starts = 0.5: must be a whole number >= 1",
        "5: optimize.free.machine.r: no such parameter of the machine; write optimize.free.r",
        "6: optimize.free.crank.m = 3: must be a table with min and max",
        "7: optimize.free.crank.s.step: unknown key; known here: min, max",
        "8: optimize.free.z = { min = 0.1 }: must have min and max",
        '10: optimize.limits.range(rocker.psi).min = "40 kg": must be a number in rad',
        '10: optimize.limits.range(rocker.psi).max = "20 N": must be a number in rad',
        "14: sweep.parameter.1.to: must be > from, 1 m (machine.h)",
    ]
    for expected, line in zip(lines, done.stderr.splitlines(), strict=True):
        assert line.startswith(f"chainunit: mine.toml:{expected}"), line


FREE_S = "[optimize.free.crank]\ns = { min = 0, max = 1 }\n"
UNSUITABLE = {
    "optimize: is missing": "",
    "must name at least one parameter": "[optimize]\n",
    'quantities of a turn are of organs with two bars; leave out organ = "chain"': f'organ = "chain"\n{FREE_S}',
    "needs webs with mass or load": f'optimize.slack_free_speed = 3\n{FREE_S}[system]\nmachine = "KnifeDrive"',
}


@pytest.mark.parametrize("words", UNSUITABLE)
def test_what_cannot_be_searched(words, tmp_path):
    (tmp_path / "mine.toml").write_text(UNSUITABLE[words])
    done = chainunit("optimize", "mine.toml", cwd=tmp_path)
    assert done.returncode == 2 and words in done.stderr


@pytest.mark.second
def test_the_command(tmp_path, best):
    (tmp_path / "mine.toml").write_text(TABLE)
    done = chainunit("optimize", "mine.toml", "-o", "out/deep", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "more of crank.m.min raises peak(crank_torque) by" in done.stdout
    words = " ".join(done.stdout.split())
    assert "The best machine has r 0.17522 m (today 0.15000 m), h" in words and "crank.s -0.264" in words
    folder = tmp_path / "out" / "deep"
    names = {"best.toml", "result.json", "result.md", "report.html", "torque.png", LIST, *OF_STUDY}
    assert {file.name for file in folder.iterdir()} == names
    result = ResultEntries(json.loads((folder / "result.json").read_text("utf-8")))
    assert result["quantities"]["peak(crank_torque)"]["best"]["value"] == pytest.approx(
        best.answer.value, rel=1e-6
    )
    # the file with the best values is a study with that machine
    written = study_files.load(folder / "best.toml")
    assert written.machine.by_name == pytest.approx(best.machine.by_name, rel=1e-3)
    q = cycle_quantity("peak(crank_torque)", written.machine.model)
    value = evaluate(written.machine, [q], 3.0, written.feed, engine="numpy")[q.name]
    assert float(value) == pytest.approx(best.answer.value, rel=1e-4)
    # its tables are those of the study, so that the search may go on from there
    assert wishes_of(written.plans).free == best.wishes.free
    page = (folder / "report.html").read_text("utf-8")
    for name in ("r", "crank.m", "peak(crank_torque)"):
        assert f'<th scope="row"><span class="as-is">{name}</span></th>' in page
    other = chainunit("study", "-o", "out/deep", cwd=tmp_path)
    assert other.returncode == 2 and "has the result of a search for the best machine" in other.stderr


@pytest.fixture
def few(tmp_path):
    """A search over one number."""
    (tmp_path / "mine.toml").write_text(
        '[optimize]\nobjectives = ["rms(crank_torque)"]\n[optimize.free.crank]\ns = { min = -1, max = 1 }'
    )
    return tmp_path


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
@pytest.mark.parametrize(("sent", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_an_interrupt_inside_the_solver_ends_the_command(sent, status, few, monkeypatch):
    """CasADi drops an exception inside the solver: the interrupt must reach the command."""
    calls, stoppable = [], program.stoppable

    @contextmanager
    def interrupted():
        with stoppable() as stopped:

            def after_an_iteration():
                calls.append(1)
                if len(calls) == 2:
                    signal.raise_signal(sent)
                return stopped()

            yield after_an_iteration

    monkeypatch.setattr(program, "stoppable", interrupted)
    done = chainunit("optimize", "mine.toml", "-o", "out", cwd=few)
    assert done.returncode == status and "interrupted" in done.stderr, done.stderr
    # the second time IPOPT is told to end, and the third time the search asks why it ended
    assert len(calls) == 3 and not (few / "out").exists()


@pytest.mark.second
def test_the_command_with_an_impossible_wish(tmp_path):
    text = TABLE.replace('"16 deg", max = "20 deg"', '"40 deg"').replace("starts = 4", "starts = 1")
    (tmp_path / "mine.toml").write_text(text)
    done = chainunit("optimize", "mine.toml", "-o", "out", cwd=tmp_path)
    assert done.returncode == 1 and not (tmp_path / "out" / "best.toml").exists()
    assert "No machine within the bounds has range(rocker.psi) of at least 40 deg." in done.stdout


def test_no_machine_within_the_bounds_turns(tmp_path):
    (tmp_path / "mine.toml").write_text("[optimize.free]\nr = { min = 1.2, max = 1.4 }\n")
    done = chainunit("optimize", "mine.toml", cwd=tmp_path)
    assert done.returncode == 1
    assert (
        "No machine within the bounds of optimize.free turns. The one nearest to today's: r = 1.2 m"
        in done.stderr
    )


def test_a_speed_beyond_the_limit_of_the_organs_is_told(best):
    """The limit of the best machine, not that of today's."""
    config = study_files.parse(TABLE)
    feed, answer = best.wishes.feed, best.machine
    (organ,) = as_data(best_machine(best, Heading.of(config.title, config.file)))["organs"]
    limit = ROCKER_GOOD * answer.chain_modes(feed.left, feed.right).frequency[0]
    assert (
        organ["topic"] == "rocker torque" and organ["limit"]["value"] == pytest.approx(limit) and limit < 3.0
    )
    assert "the limit of the best machine is" in plain(OptimizedStudy(config, best).report)
    slow = _with(best, wishes=_with(best.wishes, crank_speed=0.9 * limit))
    assert best_machine(slow, Heading.of(config.title, config.file)).organs == []


@pytest.mark.second
def test_in_python(best):
    result = Study.from_text(TABLE).optimize()
    assert result.met and result.best.answer.value == pytest.approx(best.answer.value, rel=1e-6)
    assert result.study.machine.by_name == result.machine.by_name
    assert (
        "peak(crank_torque)" in repr(result)
        and ResultEntries(json.loads(result.to_json()))["status"] == "complete"
    )


@pytest.mark.parametrize("name", [*EXAMPLES, "table"])
def test_tables_are_written_as_they_are_read(name):
    tables = tomllib.loads(TABLE if name == "table" else example(name))
    assert tomllib.loads(toml_text(tables)) == tables
    nested = {"a": {"b": [{"c": 1}, {"c": 'x"y'}], "d e": {"f": {"g": [1.5, -math.inf]}}}, "h": True, "k": {}}
    assert tomllib.loads(toml_text(nested)) == nested
