"""Whether a fit describes the recordings. A wrong model leaves orders of the crank in the residuals, or strains
clocks and sensors: a wrong gear is described by a clock that runs too fast."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import f

from ...refusals import unit_behind
from .fit import Normal
from .problem import Comparison, Problem
from .unknown import Unknown

ORDERS = 20
"""Highest order of the crank that is looked at."""
ROWS = 10
"""Number of rows for each order that is looked at."""
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
    """The checks of all columns of a fit that have a value in each row. Of few rows fewer orders are looked at."""
    columns = [each for each in best.comparisons if each.column != "mark" and len(each.residuals) >= 2 * ROWS]
    level = (1.0 - FALSE_ALARMS) ** (1.0 / max(1, len(columns)))
    return [check(each, level) for each in columns]


def check(of: Comparison, level: float) -> ResidualCheck:
    """The check of one column; noise is within the limit of its statistic with the probability `level`."""
    rows = len(of.residuals)
    orders = min(ORDERS, rows // ROWS)
    # the noise is measured, too
    limit = 2 * orders * float(f.ppf(level, 2 * orders, rows - 2 * orders - 1))
    waves = np.stack(list(_waves(of.angle, orders)), axis=1)
    parts, *_ = np.linalg.lstsq(waves, of.residuals, rcond=None)
    rest = of.residuals - waves @ parts
    noise = float(np.sqrt(np.sum(rest**2) / (len(rest) - waves.shape[1])))
    # the constant part is that of an offset
    covariance = np.linalg.inv(waves.T @ waves)[1:, 1:]
    statistic = float(parts[1:] @ np.linalg.solve(covariance, parts[1:])) / noise**2
    sizes = np.hypot(parts[1::2], parts[2::2]) * of.size
    largest = np.argsort(-sizes)[:3]
    found = tuple((int(k) + 1, float(sizes[k])) for k in largest)
    return ResidualCheck(of.run, of.column, statistic, limit, found, noise)


def _waves(angle: Any, orders: int) -> Iterator[Any]:
    yield np.ones(len(angle))
    for order in range(1, orders + 1):
        yield np.cos(order * angle)
        yield np.sin(order * angle)
