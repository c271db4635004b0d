"""C of the functions of `chainunit.core.printing.elementary`, and of the smaller and the larger of two numbers.

It has the bits that JavaScript has: both are printed from the same operations, and none of the functions calls the C
library for more than a root, a size or a sign, which IEEE 754 rounds in one way. A product and a sum must not be
contracted to one rounding: the header says so to the compilers, and the flags of our own builds say it, too.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

from .c_forms import number
from .elementary import OWN, is_pair
from .operations import ARGUMENT, NUMBER, Operation
from .recorder import CHOOSE, EXPONENT, MANTISSA, POWER2, recorded

HEADER = "elementary.h"
"""Name of the file with the functions."""

_NO_CONTRACTION = """\
/* The same bits on each machine: a product and a sum are rounded one after the other. */
#if defined __clang__
#pragma STDC FP_CONTRACT OFF
/* a function without optimization needs it once more, at its begin */
#define ROUNDED_APART _Pragma("STDC FP_CONTRACT OFF")
#else
#define ROUNDED_APART
#if defined __GNUC__
/* GCC 12 contracts vectors of a sum and a difference all the same; short vectors cost more than they save */
#pragma GCC optimize("fp-contract=off", "no-tree-slp-vectorize")
#elif defined _MSC_VER
#pragma fp_contract(off)
#endif
#endif
"""

_HEAD = """\
/* Functions made of basic operations, which every machine rounds in the same way. Generated. */
#ifndef CHAINUNIT_ELEMENTARY_H
#define CHAINUNIT_ELEMENTARY_H
#include <math.h>
#include <stdint.h>
#include <string.h>
#if defined __SSE2__ || defined _M_X64
#include <emmintrin.h>
#endif

"""

_BASIC = """\

/* two results */
typedef struct { double a, b; } Two;

static inline uint64_t bits_of(double x) { uint64_t b; memcpy(&b, &x, 8); return b; }
static inline double of_bits(uint64_t b) { double x; memcpy(&x, &b, 8); return x; }
/* the nearest exponent of 2 of a positive number, and what that power is multiplied by */
#define ROOT_OF_HALF 0x3fe6a09e667f3bcd
static inline double exponent_of(double x) {
    return (double)(int)((bits_of(x) + (0x3ff0000000000000 - ROOT_OF_HALF)) >> 52) - 1023.0;
}
static inline double mantissa_of(double x) {
    return of_bits(((bits_of(x) - ROOT_OF_HALF) & 0xfffffffffffff) + ROOT_OF_HALF);
}
/* 2 to the power of a whole number, which the last digits of so large a number are */
static inline double power_of_2(double k) { return of_bits(bits_of(k + 4503599627371519.0) << 52); }
/* the smaller and the larger of two numbers: NaN where one is, and of two zeros -0 is the smaller */
#if defined __SSE2__ || defined _M_X64
static inline double least_of(double x, double y) {
    const __m128d a = _mm_set_sd(x), b = _mm_set_sd(y);
    return _mm_cvtsd_f64(_mm_or_pd(_mm_min_sd(a, b), _mm_min_sd(b, a)));
}
#else
static inline double least_of(double x, double y) { return of_bits(bits_of(x < y ? x : y) | bits_of(y < x ? y : x)); }
#endif
static inline double largest_of(double x, double y) { return -least_of(-x, -y); }
"""

_SIGNS = {"ADD": "+", "SUB": "-", "MUL": "*", "DIV": "/", "LT": "<"}
_FORMS = {kind: f"{{0}} {sign} {{1}}" for kind, sign in _SIGNS.items()} | {
    "NEG": "-{0}",
    "SQRT": "sqrt({0})",
    "FABS": "fabs({0})",
    "COPYSIGN": "copysign({0}, {1})",
    CHOOSE: "{0} ? {1} : {2}",
    EXPONENT: "exponent_of({0})",
    MANTISSA: "mantissa_of({0})",
    POWER2: "power_of_2({0})",
}
"""The basic operations in C."""


@cache
def header() -> str:
    """The C header with all functions."""
    written = dict.fromkeys((function, arguments) for function, arguments, _ in OWN.values())
    functions = [_function(*signature) for signature in written]
    return "\n".join([_HEAD + _NO_CONTRACTION + _BASIC, *functions, "#endif", ""])


def _function(function: Callable[..., Any], arguments: int) -> str:
    """The definition in C of a function of so many numbers, from its operations as `recorded` has them; two results
    are a `Two`."""
    recording = recorded(function, arguments)

    def value(place: int) -> str:
        operation = recording.items[place]
        if operation.kind == NUMBER:
            return number(operation.value)
        return f"x{operation.entry[1]}" if operation.kind == ARGUMENT else f"v{place}"

    def line(place: int, operation: Operation) -> str:
        kind = "int" if operation.kind == "LT" else "double"
        return (
            f"    const {kind} v{place} = {_FORMS[operation.kind].format(*map(value, operation.operands))};"
        )

    results = [value(place) for place in recording.results]
    kind, result = ("Two", f"(Two){{{', '.join(results)}}}") if len(results) > 1 else ("double", results[0])
    parameters = ", ".join(f"double x{k}" for k in range(arguments))
    lines = [line(place, operation) for place, operation in enumerate(recording.items) if operation.operands]
    head = f"static inline {kind} {function.__name__}({parameters}) {{"
    return "\n".join([head, *lines, f"    return {result};", "}", ""])


def own_forms() -> dict[str, str]:
    """The form in C of each operation of a model that the functions of the header compute, by its kind."""
    forms = {"FMIN": "least_of({0},{1})", "FMAX": "largest_of({0},{1})"}
    for kind, (function, arguments, result) in OWN.items():
        call = f"{function.__name__}({','.join(f'{{{k}}}' for k in range(arguments))})"
        forms[kind] = f"{call}.{'ab'[result]}" if is_pair(kind) else call
    return forms
