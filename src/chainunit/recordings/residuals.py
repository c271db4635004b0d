"""Whether a fit describes the recordings. A wrong model leaves orders of the crank in the residuals, or moves clocks
and sensors away from their known values: a wrong gear is described by a clock that runs too fast. A machine whose
speed or load was not steady leaves residuals that change slowly, beside the orders."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..core.messages import unit_behind
from ..core.quantities import quantity
from ..reading.results import InUnit, derived, part, result
from .fit import Fit, NormalEquations
from .measurands import MEASURANDS
from .problem import Comparison, Problem
from .unknown import Unknown

ORDERS = 20
"""Highest order of the crank that is looked at."""
ROWS = 10
"""Number of rows for each order that is looked at."""
RESOLVED = 2e-2
"""Size of a combination of orders over the rows, in parts of the largest one, from which on they resolve it."""
PART = 0.5 * math.pi
"""Crank angle of a part of the run, of which the mean is looked at [rad]."""
EXCESS_NOISE = 1.5
"""Noise in parts of the stated one from which on a sentence names it, and slow changes are no noise: those of a
smaller size do not bend a result by much."""
FALSE_REJECTIONS = 1e-3
"""Share of right models of which some column is taken for wrong."""
CONFLICT = 5.0
"""Deviation from what is known of a clock or a sensor, in standard deviations, that is no chance."""


@result
class OrderAmplitude:
    """An order of the crank in the residuals of a column."""

    order: int = quantity("1", "the order")
    amplitude: InUnit = part("its amplitude")


@result
class ResidualTest:
    """The residuals of a column of a run.

    `statistic` is the sum of the squares of the parts of the residuals along cosine and sine of all orders, in
    standard deviations of noise of the same size; noise exceeds `limit` in the permitted share of fits. `orders` are
    the three largest orders with their amplitudes in the unit of the column. `noise` is the standard deviation of the
    rest, in parts of the stated noise of the sensor. `slow` is the sum of the squares of the means of the rest over
    parts of the run, in the same deviations, with its limit, and `changes` the standard deviation of these means in
    the unit of the column.
    """

    run: str = part("the run")
    column: str = part("the column")
    statistic: float = quantity("1", "sum of squares of the parts along all orders, in deviations of noise")
    limit: float = quantity("1", "limit of the statistic")
    orders: tuple[tuple[int, float], ...]
    noise: float = quantity("1", "standard deviation of the rest, in parts of the stated noise")
    slow: float = part(
        "sum of squares of the means over parts of the run, in the same deviations", unit="1", default=0.0
    )
    slow_limit: float = part("its limit", unit="1", default=math.inf)
    changes: float = 0.0

    @derived()
    def reason(self) -> str:
        """Why the residuals are no noise: "slow", "orders"; empty where they may be noise. The size of noise alone is
        no reason."""
        if self.noise > EXCESS_NOISE and self.slow > self.slow_limit:
            return "slow"
        return "orders" if not self.statistic <= self.limit else ""

    @derived()
    def is_noise(self) -> bool:
        """Whether the residuals may be noise."""
        return not self.reason

    @derived(name="changes")
    def slow_changes(self) -> InUnit:
        """Standard deviation of the means over parts of the run."""
        return InUnit(self.changes, MEASURANDS[self.column].unit)

    @derived(name="orders")
    def largest_orders(self) -> list[OrderAmplitude]:
        """The three largest orders."""
        unit = MEASURANDS[self.column].unit
        return [OrderAmplitude(order, InUnit(size, unit)) for order, size in self.orders]


@dataclass(frozen=True)
class PriorConflict:
    """A number of a clock or a sensor whose best value is farther from what is known of it than chance explains, by
    so many standard deviations."""

    name: str
    unit: str
    value: float
    deviations: float
    known: float | None = None

    def __str__(self) -> str:
        return (
            f"{self.name} = {self.value:.4g}{unit_behind(self.unit)} is {abs(self.deviations):.2g} standard "
            "deviations beside the known value"
            + ("" if self.known is None else f", {self.known:.4g}{unit_behind(self.unit)}")
        )


def sensor_conflicts(problem: Problem, best: NormalEquations) -> list[PriorConflict]:
    """The numbers of clocks and sensors that are not as they are known."""
    numbers = zip(problem.unknowns, best.z, problem.needs_simulation, strict=True)
    sensors = [
        (u, float(x), (float(x) - u.start) / u.prior_deviation)
        for u, x, simulated in numbers
        if not simulated
    ]
    return [PriorConflict(u.name, u.unit, x, far) for u, x, far in sensors if abs(far) > CONFLICT]


def prior_conflicts(sought: Sequence[Unknown], best: NormalEquations) -> list[PriorConflict]:
    """The `sought` numbers with a stated deviation, in the order of the problem, that are not as they are known."""
    expected = [(u, float(x)) for u, x in zip(sought, best.z, strict=False) if not u.is_even]
    priors = [
        PriorConflict(u.name, u.unit, x, (x - u.start) / u.prior_deviation, u.start) for u, x in expected
    ]
    return [conflict for conflict in priors if abs(conflict.deviations) > CONFLICT]


def describes(
    problem: Problem, best: Fit, tests: Sequence[ResidualTest], excepted: Collection[str] = ()
) -> bool:
    """Whether a fit describes the recordings: it ended, its residuals may be noise, and the numbers of clocks and
    sensors and all sought ones, without the `excepted`, are as they are known."""
    conflicts = [*sensor_conflicts(problem, best), *prior_conflicts(problem.sought, best)]
    are_known = all(conflict.name in excepted for conflict in conflicts)
    return best.is_ended and are_known and all(test.is_noise for test in tests)


def residual_tests(best: NormalEquations) -> list[ResidualTest]:
    """The checks of all columns of a fit that have a value in each row. Of few rows fewer orders are looked at."""
    columns = [
        comparison
        for comparison in best.comparisons
        if comparison.column != "mark" and len(comparison.residuals) >= 2 * ROWS
    ]
    # each has two statistics
    level = (1.0 - FALSE_REJECTIONS) ** (0.5 / max(1, len(columns)))
    return [residual_test(comparison, level) for comparison in columns]


def residual_test(comparison: Comparison, level: float) -> ResidualTest:
    """The check of one column, whether its residuals go with the orders of the crank's turn or wander in the run;
    noise is within the limit of its statistic with the probability `level`.

    The residuals are split by least squares into parts along cosine and sine of the orders, and a rest, whose size is
    that of the noise: the squares of the parts over that of noise have the F distribution. Over a part of a turn, as
    of a machine that swings after its motor was switched off, the orders are nearly one another's sums. So their
    orthogonal combinations are taken, as far as the angles resolve them.
    """
    from scipy.stats import f

    rows = len(comparison.residuals)
    orders = min(ORDERS, rows // ROWS)
    # the constant part is that of an offset
    waves = np.stack(list(_waves(comparison.angle, orders)), axis=1)
    waves -= np.mean(waves, axis=0)
    residuals = comparison.residuals - np.mean(comparison.residuals)
    squares, combinations = np.linalg.eigh(waves.T @ waves)
    resolved = squares > RESOLVED**2 * squares[-1]
    sizes, combinations = np.sqrt(squares[resolved]), combinations[:, resolved]
    count = len(sizes)
    along = combinations.T @ (waves.T @ residuals) / sizes
    free = rows - count - 1
    rest = residuals - waves @ (combinations @ (along / sizes))
    noise = math.sqrt(float(rest @ rest) / free)
    # the noise is measured, too
    limit = count * float(f.ppf(level, count, free))
    parts = combinations @ (along / sizes)
    amplitudes = np.hypot(parts[::2], parts[1::2]) * comparison.size
    largest = np.argsort(-amplitudes)[:3]
    orders_found = tuple((int(k) + 1, float(amplitudes[k])) for k in largest)
    statistic = _over(float(along @ along), noise**2)
    slow = _slow(rest, comparison.angle, level)
    return ResidualTest(
        comparison.run,
        comparison.column,
        statistic,
        limit,
        orders_found,
        noise,
        *slow[:2],
        slow[2] * comparison.size,
    )


def _slow(residuals: Any, angle: Any, level: float) -> tuple[float, float, float]:
    """The sum of the squares of the means of parts of the run, in standard deviations of the noise within the parts,
    its limit, and the standard deviation of the means."""
    from scipy.stats import f

    rows, count = len(residuals), min(len(residuals) // ROWS, round(float(np.ptp(angle)) / PART))
    if count < 2:
        return 0.0, math.inf, 0.0
    begins = np.linspace(0.0, rows, count, endpoint=False).astype(int)
    sizes = np.diff(np.append(begins, rows))
    means = np.add.reduceat(residuals, begins) / sizes
    between = float(np.sum(sizes * means**2))
    within = (float(residuals @ residuals) - between) / (rows - count)
    limit = (count - 1) * float(f.ppf(level, count - 1, rows - count))
    return _over(between, within), limit, math.sqrt(between / rows)


def _over(part: float, noise: float) -> float:
    """A part of the residuals over their noise; 0 where neither is there, as of a recording that the model made."""
    if noise > 0.0:
        return part / noise
    return math.inf if part > 0.0 else 0.0


def _waves(angle: Any, orders: int) -> Iterator[Any]:
    for order in range(1, orders + 1):
        yield np.cos(order * angle)
        yield np.sin(order * angle)
