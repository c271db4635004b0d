"""Intervals of quantiles and shares: against scipy, against the binomial distribution, against simulation."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import beta, norm, quantile_test, ttest_1samp

from chainunit.study.quantiles import Estimate, independent_count, mean_share, quantile, runs_needed, share


@pytest.mark.parametrize("q", [0.05, 0.5, 0.95, 0.99])
def test_the_interval_is_scipys(q):
    rng = np.random.default_rng(3)
    for n in (runs_needed(q), 100, 400, 2000):
        values = rng.normal(size=n)
        reference = quantile_test(values, p=q).confidence_interval(0.95)
        got = quantile(values, q)
        if math.isnan(reference.low) or math.isnan(reference.high):
            assert got is None
        else:
            assert (got.low, got.high) == (reference.low, reference.high) and got.value == np.quantile(
                values, q
            )


def test_what_the_number_of_runs_cannot_tell_is_left_out():
    assert [runs_needed(q) for q in (0.05, 0.5, 0.95, 0.99)] == [72, 6, 72, 368]
    for q in (0.05, 0.5, 0.95, 0.99):
        n = runs_needed(q)
        tail = 1.0 - max(q, 1.0 - q)
        assert (1.0 - tail) ** n <= 0.025 < (1.0 - tail) ** (n - 1)
        assert quantile(np.arange(n - 1), q) is None and quantile(np.arange(n), q) is not None
    assert quantile(np.arange(20.0), 0.99) is None


def test_the_interval_holds_the_quantile_as_often_as_it_says():
    rng = np.random.default_rng(5)
    for q, n in ((0.5, 20), (0.95, 150), (0.99, 400)):
        true = -math.log(1.0 - q)
        results = [quantile(rng.exponential(size=n), q) for _ in range(400)]
        assert np.mean([e.low <= true <= e.high for e in results]) > 0.94


def test_values_of_one_run_count_together():
    """Each run has a level of its own, by which its values hardly differ: they count for as many as there are runs,
    and so an interval as if all were independent misses the quantile more often than not."""
    rng = np.random.default_rng(11)
    free = rng.exponential(size=(20, 50))
    assert independent_count(free, 0.5) > 500 and quantile(free, 0.95) is not None
    tied = rng.normal(10.0, 3.0, size=(10, 1)) + 0.1 * rng.normal(size=(10, 30))
    assert independent_count(tied, 0.95) < 30 and quantile(tied, 0.95) is None
    hits, plain = [], []
    for _ in range(200):
        runs = rng.normal(10.0, 1.0, size=(60, 1)) + 0.3 * rng.normal(size=(60, 30))
        hits.append(quantile(runs, 0.5))
        plain.append(quantile(runs.ravel(), 0.5))
    inside = [np.mean([e.low <= 10.0 <= e.high for e in each]) for each in (hits, plain)]
    assert inside[0] > 0.92 and inside[1] < 0.5


@pytest.mark.stages(first=2)
@pytest.mark.parametrize("common", [0.0, 0.3, 0.5, 0.8])
@pytest.mark.parametrize("q", [0.5, 0.95])
def test_what_few_starts_tell_is_so(common, q):
    """Ten starts of 30 turns, whose values have the share `common` of their variance by the start: an interval that
    is given holds the quantile, also where it is seldom given."""
    rng = np.random.default_rng(23)
    levels, turns = rng.normal(size=(300, 10, 1)), rng.normal(size=(300, 10, 30))
    true = norm.ppf(q)
    results = [quantile(x, q) for x in math.sqrt(common) * levels + math.sqrt(1.0 - common) * turns]
    held = [e.low <= true <= e.high for e in results if e is not None]
    assert sum(held) >= 0.93 * len(held)
    if q == 0.5 or common == 0.0:
        assert len(held) >= 270
    elif common >= 0.5:
        assert len(held) <= 3


def test_one_run_is_one():
    values = np.random.default_rng(2).normal(size=(1, 300))
    assert independent_count(values, 0.5) == 1 and independent_count(values.T, 0.5) == 300


def test_a_motion_that_repeats_itself_needs_no_number_of_runs():
    values = 100.0 + np.linspace(0.0, 0.9, 10)[:, None] + np.zeros((10, 30))
    assert quantile(values, 0.95) == Estimate(pytest.approx(100.9), 100.0, 100.9)
    assert quantile(values * np.linspace(1.0, 1.06, 10)[:, None], 0.95) is None


def test_shares_are_clopper_and_pearsons():
    got = share(3, 20)
    assert got.value == 0.15
    assert got.low == pytest.approx(beta.ppf(0.025, 3, 18)) and got.high == pytest.approx(
        beta.ppf(0.975, 4, 17)
    )
    # in n runs that none fails: 1 - 0.025^(1/n)
    assert share(0, 50).low == 0.0 and share(0, 50).high == pytest.approx(1.0 - 0.025 ** (1.0 / 50))


def test_a_mean_share_has_students_interval():
    shares = np.array([0.9, 0.85, 0.95, 0.8])
    got, wanted = mean_share(shares), ttest_1samp(shares, 0.0).confidence_interval(0.95)
    assert (got.value, got.low) == pytest.approx((0.875, wanted.low))
    assert wanted.high == pytest.approx(got.high)
    assert mean_share([0.0, 0.5]).low == 0.0 and mean_share([1.0, 0.5]).high == 1.0
    assert mean_share([0.3, 0.3, 0.3]) == Estimate(pytest.approx(0.3), pytest.approx(0.3), pytest.approx(0.3))
    assert mean_share([0.3]) == Estimate(0.3, 0.0, 1.0), "one run does not tell how runs differ"
