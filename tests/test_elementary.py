"""The own sine, arcsine, arctangent, exponential and logarithm: against 64-bit mantissas of the C library, at special
arguments, and the same bits from arrays, from the list of operations, and from C printed from it."""

from __future__ import annotations

import ctypes
import math

import numpy as np
import pytest
from basic_operations import ARRAYS as XP

from chainunit.core.native.compilers import compile_code, compiler
from chainunit.core.printing import elementary
from chainunit.core.printing.c_elementary import HEADER, header

LONG = np.longdouble
long_doubles = pytest.mark.skipif(np.finfo(LONG).nmant < 63, reason="long doubles have no 64 bits here")
pytestmark = pytest.mark.filterwarnings("ignore::RuntimeWarning")


def sine(xp, x):
    return elementary.sine_and_cosine(xp, x)[0]


def cosine(xp, x):
    return elementary.sine_and_cosine(xp, x)[1]


def near(at, rng, n):
    """Numbers near `at`, as near as doubles are."""
    return at + rng.choice([-1.0, 1.0], n) * 10.0 ** rng.uniform(-17.0, -1.0, n)


def spread(rng, n, low, high):
    """Numbers of both signs whose sizes are spread over decades."""
    return rng.choice([-1.0, 1.0], n) * 10.0 ** rng.uniform(low, high, n)


def multiples(rng, n):
    """The doubles around multiples of pi/2, where a result is small."""
    k = rng.integers(1, 8_270_000, n) * (0.5 * np.pi)
    return np.nextafter(k, k * rng.choice([0.0, 1.0, 2.0], n))


def unit(rng, n):
    return rng.uniform(-1.0, 1.0, n)


ONE = {
    # function: reference, its arguments, the largest error in units in the last place
    "sine": (sine, np.sin, (
        lambda rng, n: rng.uniform(-10.0, 10.0, n), lambda rng, n: rng.uniform(-1.3e7, 1.3e7, n), multiples,
        lambda rng, n: spread(rng, n, -300.0, 7.0),
    ), 0.82),
    "cosine": (cosine, np.cos, (
        lambda rng, n: rng.uniform(-10.0, 10.0, n), lambda rng, n: rng.uniform(-1.3e7, 1.3e7, n), multiples,
        lambda rng, n: spread(rng, n, -300.0, 7.0),
    ), 0.82),
    "arcsine": (elementary.arcsine, np.arcsin, (
        unit, lambda rng, n: np.clip(near(1.0, rng, n), -1.0, 1.0), lambda rng, n: near(-0.5, rng, n),
        lambda rng, n: spread(rng, n, -300.0, 0.0),
    ), 0.68),
    "arccosine": (elementary.arccosine, np.arccos, (
        unit, lambda rng, n: np.clip(near(1.0, rng, n), -1.0, 1.0), lambda rng, n: near(0.5, rng, n),
        lambda rng, n: np.clip(near(-1.0, rng, n), -1.0, 1.0), lambda rng, n: spread(rng, n, -300.0, 0.0),
    ), 0.68),
    "exponential": (elementary.exponential, np.exp, (
        lambda rng, n: rng.uniform(-708.0, 709.7, n), unit, lambda rng, n: spread(rng, n, -300.0, 2.0),
    ), 0.95),
    "logarithm": (elementary.logarithm, np.log, (
        lambda rng, n: np.abs(spread(rng, n, -307.6, 308.2)), lambda rng, n: rng.uniform(0.4, 2.5, n),
        lambda rng, n: near(1.0, rng, n),
    ), 0.83),
}  # fmt: skip
TWO = {
    "anywhere": lambda rng, n: (rng.normal(size=n), rng.normal(size=n)),
    "sizes": lambda rng, n: (spread(rng, n, -140.0, 140.0), spread(rng, n, -140.0, 140.0)),
    "diagonal": lambda rng, n: (near(1.0, rng, n), near(1.0, rng, n) * rng.choice([-1.0, 1.0], n)),
    "switch": lambda rng, n: (near(math.tan(math.pi / 8.0), rng, n), near(1.0, rng, n)),
    "small": lambda rng, n: (spread(rng, n, -280.0, -250.0), spread(rng, n, -280.0, -250.0)),
}


