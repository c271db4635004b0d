"""The poles of a linear model."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..reading.results import derived, part, result

_ROUNDING = 1e-13
"""Size of a pole over the largest of its block up to which it is 0, and its real part."""
_EQUAL = 1e-9
"""Part of the largest share of a state in a pole up to which another one is as large."""


@result
class Pole:
    """A pole, or a pair of conjugate ones."""

    real: float = part("real part", unit="1/s")
    imaginary: float = part("size of the imaginary part; not 0 for a pair", unit="rad/s")
    state: str = part("the state that takes the largest part in its motion (participation factor)")

    @derived("rad/s")
    def natural_frequency(self) -> float:
        """Natural frequency: the size of the pole."""
        return math.hypot(self.real, self.imaginary)

    @derived("1")
    def damping_ratio(self) -> float | None:
        """Damping ratio: -real part over natural frequency, 1 for a decay without oscillation, negative for an
        instability; none for a pole at 0."""
        return -self.real / self.natural_frequency if self.natural_frequency else None

    @derived("s")
    def time_constant(self) -> float | None:
        """Time constant: the time in which its motion falls to 1/e; negative where it grows; none where it does
        neither."""
        return -1.0 / self.real if self.real else None


def poles_of(A: Any, names: Sequence[str]) -> tuple[Pole, ...]:
    """The poles of the matrix `A` [1/s], shape (n, n), of the states with these names; the slowest first, of
    two that are equally slow the one that grows. Equal means to nine digits, so that rounding does not decide.

    The states are divided into groups that act on each other both ways; A is block triangular in them, and has
    the eigenvalues of the blocks. So an integral on which nothing depends, such as an angle or an energy, has a
    pole at 0 without rounding; in a block a pole that rounding moves from 0 is set to 0.
    """
    from scipy.linalg import eig
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import connected_components

    A = np.asarray(A, float)
    count, group = connected_components(csr_matrix(A != 0.0), connection="strong") if len(A) else (0, [])
    poles = []
    for k in range(count):
        members = np.flatnonzero(group == k)
        values, left, right = eig(A[np.ix_(members, members)], left=True, right=True)
        values = np.where(np.abs(values) <= _ROUNDING * np.max(np.abs(values)), 0.0, values)
        shares = np.abs(left.conj() * right)
        for value, share in zip(values, shares.T, strict=True):
            if value.imag >= 0.0:
                state = names[members[int(np.argmax(share >= (1.0 - _EQUAL) * np.max(share)))]]
                real = 0.0 if abs(value.real) <= _ROUNDING * np.max(np.abs(values)) else float(value.real)
                poles.append(Pole(real, float(value.imag), state))

    def order(pole: Pole) -> tuple[float, float, str]:
        return float(f"{pole.natural_frequency:.9e}"), -float(f"{pole.real:.9e}"), pole.state

    return tuple(sorted(poles, key=order))
