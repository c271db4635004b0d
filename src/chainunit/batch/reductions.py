"""Quantities of a cycle, computed while the states go by, so that the states need not be stored."""

from __future__ import annotations

import math
import numbers
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import accumulate
from typing import Any

import numpy as np

from ..core.errors import InputError, shown

MOST_BINS = 1024
"""Largest number of bins of a histogram."""


@dataclass(frozen=True)
class Reduction:
    """A reduction of a column over the last dimension: its title, as a function of an array, and in C.

    In C each lane starts with `begin` and takes up each value by `take`, where ``{a}`` is the lane, ``{y}`` the
    value, ``{one}`` 1 for a lane that counts and 0 for one that does not, and ``{limit}`` the limit of a count. The
    lanes are put together by `merge`: their "sum", the "least" or the "largest". The result is `end` of this,
    ``{a}``, and of the number of values, ``{n}``.
    """

    title: str
    of_array: Callable[..., Any]
    begin: str
    take: str
    merge: str
    end: str = "{a}"


REDUCTIONS = {
    "min": Reduction("least", lambda x: np.min(x, axis=-1), "V(INFINITY)", "fmin_v({a},{y})", "least"),
    "max": Reduction("largest", lambda x: np.max(x, axis=-1), "V(-INFINITY)", "fmax_v({a},{y})", "largest"),
    "peak": Reduction(
        "largest absolute value",
        lambda x: np.max(np.abs(x), axis=-1),
        "V(0.0)",
        "fmax_v({a},fabs_v({y}))",
        "largest",
    ),
    "mean": Reduction(
        "mean", lambda x: np.mean(x, axis=-1), "V(0.0)", "{a}+{one}*{y}", "sum", "{a}/(double)({n})"
    ),
    "rms": Reduction(
        "root of the mean square",
        lambda x: np.sqrt(np.mean(x * x, axis=-1)),
        "V(0.0)",
        "{a}+{one}*{y}*{y}",
        "sum",
        "sqrt({a}/(double)({n}))",
    ),
}
"""By name."""
_COUNT = Reduction(
    "number of states beyond a limit",
    lambda x, limit: np.sum(np.abs(x) > limit, axis=-1),
    "V(0.0)",
    "{a}+{one}*ONES(fabs_v({y})>V({limit}))",
    "sum",
)


@dataclass(frozen=True)
class Beyond:
    """The number of states in which a column is larger in size than a `limit`, in the unit of the column or a text
    such as "30 N m".

    Raises
    ------
    InputError
        for a limit that is no finite number of at least 0.
    """

    limit: float

    def __post_init__(self) -> None:
        # a limit with a unit becomes a number when the unit of its column is known
        if isinstance(self.limit, numbers.Real) and not (math.isfinite(self.limit) and self.limit >= 0.0):
            raise InputError(f"Beyond: limit = {self.limit}: must be a finite number >= 0, a size")

    @property
    def numbers(self) -> tuple[float, float]:
        """The numbers that the code takes: the limit, and 0."""
        return self.limit, 0.0

    def of_array(self, x: Any) -> Any:
        """The numbers over the last of two dimensions: shape (1, outer)."""
        return _COUNT.of_array(x, self.limit)[None]


@dataclass(frozen=True)
class Histogram:
    """The numbers of states by the value of a column: `bins` of equal width from `low` to `high`, in the unit of the
    column or texts such as "30 N m". The first bin has all states below it, too, and the last one all above it.

    Raises
    ------
    InputError
        for ends that are not finite or not in this order, and for fewer than 2 or more than `MOST_BINS` bins.
    """

    low: float
    high: float
    bins: int

    def __post_init__(self) -> None:
        are_numbers = isinstance(self.low, numbers.Real) and isinstance(self.high, numbers.Real)
        if are_numbers and not (
            math.isfinite(self.low) and math.isfinite(self.high) and self.low < self.high
        ):
            raise InputError(f"Histogram: low = {self.low}, high = {self.high}: must be finite, low < high")
        if not (isinstance(self.bins, int) and 2 <= self.bins <= MOST_BINS):
            raise InputError(
                f"Histogram: bins = {shown(self.bins)}: must be a whole number from 2 to {MOST_BINS}"
            )

    @property
    def numbers(self) -> tuple[float, float]:
        """The numbers that the code takes: the begin, and the bins per unit."""
        return self.low, self.bins / (self.high - self.low)

    @property
    def middles(self) -> Any:
        """The middle of each bin, shape (bins,)."""
        return self.low + (np.arange(self.bins) + 0.5) * (self.high - self.low) / self.bins

    def of_array(self, x: Any) -> Any:
        """The numbers over the last of two dimensions: shape (bins, outer)."""
        place = np.floor((np.nan_to_num(x) - self.low) * (self.bins / (self.high - self.low)))
        place = np.clip(place, 0, self.bins - 1).astype(np.int64)
        rows = np.arange(len(x))[:, None] * self.bins
        counts = np.bincount((rows + place).ravel(), minlength=len(x) * self.bins)
        return counts.reshape(len(x), self.bins).T