def error(got, exact):
    """The largest deviation in units in the last place."""
    return float(np.max(np.abs((got - exact) / np.spacing(np.abs(exact.astype(float))))))


def check_one(name, n):
    function, reference, arguments, most = ONE[name]
    rng = np.random.default_rng(5)
    for draw in arguments:
        x = draw(rng, n)
        assert error(function(XP, x).astype(LONG), reference(x.astype(LONG))) < most


def check_two(draw, n):
    y, x = TWO[draw](np.random.default_rng(6), n)
    exact = np.arctan2(y.astype(LONG), x.astype(LONG))
    assert error(elementary.arctangent2(XP, y, x).astype(LONG), exact) < 0.73


@long_doubles
@pytest.mark.parametrize("name", ONE)
def test_every_result_is_within_one_unit_in_the_last_place(name):
    check_one(name, 40_000)


@long_doubles
@pytest.mark.parametrize("draw", TWO)
def test_every_angle_of_a_vector_is_within_one_unit_in_the_last_place(draw):
    check_two(draw, 40_000)


@long_doubles
@pytest.mark.slow
def test_a_million_arguments_each():
    for name in ONE:
        check_one(name, 1_000_000)
    for draw in TWO:
        check_two(draw, 1_000_000)


def test_a_large_angle_is_rounded_once_more():
    """Behind 2**23 quarters of a turn the result is that of an angle within a unit in the last place, of size 1 at
    most; behind 2**40 rad there is none."""
    x = np.random.default_rng(7).uniform(2e7, 2.0**40, 20_000)
    s, c = elementary.sine_and_cosine(XP, x)
    off = np.abs(np.arctan2(s, c) - np.arctan2(np.sin(x), np.cos(x)))
    assert np.all(np.minimum(off, 2.0 * np.pi - off) < 1.01 * np.spacing(x) + 1e-15)
    np.testing.assert_allclose(s * s + c * c, 1.0, rtol=2e-15)
    for beyond in (2.0**40, 1e300, np.inf, -np.inf, np.nan):
        assert np.isnan(elementary.sine_and_cosine(XP, np.array(beyond))).all()


def test_special_arguments():
    def values(function, *x):
        return [float(v) for v in function(XP, np.array(x))]

    inf, nan = math.inf, math.nan
    np.testing.assert_array_equal(values(sine, 0.0, np.pi / 6.0), [0.0, math.sin(math.pi / 6.0)])
    np.testing.assert_array_equal(values(cosine, 0.0), [1.0])
    half = math.pi / 2.0
    np.testing.assert_array_equal(
        values(elementary.arcsine, 1.0, -1.0, 0.0, 1.0 + 1e-15, nan), [half, -half, 0.0, nan, nan]
    )
    np.testing.assert_array_equal(
        values(elementary.arccosine, 1.0, -1.0, 0.0, 1.0 + 1e-15, nan), [0.0, math.pi, half, nan, nan]
    )
    np.testing.assert_array_equal(
        values(elementary.exponential, -inf, inf, nan, 0.0, 710.0, -746.0), [0.0, inf, nan, 1.0, inf, 0.0]
    )
    # results with fewer digits are rounded once
    assert values(elementary.exponential, -745.0, -730.0) == [math.exp(-745.0), math.exp(-730.0)]
    np.testing.assert_array_equal(
        values(elementary.logarithm, 0.0, -0.0, -1.0, -inf, inf, nan, 1.0),
        [-inf, -inf, nan, nan, inf, nan, 0.0],
    )
    y, x = (
        np.array([[0.0, -0.0, 1.0, -1.0, 5e-324, nan]] * 6),
        np.array([[0.0, -0.0, 1.0, -1.0, 5e-324, nan]] * 6).T,
    )
    got, exact = elementary.arctangent2(XP, y, x), np.arctan2(y, x)
    np.testing.assert_array_equal(got, exact)
    known = ~np.isnan(exact)  # before and behind the cut
    np.testing.assert_array_equal(np.signbit(got)[known], np.signbit(exact)[known])


