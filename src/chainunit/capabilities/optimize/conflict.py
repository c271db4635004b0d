"""Limits that no machine meets: each one that is impossible alone, and a smallest set of others, by deletion.

An elastic program gives each limit a slack and makes the sum of the slacks least. Where it stays above 0 from all
starts, the limits conflict. A limit is taken out for good where the others conflict without it; the remaining limits
conflict, and without any one of them the others can be met.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from .search import Answer, Search
from .wishes import SLACK, TURNS

MET = 1e-6
"""Largest sum of slacks, as shares of the limits, that counts as none."""
_HELD = 1e-6
"""Least multiplier of a bound that holds the nearest machine back."""


@dataclass(frozen=True)
class Conflict:
    """Why no machine meets the limits."""

    alone: Mapping[str, float]
    """limits that no machine meets, even without all others, each with the value of its quantity that comes nearest;
    NaN for one of no quantity"""
    together: tuple[str, ...]
    """limits beside these, each of which can be met, that conflict"""
    nearest: Answer
    """the machine that misses the limits of `names` by the least sum of shares"""
    bounds: tuple[tuple[str, str], ...]
    """the bounds of parameters, (name, side), that hold it"""

    @property
    def names(self) -> tuple[str, ...]:
        """The limits of both kinds."""
        return (*self.alone, *self.together)


def nearest(
    search: Search, starts: Sequence[Any], without: frozenset[str] = frozenset()
) -> tuple[Answer | None, bool]:
    """The machine that misses the limits by the least sum of shares, and whether it meets all of them."""
    best: Answer | None = None
    for x in starts:
        answer = search.solve(x, None, without=without)
        if answer.feasible and (best is None or answer.value < best.value):
            best = answer
            if best.value < MET:
                return best, True
    return best, False


def conflict(search: Search, starts: Sequence[Any], first: Answer) -> Conflict:
    """All limits that cannot be met alone, and a smallest set of others that cannot be met together; `first` is the
    nearest machine under all limits."""
    wishes = search.wishes
    slack = [SLACK] if wishes.table.slack_free_speed else []
    names = [*(limit.name for limit in wishes.limits), *slack, TURNS]
    # the nearest machine is the best start: a limit less moves it little
    starts = [first.x, *starts]
    closest, alone = first, dict[str, float]()
    # a limit that the nearest machine meets is not impossible alone
    for name in (name for name in names if first.misses.get(name, 0.0) > MET):
        answer, met = nearest(search, starts, without=frozenset(names) - {name})
        if not met and answer is not None:
            closest, alone[name] = answer, _value(search, name, answer.x)
    together: tuple[str, ...] = ()
    if not alone or not nearest(search, starts, without=frozenset(alone))[1]:
        others = [name for name in names if name not in alone]
        closest, together = _together(search, starts, first, others, frozenset(alone))
    if len(alone) > 1 or (alone and together):
        # the nearest machine under all limits of the conflict
        answer, _ = nearest(search, starts, without=frozenset(names) - {*alone, *together})
        closest = answer or first
    bounds = tuple(key for key, factor in closest.at_bounds.items() if abs(factor) > _HELD)
    return Conflict(alone, together, closest, bounds)


def _value(search: Search, name: str, x: Any) -> float:
    q = next((limit.quantity for limit in search.wishes.limits if limit.name == name), None)
    return search.value(q, x) if q is not None and search.turns(x) else math.nan


def _together(
    search: Search, starts: Sequence[Any], first: Answer, names: list[str], out: frozenset[str]
) -> tuple[Answer, tuple[str, ...]]:
    """A smallest set of the limits `names` that conflict, by deletion, and the nearest machine under it; the limits
    `out` are left out."""
    # limits that the nearest machine meets are the first to be taken out
    left_in, closest = sorted(names, key=lambda name: first.misses.get(name, 0.0)), first
    for name in list(left_in):
        if len(left_in) == 1:
            break
        answer, met = nearest(search, starts, out | {name})
        if not met and answer is not None:
            out, closest = out | {name}, answer
            left_in.remove(name)
    return closest, tuple(left_in)
