"""The points of a sweep. A point is determined by the plan and its number alone, so that work can start at any."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from ...core.quantities import Variable

MOST_OF_HYPERCUBE = 1_000_000
"""Largest number of points of a Latin hypercube: each of its points depends on all others, so that all are made."""
_SIGMAS = 3.0
"""Standard deviations of a normal distribution in its tolerance."""
_HALF = 2.0**-31
"""Half of the distance between the numbers that Sobol's sequence gives: no number is 0 or 1 then."""


@dataclass(frozen=True)
class SweptParameter:
    """A quantity that a sweep varies: its declaration by its full name, its value in the study (`centre`), and either
    its `values` or its ends, in its unit. With a `tolerance` the ends are `centre` less and plus the tolerance."""

    variable: Variable
    centre: float
    values: tuple[float, ...] = ()
    low: float = math.nan
    high: float = math.nan
    tolerance: float | None = None
    distribution: str = "uniform"

    @property
    def name(self) -> str:
        """Its full name."""
        return self.variable.name

    @property
    def ends(self) -> tuple[float, float]:
        """Least and largest value; of a normal distribution nearly all values are between them."""
        return (min(self.values), max(self.values)) if self.values else (self.low, self.high)

    @property
    def is_normal(self) -> bool:
        """Whether its values are normally distributed."""
        return self.distribution == "normal"

    @property
    def deviation(self) -> float:
        """The standard deviation of normally distributed values."""
        assert self.tolerance is not None
        return self.tolerance / _SIGMAS

    def of_share(self, u: Any) -> Any:
        """The values below which the shares `u` of all values lie, shape of `u`, between 0 and 1."""
        if self.values:
            return np.array(self.values)[np.minimum((u * len(self.values)).astype(int), len(self.values) - 1)]
        if self.is_normal:
            from scipy.special import ndtri

            return self.centre + self.deviation * ndtri(u)
        return self.low + (self.high - self.low) * u


@dataclass(frozen=True)
class SweepPlan:
    """A sweep: its parameters and points, and its results by name.

    `basis` are the assumptions behind some quantities, an instance of `CycleBasis`; `angles` is the number of crank
    angles, `event` the run of the event of the measures, `best` the result whose least or largest values (`best_is`)
    are best.
    """

    method: str
    seed: int
    points: int
    parameters: tuple[SweptParameter, ...]
    quantities: tuple[str, ...]
    measures: tuple[str, ...]
    event: str
    best: str
    best_is: str
    angles: int
    basis: Any

    @property
    def is_grid(self) -> bool:
        """Whether the points are all combinations of values."""
        return self.method == "grid"

    @property
    def shape(self) -> tuple[int, ...]:
        """The number of values of each parameter of a grid; of others the number of points."""
        return (
            tuple(len(parameter.values) for parameter in self.parameters) if self.is_grid else (self.points,)
        )

    @property
    def dims(self) -> tuple[str, ...]:
        """The dimensions of the results: the parameters of a grid, else ``point``."""
        return tuple(parameter.name for parameter in self.parameters) if self.is_grid else ("point",)

    def values(self, begin: int, end: int) -> dict[str, Any]:
        """The values of the parameters at the points from `begin` to `end` - 1, by name, shape (end - begin,)."""
        if self.is_grid:
            places = np.unravel_index(np.arange(begin, end), self.shape)
            return {
                parameter.name: np.array(parameter.values)[k]
                for parameter, k in zip(self.parameters, places, strict=True)
            }
        size = len(self.parameters)
        if self.method == "sobol":
            shares = _sobol(self.seed, size)(begin, end)
        else:
            shares = _hypercube(self.seed, size, self.points)[begin:end]
        return {
            parameter.name: parameter.of_share(u)
            for parameter, u in zip(self.parameters, shares.T, strict=True)
        }


@lru_cache(maxsize=4)
def _sobol(seed: int, size: int) -> Callable[[int, int], Any]:
    """A function that gives any part of Sobol's scrambled sequence, shape (numbers, size)."""
    from scipy.stats import qmc

    sequence = qmc.Sobol(size, scramble=True, rng=np.random.default_rng(seed))
    lock = threading.Lock()

    def part(begin: int, end: int) -> Any:
        """The points from `begin` to `end` - 1; the sequence goes on from the last one, or starts anew."""
        with lock:
            if begin == 0 or sequence.num_generated > begin:
                sequence.reset()
            if begin > sequence.num_generated:
                sequence.fast_forward(begin - sequence.num_generated)
            # scipy warns of a first part whose length is no power of 2
            count = end - begin
            drawn = 1 << (count - 1).bit_length() if begin == 0 else count
            return sequence.random(drawn)[:count] + _HALF

    return part


@lru_cache(maxsize=2)
def _hypercube(seed: int, size: int, points: int) -> Any:
    """All points of a Latin hypercube, shape (points, size)."""
    from scipy.stats import qmc

    return qmc.LatinHypercube(size, rng=np.random.default_rng(seed)).random(points)
