# %% [markdown]
# The level of an alarm
#
# Prints the coefficients in `chainunit.machines.load_filter`. The level z that is exceeded at a given rate solves
# s = z exp(-z^2/2). With q = sqrt(-2 log(s)) the difference z - q is smooth: a quotient of two polynomials of q.
# Weighted least squares (Lawson) make its largest error in parts of z least, over a range that is a little wider than
# that of the levels that occur.

# %%
from __future__ import annotations

import math

import numpy as np
from numpy.polynomial import chebyshev, polynomial

from chainunit.machines.load_filter import LEAST_LEVEL, LEAST_SHARE

DEGREE, DIGITS, ROUNDS = 4, 9, 3000


def quotient(q, f, weight):
    """Numerator and divisor, whose highest factor is 1, of the quotient that is nearest to `f`."""
    # a variable from -1 to 1 in which the function is of one size, and so are the polynomials
    middle = math.sqrt(q[0] * q[-1])
    y = (q - middle) / (q + middle)
    largest = np.abs(y).max()
    T = chebyshev.chebvander(y / largest, DEGREE)
    lawson, divisor, least = np.ones_like(q), np.ones_like(q), (math.inf, None)
    for _ in range(ROUNDS):
        rows = np.hstack([T, -f[:, None] * T[:, 1:]])
        scale = lawson * weight / divisor
        k = np.linalg.lstsq(rows * scale[:, None], f * scale, rcond=None)[0]
        above, below = k[: DEGREE + 1], np.r_[1.0, k[DEGREE + 1 :]]
        divisor = np.abs(T @ below)
        error = np.abs(T @ above / (T @ below) - f) * weight
        least = min(least, (error.max(), (above, below)), key=lambda each: each[0])
        lawson *= (0.3 + 0.7 * error / error.max()) ** 0.3
        lawson /= lawson.max()
    above, below = (powers(each, middle, largest) for each in least[1])
    return above / below[-1], below / below[-1]


def powers(factors, middle, largest):
    """The polynomial of Chebyshev's in y times (q + middle)^DEGREE, by powers of q."""
    total = np.zeros(1)
    for k, factor in enumerate(chebyshev.cheb2poly(factors)):
        ends = [np.array([-middle, 1.0])] * k + [np.array([middle, 1.0])] * (DEGREE - k)
        term = np.array([factor / largest**k])
        for each in ends:
            term = polynomial.polymul(term, each)
        total = polynomial.polyadd(total, term)
    return total


def main() -> None:
    q = math.sqrt(-2.0 * math.log(LEAST_SHARE))
    z = np.exp(np.linspace(math.log(0.999 * LEAST_LEVEL), math.log(1.001 * (q + 0.1)), 6001))
    q = np.sqrt(z * z - 2.0 * np.log(z))
    rounded = [[float(f"{x:.{DIGITS}g}") for x in each] for each in quotient(q, z - q, 1.0 / z)]
    print(*rounded, sep="\n")
    above, below = (polynomial.polyval(q, each) for each in rounded)
    print(f"largest error in parts of the level: {np.abs((q + above / below) / z - 1.0).max():.1e}")


if __name__ == "__main__":
    main()
