"""Limits that no machine meets together: a smallest set of them, by deletion.

An elastic program gives each limit a slack and makes the sum of the slacks least. Where it stays above 0 from all
starts, the limits conflict. A limit is taken out for good where the others conflict without it; those that remain
conflict, and without any one of them the others can be met.
"""

from __future__ import annotations

from collections.abc import Sequence
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
    """The limits that conflict, by name; the machine that misses the limits by the least sum of shares; and the
    bounds of parameters, (name, side), that hold it."""

    names: tuple[str, ...]
    nearest: Answer
    bounds: tuple[tuple[str, str], ...]


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
    """A smallest set of limits that cannot be met together; `first` is the nearest machine under all limits."""
    wishes = search.wishes
    names = [limit.name for limit in wishes.limits]
    names += [SLACK] if wishes.slack_free_speed else []
    names += [TURNS]
    # limits that the nearest machine meets are the first to be taken out
    names.sort(key=lambda name: first.misses.get(name, 0.0))
    # the nearest machine is the best start: a limit less moves it little
    starts = [first.x, *starts]
    out: frozenset[str] = frozenset()
    last = first
    for name in names:
        if len(out) == len(names) - 1:
            break
        answer, met = nearest(search, starts, out | {name})
        if not met and answer is not None:
            out, last = out | {name}, answer
    bounds = tuple(key for key, factor in last.at_bounds.items() if abs(factor) > _HELD)
    return Conflict(tuple(name for name in names if name not in out), last, bounds)
