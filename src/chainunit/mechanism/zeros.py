"""Zeros of a quantity over the way of a driver, from its values and its exact slopes, so that none is missed: simple
ones, those at which it only touches zero, and ranges in which it is zero."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

_PARTS = 360
"""Parts of the way at first: over a turn they are a degree wide, and each has a place in its middle."""
_ROUGH = 0.1
"""Error of the cubic through the ends of a part, in parts of the least value there, beyond which it is halved."""
_EXACT = 1e-9
"""The same error in parts of the largest value, within which a part is never halved."""
_DEEPEST, _MOST = 16, 4000
"""Rounds of halving, and parts in one round: a quantity that is rough all the way is rounding."""
_HALVINGS = 40
"""Halvings of a part to the place of an extreme, or to the end of a range."""
_STEPS = 60
"""Most steps to a zero: every third one halves the range that holds it, the others are Newton's."""
_NARROW = 5e-3
"""Part of the way up to which a range of zeros counts as one: that of a flat one is as wide by rounding."""

ValuesAndSlopes = Callable[[Any], tuple[Any, Any]]
"""The values of the quantity at places, and its slopes there, each of the shape of the places."""


class SampledCurve(NamedTuple):
    """A quantity at places that lie close where it changes sharply: the places, the values, the slopes, of shape (n,)
    each."""

    x: Any
    values: Any
    slopes: Any

    def with_places(self, quantity: ValuesAndSlopes, x: Any) -> SampledCurve:
        """The curve with further places."""
        every = np.concatenate([self.x, x])
        order = np.argsort(every, kind="stable")
        return SampledCurve(
            every[order],
            *(np.concatenate([a, b])[order] for a, b in zip(self[1:], quantity(x), strict=True)),
        )


class Zero(NamedTuple):
    """A zero from `begin` to `end`, which are one place unless the quantity is zero over a range, and the sign of the
    quantity before it and behind it."""

    begin: float
    end: float
    before: float
    behind: float


def sampled(quantity: ValuesAndSlopes, low: float, high: float) -> SampledCurve:
    """The quantity from `low` to `high`. A part of the way is halved until the cubic through its ends meets the value
    in its middle; so a load that acts over a thousandth of the way has places of its own."""
    x = np.linspace(low, high, _PARTS + 1)
    curve = SampledCurve(x, *quantity(x))
    largest = float(np.max(np.abs(curve.values)))
    ends = np.arange(_PARTS)
    for _ in range(_DEEPEST):
        (x0, f0, g0), (x1, f1, g1) = ([column[ends + k] for column in curve] for k in (0, 1))
        middle = 0.5 * (x0 + x1)
        value, _ = quantity(middle)
        cubic = 0.5 * (f0 + f1) + 0.125 * (x1 - x0) * (g0 - g1)
        least = np.minimum(np.abs(value), np.minimum(np.abs(f0), np.abs(f1)))
        rough = np.abs(value - cubic) > np.maximum(_ROUGH * least, _EXACT * largest)
        curve = curve.with_places(quantity, middle)
        halves = np.concatenate([x0[rough], middle[rough]])
        if not len(halves) or len(halves) > _MOST:
            break
        ends = np.searchsorted(curve.x, halves)
    return curve


