"""Joint fit of all runs: least squares with exact derivatives, bounds and priors."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..core.brief import briefly_shown
from ..core.errors import InputError, RunError
from ..reading.results import InUnit, difference, part, result
from .plant import ANGLE
from .problem import MARK_ANGLE, OUTLIER, Comparison, Problem, SimulatedRun
from .unknown import Unknown

MOST_ROUNDS = 60
"""Most rounds from a start to its end."""
TURNS = 5.0
"""Turns of the crank that are fitted first."""
ROUGH = 1e-3
"""Expected decrease of the sum of squares of the first turns, in parts of it, below which their fit ends."""
SAME_POINT = 1.005
"""Sums of squares that differ by less than this factor belong to the same point."""
DAMPING = 1e-2
"""Damping of the first step, in parts of the information of the priors."""
STATED_ROWS = 100.0
"""Number of rows that would tell the noise of a column as well as its sensor's data sheet does."""
_MEDIAN = 0.455
"""Median of the square of a standard normal number."""
MOST_SENSOR_STEPS = 5
"""Most steps of the unknowns of clocks and sensors without simulation."""
NEAR = 1.5
"""Deviation of a column, in parts of its noise, from which on it counts by its noise."""
ENOUGH = 1e-2
"""Decrease of the sum of squares below which the fit ends; one standard deviation is 1."""


@dataclass(frozen=True)
class NormalEquations:
    """The `comparisons` at a point `z`, their sum of squares with that of the priors, its gradient, and the matrix of
    the normal equations: of the runs alone, `fisher`, and with the priors, `matrix`. By run and column, `weights` are
    factors on the residuals."""

    z: Any
    comparisons: tuple[Comparison, ...]
    weights: Mapping[tuple[str, str], float]
    cost: float
    gradient: Any
    fisher: Any
    matrix: Any

    @cached_property
    def mean_squares(self) -> dict[tuple[str, str], float]:
        """The mean squares of the residuals by run and column."""
        return {
            (comparison.run, comparison.column): float(np.mean(comparison.residuals**2))
            for comparison in self.comparisons
        }

    @cached_property
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


def normal_equations(
    problem: Problem, z: Any, workers: int = 2, scales: Scales | None = None
) -> NormalEquations:
    """The normal equations at these values of the unknowns. A residual that is an outlier counts less (Huber)."""
    return assemble(problem, z, tuple(problem.comparisons(z, workers)), scales)


def assemble(
    problem: Problem, z: Any, comparisons: tuple[Comparison, ...], scales: Scales | None = None
) -> NormalEquations:
    """The normal equations at the unknowns `z`, shape (unknowns,), from the `comparisons` there and from the prior:
    cost, gradient and matrix. Residuals are divided by the `scales` of their columns, and those beyond `OUTLIER`
    count less (Huber)."""
    deviations = problem.prior_deviations
    size = len(deviations)
    fisher, gradient = np.zeros((size, size)), (problem.start_values - z) / deviations**2
    cost = float(np.sum(((z - problem.start_values) / deviations) ** 2))
    weights = {(c.run, c.column): 1.0 / (scales or {}).get((c.run, c.column), 1.0) for c in comparisons}
    for comparison in comparisons:
        factor = weights[comparison.run, comparison.column]
        r = np.abs(comparison.residuals) * factor
        cost += float(np.sum(np.where(r < OUTLIER, r * r, OUTLIER * (2.0 * r - OUTLIER))))
        root = np.sqrt(OUTLIER / np.maximum(r, OUTLIER))
        slopes, places = comparison.slopes, np.array(comparison.places, int)
        if np.any(root < 1.0):
            slopes = slopes * root[:, None]
        # the product of a matrix with itself costs half of that of two
        fisher[np.ix_(places, places)] += factor**2 * (slopes.T @ slopes)
        gradient[places] += factor**2 * (slopes.T @ (root * comparison.residuals))
    return NormalEquations(
        z, comparisons, weights, cost, gradient, fisher, fisher + np.diag(1.0 / deviations**2)
    )


@briefly_shown
@dataclass(frozen=True)
class Fit(NormalEquations):
    """The best fit, and the number of `rounds` that it took. `starts` is the number of points from which it was
    sought, and `agreeing` of them led to it. `is_ended` tells whether no further round would improve it; a fit that
    still improves after `MOST_ROUNDS` is that of a model which does not describe the recordings."""

    rounds: int
    starts: int
    agreeing: int
    is_ended: bool = True

    @property
    def worst(self) -> tuple[Comparison, float]:
        """The comparison with the largest residuals, and their RMS in standard deviations of its noise."""
        squares = self.mean_squares
        worst = max(self.comparisons, key=lambda comparison: squares[comparison.run, comparison.column])
        return worst, math.sqrt(squares[worst.run, worst.column])


