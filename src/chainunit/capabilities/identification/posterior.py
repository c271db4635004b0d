"""Values of the sought numbers with their intervals: the distribution that recordings and priors leave.

Near the best fit the simulated columns are taken as quadratic along the directions in which the distribution is wide,
and as linear along all others. A number of which only the bounds are known is evenly distributed within them
beforehand. The distribution is sampled: its form along a number that the recordings hardly determine is that of the
bounds, and products, such as that of friction and weight, which are determined much better than each factor, bend it.
"""

from __future__ import annotations

import contextlib
import itertools
import math
from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ...core.errors import RunError
from ...recordings.fit import NormalEquations, inverse
from ...recordings.problem import OUTLIER, Comparison, Problem

WIDE = 0.02
"""Standard deviation of a direction, in parts of that of its prior, from which on it counts as wide."""
MOST_WIDE = 6
STEP = 5e-3
"""Time between the rows that are taken for second derivatives [s]."""
PARTS = (1.0, 0.3, 0.1, 0.03, 0.01, 0.001)
"""Parts of a step for second derivatives that are tried until the machine runs after it."""
CHAINS, STEPS, KEPT = 300, 1200, 10
"""Number of chains, their steps, of which the second half counts, and states that are kept of each."""
_STIFF = 1e4
"""Stiffness of a number whose bound is active, in parts of one standard deviation of its prior."""
LEVEL = 0.95
"""Probability of an interval."""
SHARP, BOUND_LEVEL, BOUND_DEVIATIONS = 0.1, 0.9973, 3.0
"""Standard deviation of a number, in parts of that of its prior, up to which a bound can contradict it; probability
with which right bounds press less; and standard deviations beyond its bound from which on the bound is active."""


@dataclass(frozen=True)
class Marginal:
    """A sought number: its mean `value`, its standard `deviation`, the interval from `low` to `high` that contains it
    with a probability of 95 %, and the standard deviation `prior_deviation` of its prior."""

    name: str
    unit: str
    value: float
    deviation: float
    low: float
    high: float
    prior_deviation: float


@dataclass(frozen=True)
class Posterior:
    """The distributions of all sought numbers, and `samples` of them, shape (samples, numbers). The recordings
    contradict a bound of each of the numbers `active_bounds`."""

    marginals: tuple[Marginal, ...]
    samples: Any
    active_bounds: tuple[str, ...] = ()

    @cached_property
    def covariance(self) -> Any:
        """The covariance of the sought numbers, shape (numbers, numbers)."""
        return np.atleast_2d(np.cov(self.samples, rowvar=False))


def posterior(problem: Problem, best: NormalEquations, workers: int = 2, seed: int = 0) -> Posterior:
    """The distribution of the sought numbers around the best fit."""
    rng = np.random.default_rng(seed)
    active = _active_bounds(problem, best)
    density = _CurvedDensity(problem, best, workers, active)
    samples = density.sample(rng)
    if active:
        samples = _beyond_bounds(problem, best, active, samples, rng)
    edges = np.quantile(samples, [0.5 - 0.5 * LEVEL, 0.5 + 0.5 * LEVEL], axis=0)
    means, deviations = np.mean(samples, axis=0), np.std(samples, axis=0, ddof=1)
    rows = np.stack([means, deviations, *edges], axis=1)
    marginals = tuple(
        Marginal(u.name, u.unit, float(x), float(s), float(low), float(high), u.prior_deviation)
        for u, (x, s, low, high) in zip(problem.sought, rows, strict=True)
    )
    return Posterior(marginals, samples, tuple(problem.sought[k].name for k in active))


def _score(problem: Problem, best: NormalEquations) -> Any:
    """The gradient of the logarithm of the density at the best fit: where there are bounds alone, of the recordings
    alone."""
    even = np.array([u.is_even for u in problem.unknowns])
    return best.gradient - np.where(even, (problem.start_values - best.z) / problem.prior_deviations**2, 0.0)


def _active_bounds(problem: Problem, best: NormalEquations) -> dict[int, float]:
    """The places of the sought numbers whose bound is active, with the gradient towards it."""
    from scipy.stats import chi2

    count, (low, high), pull = len(problem.sought), problem.bounds, _score(problem, best)
    near = 1e-6 * problem.prior_deviations
    held = np.where(best.z <= low + near, pull < 0.0, (best.z >= high - near) & (pull > 0.0))
    at_bounds = [int(k) for k in np.flatnonzero(held[:count])]
    if not at_bounds:
        return {}
    # what the sum of squares would fall by without these bounds; one of them alone may press for another one's error
    fall = float(pull[at_bounds] @ best.covariance[np.ix_(at_bounds, at_bounds)] @ pull[at_bounds])
    if fall < chi2.ppf(BOUND_LEVEL, len(at_bounds)):
        return {}
    active, deviations = dict[int, float](), best.deviations
    for k in at_bounds:
        if deviations[k] > SHARP * problem.prior_deviations[k]:
            continue  # a number that is hardly determined comes to its bound by chance, and along a bend
        # the others stay at their bounds, as they did in the fit
        free = [j for j in range(len(best.z)) if j == k or j not in at_bounds]
        variance = inverse(best.matrix[np.ix_(free, free)])[free.index(k), free.index(k)]
        if abs(pull[k]) * math.sqrt(variance) > BOUND_DEVIATIONS:
            active[k] = float(pull[k])
    return active


