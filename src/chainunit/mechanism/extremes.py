"""The largest and the least value of a quantity over the way of the driver, such as the place of a ram.

The search of `extreme` has the same operations for all values, so that symbols do, too: an FMU computes the extremes
of its own lengths before a run. For arrays: `sampled_quantities`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

Coordinate = Callable[[Any], tuple[Any, Any, Any]]
"""A quantity and its first and second derivative by the coordinate, at a coordinate."""

ROUNDS = 4
"""Newton steps from the best place: the error of the place squares in each, from half of a step at first."""
_NO_CURVATURE = 1e-100


def extreme(
    xp: Any, function: Coordinate, places: Sequence[float], sense: float, ends: bool = False
) -> tuple[Any, Any]:
    """Where a smooth quantity is largest (`sense` +1) or least (-1), at the places or between them, and its value
    there.

    Each place gives the vertex of its parabola; from the best of these, Newton's method finds where the first
    derivative vanishes.

    Parameters
    ----------
    xp : engine (see `chainunit.core.engines`), but no dual one
    places : evenly spaced, close enough that at most one extreme lies near each
    ends : whether the coordinate ends at the first and the last place; else the places are a whole turn
    """
    reach = places[1] - places[0]
    low, high = (places[0], places[-1]) if ends else (places[0] - reach, places[-1] + reach)

    def vertex(q: Any, around: Any, reach: float) -> tuple[Any, Any]:
        """The place of the vertex of the parabola at `q`, within `reach` of `around`, and its value there."""
        value, first, second = function(q)
        bend = xp.maximum(-sense * second, _NO_CURVATURE)
        near = xp.minimum(xp.maximum(q + sense * first / bend, around - reach), around + reach)
        near = xp.minimum(xp.maximum(near, low), high)
        way = near - q
        return near, sense * (value + way * (first + 0.5 * way * second))

    place, best, around = None, None, 0.0
    for q in places:
        # farther away the parabola of the next place is better
        near, value = vertex(q, q, 0.5 * reach)
        if best is None:
            place, best, around = near, value, q
            continue
        # a product, as symbols have no branch
        more = value > best
        place, around = place + more * (near - place), around + more * (q - around)
        best = xp.maximum(best, value)
    for _ in range(ROUNDS - 1):
        place, _ = vertex(place, around, reach)
    return place, function(place)[0]


class MotionExtreme(NamedTuple):
    """An extreme of a quantity of a linkage: the quantity as a `function` of engine and mechanism, and the arguments
    of `extreme`."""

    function: Callable[[Any, Any], tuple[Any, Any, Any]]
    places: Sequence[float]
    sense: float
    ends: bool

    def value(self, xp: Any, placed: Callable[[Any], Any]) -> Any:
        """Its value; `placed` gives the mechanism at a coordinate."""
        return extreme(xp, lambda q: self.function(xp, placed(q)), self.places, self.sense, self.ends)[1]
