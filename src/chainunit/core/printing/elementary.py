"""Sine, cosine, arcsine, arccosine, arctangent, exponential and logarithm of our own.

The functions of a C library, of a browser and of numpy differ in their last bits. These are made of the basic
operations alone, which IEEE 754 rounds in one way everywhere: whatever computes them has the same bits. Each is
written once, for any engine of basic operations, such as a `Recorder`, which lists the operations from which code is
printed.

An engine has ``sqrt abs copysign`` and

``choose(condition, a, b)``
    `a` if the condition, a comparison, holds, else `b`; both are computed
``exponent(x)``
    the nearest exponent of 2 of a positive normal number, as a whole number
``mantissa(x)``
    what that power is multiplied by, from the root of 1/2 to the root of 2
``power2(k)``
    2 to the power of a whole number from -1022 to 1023

The largest errors, in units in the last place of the result, and the arguments for which they hold:

======================  =====  ===================================================================
`sine_and_cosine`       0.82   to 1.3e7 in size; an angle beyond is rounded to 53 bits once more, and
                               from 2**40 on the results are NaN
`arcsine`, `arccosine`  0.68   -1 to 1
`arctangent2`           0.73   0, and from 1e-280 to 1e280 in size
`exponential`           0.95   all; results below 2.3e-308 have fewer digits
`logarithm`             0.83   all from 2.3e-308 on
======================  =====  ===================================================================

The coefficients are those of minimax polynomials (``bench/minimax.py``). A zero may have another sign than in a C
library.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
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
_HALF_PI_PARTS = (1.5707963276654482, -8.705516307827565e-10, 6.12323399409214e-17, 1.6446256936324258e-26)
"""pi/2 in parts that end at the bits 2**-29, 2**-52 and 2**-82, and a rest: up to 2**23 times each of the first three
is exact, and so is what the first two leave of an angle."""
_WHOLE_NUMBERS, _FOURS = 1.5 * 2.0**52, 1.5 * 2.0**54
"""Numbers of this size are whole, or multiples of 4: a sum is rounded to one of them, of two to the even one."""
_HALF_PI = (1.5707963267948966, 6.123233995736766e-17)
"""pi/2 as a sum."""
_QUARTER_PI = (0.7853981633974483, 3.061616997868383e-17)
"""pi/4 as a sum; four times the first part, and three times, is exact."""
_TAN_22 = 0.41421356237309503
"""Tangent of pi/8."""
_LOG_2 = (0.6931471805598903, 5.497923018708371e-14)
"""log(2) as a sum; up to 2**11 times the first part is exact."""
_PER_LOG_2 = 1.4426950408889634
_WHOLE = 2.0**40
"""Size of an angle from which on the results are NaN."""
_TINY = 1e-300
"""Changes no divisor but 0."""
_NORMAL = 2.0**-1022
"""The smallest number with all digits."""


def sine_and_cosine(xp: Any, x: Any) -> tuple[Any, Any]:
    """Sine and cosine of an angle [rad]."""
    n = _nearest(x * _TWO_OVER_PI)
    first, second, third, last = _HALF_PI_PARTS
    r, lost = _sum((x - n * first) - n * second, -(n * third))
    tail = xp.choose(xp.abs(x) < _WHOLE, lost - n * last, math.nan)
    z = r * r
    half = 0.5 * z
    most = 1.0 - half
    sine = r + (r * z * _polynomial(_SINE, z) + tail * most)
    cosine = most + (((1.0 - most) - half) + (z * z * _polynomial(_COSINE, z) - r * tail))
    # sine and cosine of the quarters of a turn, of which there are -2 to 2 beside whole turns
    quarters = n - ((n + _FOURS) - _FOURS)
    count = xp.abs(quarters)
    along, across = 1.0 - count, quarters * (2.0 - count)
    return sine * along + cosine * across, cosine * along + sine * -across


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
    beyond, rest = _short_sum(2.0 * high, -2.0 * s)
    inside = middle + (tail + (low - near * lost))
    return xp.choose(
        far, xp.choose(x < 0.0, beyond + (rest + (2.0 * low - 2.0 * lost)), 2.0 * (s + lost)), inside
    )


def _near_zero(xp: Any, x: Any) -> tuple[Any, Any, Any, Any]:
    """The reduction of an arcsine to a number s from 0 to 1/2, for which the polynomial is exact.

    With size = |x| it is s = size up to 1/2, and beyond s = sqrt((1 - size)/2), as arcsin(size) = pi/2 - 2 arcsin(s).

    Returns
    -------
    whether the size is beyond 1/2, the size, s, and arcsin(s) - s
    """
    size = xp.abs(x)
    far = size > 0.5
    z = xp.choose(far, 0.5 * (1.0 - size), size * size)
    s = xp.choose(far, xp.sqrt(z), size)
    # what the rounding of the root lost: (z - s*s)/(2 s)
    rounded = xp.choose(far, _rest(z, s, s) / (2.0 * s + _TINY), 0.0)
    return far, size, s, rounded + s * z * _polynomial(_ARCSINE, z)


def arctangent2(xp: Any, y: Any, x: Any) -> Any:
    """The angle of a vector (x, y) [rad], from -pi to pi; 0 or pi for one without length."""
    across, along = xp.abs(y), xp.abs(x)
    steep = along < across
    small, large = xp.choose(steep, along, across), xp.choose(steep, across, along)
    # the angle from the nearer axis is that of small/large, or pi/4 and that of (small - large)/(small + large)
    far = _TAN_22 * large < small
    total, beyond = _short_sum(large, small)
    gap, rest = _short_sum(large, -small)
    over, over_rest = xp.choose(far, -gap, small), xp.choose(far, -rest, 0.0)
    under, under_rest = xp.choose(far, total, large), xp.choose(far, beyond, 0.0)
    under = under + _TINY
    # so many quarters of pi, and this angle, forward or backward
    back = xp.copysign(1.0, x) < 0.0
    quarters, way = xp.choose(far, 1.0, 0.0), xp.choose(steep, -1.0, 1.0)
    quarters = xp.choose(steep, 2.0 - quarters, quarters)
    quarters, way = xp.choose(back, 4.0 - quarters, quarters), xp.choose(back, -way, way)
    inverse = way / under
    q = over * inverse
    z = q * q
    lost = (_rest(over, q, way * under) + (over_rest - q * (way * under_rest))) * inverse
    high, low = _QUARTER_PI
    h, tail = _short_sum(quarters * high, q)
    rest = (tail + quarters * low) + q * z * _polynomial(_ARCTANGENT, z)
    return xp.copysign(h + (rest + lost * (1.0 - z)), y)


def exponential(xp: Any, x: Any) -> Any:
    """The exponential; inf beyond the largest number."""
    x = xp.choose(x < -760.0, -760.0, xp.choose(x > 720.0, 720.0, x))
    k = _nearest(x * _PER_LOG_2)
    high, low = _LOG_2
    r, tail = _short_sum(x - k * high, -(k * low))
    size = 1.0 + (r + (tail + r * r * _polynomial(_EXPONENTIAL, r)))
    half = _nearest(0.5 * k)
    return size * xp.power2(half) * xp.power2(k - half)


def logarithm(xp: Any, x: Any) -> Any:
    """The natural logarithm; -inf of 0, and NaN of a negative number."""
    k, f = xp.exponent(x), xp.mantissa(x) - 1.0
    beyond = xp.choose(x < 0.0, math.nan, xp.choose(x < _NORMAL, -math.inf, x))
    k = xp.choose(x > 0.0, xp.choose(x < math.inf, k, x), beyond)
    s = f / (2.0 + f)
    z, half = s * s, 0.5 * f * f
    high, low = _LOG_2
    # log(1 + f) = 2 s + s z P, where 2 s = f - s f and s f = f*f/2 - s f*f/2
    most, lost = _short_sum(f, -half)
    return k * high + (most + (s * _polynomial((half, *_LOGARITHM), z) + (lost + k * low)))


def _sum(a: Any, b: Any) -> tuple[Any, Any]:
    """The rounded sum and what the rounding lost."""
    s = a + b
    other = s - a
    return s, (a - (s - other)) + (b - other)


def _short_sum(a: Any, b: Any) -> tuple[Any, Any]:
    """The same if `a` is not smaller than `b` in size, or 0."""
    s = a + b
    return s, b - (s - a)


def _rest(p: Any, a: Any, b: Any) -> Any:
    """The difference of `p` and the product of `a` and `b`, which is near to it, by factors of 26 bits (Dekker)."""
    a1 = _upper(a)
    b1 = a1 if b is a else _upper(b)
    a2, b2 = a - a1, b - b1
    return (((p - a1 * b1) - a1 * b2) - a2 * b1) - a2 * b2


def _upper(a: Any) -> Any:
    """The upper half of the digits of a number (Veltkamp)."""
    t = 134217729.0 * a
    return t - (t - a)


def _nearest(x: Any) -> Any:
    """The nearest whole number, of two the even one, of a number up to 2**51 in size."""
    return (x + _WHOLE_NUMBERS) - _WHOLE_NUMBERS


def _polynomial(coefficients: Sequence[Any], z: Any) -> Any:
    """The polynomial with these coefficients, lowest power first: pairs of terms, then pairs of these, which a
    processor computes at the same time."""
    pairs = [low + z * high for low, high in zip(coefficients[::2], coefficients[1::2], strict=False)]
    terms = [*pairs, *coefficients[2 * len(pairs) :]]
    return _polynomial(terms, z * z) if len(terms) > 1 else terms[0]


OWN: dict[str, tuple[Callable[..., Any], int, int]] = {
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


def is_pair(kind: str) -> bool:
    """Whether the function that computes operations of this `kind` has two results, as sine and cosine."""
    return kind in OWN and len(recording(kind).results) > 1
