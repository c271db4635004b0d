"""Sine, cosine, arcsine, arccosine, arctangent, exponential and logarithm of our own.

The functions of a C library, of a browser and of numpy differ in their last bits. These are made of the basic
operations alone, which IEEE 754 rounds in one way everywhere: whatever computes them has the same bits. Each is
written once, for any engine of basic operations: `numpy_basic` computes arrays, `Recorder` lists the operations
from which code is printed.

An engine has ``sqrt abs minimum maximum floor copysign`` and

``nearest(x)``
    the nearest whole number, of two the even one
``choose(condition, a, b)``
    `a` where the condition, a comparison, holds, else `b`; both are computed
``exponent(x)``
    the exponent of 2 of a positive normal number, as a whole number
``power2(k)``
    2 to the power of a whole number from -1022 to 1023

The largest errors, in units in the last place of the result, and the arguments for which they hold:

======================  =====  ===================================================================
`sine_and_cosine`       0.82   to 1.3e7 in size; an angle beyond is rounded to 53 bits once more, and
                               from 2**40 on the results are NaN
`arcsine`, `arccosine`  0.67   -1 to 1
`arctangent2`           0.72   0, and from 1e-280 to 1e280 in size
`exponential`           0.95   all; results below 2.3e-308 have fewer digits
`logarithm`             0.83   all from 2.3e-308 on
======================  =====  ===================================================================

The coefficients are those of minimax polynomials (``bench/minimax.py``). A zero may have another sign than in a C
library.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

from .recorder import Recorded, recorded

_SINE = (
    -0.16666666666666632,
    0.008333333333322425,
    -0.00019841269829816956,
    2.7557313695228018e-06,
    -2.5050758653495004e-08,
    1.589682794137601e-10,
)
"""(sin(r)/r - 1)/z of z = r*r."""
_COSINE = (
    0.0416666666666666,
    -0.0013888888888874138,
    2.4801587289491857e-05,
    -2.755731435525017e-07,
    2.0875723685580795e-09,
    -1.1359669927930888e-11,
)
"""(cos(r) - 1 + z/2)/z**2 of z = r*r."""
_ARCSINE = (
    0.16666666666666763,
    0.07499999999970257,
    0.04464285717512393,
    0.030381942683511548,
    0.022372215662386202,
    0.01735160006653413,
    0.013980961640961196,
    0.011397775185547876,
    0.010786530098649534,
    0.0036830489830806537,
    0.02176345923037644,
    -0.021077207359307747,
    0.03267682087004241,
)
"""(asin(s)/s - 1)/z of z = s*s, to s = 1/2."""
_ARCTANGENT = (
    -0.333333333333332,
    0.19999999999954082,
    -0.14285714280248524,
    0.11111110786138116,
    -0.09090897836449295,
    0.07692061637031876,
    -0.0666312038222454,
    0.058480089005062,
    -0.050398454299686264,
    0.038078318737201425,
    -0.017922276790049638,
)
"""(atan(q)/q - 1)/z of z = q*q, to q = tan(pi/8)."""
_EXPONENTIAL = (
    0.5,
    0.1666666666666667,
    0.041666666666663375,
    0.008333333333325746,
    0.0013888888889935617,
    0.00019841269876809433,
    2.480158581966914e-05,
    2.75572527238546e-06,
    2.7558272506801364e-07,
    2.5106309654165017e-08,
    2.066423167300842e-09,
)
"""(exp(r) - 1 - r)/r**2, to r = log(2)/2."""
_LOGARITHM = (
    0.6666666666666734,
    0.3999999999941468,
    0.28571428742387023,
    0.22222198573260976,
    0.18183564321552453,
    0.1531405068080525,
    0.1479594831948716,
)
"""(log((1 + s)/(1 - s))/s - 2)/z of z = s*s, to s = 3 - 2*sqrt(2)."""

_TWO_OVER_PI = 0.6366197723675814
_HALF_PI_PARTS = (1.570796325802803, 9.920935791635221e-10, 5.17018297889025e-19, 2.9038559739793605e-28)
"""pi/2 in parts of 30, 30, 30 and 53 bits: up to 2**23 times each of the first three is exact."""
_HALF_PI = (1.5707963267948966, 6.123233995736766e-17)
"""pi/2 as a sum."""
_QUARTER_PI = (0.7853981633974483, 3.061616997868383e-17)
"""pi/4 as a sum; four times the first part, and three times, is exact."""
_TAN_22 = 0.41421356237309503
"""Tangent of pi/8."""
_LOG_2 = (0.6931471805598903, 5.497923018708371e-14)
"""log(2) as a sum; up to 2**11 times the first part is exact."""
_PER_LOG_2 = 1.4426950408889634
_ROOT_2 = 1.4142135623730951
_WHOLE = 2.0**40
"""Size of an angle from which on the results are NaN."""
_NORMAL = 2.0**-1022
"""The smallest number with all digits."""


def sine_and_cosine(xp: Any, x: Any) -> tuple[Any, Any]:
    """Sine and cosine of an angle [rad]."""
    n = xp.nearest(x * _TWO_OVER_PI)
    first, second, third, last = _HALF_PI_PARTS
    a, lost = _sum(x - n * first, -(n * second))
    b, more = _sum(a, -(n * third))
    r, tail = _short_sum(b, (lost + more) - n * last)
    z = r * r
    sine = r + (r * z * _polynomial(_SINE, z) + tail * (1.0 - 0.5 * z))
    half = 0.5 * z
    most = 1.0 - half
    cosine = most + (((1.0 - most) - half) + (z * z * _polynomial(_COSINE, z) - r * tail))
    quarter = n - 4.0 * xp.floor(0.25 * n)
    odd = 2.0 * xp.floor(0.5 * quarter) < quarter
    known = xp.abs(x) < _WHOLE

    def signed(negative: Any, size: Any) -> Any:
        return xp.choose(known, xp.choose(negative, -size, size), math.nan)

    return (
        signed(quarter > 1.5, xp.choose(odd, cosine, sine)),
        signed(xp.abs(quarter - 1.5) < 1.0, xp.choose(odd, sine, cosine)),
    )


def arcsine(xp: Any, x: Any) -> Any:
    """Arcsine [rad]; NaN for a number beyond -1 to 1."""
    far, size, s, lost = _near_zero(xp, x)
    high, low = _HALF_PI
    h, tail = _short_sum(high, -2.0 * s)
    return xp.copysign(xp.choose(far, h + (tail + (low - 2.0 * lost)), size + lost), x)


def arccosine(xp: Any, x: Any) -> Any:
    """Arccosine [rad]; NaN for a number beyond -1 to 1."""
    far, _, s, lost = _near_zero(xp, x)
    high, low = _HALF_PI
    near = xp.copysign(1.0, x)
    middle, tail = _short_sum(high, -near * s)
    behind, rest = _short_sum(2.0 * high, -2.0 * s)
    inside = middle + (tail + (low - near * lost))
    return xp.choose(
        far, xp.choose(x < 0.0, behind + (rest + (2.0 * low - 2.0 * lost)), 2.0 * (s + lost)), inside
    )


def _near_zero(xp: Any, x: Any) -> tuple[Any, Any, Any, Any]:
    """Whether `x` is beyond 1/2 in size; its size; the number s to 1/2 whose arcsine is looked for, which is then
    sqrt((1 - size)/2) and else the size; and what the arcsine has beyond s."""
    size = xp.abs(x)
    far = size > 0.5
    z = xp.choose(far, 0.5 * (1.0 - size), size * size)
    s = xp.choose(far, xp.sqrt(z), size)
    square, rest = _product(s, s)
    rounded = xp.choose(far, ((z - square) - rest) / xp.maximum(2.0 * s, 1e-300), 0.0)
    return far, size, s, rounded + s * z * _polynomial(_ARCSINE, z)


def arctangent2(xp: Any, y: Any, x: Any) -> Any:
    """The angle of a vector (x, y) [rad], from -pi to pi; 0 or pi for one without length."""
    across, along = xp.abs(y), xp.abs(x)
    small, large = xp.minimum(across, along), xp.maximum(across, along)
    # the angle from the nearer axis is that of small/large, or pi/4 and that of (small - large)/(small + large)
    far = _TAN_22 * large < small
    total, beyond = _short_sum(large, small)
    gap, rest = _short_sum(large, -small)
    over, over_rest = xp.choose(far, -gap, small), xp.choose(far, -rest, 0.0)
    under, under_rest = xp.choose(far, total, large), xp.choose(far, beyond, 0.0)
    under = xp.choose(under < 1e-300, 1.0, under)
    q = over / under
    whole, part = _product(q, under)
    lost = (((over - whole) - part) + (over_rest - q * under_rest)) / under
    z = q * q
    lost = lost - lost * z + q * z * _polynomial(_ARCTANGENT, z)
    # so many quarters of pi, and this angle, forward or backward
    steep, back = along < across, xp.copysign(1.0, x) < 0.0
    quarters, way = xp.choose(far, 1.0, 0.0), xp.choose(steep, -1.0, 1.0)
    quarters = xp.choose(steep, 2.0 - quarters, quarters)
    quarters, way = xp.choose(back, 4.0 - quarters, quarters), xp.choose(back, -way, way)
    high, low = _QUARTER_PI
    h, tail = _sum(quarters * high, way * q)
    return xp.copysign(h + (tail + (quarters * low + way * lost)), y)


def exponential(xp: Any, x: Any) -> Any:
    """The exponential; inf beyond the largest number."""
    x = xp.minimum(xp.maximum(x, -760.0), 720.0)
    k = xp.nearest(x * _PER_LOG_2)
    high, low = _LOG_2
    r, tail = _short_sum(x - k * high, -(k * low))
    size = 1.0 + (r + (tail + r * r * _polynomial(_EXPONENTIAL, r)))
    half = xp.nearest(0.5 * k)
    return size * xp.power2(half) * xp.power2(k - half)


def logarithm(xp: Any, x: Any) -> Any:
    """The natural logarithm; -inf of 0, and NaN of a negative number."""
    k = xp.exponent(x)
    part = xp.nearest(-0.5 * k)
    size = x * xp.power2(part) * xp.power2(-k - part)
    upper = size > _ROOT_2
    k, size = xp.choose(upper, k + 1.0, k), xp.choose(upper, 0.5 * size, size)
    f = size - 1.0
    s = f / (2.0 + f)
    z, half = s * s, 0.5 * f * f
    high, low = _LOG_2
    # log(1 + f) = 2 s + s z P, where 2 s = f - s f and s f = f*f/2 - s f*f/2
    value = k * high - ((half - (s * (half + z * _polynomial(_LOGARITHM, z)) + k * low)) - f)
    value = xp.choose(x < math.inf, value, x)
    return xp.choose(x > 0.0, value, xp.choose(x < 0.0, math.nan, xp.choose(x < _NORMAL, -math.inf, x)))


def _sum(a: Any, b: Any) -> tuple[Any, Any]:
    """The rounded sum and what the rounding lost."""
    s = a + b
    other = s - a
    return s, (a - (s - other)) + (b - other)


def _short_sum(a: Any, b: Any) -> tuple[Any, Any]:
    """The same where `a` is not smaller than `b` in size."""
    s = a + b
    return s, b - (s - a)


def _product(a: Any, b: Any) -> tuple[Any, Any]:
    """The rounded product and what the rounding lost (Dekker), by factors of 26 bits."""
    p = a * b
    a1, b1 = _upper(a), _upper(b)
    a2, b2 = a - a1, b - b1
    return p, ((a1 * b1 - p) + a1 * b2 + a2 * b1) + a2 * b2


def _upper(a: Any) -> Any:
    """The upper half of the digits of a number (Veltkamp)."""
    t = 134217729.0 * a
    return t - (t - a)


def _polynomial(coefficients: Sequence[float], z: Any) -> Any:
    """The polynomial with these coefficients, lowest power first: even and odd powers apart, which a processor
    computes at the same time."""
    square = z * z

    def horner(some: Sequence[float]) -> Any:
        value: Any = some[-1]
        for each in reversed(some[:-1]):
            value = value * square + each
        return value

    return horner(coefficients[::2]) + z * horner(coefficients[1::2])


OWN = {
    "SIN": (sine_and_cosine, 1, 0),
    "COS": (sine_and_cosine, 1, 1),
    "ASIN": (arcsine, 1, 0),
    "ACOS": (arccosine, 1, 0),
    "ATAN2": (arctangent2, 2, 0),
    "EXP": (exponential, 1, 0),
    "LOG": (logarithm, 1, 0),
}
"""By kind of the operation that it computes: function, number of its arguments, place of the result."""


def recording(kind: str) -> Recorded:
    """The basic operations of the function that computes operations of this `kind`."""
    function, arguments, _ = OWN[kind]
    return recorded(function, arguments)


def numpy_basic() -> SimpleNamespace:
    """The engine of basic operations on arrays."""
    import numpy as np

    def bits(x: Any) -> Any:
        return np.asarray(x, float).view(np.int64)

    return SimpleNamespace(
        sqrt=np.sqrt,
        abs=np.abs,
        minimum=np.minimum,
        maximum=np.maximum,
        floor=np.floor,
        copysign=np.copysign,
        nearest=np.rint,
        choose=np.where,
        exponent=lambda x: ((bits(x) >> 52 & 0x7FF) - 1023).astype(float),
        power2=lambda k: (np.asarray(k + 1023.0).astype(np.int64) << 52).view(float),
    )