def _beyond_bounds(
    problem: Problem, best: NormalEquations, active: dict[int, float], samples: Any, rng: Any
) -> Any:
    """The samples with the numbers of active bounds on their side of the bound, from which the density falls by the
    gradient; the others follow."""
    places, pulls = list(active), np.array(list(active.values()))
    steps = -np.sign(pulls) * rng.exponential(1.0 / np.abs(pulls), (len(samples), len(active)))
    covariance = best.covariance[places, : samples.shape[1]]
    samples = samples + steps @ np.linalg.solve(covariance[:, places], covariance)
    samples[:, places] = best.z[places] + steps
    low, high = (bound[: samples.shape[1]] for bound in problem.bounds)
    return np.clip(samples, low, high)


class _CurvedDensity:
    """The distribution near the best fit. The change of all unknowns is `across` @ a + `along` @ b, with the places
    `a` in the wide directions and `b` in all others. Given `a`, `b` is normal."""

    def __init__(
        self, problem: Problem, best: NormalEquations, workers: int, active: Collection[int]
    ) -> None:
        self._problem, self._z, self._fixed = problem, best.z, list(active)
        count, size = len(problem.sought), len(best.z)
        spread = problem.prior_deviations
        stiff = np.zeros(size)
        stiff[self._fixed] = (_STIFF / spread[self._fixed]) ** 2
        covariance = inverse(best.matrix + np.diag(stiff))
        relative = covariance[:count, :count] / np.outer(spread[:count], spread[:count])
        sizes, directions = np.linalg.eigh(relative)
        wide = np.flatnonzero(np.sqrt(sizes) > WIDE)[-MOST_WIDE:]
        # along a direction the nuisances follow
        follow = covariance[:, :count] @ np.linalg.inv(covariance[:count, :count])
        ridges = follow @ (spread[:count, None] * directions) * np.sqrt(sizes)
        self._across = ridges[:, wide]
        narrow = [k for k in range(count) if k not in wide]
        self._along = np.hstack([ridges[:, narrow], np.eye(size)[:, count:] * spread[count:]])
        self._pairs = list(itertools.combinations_with_replacement(range(len(wide)), 2))
        self._reduce(best, workers, stiff)

    def _reduce(self, best: NormalEquations, workers: int, stiff: Any) -> None:
        """The sum of squares as a quadratic form of (1, a, products of a, b), reduced by the best b: a form of the
        first three, and b as a normal distribution with a mean that is linear in them. Numbers of active bounds have
        a further, `stiff` information."""
        problem = self._problem
        even = np.array([u.is_even for u in problem.unknowns])
        priors = np.where(even, 0.0, 1.0 / problem.prior_deviations**2) + stiff
        wide, pairs = self._across.shape[1], len(self._pairs)
        basis = np.hstack([self._across, self._along])
        # the places of a and b in the form
        linear = 1 + np.r_[0:wide, wide + pairs : wide + pairs + self._along.shape[1]]
        matrix = np.zeros((1 + wide + pairs + self._along.shape[1],) * 2)
        matrix += self._squares(best, workers, linear)
        matrix[np.ix_(linear, linear)] += basis.T @ (priors[:, None] * basis)
        # the gradient is that of all rows; without the pull of a prior where there are bounds alone
        matrix[0, linear] = matrix[linear, 0] = -basis.T @ np.where(stiff > 0.0, 0.0, _score(problem, best))
        kept, of_b = slice(0, 1 + wide + pairs), slice(1 + wide + pairs, None)
        inner = matrix[of_b, of_b]
        mean = -np.linalg.solve(inner, matrix[of_b, kept])
        self._form = matrix[kept, kept] + matrix[kept, of_b] @ mean
        # of `b`, only the share in the sought numbers is sampled
        along = self._along[: len(problem.sought)]
        self._mean = along @ mean
        root: Any = np.linalg.qr((along @ np.linalg.cholesky(inverse(inner))).T, mode="r")
        self._root = root.T

    def _squares(self, best: NormalEquations, workers: int, linear: Any) -> Any:
        """The products of the derivatives of all columns, of first order and of second order by pairs."""
        wide, basis = self._across.shape[1], np.hstack([self._across, self._along])
        problem = self._problem.thinned(STEP)
        low, high = problem.bounds
        base = list(problem.comparisons(best.z, workers))
        seconds = np.empty((len(base), wide), object)
        for k in range(wide):
            step = self._across[:, k]
            ahead, behind = (_largest_factor(best.z, sign * step, low, high) for sign in (1.0, -1.0))
            size = max(min(ahead, 1.0), 0.1) if ahead >= behind else -max(min(behind, 1.0), 0.1)
            size, moved = _moved(problem, best.z, step, size, workers)
            for n, (at_best, beyond) in enumerate(zip(base, moved, strict=True)):
                seconds[n, k] = (beyond.slopes - at_best.slopes) @ self._across[list(at_best.places)] / size
        total = np.zeros((1 + wide + len(self._pairs) + self._along.shape[1],) * 2)
        for at_best, second, full in zip(base, seconds, best.comparisons, strict=True):
            table = np.zeros((len(at_best.slopes), len(total)))
            table[:, linear] = at_best.slopes @ basis[list(at_best.places)]
            for n, (i, j) in enumerate(self._pairs):
                # half of the second derivative; of a mixed one, the mean of both
                table[:, 1 + wide + n] = 0.5 * (second[i][:, j] + (second[j][:, i] if i != j else 0.0))
            # in the thinned columns, the sizes of the noise are others by a trifle
            table *= best.weights[at_best.run, at_best.column] * at_best.size / full.size
            edges = np.linspace(0, len(full.residuals), len(table) + 1).round().astype(int)
            rows = np.diff(edges)
            # where a bound holds a number, the residuals have a part along the second derivatives
            sums = np.add.reduceat(np.clip(full.residuals, -OUTLIER, OUTLIER), edges[:-1])
            total[0] -= best.weights[at_best.run, at_best.column] * (sums @ table)
            total += np.mean(rows) * (table.T @ table)
        # those along the first derivatives are in the gradient
        total[1:, 0] = total[0, 1:]
        return total

    def _terms(self, a: Any) -> Any:
        """One, `a` and its products, shape (chains, terms)."""
        products = [a[:, i] * a[:, j] for i, j in self._pairs]
        return np.column_stack([np.ones(len(a)), a, *products])

    def _draw(self, a: Any, rng: Any) -> tuple[Any, Any]:
        """The logarithm of the density at `a`, shape (chains,), and sought numbers, shape (chains, numbers)."""
        problem, terms = self._problem, self._terms(a)
        count = len(problem.sought)
        z = self._z[:count] + a @ self._across[:count].T + terms @ self._mean.T
        z += rng.standard_normal((len(a), self._root.shape[1])) @ self._root.T
        low, high = (bound[:count] for bound in problem.bounds)
        outside = np.maximum(low - z, z - high) / problem.prior_deviations[:count]
        outside[:, self._fixed] = 0.0
        beyond = np.sum(np.maximum(outside, 0.0), axis=1)
        density = -0.5 * np.einsum("ni,ij,nj->n", terms, self._form, terms)
        # beyond the bounds there is nothing; the steep slope leads chains back that began there
        return density - np.where(beyond > 0.0, 1e3 * (1.0 + beyond), 0.0), z

    def sample(self, rng: Any) -> Any:
        """Samples of the sought numbers, shape (samples, numbers), by Metropolis' method in many chains: a step of a
        chain is a part of the difference of two others (differential evolution)."""
        wide = self._across.shape[1]
        if not wide:
            return self._draw(np.zeros((CHAINS * KEPT, 0)), rng)[1]
        a = rng.standard_normal((CHAINS, wide))
        density, z = self._draw(a, rng)
        samples = []
        for step in range(STEPS):
            others = np.array([rng.permutation(CHAINS) for _ in range(2)])
            jump = 1.0 if step % 10 == 9 else 1.7 / math.sqrt(2.0 * wide)
            tried = a + jump * (a[others[0]] - a[others[1]]) + 1e-3 * rng.standard_normal(a.shape)
            new, new_z = self._draw(tried, rng)
            accepted = np.log(rng.random(CHAINS)) < new - density
            a, z = np.where(accepted[:, None], tried, a), np.where(accepted[:, None], new_z, z)
            density = np.where(accepted, new, density)
            if step >= STEPS // 2 and (step + 1) % (STEPS // 2 // KEPT) == 0:
                samples.append(z)
        return np.concatenate(samples)


def _moved(problem: Problem, z: Any, step: Any, size: float, workers: int) -> tuple[float, list[Comparison]]:
    """A step of that `size`, or of a part of it with which the machine runs, and the comparisons after it.

    Raises
    ------
    RunError
        if the machine runs with no part of `PARTS`.
    """
    for part in PARTS[:-1]:
        with contextlib.suppress(RunError):
            return part * size, list(problem.comparisons(z + part * size * step, workers))
    return PARTS[-1] * size, list(problem.comparisons(z + PARTS[-1] * size * step, workers))


def _largest_factor(z: Any, step: Any, low: Any, high: Any) -> float:
    """The largest factor on a step that stays within the bounds."""
    with np.errstate(divide="ignore", invalid="ignore"):
        room = np.where(step > 0.0, (high - z) / step, np.where(step < 0.0, (low - z) / step, math.inf))
    return float(np.min(np.maximum(room, 0.0)))
