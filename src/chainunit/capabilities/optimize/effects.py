"""Free parameters on which nothing depends: a search would give them any value."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...core.errors import InputError
from .program import COARSE
from .rows import grid
from .search import Search
from .wishes import Wishes

_MACHINES = 4
_NONE = 1e-9
"""Largest change over the whole distance between the bounds, as a share of a quantity, that is one of rounding."""


def effective_search(wishes: Wishes) -> tuple[Search, dict[str, tuple[float, float]]]:
    """The search over the free parameters that have an effect, and the bounds of the others, which keep their values
    of today.

    Raises
    ------
    InputError
        where no free parameter has an effect.
    RunError
        where no machine within the bounds turns.
    """
    search = Search(wishes)
    idle = {
        name: wishes.free[name]
        for name, change in zip(wishes.names, _changes(search), strict=True)
        if change <= _NONE
    }
    if not idle:
        return search, idle
    effective = {name: bounds for name, bounds in wishes.free.items() if name not in idle}
    if not effective:
        objectives = ", ".join(q.name for q in wishes.objectives)
        raise InputError(
            f"optimize.free: {no_effect(wishes, tuple(idle))}; free a parameter on which {objectives} depends",
            "optimize.free",
        )
    return Search(replace(wishes, free=effective)), idle


def no_effect(wishes: Wishes, names: tuple[str, ...]) -> str:
    """Words on parameters without an effect: ``ratio has no effect on peak(crank_torque)``."""
    objectives = ", ".join(q.name for q in wishes.objectives)
    limits = " and the limits" if wishes.limits or wishes.table.slack_free_speed else ""
    return f"{', '.join(names)} {'have' if len(names) > 1 else 'has'} no effect on {objectives}{limits}"


def _changes(search: Search) -> np.ndarray:
    """The largest change of any quantity, pull or requirement by each free parameter over the distance between its
    bounds, as a share of its size, shape (free,); 0 where all exact derivatives are 0, at some machines within the
    bounds."""
    columns, wishes, q = search.columns, search.wishes, grid(COARSE)
    # the columns of each quantity, and of the pulls, with the crank speed at which they count
    groups = []
    for quantity in (*wishes.objectives, *(limit.quantity for limit in wishes.limits)):
        # the installed power is that of the shaft, whatever its gear
        names = ["power"] if quantity.name == "installed_power" else [i.column for i in quantity.integrands]
        groups.append(([columns.whole(name) for name in names], wishes.crank_speed))
    groups += [(search.pulls, wishes.table.slack_free_speed)] if search.pulls else []
    largest = np.zeros(columns.size)
    for x in [search.base, *search.starts(_MACHINES)[0]]:
        for places, w in groups:
            values = columns.values(x, q, w, places)[0]
            slopes = columns.slopes(x, q, w, places)
            if len(places) > 1 and places is not search.pulls:
                # a range does not change if all values change alike
                values, slopes = values - np.mean(values), slopes - np.mean(slopes, axis=(0, 1))
            size = np.max(np.abs(values)) or 1.0
            largest = np.maximum(largest, columns.span * np.max(np.abs(slopes), axis=(0, 1)) / size)
        distances = np.abs(columns.distances(x))[:, None]
        sizes = np.where(distances > 0.0, distances, 1.0)
        shares = np.abs(np.array(columns.distance_slopes(x))) * columns.span / sizes
        largest = np.maximum(largest, np.max(shares, axis=0, initial=0.0))
    return largest
