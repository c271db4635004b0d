"""Whether a fit describes the recordings. A wrong model leaves orders of the crank in the residuals, or strains
clocks and sensors: a wrong gear is described by a clock that runs too fast."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import chi2

from ...refusals import unit_behind
from .fit import Normal
from .problem import Comparison, Problem
from .unknown import Unknown

ORDERS = 20
"""Highest order of the crank that is looked at."""
LEAST_ROWS = 10 * ORDERS
"""Least number of rows whose orders can be checked."""
FALSE_ALARMS = 0.01
"""Share of right models of which some column is taken for wrong."""


STRAINED = 5.0
"""Deviation from what is known of a clock or a sensor, in standard deviations, that is no chance."""


@dataclass(frozen=True)
class ResidualCheck:
    """The residuals of a column of a run.

    `statistic` is the sum of the squares of the cosine and sine parts of all orders, in standard deviations of noise
    of the same size; noise exceeds `limit` in the permitted share of fits. `orders` are the three largest orders with
    their amplitudes in the unit of the column. `noise` is the standard deviation of the rest, in parts of the
    stated noise of the sensor.
    """

    run: str
    column: str
    statistic: float
    limit: float
    orders: tuple[tuple[int, float], ...]
    noise: float

    @property
    def is_noise(self) -> bool:
        """Whether the residuals may be noise."""
        return self.statistic <= self.limit


@dataclass(frozen=True)
class Strain:
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


def strains(problem: Problem, best: Normal) -> list[Strain]:
    """The strained numbers of clocks and sensors."""
    numbers = zip(problem.unknowns, best.z, problem.simulated_with, strict=True)
    own = [(u, float(x), (float(x) - u.start) / u.spread) for u, x, simulated in numbers if not simulated]
    return [Strain(u.name, u.unit, x, far) for u, x, far in own if abs(far) > STRAINED]


def strained_priors(sought: Sequence[Unknown], best: Normal) -> list[Strain]:
    """The `sought` numbers with a stated deviation, in the order of the problem, that are not as they are known."""
    known = [(u, float(x)) for u, x in zip(sought, best.z, strict=False) if not u.is_even]
    priors = [Strain(u.name, u.unit, x, (x - u.start) / u.spread, u.start) for u, x in known]
    return [each for each in priors if abs(each.deviations) > STRAINED]


def check_residuals(best: Normal) -> list[ResidualCheck]:
    """The checks of all columns of a fit that have a value in each row, and enough rows."""
    columns = [
        each for each in best.comparisons if each.column != "mark" and len(each.residuals) >= LEAST_ROWS
    ]
    limit = float(chi2.ppf((1.0 - FALSE_ALARMS) ** (1.0 / max(1, len(columns))), 2 * ORDERS))
    return [check(each, limit) for each in columns]


def check(of: Comparison, limit: float) -> ResidualCheck:
    """The check of one column, with this limit of the statistic."""
    waves = np.stack(list(_waves(of.angle)), axis=1)
    parts, *_ = np.linalg.lstsq(waves, of.residuals, rcond=None)
    rest = of.residuals - waves @ parts
    noise = float(np.sqrt(np.sum(rest**2) / (len(rest) - waves.shape[1])))
    # the constant part is that of an offset
    covariance = np.linalg.inv(waves.T @ waves)[1:, 1:]
    statistic = float(parts[1:] @ np.linalg.solve(covariance, parts[1:])) / noise**2
    sizes = np.hypot(parts[1::2], parts[2::2]) * of.size
    largest = np.argsort(-sizes)[:3]
    orders = tuple((int(k) + 1, float(sizes[k])) for k in largest)
    return ResidualCheck(of.run, of.column, statistic, limit, orders, noise)


def _waves(angle: Any) -> Iterator[Any]:
    yield np.ones(len(angle))
    for order in range(1, ORDERS + 1):
        yield np.cos(order * angle)
        yield np.sin(order * angle)
