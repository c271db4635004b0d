"""Extremes and roots of quantities over the way of a driver, between the places at which they are sampled, too."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

_CANDIDATES = 2
"""So many of the largest samples of a quantity may lie beside its largest value."""
_POINTS = 9
_ROUNDS = 10
"""Points of a range around a sample, and rounds in which the range shrinks to two of its steps."""
_HALVINGS = 48


def largest(values_at: Callable[[Any], Any], q: Any, *, around: bool) -> tuple[Any, Any]:
    """The place and the largest value of each quantity, each of shape (quantities,).

    The search needs no derivative, so that a corner or a jump of a load does not mislead it.

    Parameters
    ----------
    values_at : gives the quantities at places of shape (n,), shape (quantities, n)
    q : evenly spaced places, close enough that at most one extreme lies between two neighbours
    around : whether the last place is the first one again, after a whole turn
    """
    samples, step = np.asarray(values_at(q)), float(q[1] - q[0])
    rows = np.arange(len(samples))
    best, place = np.max(samples, axis=1), q[np.argmax(samples, axis=1)]
    high_before = np.pad(samples, ((0, 0), (1, 1)), constant_values=-np.inf)
    local = (samples >= high_before[:, :-2]) & (samples >= high_before[:, 2:])
    ranked = np.argsort(np.where(local, -samples, np.inf), axis=1, kind="stable")
    for k in range(min(_CANDIDATES, len(q))):
        middle, reach = q[ranked[:, k]], step
        for _ in range(_ROUNDS):
            at = middle[:, None] + np.linspace(-reach, reach, _POINTS)
            if not around:
                at = np.clip(at, q[0], q[-1])
            values = _own(values_at, at)
            top = np.argmax(values, axis=1)
            middle, value = at[rows, top], values[rows, top]
            more = value > best
            best, place = np.where(more, value, best), np.where(more, middle, place)
            reach *= 2.0 / (_POINTS - 1)
    return place, best


def roots(values_at: Callable[[Any], Any], q: Any, *, around: bool) -> list[Any]:
    """The places at which each quantity changes its sign, a sorted array for each. The arguments are those of
    `largest`; a quantity that only touches zero has no root there."""
    found: list[Any] = []
    for row, signs in enumerate(np.sign(values_at(q))):
        if around:
            signs[-1] = signs[0]
        for k in np.flatnonzero(signs == 0.0):
            # a zero belongs to the range before it
            signs[k] = signs[k - 1] if k else signs[-2] if around else next((s for s in signs if s), 0.0)
        if around:
            signs[-1] = signs[0]
        changes = np.flatnonzero(np.diff(signs))
        low, high, sign = q[changes], q[changes + 1], signs[changes]
        for _ in range(_HALVINGS if len(changes) else 0):
            middle = 0.5 * (low + high)
            same = np.sign(np.asarray(values_at(middle))[row]) == sign
            low, high = np.where(same, middle, low), np.where(same, high, middle)
        found.append(0.5 * (low + high))
    return found


def _own(values_at: Callable[[Any], Any], at: Any) -> Any:
    """The values of each quantity at its own places `at`, shape (quantities, points)."""
    count, points = at.shape
    values = np.asarray(values_at(at.ravel())).reshape(count, count, points)
    return values[np.arange(count), np.arange(count)]