CALLS = """
#include "elementary.h"
void f_SIN(const double *a, double *r) { const Two b = sine_and_cosine(a[0]); r[0] = b.a, r[1] = b.b; }
void f_COS(const double *a, double *r) { f_SIN(a, r); }
void f_ASIN(const double *a, double *r) { r[0] = arcsine(a[0]); }
void f_ACOS(const double *a, double *r) { r[0] = arccosine(a[0]); }
void f_ATAN2(const double *a, double *r) { r[0] = arctangent2(a[0], a[1]); }
void f_EXP(const double *a, double *r) { r[0] = exponential(a[0]); }
void f_LOG(const double *a, double *r) { r[0] = logarithm(a[0]); }
void f_FMIN(const double *a, double *r) { r[0] = least_of(a[0], a[1]); }
void f_FMAX(const double *a, double *r) { r[0] = largest_of(a[0], a[1]); }
"""


@pytest.fixture(params=["-O2", "-O0", "-O3 -march=native -ffp-contract=fast", "-O2 -U__SSE2__"])
def in_c(request, tmp_path):
    """A function of a kind of operation and an array of arguments, shape (n, arguments), in C: the first result and
    the second, where there is one. The header keeps a compiler from contracting that would by its options."""
    sources = {"f.c": CALLS.encode(), HEADER: header().encode()}
    flags = (*request.param.split(), "-std=gnu11", "-fPIC", "-shared", "f.c", "-o", "f.so", "-lm")
    (tmp_path / "f.so").write_bytes(compile_code(compiler(), flags, sources, "f.so"))
    library = ctypes.CDLL(str(tmp_path / "f.so"))

    def values(kind, x):
        results = np.empty((len(x), 2))
        pointer = ctypes.POINTER(ctypes.c_double)
        for row, result in zip(np.ascontiguousarray(x), results, strict=True):
            getattr(library, f"f_{kind}")(row.ctypes.data_as(pointer), result.ctypes.data_as(pointer))
        return results.T

    return values


@pytest.mark.skipif(compiler() is None, reason="no C compiler")
def test_c_and_arrays_have_the_same_bits(in_c):
    """One definition, two printers: C without contraction gives the bits of numpy."""
    rng = np.random.default_rng(8)
    arguments = {"ATAN2": spread(rng, 2000, -3.0, 3.0), "ASIN": unit(rng, 1000), "ACOS": unit(rng, 1000)}
    for kind, (function, count, place) in elementary.OWN.items():
        x = arguments.get(kind, spread(rng, 1000, -3.0, 2.5)).reshape(-1, count)
        x = np.abs(x) if kind == "LOG" else x
        want = function(XP, *x.T)
        want = want[place] if isinstance(want, tuple) else want
        np.testing.assert_array_equal(in_c(kind, x)[place].view(np.int64), want.view(np.int64), kind)


@pytest.mark.skipif(compiler() is None, reason="no C compiler")
def test_the_smaller_and_the_larger_of_two_numbers(in_c):
    """NaN where one is, and -0 below 0, as in WebAssembly."""
    some = np.array([0.0, -0.0, 1.0, -1.0, 5e-324, -1e308, math.inf, -math.inf, math.nan])
    x = np.array(np.meshgrid(some, some)).reshape(2, -1).T
    for kind, of, zero in (("FMIN", np.minimum, np.logical_or), ("FMAX", np.maximum, np.logical_and)):
        got, want = in_c(kind, x)[0], of(*x.T)
        np.testing.assert_array_equal(got, want, kind)
        zeros = (x == 0.0).all(axis=1)
        np.testing.assert_array_equal(np.signbit(got[zeros]), zero(*np.signbit(x[zeros].T)), kind)
