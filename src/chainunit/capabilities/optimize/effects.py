"""Free parameters on which nothing depends: a search would give them any value."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...core.errors import InputError
from .extremes import grid
from .program import COARSE
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
    rest = {name: bounds for name, bounds in wishes.free.items() if name not in idle}
    if not rest:
        wanted = ", ".join(q.name for q in wishes.objectives)
        raise InputError(
            f"optimize.free: {no_effect(wishes, tuple(idle))}; free a parameter on which {wanted} depends",
            "optimize.free",
        )
    return Search(replace(wishes, free=rest)), idle


def no_effect(wishes: Wishes, names: tuple[str, ...]) -> str:
    """Words on parameters without an effect: ``ratio has no effect on peak(crank_torque)``."""
    wanted = ", ".join(q.name for q in wishes.objectives)
    limits = " and the limits" if wishes.limits or wishes.slack_free_speed else ""
    return f"{', '.join(names)} {'have' if len(names) > 1 else 'has'} no effect on {wanted}{limits}"


def _changes(search: Search) -> np.ndarray:
    """The largest change of any quantity, pull or requirement by each free parameter over the distance between its
    bounds, as a share of its size, shape (free,); 0 where all exact derivatives are 0, at some machines within the
    bounds."""
    space, wishes, q = search.space, search.wishes, grid(COARSE)
    quantities = (*wishes.objectives, *(limit.quantity for limit in wishes.limits))
    # the installed power is that of the shaft, whatever its gear
    columns = [
        ["power"] if each.name == "installed_power" else [i.column for i in each.integrands]
        for each in quantities
    ]
    blocks = [([search.columns.whole(name) for name in names], space.speed) for names in columns]
    relative = [len(names) > 1 for names in columns]
    if wishes.slack_free_speed:
        blocks.append((search.mean_pulls, space.slack_speed))
        relative.append(False)
    largest = np.zeros(space.n)
    for x in [search.base, *search.starts(_MACHINES)[0]]:
        by_speed = {w: space.kernel.slopes(x, q, np.full(len(q), w)) for w in {w for _, w in blocks}}
        for (rows, w), is_relative in zip(blocks, relative, strict=True):
            values, slopes = (each[rows] for each in by_speed[w])
            slopes = slopes[:, : space.n]
            if is_relative:
                # a range does not change where all values change alike
                values, slopes = (
                    values - np.mean(values),
                    slopes - np.mean(slopes, axis=(0, 2), keepdims=True),
                )
            size = np.max(np.abs(values)) or 1.0
            largest = np.maximum(largest, space.span * np.max(np.abs(slopes), axis=(0, 2)) / size)
        met = np.abs(space.requirements.values(x))[:, None]
        shares = np.abs(space.requirements.slopes(x)) * space.span / np.where(met > 0.0, met, 1.0)
        largest = np.maximum(largest, np.max(shares, axis=0, initial=0.0))
    return largest
