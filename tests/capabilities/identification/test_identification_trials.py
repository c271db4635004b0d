"""Random hidden machines are identified: bench/identification.py in small."""

from __future__ import annotations

import importlib
from pathlib import Path

import numpy as np
import pytest

from chainunit.core.native.compilers import compiler

pytestmark = pytest.mark.skipif(compiler() is None, reason="no C compiler")


@pytest.fixture
def bench(monkeypatch):
    monkeypatch.syspath_prepend(str(Path(__file__).parents[3] / "bench"))
    return importlib.import_module("identification")


def test_figures_of_errors_that_are_known(bench):
    """Of numbers that are drawn as they are stated: they cover and scatter so; of others, they do not."""
    rng = np.random.default_rng(3)

    def trial(scatter):
        numbers = []
        for error in rng.standard_normal(16):
            value = 10.0 + 0.04 * scatter * error
            numbers.append(
                {
                    "name": "machine.x", "true": 10.0, "value": value, "deviation": 0.04, "low": value - 0.0784,
                    "high": value + 0.0784, "spread": 1.0, "fitted": value, "bound": 0.02,
                }
            )  # fmt: skip
        return {"numbers": numbers}

    right = bench.coverage([trial(1.0) for _ in range(200)])
    assert right["cover"] == pytest.approx(0.95, abs=0.015) and right["error"] == pytest.approx(1.0, abs=0.04)
    assert right["to_bound"] == pytest.approx(2.0, abs=0.08)
    assert right["sharp"] == 3200 and right["sharp_median"] == pytest.approx(0.0027, abs=2e-4)
    assert bench.coverage([trial(2.0) for _ in range(200)])["cover"] < 0.7


@pytest.mark.slow
def test_twelve_hidden_machines(bench):
    """Of 192 numbers 95 % lie within their intervals, but for chance, and errors scatter as is stated."""
    trials = [bench.result("bare", k) for k in range(12)]
    found = bench.coverage(trials)
    assert 0.88 < found["cover"] <= 1.0 and 0.75 < found["error"] < 1.3
    assert found["sharp"] > 20 and found["sharp_worst"] < 0.02 and found["sharp_median"] < 0.005
    assert sum(not each["is_described"] for each in trials) <= 1
    assert max(each["rounds"] for each in trials) <= 15


@pytest.mark.slow
def test_a_machine_at_its_bounds(bench):
    """A wall and an inertia are at the ends of their ranges, which hold the best fit: the residuals that this leaves
    are no reason for a distribution elsewhere."""
    found = bench.result("bare", 34)
    numbers = found["numbers"]
    assert found["held"] == ()
    limits = [bench.ranges()[each["name"].removeprefix("machine.")] for each in numbers]
    assert any(each["fitted"] in ends for each, ends in zip(numbers, limits, strict=True))
    assert all(abs(each["value"] - each["true"]) < 3.0 * each["deviation"] for each in numbers)


@pytest.mark.slow
@pytest.mark.parametrize("k", [0, 1, 2])
def test_another_friction_chains_and_another_gear_are_recognised(bench, k):
    assert not bench.result("wrong", k)["is_described"]


def test_figures_of_suspects_that_are_known(bench):
    """A machine that is told with both wrong numbers in the first set, one with both in two sets, one with one of
    them, and one that is not told."""

    def trial(*sets, is_described=False):
        number = {"name": "machine.x", "true": 1.0, "value": 1.1, "deviation": 0.1, "low": 0.9, "high": 1.3}
        number |= {"spread": 1.0, "fitted": 1.1, "bound": 0.1}
        return {
            "wrong": ["a", "b"], "shown": ["a"], "is_described": is_described, "seconds": 2.0, "numbers": [number],
            "sets": [{"names": names, "excess": 0.0, "describes": None} for names in sets],
        }  # fmt: skip

    trials = [trial(["b", "a"], ["c"]), trial(["a", "c"], ["b"]), trial(["a"]), trial(is_described=True)]
    found = bench.suspicion(trials)
    assert [found[key] for key in ("machines", "told", "both", "shown", "one", "first")] == [4, 3, 2, 3, 3, 1]
    assert found["suspects"] == 3.0 and found["cover_of_others"] == 1.0


@pytest.mark.slow
def test_two_wrong_known_numbers_are_the_suspects(bench):
    """A gain of the converter and the mass of a web, each stated wrong by 20 %; the same machine with right numbers
    is described."""
    found, right = bench.stated_result("doubted", 2), bench.stated_result("known", 2)
    assert not found["is_described"] and found["sets"][0]["describes"]
    assert set(found["wrong"]) <= {name for some in found["sets"] for name in some["names"]}
    assert right["is_described"] and right["sets"] == []
