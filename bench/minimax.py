# %% [markdown]
# Polynomials of the own sine, arcsine, arctangent, exponential and logarithm
#
# Prints the coefficients in `chainunit.core.printing.elementary`: minimax polynomials by the exchange of Remez in
# 50-digit arithmetic, rounded to doubles, each with its largest error relative to the function.

# %%
from __future__ import annotations

from collections.abc import Callable
from typing import Any

from mpmath import (
    asin,
    atan,
    cos,
    exp,
    linspace,
    log,
    lu_solve,
    matrix,
    mp,
    mpf,
    pi,
    polyval,
    sin,
    sqrt,
)

mp.dps = 50


def near_zero(f: Callable, x: Any) -> Any:
    """A value near 0 in more digits, as differences cancel there."""
    with mp.workdps(120):
        return f(mpf(x))


CASES: dict[str, tuple[Callable, Callable, Any, Any, int]] = {
    # name: remainder, its share of the function, interval, number of coefficients
    "SINE": (
        lambda z: (sin(sqrt(z)) / sqrt(z) - 1) / z, lambda z: z, mpf(0), (pi / 4) ** 2, 6,
    ),
    "COSINE": (
        lambda z: (cos(sqrt(z)) - 1 + z / 2) / z**2, lambda z: z**2, mpf(0), (pi / 4) ** 2, 6,
    ),
    "ARCSINE": (
        lambda z: (asin(sqrt(z)) / sqrt(z) - 1) / z, lambda z: z, mpf(0), mpf(1) / 4, 13,
    ),
    "ARCTANGENT": (
        lambda z: (atan(sqrt(z)) / sqrt(z) - 1) / z, lambda z: z, mpf(0), (sqrt(2) - 1) ** 2, 11,
    ),
    "EXPONENTIAL": (
        lambda r: (exp(r) - 1 - r) / r**2, lambda r: r**2 + mpf(10) ** -6, -log(2) / 2, log(2) / 2, 11,
    ),
    "LOGARITHM": (
        lambda z: (log((1 + sqrt(z)) / (1 - sqrt(z))) / sqrt(z) - 2) / z, lambda z: z / 2, mpf(0),
        (3 - 2 * sqrt(2)) ** 2, 7,
    ),
}  # fmt: skip


def minimax(f: Callable, weight: Callable, low: Any, high: Any, count: int) -> tuple[list[float], float]:
    """The coefficients, lowest power first, and the largest weighted error after their rounding."""
    tiny = mpf(10) ** -12 * (high - low)

    def exact(x: Any) -> Any:
        return near_zero(f, x if abs(x) > tiny else tiny)

    middle, half = (high + low) / 2, (high - low) / 2
    points = [middle - half * cos(pi * (2 * k + 1) / (2 * (count + 1))) for k in range(count + 1)]
    grid = linspace(low, high, 1501)
    exact_there = [exact(x) for x in grid]
    weights = [weight(x) for x in grid]
    for _ in range(12):
        rows = matrix(count + 1, count + 1)
        right = matrix(count + 1, 1)
        for i, x in enumerate(points):
            for j in range(count):
                rows[i, j] = x**j
            rows[i, count] = (-1) ** i / weight(x)
            right[i] = exact(x)
        found = list(lu_solve(rows, right))
        c = found[:count]
        errors = [w * (polyval(c[::-1], x) - y) for x, y, w in zip(grid, exact_there, weights, strict=True)]
        # the largest error between two changes of sign
        peaks: list[int] = []
        for k, e in enumerate(errors):
            if peaks and (errors[peaks[-1]] > 0) == (e > 0):
                if abs(e) > abs(errors[peaks[-1]]):
                    peaks[-1] = k
            elif e != 0:
                peaks.append(k)
        while len(peaks) > count + 1:
            peaks.pop(0 if abs(errors[peaks[0]]) < abs(errors[peaks[-1]]) else -1)
        if len(peaks) < count + 1:
            break
        points = [grid[k] for k in peaks]
    rounded = [float(x) for x in c]
    worst = max(
        abs(w * (polyval([mpf(x) for x in rounded[::-1]], x) - y))
        for x, y, w in zip(grid, exact_there, weights, strict=True)
    )
    return rounded, float(worst)


def main() -> None:
    for name, case in CASES.items():
        coefficients, worst = minimax(*case)
        print(f"{name} = (  # error 2^{float(log(worst, 2)):.1f}")
        print("".join(f"    {c!r},\n" for c in coefficients) + ")")


if __name__ == "__main__":
    main()
