"""Quantiles and shares of random runs, as exactly as their number allows: binomial intervals.

For any distribution, the number of runs below its quantile q is binomial. So an interval between two of the
ordered values holds the quantile with a known confidence. If there are too few runs, even the largest value
may lie below the quantile, and the interval has no upper end: such a quantile is left out.

Several values of one run (the turns of a start) are not independent. They count as a smaller number of
independent values, which follows from the differences between the runs (Kish's design effect; Woodruff's
interval). A few runs determine these differences badly, so the largest differences that are likely are used.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..reading.results import Estimate

LESS_ALIKE = 0.9
"""Confidence that the values of one run are no more alike than assumed."""
CONFIDENCE = 0.95
"""Confidence of all intervals; the rest is divided equally between both ends."""
HIGH = 0.95
"""The quantile that is given beside the median."""
ALIKE = 0.05
"""Values of several runs that differ by less than this share of their median count as alike, as in a motion
that repeats itself: then nothing is random, and the interval holds all values."""


def quantile(values: Any, q: float) -> Estimate | None:
    """The quantile `q` of independent values, shape (n,), or of runs with several values each, shape (runs, n); its
    interval is between two of the ordered values. None where the values count as fewer than `runs_needed`."""
    from scipy.stats import binom

    values = np.asarray(values, float)
    ranking = np.sort(values, axis=None)
    value = float(np.quantile(ranking, q))
    if _alike(values):
        return Estimate(value, float(ranking[0]), float(ranking[-1]))
    runs = independent_count(values, q)
    if runs < runs_needed(q):
        return None
    least, most = binom.ppf((0.5 * (1.0 - CONFIDENCE), 0.5 * (1.0 + CONFIDENCE)), runs, q)
    per_run = len(ranking) / runs
    low, high = math.floor((least - 1.0) * per_run), math.ceil((most + 1.0) * per_run) - 1
    return Estimate(
        value,
        float(ranking[max(0, low)]),
        float(ranking[min(high, len(ranking) - 1)]),
    )


def independent_count(values: Any, q: float) -> int:
    """The number of independent values as which the `values` count at the quantile `q`. All values count if
    they are of shape (n,), or of runs, shape (runs, n), that are alike; else their number is divided by the larger
    of two design effects: the estimate from the shares of each run above the quantile, and the upper confidence
    limit from the ranks of all values. The few shares alone may look independent by chance."""
    values = np.asarray(values, float)
    if values.ndim == 1 or values.shape[1] == 1 or _alike(values):
        return int(values.size)
    runs, n = values.shape
    if runs == 1:
        return 1
    limit = np.quantile(values, q)
    # the shares of each run, where values that equal the quantile count as below it, and as above it
    shares = [np.mean(above, axis=1) for above in (values > limit, values >= limit)]
    # of independent values, such a share has the variance q (1 - q)/n
    effect_by_shares = float(np.max(np.var(shares, axis=1, ddof=1))) * n / (q * (1.0 - q))
    effect_by_ranks = 1.0 + (n - 1) * _alikeness(values)
    return int(values.size / max(1.0, effect_by_shares, effect_by_ranks))


def _alikeness(values: Any) -> float:
    """The correlation of the values of one run: the upper confidence limit of the intraclass correlation of
    their ranks, by a one-way analysis of variance; values of shape (runs, n)."""
    from scipy.stats import f, rankdata

    runs, n = values.shape
    ranks = rankdata(values).reshape(runs, n)
    between = n * np.var(np.mean(ranks, axis=1), ddof=1)
    within = np.mean(np.var(ranks, axis=1, ddof=1))
    most = between / f.ppf(1.0 - LESS_ALIKE, runs - 1, runs * (n - 1))
    return float(max(0.0, (most - within) / (most + (n - 1) * within)))


def _alike(values: Any) -> bool:
    """Whether the values are of several runs and count as alike, see `ALIKE`."""
    return values.ndim == 2 and bool(np.ptp(values) <= ALIKE * abs(np.median(values)))


def share(count: int, runs: int) -> Estimate:
    """The share of runs in which something happens, from `count` of them (Clopper and Pearson)."""
    from scipy.stats import binomtest

    interval = binomtest(count, runs).proportion_ci(CONFIDENCE, method="exact")
    return Estimate(count / runs, float(interval.low), float(interval.high))


def mean_share(shares: Any) -> Estimate:
    """The mean of the shares of several independent runs, shape (runs,), with the interval of Student's
    distribution within 0 to 1; of a single run, that is all of it, as nothing tells how runs differ."""
    from scipy.stats import t

    shares = np.asarray(shares, float)
    mean = float(np.mean(shares))
    if len(shares) < 2:
        return Estimate(mean, 0.0, 1.0)
    error = float(np.std(shares, ddof=1)) / math.sqrt(len(shares))
    reach = float(t.ppf(0.5 * (1.0 + CONFIDENCE), len(shares) - 1)) * error
    return Estimate(mean, max(0.0, mean - reach), min(1.0, mean + reach))


def runs_needed(q: float) -> int:
    """The least number of independent runs with which the quantile `q` has an interval. All n runs lie on one
    side of the quantile with the probability q^n or (1 - q)^n, which must be at most (1 - `CONFIDENCE`)/2."""
    return math.ceil(math.log(0.5 * (1.0 - CONFIDENCE)) / math.log(max(q, 1.0 - q)))