def fit(
    problem: Problem,
    z: Any = None,
    workers: int = 2,
    progress: Callable[[int, float], None] = lambda *_: None,
    starts: int = 1,
    seed: int = 0,
    most: int | None = None,
) -> Fit:
    """The values of the unknowns that fit best, from `z` or from the start values, and from `starts` - 1 random ones.

    The first turns of the runs are fitted before the whole: over a few turns a motor without speed control keeps in
    step with a simulated one of another load, and each of the starts costs little. There, and in the whole, a column
    counts by its deviation as long as it deviates by more than its noise: else the most exact one, such as the count
    of an encoder, alone would lead. The unknowns of clocks and sensors follow all others without simulation.

    Parameters
    ----------
    most : most rounds of the first turns, and of the whole; without it `MOST_ROUNDS`

    Raises
    ------
    RunError
        if the machine does not run with the start values.
    """
    counter = itertools.count(1)

    def rounds_of(part: Problem) -> _LevenbergMarquardt:
        return _LevenbergMarquardt(
            part, workers, lambda cost: progress(next(counter), cost), most or MOST_ROUNDS
        )

    first, rng = _first_turns(problem), np.random.default_rng(seed)
    z = problem.initial_point(workers) if z is None else z
    ends = list[NormalEquations]()
    for k in range(starts if first is not problem or starts > 1 else 0):
        rounds = rounds_of(first)
        try:
            near = _fit_roughly(rounds, _random_start(problem, z, rng) if k else z)
            ends.append(rounds.minimize(near, None, ROUGH))
        except RunError:
            if starts == 1:
                raise
    if ends:
        best = min(ends, key=lambda end: end.cost)
        # the clock of the first turns says nothing about the rest
        z = np.where([".count." in u.name for u in problem.unknowns], problem.start_values, best.z)
    rounds = rounds_of(problem)
    whole = rounds.minimize(_fit_roughly(rounds, z), None, 0.0)
    whole = rounds.minimize(whole, _measured_noises(whole), 0.0)
    agreeing = sum(end.cost < SAME_POINT * best.cost for end in ends) if ends else 1
    point = whole.z, whole.comparisons, whole.weights, whole.cost, whole.gradient, whole.fisher
    return Fit(*point, whole.matrix, next(counter) - 1, starts, agreeing, not rounds.is_cut)


def _first_turns(problem: Problem) -> Problem:
    """The problem of the first turns of all runs, where that is much less."""
    runs = []
    for run in problem.runs:
        begin = float(run.recording.time[0])
        part = run.recording.part(end=begin + TURNS * 2.0 * math.pi / run.crank_speed)
        runs.append(replace(run, recording=part))
    rows = [sum(len(run.recording.time) for run in some) for some in (runs, problem.runs)]
    if 2 * rows[0] > rows[1]:
        return problem
    return Problem(problem.plant, runs, problem.sought, problem.sensors)


def _random_start(problem: Problem, z: Any, rng: Any) -> Any:
    """A point with random values of the sought numbers in their bounds."""
    low, high = problem.bounds
    sought = ~np.array([u.is_nuisance for u in problem.unknowns])
    random = np.clip(problem.start_values + problem.prior_deviations * rng.standard_normal(len(z)), low, high)
    bounded = sought & np.isfinite(high - low)
    random[bounded] = rng.uniform(low[bounded], high[bounded])
    return np.where(sought, random, z)


def _fit_roughly(rounds: _LevenbergMarquardt, z: Any) -> NormalEquations:
    """From `z` on, the fit with columns that count by their deviations, until all deviate by their noise."""
    best = rounds.evaluate(z, None)
    while not rounds.are_spent and max((scales := _scales(best)).values()) > NEAR:
        before = best.mean_squares
        best = rounds.minimize(best, scales, 0.02)
        if all(best.mean_squares[key] > 0.9 * share for key, share in before.items()):
            break
    return rounds.reweight(best, None)


def _scales(point: NormalEquations) -> dict[tuple[str, str], float]:
    return {key: max(1.0, math.sqrt(share)) for key, share in point.mean_squares.items()}


def _measured_noises(point: NormalEquations) -> dict[tuple[str, str], float]:
    """The measured noise of each column in parts of the stated one, which counts as some rows. Outliers are those
    of noise of the median size."""
    noises = {}
    for comparison in point.comparisons:
        squares = comparison.residuals**2
        outlier = OUTLIER**2 * max(1.0, float(np.median(squares)) / _MEDIAN)
        total = STATED_ROWS + float(np.sum(np.minimum(squares, outlier)))
        noises[comparison.run, comparison.column] = math.sqrt(total / (STATED_ROWS + len(squares)))
    return noises


