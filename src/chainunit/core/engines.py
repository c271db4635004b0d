"""The namespaces ``xp`` that every kernel computes in.

A kernel uses operators and exactly the names of `NAMES`; each engine here offers just these, so that a
name that one engine lacks cannot slip into a kernel.

========  ==============================================================================
`MATH`    floats at one point, five times as fast as numpy; raises an error in place of a NaN, and
          `minimum` and `maximum` may ignore a NaN
`numpy_`  arrays of any broadcastable shape
`casadi_` symbols, from which C code, exact derivatives and sparsity come
`dual`    first-order dual numbers on top of any of the others: exact slopes
========  ==============================================================================
"""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

NAMES = ("sin", "cos", "sqrt", "atan2", "asin", "acos", "exp", "log", "abs", "minimum", "maximum")

MATH = SimpleNamespace(
    sin=math.sin,
    cos=math.cos,
    sqrt=math.sqrt,
    atan2=math.atan2,
    asin=math.asin,
    acos=math.acos,
    exp=math.exp,
    log=math.log,
    abs=abs,
    minimum=min,
    maximum=max,
)


def numpy_() -> SimpleNamespace:
    """The engine on numpy arrays (numpy >= 2, which has the names of the array API)."""
    import numpy

    return SimpleNamespace(**{name: getattr(numpy, name) for name in NAMES})


def casadi_() -> SimpleNamespace:
    """The engine on CasADi symbols (SX)."""
    import casadi

    casadi_names = {"abs": "fabs", "minimum": "fmin", "maximum": "fmax"}
    return SimpleNamespace(**{name: getattr(casadi, casadi_names.get(name, name)) for name in NAMES})


class Dual:
    """``v + d*epsilon``: a value with its derivative in one direction.

    `v` and `d` are the numbers of the engine below (floats, arrays, symbols). Values are computed in the same
    order as without duals, so that equal symbols stay equal.
    """

    __slots__ = ("d", "v")
    # numpy must hand `array * Dual` to Dual instead of looping over its elements
    __array_ufunc__ = None

    def __init__(self, v: Any, d: Any) -> None:
        self.v = v
        self.d = d

    def __add__(self, other: Any) -> Dual:
        if isinstance(other, Dual):
            return Dual(self.v + other.v, self.d + other.d)
        return Dual(self.v + other, self.d)

    def __radd__(self, other: Any) -> Dual:
        return Dual(other + self.v, self.d)

    def __sub__(self, other: Any) -> Dual:
        if isinstance(other, Dual):
            return Dual(self.v - other.v, self.d - other.d)
        return Dual(self.v - other, self.d)

    def __rsub__(self, other: Any) -> Dual:
        return Dual(other - self.v, -self.d)

    def __mul__(self, other: Any) -> Dual:
        if other is self:
            return Dual(self.v * self.v, 2.0 * (self.v * self.d))
        if isinstance(other, Dual):
            return Dual(self.v * other.v, self.v * other.d + self.d * other.v)
        return Dual(self.v * other, self.d * other)

    def __rmul__(self, other: Any) -> Dual:
        return Dual(other * self.v, other * self.d)

    def __truediv__(self, other: Any) -> Dual:
        if isinstance(other, Dual):
            v, minus_per = self.v / other.v, -1.0 / other.v
            return Dual(v, (v * other.d - self.d) * minus_per)
        return Dual(self.v / other, self.d / other)

    def __rtruediv__(self, other: Any) -> Dual:
        v, minus_per = other / self.v, -1.0 / self.v
        return Dual(v, v * self.d * minus_per)

    def __neg__(self) -> Dual:
        return Dual(-self.v, -self.d)


def value(x: Any) -> Any:
    """The value of `x`, dual or not."""
    return x.v if isinstance(x, Dual) else x


def slope(x: Any) -> Any:
    """The derivative that `x` carries; 0 for a number that does not depend on the seed."""
    return x.d if isinstance(x, Dual) else 0.0


class _DualEngine(SimpleNamespace):
    """An engine on dual numbers."""


def dual(xp: Any) -> SimpleNamespace:
    """The engine on dual numbers over `xp`; plain numbers pass through it unchanged.

    At a kink (`abs`, `minimum`, `maximum`) the derivative is the one of either side.

    Raises
    ------
    TypeError
        if `xp` is dual itself: the derivatives of both would be mixed up.
    """
    if isinstance(xp, _DualEngine):
        raise TypeError(
            "dual numbers over dual numbers: take an engine that is not dual; there is one slope only"
        )

    def lift(f: Any, df: Any) -> Any:
        """A function of one argument for dual numbers; `df` gives its slope from the argument and the value."""

        def g(x: Any) -> Any:
            if isinstance(x, Dual):
                y = f(x.v)
                return Dual(y, df(x.v, y) * x.d)
            return f(x)

        return g

    def atan2(y: Any, x: Any) -> Any:
        if not (isinstance(y, Dual) or isinstance(x, Dual)):
            return xp.atan2(y, x)
        yv, xv = value(y), value(x)
        return Dual(xp.atan2(yv, xv), (xv * slope(y) - yv * slope(x)) / (xv * xv + yv * yv))

    def minimum(a: Any, b: Any) -> Any:
        if not (isinstance(a, Dual) or isinstance(b, Dual)):
            return xp.minimum(a, b)
        return -maximum(-a, -b)

    def maximum(a: Any, b: Any) -> Any:
        if not (isinstance(a, Dual) or isinstance(b, Dual)):
            return xp.maximum(a, b)
        takes_a = value(a) >= value(b)
        return Dual(xp.maximum(value(a), value(b)), slope(b) + takes_a * (slope(a) - slope(b)))

    return _DualEngine(
        sin=lift(xp.sin, lambda v, y: xp.cos(v)),
        cos=lift(xp.cos, lambda v, y: -xp.sin(v)),
        sqrt=lift(xp.sqrt, lambda v, y: 0.5 / y),
        asin=lift(xp.asin, lambda v, y: 1.0 / xp.sqrt(1.0 - v * v)),
        acos=lift(xp.acos, lambda v, y: -1.0 / xp.sqrt(1.0 - v * v)),
        exp=lift(xp.exp, lambda v, y: y),
        log=lift(xp.log, lambda v, y: 1.0 / v),
        atan2=atan2,
        abs=lambda x: maximum(x, -x),
        minimum=minimum,
        maximum=maximum,
    )
