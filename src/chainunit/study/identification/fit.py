"""Joint fit of all runs: least squares with exact derivatives, bounds and priors."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ...errors import RunError
from .problem import OUTLIER, Comparison, Problem

MOST_ROUNDS = 80
NEAR = 1.5
"""Deviation of a column, in parts of its noise, from which on it counts by its noise."""
ENOUGH = 1e-2
"""Decrease of the sum of squares below which the fit ends; one standard deviation is 1."""


@dataclass(frozen=True)
class Normal:
    """The `comparisons` at a point `z`, their sum of squares with that of the priors, its gradient, and the matrix of
    the normal equations: of the runs alone, `fisher`, and with the priors, `matrix`."""

    z: Any
    comparisons: tuple[Comparison, ...]
    cost: float
    gradient: Any
    fisher: Any
    matrix: Any

    @cached_property
    def shares(self) -> dict[tuple[str, str], float]:
        """The mean squares of the residuals by run and column."""
        return {(each.run, each.column): float(np.mean(each.residuals**2)) for each in self.comparisons}

    @property
    def covariance(self) -> Any:
        """The covariance of all unknowns, shape (unknowns, unknowns)."""
        return inverse(self.matrix)

    @property
    def deviations(self) -> Any:
        """The standard deviation of each unknown, shape (unknowns,)."""
        return np.sqrt(np.diag(self.covariance))


def inverse(matrix: Any) -> Any:
    """The inverse of a matrix of normal equations, whose unknowns differ in size by many orders."""
    scale = np.outer(*[1.0 / np.sqrt(np.diag(matrix))] * 2)
    return np.linalg.inv(matrix * scale) * scale


Scales = Mapping[tuple[str, str], float]
"""By run and column, a factor on the standard deviation of the column."""


def normal(problem: Problem, z: Any, workers: int = 2, scales: Scales | None = None) -> Normal:
    """The normal equations at these values of the unknowns. A residual that is an outlier counts less (Huber)."""
    return _normal(problem, z, tuple(problem.comparisons(z, workers)), scales)


def _normal(
    problem: Problem, z: Any, comparisons: tuple[Comparison, ...], scales: Scales | None = None
) -> Normal:
    spread = problem.spreads
    size = len(spread)
    fisher, gradient = np.zeros((size, size)), (problem.starts - z) / spread**2
    cost = float(np.sum(((z - problem.starts) / spread) ** 2))
    for each in comparisons:
        factor = 1.0 / (scales or {}).get((each.run, each.column), 1.0)
        residuals, slopes = each.residuals * factor, each.slopes * factor
        r = np.abs(residuals)
        weight = np.minimum(1.0, OUTLIER / np.maximum(r, OUTLIER))
        cost += float(np.sum(np.where(r < OUTLIER, r * r, OUTLIER * (2.0 * r - OUTLIER))))
        weighted, places = slopes * weight[:, None], np.array(each.places)
        fisher[np.ix_(places, places)] += slopes.T @ weighted
        gradient[places] += weighted.T @ residuals
    return Normal(z, comparisons, cost, gradient, fisher, fisher + np.diag(1.0 / spread**2))


def fit(
    problem: Problem, z: Any = None, workers: int = 2, report: Callable[[int, float], None] = lambda *_: None
) -> Normal:
    """The values of the unknowns that fit best, from `z` or from the start values.

    The nuisances come first: with a wrong angle of the crank the other unknowns have no direction. As long as a
    column deviates by more than its noise, it counts by its deviation: else the most exact one, such as the count of
    an encoder, alone would lead.

    Raises
    ------
    RunError
        where the fit does not end in `MOST_ROUNDS` rounds.
    """
    nuisances, all_unknowns = (
        np.array([u.is_nuisance or x for u in problem.unknowns]) for x in (False, True)
    )
    best = normal(problem, problem.started(workers) if z is None else z, workers)
    rounds = _Rounds(problem, workers, report)
    for free in (nuisances, all_unknowns):
        best = rounds.down(best, free, _scales(best), 0.02)
    while max((scales := _scales(best)).values()) > NEAR:
        before = best.shares
        best = rounds.down(best, all_unknowns, scales, 0.02)
        if all(best.shares[key] > 0.9 * share for key, share in before.items()):
            break
    return rounds.down(best, all_unknowns, None, 0.0)


def _scales(at: Normal) -> dict[tuple[str, str], float]:
    return {key: max(1.0, math.sqrt(share)) for key, share in at.shares.items()}


class _Rounds:
    """The rounds of a fit, by Levenberg's and Marquardt's method."""

    def __init__(self, problem: Problem, workers: int, report: Callable[[int, float], None]) -> None:
        self._problem, self._workers, self._report, self._count = problem, workers, report, 0

    def down(self, best: Normal, free: Any, scales: Scales | None, enough: float) -> Normal:
        """The least sum of squares over the `free` unknowns, up to the share `enough` of it."""
        problem, damping, growth = self._problem, 1.0, 2.0
        best = _normal(problem, best.z, best.comparisons, scales)
        while damping < 1e12:
            if self._count == MOST_ROUNDS:
                raise RunError(
                    f"the fit did not end in {MOST_ROUNDS} rounds; start nearer, or give narrower bounds"
                )
            self._count += 1
            self._report(self._count, best.cost)
            z = _next(problem, best, free, damping)
            trial = normal(problem, z, self._workers, scales)
            gain, step = best.cost - trial.cost, z - best.z
            if gain > 0.0:
                # the damping follows the agreement with the expected gain (Nielsen)
                expected = float(2.0 * step @ best.gradient - step @ best.matrix @ step)
                damping *= max(1.0 / 8.0, 1.0 - (2.0 * gain / max(expected, gain) - 1.0) ** 3)
                best, growth = trial, 2.0
                if gain < max(ENOUGH, enough * best.cost):
                    return best
            else:
                damping, growth = damping * growth, 2.0 * growth
        return best


def _next(problem: Problem, at: Normal, free: Any, damping: float) -> Any:
    """The next point. Unknowns that would pass a bound stop there, and the others follow."""
    low, high = problem.bounds
    step, moving = np.zeros(len(at.z)), free.copy()
    for _ in range(len(at.z)):
        matrix = at.matrix[np.ix_(moving, moving)]
        # those that have stopped change the gradient of the others
        gradient = at.gradient[moving] - at.matrix[np.ix_(moving, ~moving)] @ step[~moving]
        matrix = matrix + damping * np.diag(1.0 / problem.spreads[moving] ** 2)
        scale = 1.0 / np.sqrt(np.diag(matrix))
        step[moving] = scale * np.linalg.solve(matrix * np.outer(scale, scale), scale * gradient)
        z = at.z + step
        passing = moving & ((z < low) | (z > high))
        if not passing.any():
            return z
        step[passing] = np.clip(z, low, high)[passing] - at.z[passing]
        moving &= ~passing
    return np.clip(at.z + step, low, high)
