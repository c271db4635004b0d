"""Jets: a value with its first three derivatives in one direction, on top of any other engine.

A law of motion needs them: speed, acceleration, and the slope of the acceleration follow from one expression. The
parts of a jet are numbers of the engine below, which may be dual.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

from .engines import value

ORDER = 3
"""The highest derivative."""


class Jet:
    """A value and its derivatives: `parts` has them by order."""

    __slots__ = ("parts",)
    # numpy must hand `array * Jet` to Jet instead of looping over its elements
    __array_ufunc__ = None

    def __init__(self, *parts: Any) -> None:
        self.parts = parts

    def __add__(self, other: Any) -> Jet:
        if isinstance(other, Jet):
            return Jet(*(a + b for a, b in zip(self.parts, other.parts, strict=True)))
        first, *rest = self.parts
        return Jet(first + other, *rest)

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
        (a, a1, a2, a3), (b, b1, b2, b3) = self.parts, other.parts
        return Jet(
            a * b,
            a1 * b + a * b1,
            a2 * b + 2.0 * (a1 * b1) + a * b2,
            a3 * b + 3.0 * (a2 * b1 + a1 * b2) + a * b3,
        )

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Jet:
        return self * (reciprocal(other) if isinstance(other, Jet) else 1.0 / other)

    def __rtruediv__(self, other: Any) -> Jet:
        return reciprocal(self) * other

    def through(self, f: Any, f1: Any, f2: Any, f3: Any) -> Jet:
        """A function of the jet, from its value and its derivatives at the value of the jet."""
        _, x1, x2, x3 = self.parts
        return Jet(
            f, f1 * x1, f1 * x2 + f2 * (x1 * x1), f1 * x3 + 3.0 * (f2 * (x1 * x2)) + f3 * (x1 * x1 * x1)
        )


def variable(x: Any) -> Jet:
    """The variable in whose direction jets have their derivatives, at the value `x`."""
    return Jet(x, 1.0, 0.0, 0.0)


def reciprocal(x: Jet) -> Jet:
    """1 by a jet."""
    r = 1.0 / x.parts[0]
    r2 = r * r
    return x.through(r, -r2, 2.0 * (r * r2), -6.0 * (r2 * r2))


def jet(xp: Any) -> SimpleNamespace:
    """The engine on jets over `xp`; plain numbers pass through it unchanged. At a kink (`abs`, `minimum`, `maximum`)
    the derivatives are those of either side."""

    def lift(f: Callable[[Any], Any], derivatives: Callable[[Any, Any], tuple[Any, Any, Any]]) -> Any:
        """A function of one argument; `derivatives` gives the first three from argument and value."""

        def g(x: Any) -> Any:
            if not isinstance(x, Jet):
                return f(x)
            y = f(x.parts[0])
            return x.through(y, *derivatives(x.parts[0], y))

        return g

    def of_root(x: Any, y: Any) -> tuple[Any, Any, Any]:
        r = 1.0 / y
        r3 = r * r * r
        return 0.5 * r, -0.25 * r3, 0.375 * (r3 * (r * r))

    def of_log(x: Any, y: Any) -> tuple[Any, Any, Any]:
        r = 1.0 / x
        return r, -(r * r), 2.0 * (r * r * r)

    def of_arcsine(x: Any, y: Any) -> tuple[Any, Any, Any]:
        r = 1.0 / xp.sqrt(1.0 - x * x)
        r3 = r * r * r
        return r, x * r3, r3 + 3.0 * (x * x) * (r3 * (r * r))

    def of_tangent(x: Any, y: Any) -> tuple[Any, Any, Any]:
        r = 1.0 / (1.0 + x * x)
        return r, -2.0 * (x * (r * r)), (6.0 * (x * x) - 2.0) * (r * r * r)

    def of_sine(x: Any, y: Any) -> tuple[Any, Any, Any]:
        c = xp.cos(x)
        return c, -y, -c

    def of_cosine(x: Any, y: Any) -> tuple[Any, Any, Any]:
        s = xp.sin(x)
        return -s, -y, s

    def atan2(y: Any, x: Any) -> Any:
        if not (isinstance(y, Jet) or isinstance(x, Jet)):
            return xp.atan2(y, x)
        y, x = (k if isinstance(k, Jet) else Jet(k, 0.0, 0.0, 0.0) for k in (y, x))
        # turned back by the angle itself, so that the quotient is 0 here
        c, s = x.parts[0], y.parts[0]
        ratio = (y * c - x * s) / (x * c + y * s)
        return ratio.through(xp.atan2(s, c), *of_tangent(ratio.parts[0], 0.0))

    def maximum(a: Any, b: Any) -> Any:
        if not (isinstance(a, Jet) or isinstance(b, Jet)):
            return xp.maximum(a, b)
        a, b = (k if isinstance(k, Jet) else Jet(k, 0.0, 0.0, 0.0) for k in (a, b))
        takes_a = value(a.parts[0]) >= value(b.parts[0])
        parts = (y + takes_a * (x - y) for x, y in zip(a.parts[1:], b.parts[1:], strict=True))
        return Jet(xp.maximum(a.parts[0], b.parts[0]), *parts)

    def arccosine(x: Any) -> Any:
        return -arcsine(x) + 0.5 * math.pi if isinstance(x, Jet) else xp.acos(x)

    arcsine = lift(xp.asin, of_arcsine)
    return SimpleNamespace(
        sin=lift(xp.sin, of_sine),
        cos=lift(xp.cos, of_cosine),
        sqrt=lift(xp.sqrt, of_root),
        asin=arcsine,
        acos=arccosine,
        exp=lift(xp.exp, lambda x, y: (y, y, y)),
        log=lift(xp.log, of_log),
        atan2=atan2,
        abs=lambda x: maximum(x, -x),
        minimum=lambda a, b: -maximum(-a, -b),
        maximum=maximum,
    )
