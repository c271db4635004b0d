"""Extremes, roots and means of sampled quantities over the way of a driver, between the places at which they are
sampled, too."""

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
ROUNDING = 1e-14
"""Part of the largest size of a quantity below which it counts as zero."""
_PARTS, _NODES = 240, 8
"""Parts of the way at first, and points in each, of a mean: over a turn they are at most 0.3 degrees apart."""
_AGREE = 1e-9
"""Difference of two rules on a part, in parts of the integral of the quantity's size, at which they agree."""
_DEEPEST, _MOST_ROUGH = 24, 2000
"""Rounds of halving, and parts on which a quantity may be rough: one that is rough all the way is rounding."""


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
    if around:
        samples, q = samples[:, :-1], q[:-1]
    rows = np.arange(len(samples))
    best, place = np.max(samples, axis=1), q[np.argmax(samples, axis=1)]
    ends = {"mode": "wrap"} if around else {"mode": "constant", "constant_values": -np.inf}
    beside = np.pad(samples, ((0, 0), (1, 1)), **ends)
    local = (samples >= beside[:, :-2]) & (samples >= beside[:, 2:])
    ranked = np.argsort(np.where(local, -samples, np.inf), axis=1, kind="stable")
    for k in range(min(_CANDIDATES, len(q))):
        middle, reach = q[ranked[:, k]], step
        for _ in range(_ROUNDS):
            places = middle[:, None] + np.linspace(-reach, reach, _POINTS)
            if not around:
                places = np.clip(places, q[0], q[-1])
            values = _own(values_at, places)
            top = np.argmax(values, axis=1)
            middle, value = places[rows, top], values[rows, top]
            more = value > best
            best, place = np.where(more, value, best), np.where(more, middle, place)
            reach *= 2.0 / (_POINTS - 1)
    return place, best


def roots(values_at: Callable[[Any], Any], q: Any, *, around: bool) -> list[Any]:
    """The places at which each quantity changes its sign, a sorted array for each. The arguments are those of
    `largest`; a quantity that only touches zero has no root there."""
    crossings: list[Any] = []
    rows = np.asarray(values_at(q))
    for row, samples in enumerate(rows[:, :-1] if around else rows):
        nothing = ROUNDING * float(np.max(np.abs(samples)))

        def signs_of(values: Any, nothing: float = nothing) -> Any:
            return np.where(np.abs(values) <= nothing, 0.0, np.sign(values))

        signs = signs_of(samples)
        there = np.flatnonzero(signs)
        if not len(there):
            crossings.append(np.empty(0))
            continue
        # a zero belongs to the range before it, of a turn also across its begin
        last = np.searchsorted(there, np.arange(len(signs)), side="right") - 1
        signs = signs[there[last if around else np.maximum(last, 0)]]
        changes = np.flatnonzero(np.diff(signs, append=signs[:1] if around else []))
        low, high, sign = q[changes], q[changes + 1], signs[changes]
        for _ in range(_HALVINGS if len(changes) else 0):
            middle = 0.5 * (low + high)
            same = signs_of(np.asarray(values_at(middle))[row]) != -sign
            low, high = np.where(same, middle, low), np.where(same, high, middle)
        crossings.append(0.5 * (low + high))
    return crossings


def means(values_at: Callable[[Any], Any], low: float, high: float) -> tuple[Any, Any]:
    """The mean of each quantity from the place `low` to `high`, and that of its size, each of shape (quantities,)."""
    _, _, integrals, size = _parts(values_at, low, high, _PARTS)
    return np.sum(integrals, axis=1) / (high - low), size / (high - low)


def mean_rule(values_at: Callable[[Any], Any], low: float, high: float, parts: int) -> tuple[Any, Any]:
    """Places and weights by which the sum of the values is the mean of each quantity from the place `low` to `high`,
    each of shape (places,); the way has so many `parts` at first."""
    begin, end, *_ = _parts(values_at, low, high, parts)
    half = 0.5 * (end - begin)[:, None]
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    return (begin[:, None] + half * (1.0 + nodes)).ravel(), (half * weights).ravel() / (high - low)


def _parts(values_at: Callable[[Any], Any], low: float, high: float, parts: int) -> tuple[Any, Any, Any, Any]:
    """Begins and ends of parts of the way, the integral of each quantity over each of them, shape (quantities,
    parts), and the integral of its size over the way.

    Gauss's rule on parts of the way; a part is halved until both rules agree, so that a load that begins or ends
    sharply counts as it is. One that acts over less than 0.3 degrees of a turn may lie between all points.
    """
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)

    def integrals(begin: Any, end: Any) -> tuple[Any, Any]:
        half = 0.5 * (end - begin)
        places = 0.5 * (begin + end)[:, None] + half[:, None] * nodes
        values = np.asarray(values_at(places.ravel())).reshape(-1, *places.shape)
        return (values @ weights) * half, (np.abs(values) @ weights) * half

    edges = np.linspace(low, high, parts + 1)
    begin, end = edges[:-1], edges[1:]
    whole, sizes = integrals(begin, end)
    size = np.sum(sizes, axis=1)
    done: list[tuple[Any, Any, Any]] = []
    for k in range(_DEEPEST):
        middle = 0.5 * (begin + end)
        halves = [integrals(begin, middle)[0], integrals(middle, end)[0]]
        differs = np.abs(halves[0] + halves[1] - whole) > _AGREE * size[:, None]
        differs &= np.count_nonzero(differs, axis=1, keepdims=True) <= _MOST_ROUGH
        rough = np.any(differs, axis=0) & (k < _DEEPEST - 1)
        done += [(begin[~rough], middle[~rough], halves[0][:, ~rough])]
        done += [(middle[~rough], end[~rough], halves[1][:, ~rough])]
        if not np.any(rough):
            break
        begin, end = (np.concatenate([x[rough], y[rough]]) for x, y in ((begin, middle), (middle, end)))
        whole = np.concatenate([half[:, rough] for half in halves], axis=1)
    begins, ends, values = zip(*done, strict=True)
    return np.concatenate(begins), np.concatenate(ends), np.concatenate(values, axis=1), size


def _own(values_at: Callable[[Any], Any], places: Any) -> Any:
    """The values of each quantity at its own `places`, shape (quantities, points)."""
    count, points = places.shape
    values = np.asarray(values_at(places.ravel())).reshape(count, count, points)
    return values[np.arange(count), np.arange(count)]