Request = str | Beyond | Histogram
"""A reduction: a name of `REDUCTIONS`, or one that has numbers."""


@dataclass(frozen=True)
class ReducedColumn:
    """The reduction `request` of the column at a `place`, with so many rows of results: the `bins` of a histogram, or
    1. Two columns are equal if they have the same code, into which the numbers of a request do not go."""

    place: int
    request: Request = field(compare=False)
    name: str
    bins: int = 1

    @classmethod
    def checked(cls, place: int, request: Request, output: str) -> ReducedColumn:
        """The column for a reduction of the `output` at this place.

        Raises
        ------
        InputError
            for a name that is not in `REDUCTIONS`.
        """
        if isinstance(request, Histogram):
            return cls(place, request, "histogram", request.bins)
        if isinstance(request, Beyond):
            return cls(place, request, "beyond")
        if not isinstance(request, str) or request not in REDUCTIONS:
            raise InputError(
                f"{output}: no reduction {shown(request)}; there are {', '.join(REDUCTIONS)}, Beyond(limit) and "
                "Histogram(low, high, bins)"
            )
        return cls(place, request, request)

    @property
    def reduction(self) -> Reduction:
        """The reduction of a column that is no histogram."""
        return REDUCTIONS.get(self.name, _COUNT)

    @property
    def numbers(self) -> tuple[float, float]:
        """The numbers that the code takes."""
        return (0.0, 0.0) if isinstance(self.request, str) else self.request.numbers

    def of_array(self, x: Any) -> Any:
        """The reduction of the values of the column, shape (outer, inner): shape (bins, outer)."""
        if isinstance(self.request, str):
            return self.reduction.of_array(x)[None]
        return self.request.of_array(x)


Reductions = tuple[ReducedColumn, ...]
"""Empty if the results themselves are stored."""


def row_count(reductions: Reductions) -> int:
    """The number of rows of results, with one for each bin of a histogram."""
    return sum(column.bins for column in reductions)


def loop_text(reductions: Reductions) -> Mapping[str, str]:
    """The statements of a loop, by name: BEGIN before it, TAKE for each vector, PARTS after it if it is a part of a
    loop whose parts are put together later, and END at last.

    The loop has the vectors ``y`` of results, the vector ``one``, the numbers ``L``, two for each reduction, and the
    number of all states ``n``. It defines BINS (memory for the counts of a histogram), COUNT (of a vector, into
    them), SUM, LEAST and LARGEST (of all states, by the vector and the row), RESULT (of a row), and COUNTS (of the
    rows of a histogram); a loop in parts PART and PART_COUNTS.
    """
    begin, take, parts, end = [], [], [], []
    first_rows = accumulate((column.bins for column in reductions), initial=0)
    for k, (column, row) in enumerate(zip(reductions, first_rows, strict=False)):
        y = f"y[{column.place}]"
        if column.name == "histogram":
            begin.append(f"BINS(H{k},{row},{column.bins})")
            take.append(f"COUNT(H{k},{y},L[{2 * k}],L[{2 * k + 1}],{column.bins})")
            parts.append(f"PART_COUNTS({row},H{k},{column.bins})")
            end.append(f"COUNTS({row},H{k},{column.bins})")
            continue
        form, limit = column.reduction, f"L[{2 * k}]"
        begin.append(f"v A{k} = {form.begin};")
        take.append(f"A{k} = {form.take.format(a=f'A{k}', y=y, one='one', limit=limit)};")
        parts.append(f"PART({row},lane_{form.merge}(A{k}))")
        merged = f"{form.merge.upper()}(A{k},{row})"
        end.append(f"RESULT({row},{form.end.format(a=merged, n='n')})")
    statements = {"BEGIN": begin, "TAKE": take, "PARTS": parts, "END": end}
    return {name: " ".join(lines) for name, lines in statements.items()}


def flat_numbers(reductions: Reductions) -> Any:
    """The numbers of all reductions, shape (2*reductions,), and not empty."""
    return np.array([x for column in reductions for x in column.numbers] or [0.0])
