"""docs/evidence.md is what bench/page.py makes of the committed figures; the benches count and compare rightly."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest

from chainunit.capabilities.watch.notices import CHAINS_GOOD
from chainunit.core.model import Model, Part
from chainunit.core.native.compilers import compiler
from chainunit.core.quantities import Value, declaration, quantity

ROOT = Path(__file__).parents[1]


@pytest.fixture
def bench(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "bench"))
    names = {file.stem for file in (ROOT / "bench").glob("*.py")}
    yield __import__
    for name in names & sys.modules.keys():
        del sys.modules[name]


@pytest.fixture
def figures(bench):
    return json.loads(bench("page").FIGURES.read_text("utf-8"))


def test_the_page_is_made_from_the_figures(bench, figures):
    """Else run `python bench/page.py`."""
    page = bench("page")
    for name, text in page.PAGES.items():
        assert (page.DOCS / name).read_text("utf-8") == text(figures)
    assert set(figures) == {*page.BENCHES, *page.LONG}


def test_the_own_functions_take_a_tenth_more_at_most(figures):
    rows = [costs for model in figures["step_cost"]["own"].values() for costs in model.values()]
    assert len(rows) > 15 and all(own <= 1.1 * library for own, library in rows)


def test_the_limit_of_chains_is_the_measured_one(bench, figures):
    """The speed up to which a study takes the observer's word beside chains."""
    assert f"{bench('observer').share_below(figures['observer'], 0.2):.2f}" == str(CHAINS_GOOD)
    page = (bench("page").DOCS / "identification.md").read_text("utf-8")
    assert f"{bench('observer').share_below(figures['observer'], 0.05):.2f} of their lowest resonance" in page


def test_each_goal_stands_there_with_its_measured_value(bench, figures):
    page = bench("page")
    rows = [line.strip("| \n").split(" | ") for line in page.goals(figures).splitlines()[2:]]
    goals = figures["states"]["goals"]
    assert [row[0] for row in rows] == [each["goal"] for each in goals] and len(goals) >= 5
    text = (page.DOCS / "evidence.md").read_text("utf-8")
    for row, each in zip(rows, goals, strict=True):
        assert "| " + " | ".join(row) + " |" in text
        for cell, value in zip(row[1:3], (each["demanded"], each["measured"]), strict=True):
            number, *unit = cell.removeprefix("at least ").removeprefix("at most ").split()
            assert float(number) * (1e6 if unit else 1.0) == pytest.approx(value, rel=0.05)
        better = each["measured"] >= each["demanded"]
        assert each["met"] == (not better if row[1].startswith("at most") else better)
        assert row[3] == ("yes" if each["met"] else "**no**")
    rates = [row["rate"] for row in figures["states"]["rows"] if row["key"] == "chosen"]
    assert goals[0]["measured"] == max(rates) and goals[0]["demanded"] == 40e6


def test_no_rate_is_above_its_limit(bench, figures):
    page = bench("page")
    rows = [row for row in figures["states"]["rows"] if "arithmetic" in row]
    assert len(rows) > 8
    for row in rows:
        assert row["rate"] < 1.02 * row["arithmetic"], row["work"]
    assert {kind for _, kind in map(page.limit_of, rows)} <= {"arithmetic", "memory"}


@declaration
class Factor:
    k: Value = quantity("1", "factor", default=2.0)


@declaration
class Pair:
    x: Value = quantity("1", "a number", default=0.5)
    y: Value = quantity("1", "another number", default=0.5)


@declaration
class Result:
    z: Value = quantity("1", "result")


Formula = Model(
    name="Formula",
    text="A sum of two products, a quotient, a root and a sine.",
    description="operations that are easy to count",
    Parameters=Factor,
    Inputs=Pair,
    parts=(
        Part(
            Result,
            lambda xp, p, u, x, shared: Result(z=u.x * u.y + p.k * u.x + xp.sqrt(u.y) / u.x + xp.sin(u.x)),
        ),
    ),
)


def test_operations_are_counted(bench):
    """A sum is one instruction with one of its products: of x y + k x remain two, and one for each further sum. Where
    y alone varies, the quotient is a product that goes into its sum, and k x and the sine cost nothing."""
    count = bench("vector_limit").operations
    assert count(Formula, ("z",), ("x", "y")) == {"sum": 4, "division": 1, "root": 1, "sin": 1}
    assert count(Formula, ("z",), ("y",)) == {"sum": 3, "root": 1}


@pytest.mark.skipif(compiler() is None, reason="no C compiler")
def test_the_limit_is_that_of_the_busiest_unit(bench, monkeypatch):
    """Of all operations together, where divisions and roots are made of products."""
    limit = bench("vector_limit")
    times = {"sum": 1.0, "division": 5.0, "root": 7.0, "sin": 20.0}
    monkeypatch.setattr(limit, "time_of", times.__getitem__)
    monkeypatch.setattr(limit, "width", lambda: 4)
    monkeypatch.setattr(limit, "divider", lambda: True)
    assert limit.arithmetic({"sum": 10, "division": 1, "root": 2}) == pytest.approx(4 / 19.0)
    assert limit.arithmetic({"sum": 10, "division": 1, "sin": 1}) == pytest.approx(4 / 30.0)
    monkeypatch.setattr(limit, "divider", lambda: False)
    assert limit.arithmetic({"sum": 10, "division": 1, "root": 2}) == pytest.approx(4 / 29.0)
    monkeypatch.undo()
    assert limit.width() in (2, 4, 8)
    # a division takes longer than a sum on every processor
    assert 0.0 < limit.time_of("sum") < limit.time_of("division") < 1e-6


def test_the_rods_of_other_engines_are_those_of_the_machine(bench):
    """Loops close to rounding, and the rods' own potential energy varies as the machine's."""
    other = bench("other_engines")
    rods, phi = other.Rods(), np.linspace(0.0, 2.0 * np.pi, 50)
    angles, _ = rods.motion(phi)
    assert rods.gap(angles) < 1e-14 and len(rods.loops) == 3
    assert rods.gap(angles | {"coupler": angles["coupler"] + 1e-6}) == pytest.approx(1.5e-6, rel=1e-3)
    height, pins = 0.0, {}
    for rod in rods.rods:
        start = pins[rod.carrier, rod.at[0]] if rod.carrier else rod.at[1]
        for s in (rod.s, rod.length, other.MACHINE.p.e):
            pins[rod.name, s] = start + s * np.sin(angles[rod.name])
        height = height + rod.m * pins[rod.name, rod.s]
    ours = other.MACHINE.evaluate(other.LOADS | {"phi": phi, "w": other.W})["potential_energy"]
    np.testing.assert_allclose(other.MACHINE.p.g * height, ours, rtol=1e-12)


@pytest.mark.second
@pytest.mark.parametrize(("name", "torque", "loop"), [("exudyn", 1e-5, 1e-5), ("mujoco", 1e-4, 1e-7)])
def test_another_engine_finds_the_torque(name, torque, loop, bench, tmp_path, monkeypatch):
    """The packaged machine over a turn; the engine shares nothing with ours but the masses, lengths and start."""
    pytest.importorskip(name)
    monkeypatch.chdir(tmp_path)
    other = bench("other_engines")
    rows = other.ENGINES[name](other.Rods(), 1000)
    assert rows and all(0.0 < row["torque"] < torque and 0.0 < row["loop"] < loop for row in rows)
