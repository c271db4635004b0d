"""Jets: a value with its first derivatives in one direction, on top of any other engine.

A law of motion needs them: speed, acceleration, and the slope of the acceleration follow from one expression. Each
function has the rule of its first derivative alone, which takes a jet with one derivative less. The parts of a jet
are numbers of the engine below, which may be dual.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

from .engines import value


class Jet:
    """A value and its derivatives: `parts` has them by order."""

    __slots__ = ("parts",)
    # numpy must hand `array * Jet` to Jet instead of looping over its elements
    __array_ufunc__ = None

    def __init__(self, *parts: Any) -> None:
        self.parts = parts

    @property
    def lower(self) -> Jet:
        """The jet without its highest derivative."""
        return Jet(*self.parts[:-1])

    def followed(self, f: Any, slope: Callable[[Jet, Jet], Jet]) -> Jet:
        """A function of this jet with the value `f`; `slope` gives its derivative from the lower jet and its
        derivative."""
        return Jet(f, *slope(self.lower, Jet(*self.parts[1:])).parts) if len(self.parts) > 1 else Jet(f)

    def __add__(self, other: Any) -> Jet:
        if isinstance(other, Jet):
            return Jet(*(a + b for a, b in zip(self.parts, other.parts, strict=True)))
        return Jet(self.parts[0] + other, *self.parts[1:])

    __radd__ = __add__

    def __neg__(self) -> Jet:
        return Jet(*(-a for a in self.parts))

    def __sub__(self, other: Any) -> Jet:
        return self + -other

    def __rsub__(self, other: Any) -> Jet:
        return -self + other

    def __mul__(self, other: Any) -> Jet:
        if not isinstance(other, Jet):
            return Jet(*(a * other for a in self.parts))
        product = self.parts[0] * other.parts[0]
        return self.followed(product, lambda x, x1: x1 * other.lower + x * Jet(*other.parts[1:]))

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Jet:
        return self * (1.0 / other)

    def __rtruediv__(self, other: Any) -> Jet:
        def slope(x: Jet, x1: Jet) -> Jet:
            per = 1.0 / x
            return -(per * per * x1)

        return self.followed(1.0 / self.parts[0], slope) * other


def variable(x: Any) -> Jet:
    """The variable in whose direction jets have their three derivatives, at the value `x`."""
    return Jet(x, 1.0, 0.0, 0.0)


def jet(xp: Any) -> SimpleNamespace:
    """The engine on jets over `xp`; plain numbers pass through it unchanged. At a kink (`abs`, `minimum`, `maximum`)
    the derivatives of either side count."""

    def lift(f: Callable[[Any], Any], slope: Callable[[Any], Any]) -> Any:
        """A function of one argument, with the function that is its derivative."""

        def g(x: Any) -> Any:
            return x.followed(f(x.parts[0]), lambda x, x1: slope(x) * x1) if isinstance(x, Jet) else f(x)

        return g

    def both(a: Any, b: Any) -> tuple[Jet, Jet] | None:
        """Two arguments as jets, if one of them is one."""
        size = max(len(x.parts) if isinstance(x, Jet) else 0 for x in (a, b))
        first, second = (x if isinstance(x, Jet) else Jet(x, *[0.0] * (size - 1)) for x in (a, b))
        return (first, second) if size else None

    def atan2(y: Any, x: Any) -> Any:
        """The angle of (x, y), with the slope (x y' - y x') / (x^2 + y^2)."""
        if (pair := both(y, x)) is None:
            return xp.atan2(y, x)
        one, other = pair
        return one.followed(
            xp.atan2(one.parts[0], other.parts[0]),
            lambda y, y1: (
                (other.lower * y1 - y * Jet(*other.parts[1:])) / (other.lower * other.lower + y * y)
            ),
        )

    def maximum(a: Any, b: Any) -> Any:
        """The larger of two, with the derivatives that this one has."""
        if (pair := both(a, b)) is None:
            return xp.maximum(a, b)
        (x, *slopes), (y, *others) = (one.parts for one in pair)
        takes_first = value(x) >= value(y)
        parts = (b1 + takes_first * (a1 - b1) for a1, b1 in zip(slopes, others, strict=True))
        return Jet(xp.maximum(x, y), *parts)

    engine = SimpleNamespace(atan2=atan2, maximum=maximum)
    engine.sin = lift(xp.sin, lambda x: engine.cos(x))
    engine.cos = lift(xp.cos, lambda x: -engine.sin(x))
    engine.sqrt = lift(xp.sqrt, lambda x: 0.5 / engine.sqrt(x))
    engine.asin = lift(xp.asin, lambda x: 1.0 / engine.sqrt(1.0 - x * x))
    engine.acos = lambda x: 0.5 * math.pi - engine.asin(x)
    engine.exp = lift(xp.exp, lambda x: engine.exp(x))
    engine.log = lift(xp.log, lambda x: 1.0 / x)
    engine.abs = lambda x: maximum(x, -x)
    engine.minimum = lambda a, b: -maximum(-a, -b)
    return engine
