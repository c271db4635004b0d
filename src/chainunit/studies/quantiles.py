"""Quantiles and shares of random runs, with what their number can tell of them: binomial intervals.

Whatever the distribution, the number of runs below its quantile q is binomial. So an interval of two of the ordered
values holds the quantile with a known confidence. Where too few runs are there, even the largest of them may lie
below it, and the interval has no end: such a quantile is left out.

Several values of one run (the turns of a start) are not independent. They count for as many as the differences
between the runs' shares above the quantile say (Kish's design effect; Woodruff's interval).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..text import entry

CONFIDENCE = 0.95
"""Confidence of all intervals: each end is missed with half of the rest."""
ALIKE = 0.05
"""Values of several runs that differ by less than this part of their median are alike, as those of a motion that
repeats itself: then nothing is random, and the interval holds all of them."""


@dataclass(frozen=True)
class Estimate:
    """A number that was found from random runs, and the interval in which the true one lies with `CONFIDENCE`."""

    value: float
    low: float
    high: float

    def as_dict(self, unit: str, kind: str = "") -> dict[str, Any]:
        """Ready for JSON."""
        ends = {name: entry(x, unit, kind) for name, x in (("low", self.low), ("high", self.high))}
        return entry(self.value, unit, kind) | ends


def quantile(values: Any, q: float) -> Estimate | None:
    """The quantile `q` of independent values, shape (n,), or of runs with several values each, shape (runs, n),
    between two of the ordered values; None where they count for fewer than `runs_needed`."""
    from scipy.stats import binom

    values = np.asarray(values, float)
    ordered = np.sort(values, axis=None)
    found = float(np.quantile(ordered, q))
    if _alike(values):
        return Estimate(found, float(ordered[0]), float(ordered[-1]))
    runs = counted(values, q)
    if runs < runs_needed(q):
        return None
    least, most = binom.ppf((0.5 * (1.0 - CONFIDENCE), 0.5 * (1.0 + CONFIDENCE)), runs, q)
    per_run = len(ordered) / runs
    low, high = math.floor((least - 1.0) * per_run), math.ceil((most + 1.0) * per_run) - 1
    return Estimate(found, float(ordered[max(0, low)]), float(ordered[min(high, len(ordered) - 1)]))


def counted(values: Any, q: float) -> int:
    """For how many independent ones the values count at the quantile `q`: all of them, but of several runs, shape
    (runs, n), which are not alike, divided by the variance of the runs' shares above it in parts of that of
    independent values, where that is more than 1."""
    values = np.asarray(values, float)
    if values.ndim == 1 or _alike(values):
        return int(values.size)
    limit = np.quantile(values, q)
    # where many values are the same, the quantile is one of them
    shares = [np.mean(above, axis=1) for above in (values > limit, values >= limit)]
    effect = float(np.max(np.var(shares, axis=1, ddof=1))) * values.shape[1] / (q * (1.0 - q))
    return int(values.size / max(1.0, effect))


def _alike(values: Any) -> bool:
    """Whether the values are of several runs and alike."""
    return values.ndim == 2 and bool(np.ptp(values) <= ALIKE * abs(np.median(values)))


def share(count: int, runs: int) -> Estimate:
    """The share of runs in which something happens, from `count` of them (Clopper and Pearson)."""
    from scipy.stats import binomtest

    interval = binomtest(count, runs).proportion_ci(CONFIDENCE, method="exact")
    return Estimate(count / runs, float(interval.low), float(interval.high))


def runs_needed(q: float) -> int:
    """The least number of independent runs of which the quantile `q` has an interval: all of n lie on one side of it
    with a probability of q^n or (1 - q)^n, which must be within half of what `CONFIDENCE` leaves."""
    return math.ceil(math.log(0.5 * (1.0 - CONFIDENCE)) / math.log(max(q, 1.0 - q)))