def zeros(
    quantity: ValuesAndSlopes, curve: SampledCurve, nothing: float, beyond: tuple[float, float] | None
) -> list[Zero]:
    """The zeros in rising order.

    Between two places at which the slope changes its sign lies an extreme, which becomes a place, too. So between two
    neighbours the quantity rises or falls all the way and has one zero at most, and an extreme at which it touches
    zero is a place.

    Parameters
    ----------
    curve : the quantity, see `sampled`
    nothing : size up to which the quantity is zero
    beyond : signs of the quantity before the first place and behind the last one, as stops give them; where it is
        None, no sign changes at the ends
    """
    turning = np.flatnonzero(curve.slopes[:-1] * curve.slopes[1:] < 0.0)
    if len(turning):
        sign = np.sign(curve.slopes[turning])
        low, high = _halved(lambda x: np.sign(quantity(x)[1]) == sign, curve.x[turning], curve.x[turning + 1])
        curve = curve.with_places(quantity, 0.5 * (low + high))
    signs = np.where(np.abs(curve.values) <= nothing, 0.0, np.sign(curve.values))
    there = np.flatnonzero(signs)
    last = len(signs) - 1
    if not len(there):
        return [Zero(float(curve.x[0]), float(curve.x[-1]), *(beyond or (0.0, 0.0)))]
    # a zero at an open end counts as crossed
    first_side = signs[there[0]] if signs[0] else -signs[there[0]]
    last_side = signs[there[-1]] if signs[-1] else -signs[there[-1]]
    places = [-1, *map(int, there), last + 1]
    sides = [float(side) for side in (first_side, *signs[there], last_side)]
    if beyond:
        sides[0], sides[-1] = beyond
    listed: list[Zero] = []
    crossings: list[tuple[int, Any, Any]] = []
    for k, (i, j) in enumerate(itertools.pairwise(places)):
        before, behind = sides[k : k + 2]
        if j == i + 1 and before == behind:
            continue
        begin, end = _stretch(quantity, curve, nothing, i, j)
        if i >= 0 and j <= last and begin == end and before != behind:
            crossings.append((len(listed), curve.x[i], curve.x[j]))
        listed.append(Zero(begin, end, before, behind))
    if crossings:
        numbers, low, high = (np.array(column) for column in zip(*crossings, strict=True))
        for k, x in zip(numbers, _crossed(quantity, low, high), strict=True):
            listed[k] = listed[k]._replace(begin=float(x), end=float(x))
    return listed


def _stretch(
    quantity: ValuesAndSlopes, curve: SampledCurve, nothing: float, i: int, j: int
) -> tuple[float, float]:
    """Begin and end of the zero between the places `i` and `j`, at which the quantity is not zero; -1 and the number
    of places stand for those beyond the ends. One place unless it is zero over a range; the place of a zero that is
    crossed between two places is not yet exact."""
    x, last = curve.x, len(curve.x) - 1
    first, final = i + 1, j - 1
    if first > final:
        place = float(x[min(max(first, 0), last)])
        return place, place
    if x[final] - x[first] <= _NARROW * (x[-1] - x[0]):
        place = float(x[first + int(np.argmin(np.abs(curve.slopes[first : final + 1])))])
        return place, place
    ends = []
    for inside, out in ((first, i), (final, j)):
        if 0 <= out <= last:
            near, far = _halved(lambda q: np.abs(quantity(q)[0]) <= nothing, x[[inside]], x[[out]])
            ends.append(float(0.5 * (near[0] + far[0])))
        else:
            ends.append(float(x[inside]))
    return ends[0], ends[1]


def _halved(stays: Callable[[Any], Any], low: Any, high: Any) -> tuple[Any, Any]:
    """Ranges in which a condition ends that holds at `low` and not at `high`, of shape (n,) each."""
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        holds = stays(middle)
        low, high = np.where(holds, middle, low), np.where(holds, high, middle)
    return low, high


def _crossed(quantity: ValuesAndSlopes, low: Any, high: Any) -> Any:
    """The places between `low` and `high` at which the quantity changes its sign, shape (n,) each, to rounding."""
    sign = np.sign(quantity(low)[0])
    x = 0.5 * (low + high)
    for k in range(_STEPS):
        value, slope = quantity(x)
        low, high = np.where(np.sign(value) == sign, x, low), np.where(np.sign(value) == sign, high, x)
        with np.errstate(divide="ignore", invalid="ignore"):
            newton = x - value / slope
        middle = 0.5 * (low + high)
        inside = (newton >= low) & (newton <= high) & (k % 3 != 2)
        better = np.where(value == 0.0, x, np.where(inside, newton, middle))
        done = np.abs(better - x) <= 8.0 * np.spacing(np.maximum(np.abs(x), 1e-3))
        x = better
        if np.all(done):
            break
    return x