class _LevenbergMarquardt:
    """The rounds of a fit, by Levenberg's and Marquardt's method."""

    def __init__(self, problem: Problem, workers: int, progress: Callable[[float], None], most: int) -> None:
        self._problem, self._workers, self._progress, self._count = problem, workers, progress, 0
        self._most = most
        self._damping = DAMPING
        self.is_cut = False
        """whether the rounds were spent while the fit still improved"""

    @property
    def are_spent(self) -> bool:
        """Whether all rounds from a start are made."""
        return self._count >= self._most

    def reweight(self, point: NormalEquations, scales: Scales | None) -> NormalEquations:
        """The same point, with columns that count otherwise."""
        return assemble(self._problem, point.z, point.comparisons, scales)

    def evaluate(self, z: Any, scales: Scales | None) -> NormalEquations:
        """The normal equations at these values; those of clocks and sensors are the best."""
        self._count += 1
        simulations = self._problem.simulate_all(z, self._workers)
        z = _fit_sensors(self._problem, simulations, z, scales)
        equations = assemble(self._problem, z, tuple(self._problem.compare(simulations, z)), scales)
        self._progress(equations.cost)
        return equations

    def _evaluate_if_possible(self, z: Any, scales: Scales | None) -> NormalEquations | None:
        """The normal equations at these values; None if they make no machine, or one that does not run."""
        try:
            return self.evaluate(z, scales)
        except (InputError, RunError):
            return None

    def minimize(self, best: NormalEquations, scales: Scales | None, enough: float) -> NormalEquations:
        """The least sum of squares, up to the share `enough` of it, or where the rounds are spent."""
        problem, growth = self._problem, 2.0
        best = self.reweight(best, scales)
        while self._damping < 1e12:
            z = _next_point(problem, best, self._damping)
            step = z - best.z
            expected = float(2.0 * step @ best.gradient - step @ best.matrix @ step)
            if expected < max(ENOUGH, enough * best.cost):
                return best
            if self.are_spent:
                self.is_cut = True
                return best
            trial = self._evaluate_if_possible(z, scales)
            gain = best.cost - trial.cost if trial else 0.0
            if trial and gain > 0.0:
                # the damping follows the agreement with the expected gain (Nielsen)
                self._damping *= max(0.1, 1.0 - (2.0 * gain / max(expected, gain) - 1.0) ** 3)
                best, growth = trial, 2.0
            else:
                self._damping, growth = self._damping * growth, 2.0 * growth
        self._damping = DAMPING
        return best


def _fit_sensors(problem: Problem, simulations: Sequence[SimulatedRun], z: Any, scales: Scales | None) -> Any:
    """The values with those of clocks and sensors that fit best, without another simulation."""
    sensors = ~problem.needs_simulation
    best = None
    for _ in range(MOST_SENSOR_STEPS):
        point = assemble(problem, z, tuple(problem.compare(simulations, z, with_slopes=False)), scales)
        if best is not None and point.cost >= best.cost:
            break
        best, step = point, np.zeros(len(z))
        step[sensors] = _solve(point.matrix[np.ix_(sensors, sensors)], point.gradient[sensors])
        if step @ point.gradient < ENOUGH:
            break
        z = z + step
    assert best is not None
    return best.z


def _solve(matrix: Any, gradient: Any) -> Any:
    """The solution of normal equations, whose unknowns differ in size by many orders."""
    scale = 1.0 / np.sqrt(np.diag(matrix))
    return scale * np.linalg.solve(matrix * np.outer(scale, scale), scale * gradient)


def _next_point(problem: Problem, point: NormalEquations, damping: float) -> Any:
    """The next point of Levenberg and Marquardt's method, shape (unknowns,): the least squares of the linear
    residuals at `point`, with a `damping` of the unknowns that need a simulation. Unknowns that would pass a bound
    stop there, and the others are solved for again."""
    low, high = problem.bounds
    step, moving = np.zeros(len(point.z)), np.ones(len(point.z), bool)
    damped = point.matrix + np.diag(
        np.where(problem.needs_simulation, damping / problem.prior_deviations**2, 0.0)
    )
    for _ in range(len(point.z)):
        # unknowns that have stopped change the gradient of the others
        gradient = point.gradient[moving] - point.matrix[np.ix_(moving, ~moving)] @ step[~moving]
        step[moving] = _solve(damped[np.ix_(moving, moving)], gradient)
        z = point.z + step
        passing = moving & ((z < low) | (z > high))
        if not passing.any():
            return z
        step[passing] = np.clip(z, low, high)[passing] - point.z[passing]
        moving &= ~passing
    return np.clip(point.z + step, low, high)


@result
class FittedValue:
    """An unknown of a fit."""

    value: InUnit = part("value")
    deviation: InUnit = part("standard deviation")


def fitted_values(problem: Problem, best: NormalEquations) -> Iterator[tuple[Unknown, FittedValue]]:
    """Each unknown of a fit with its value and standard deviation. The angle of a run is within a turn; that of the
    mark lies on both sides of 0."""
    for unknown, x, s in zip(problem.unknowns, best.z, best.deviations, strict=True):
        value, unit = float(x), unknown.unit
        if unknown.is_nuisance and unknown.name.endswith(f".{ANGLE}") and unknown.name != MARK_ANGLE:
            value %= 2.0 * math.pi
        kind = "temperature" if unit == "K" else ""
        yield unknown, FittedValue(InUnit(value, unit, kind), difference(float(s), unit))
