"""The check of an answer by another route: machines near it, computed as a batch."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...core.quantities import quantity
from ...reading.results import result
from ...study.cycle_quantities import CycleQuantity, evaluate
from .search import FINE, Search
from .wishes import TurnLimit

STEPS = (1e-3, 1e-2)
"""Distances of the neighbours, as shares of the distance between the bounds."""
_RANDOM = 64
"""Number of random directions."""
_TOLERANCE, _ROUNDING = 1e-7, 1e-11
"""Shares by which a neighbour may exceed a limit, and has to be better: on a grid, and as computed exactly."""


@result
class Neighbours:
    """Machines near the best one."""

    number: int = quantity("1", "number of machines that were computed")
    feasible: int = quantity("1", "number of machines that meet all limits")
    better: int = quantity("1", "number of machines that meet them and are better")


def around(search: Search, x: Any) -> Any:
    """Free parameters around `x`, shape (neighbours, free): each one alone to both sides, and random directions."""
    columns, n = search.columns, search.columns.size
    rng = np.random.default_rng(int(search.wishes.table.seed))
    directions = rng.normal(size=(_RANDOM, n))
    directions /= np.max(np.abs(directions), axis=1, keepdims=True)
    directions = np.concatenate([np.eye(n), -np.eye(n), directions])
    points = np.concatenate([x + step * columns.span * directions for step in STEPS])
    return np.clip(points, columns.low, columns.low + columns.span)


def neighbours(
    search: Search, x: Any, objective: CycleQuantity, limits: Sequence[TurnLimit], value: float
) -> Neighbours:
    """The quantities of the machines `around` x, and whether these meet the limits."""
    import xarray as xr

    points = around(search, x)
    quantities = list({q.name: q for q in (objective, *(limit.quantity for limit in limits))}.values())
    machine = search.wishes.machine.replace(dict(zip(search.wishes.names, map(float, x), strict=True)))
    values = {
        name: xr.DataArray(column, dims="neighbour")
        for name, column in zip(search.wishes.names, points.T, strict=True)
    }
    # so few states take less time than a compiler
    arguments = search.wishes.crank_speed, search.wishes.feed, values, search.wishes.table, FINE
    table = evaluate(machine, quantities, *arguments, engine="numpy")
    near = search.wishes.table.clearance * search.columns.distances(search.base) * (1.0 - 1e-9)
    distances = np.array([search.columns.distances(point) for point in points])
    met = (table.reason.values == 0) & np.all(distances >= near, axis=1)
    for limit in limits:
        met &= _meets(limit, table[limit.name].values)
    if search.wishes.table.slack_free_speed:
        met[met] = [search.least_pull(point) >= 0.0 for point in points[met]]
    better = met & (table[objective.name].values < value * (1.0 - math.copysign(_TOLERANCE, value)))
    # the values at the angles of a grid are a little too small: the candidates are computed exactly
    count = 0
    if better.any():
        # and a limit may be exceeded no more than at the best machine: a steep objective gains from any share
        widened = [_widened(limit, search.value(limit.quantity, x)) for limit in limits]
        count = sum(_is_better(search, point, objective, widened, value) for point in points[better])
    return Neighbours(len(points), int(np.sum(met)), count)


def _widened(limit: TurnLimit, value: float) -> TurnLimit:
    """The limit, or the value where it is beyond."""
    low = None if limit.low is None else min(limit.low, value)
    high = None if limit.high is None else max(limit.high, value)
    return TurnLimit(limit.quantity, low, high)


def _meets(limit: TurnLimit, values: Any, tolerance: float = _TOLERANCE) -> Any:
    """Whether each of the values keeps a limit, but for a share of it that is the `tolerance`."""
    met = np.isfinite(values)
    for bound, sign in ((limit.low, 1.0), (limit.high, -1.0)):
        if bound is not None:
            met &= sign * (values - bound) >= -tolerance * max(abs(bound), 1e-12)
    return met


def _is_better(
    search: Search, x: Any, objective: CycleQuantity, limits: Sequence[TurnLimit], value: float
) -> bool:
    """Whether a machine is better than one with the objective `value`, and keeps the limits, both computed
    exactly."""
    if not all(_meets(limit, np.array(search.value(limit.quantity, x)), _ROUNDING) for limit in limits):
        return False
    return search.value(objective, x) < value * (1.0 - math.copysign(_TOLERANCE, value))
