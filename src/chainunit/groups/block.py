"""The linear system of a group: the rows of its joints, eliminated once, for its motion and, transposed, for its
forces.

A row has the coefficients of the unknowns by their numbers. Coefficients 1 and -1 that are known beforehand are
integers. They are the pivots at first, so that nothing is divided. A column that stands in two rows, as that of a rod
between two pins, is a pivot after these rows are turned against each other: it is the square of a length. What is
left are 3 x 3 unknowns at most, for Cramer's rule. So nothing divides by a quantity that vanishes outside a dead
position.

Rows that yield, with a stiffness each, may be more than the unknowns that the others leave. The unknowns then make
their strain energy least, and the multipliers share the force by it (Menabrea).
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from functools import cache
from types import MappingProxyType
from typing import Any, NamedTuple

Row = dict[int, Any]
"""Coefficients by the numbers of unknowns; the integers 1 and -1 are known beforehand."""
_FEW = 2
"""Most coefficients that the elimination of a pivot may change while there are other ways."""
_CRAMER = 3
"""Most unknowns that Cramer's rule gives."""


class Pivot(NamedTuple):
    """A pivot by its row and its unknown, the other rows that have the unknown, and the row that the pivot's row is
    turned with beforehand; -1 for none."""

    row: int
    unknown: int
    others: tuple[int, ...]
    turned: int = -1


class Plan(NamedTuple):
    """The pivots of a system in their order, and the rows and the unknowns that are left for Cramer's rule."""

    pivots: list[Pivot]
    rows: list[int]
    unknowns: list[int]


class _Step(NamedTuple):
    """An eliminated pivot: its inverse, the rest of its row, what the other rows lose of it, and the coefficients by
    which its row is turned. A row that is turned is the opposite of the sum."""

    pivot: Pivot
    per: Any
    rest: Row
    lost: list[tuple[int, Any]]
    turn: tuple[Any, Any]


class GroupMatrix:
    """A system of `rows` for as many of the unknowns, which number `size`; rows with a `stiffness` [N/m], by number,
    yield. `det` is the determinant of the part that Cramer's rule solves: 0 is a dead
    position. The rows are used up."""

    __slots__ = ("_inverse", "_plan", "_size", "_steps", "det")

    def __init__(
        self, size: int, rows: list[Row], stiffness: Mapping[int, Any] = MappingProxyType({})
    ) -> None:
        self._size = size
        pattern = [tuple([(j, x if type(x) is int else None) for j, x in row.items()]) for row in rows]
        plan = self._plan = _plan(tuple(pattern), tuple(stiffness))
        self._steps = [_eliminated(rows, pivot) for pivot in plan.pivots]
        left = [[rows[i].get(j, 0) for j in plan.unknowns] for i in plan.rows]
        if stiffness:
            self._inverse, self.det = least_squares(left, [*stiffness.values()])
            return
        minus, self.det = minus_cofactors(left)
        # casadi turns each use of 1/x into a division by x, but keeps -1/x
        minus_per = -1.0 / self.det
        self._inverse = [[c * minus_per for c in row] for row in minus]

    def solve(self, right: Sequence[Any]) -> list[Any]:
        """The unknowns, shape (size,), from the right sides of the rows, shape (rows,): down the pivots, Cramer's
        rule for the rest, and back up the pivots."""
        b, x = [*right], [0.0] * self._size
        for (i, _, _, k), _, _, lost, (p, q) in self._steps:
            if k >= 0:
                b[i], b[k] = p * b[i] + q * b[k], p * b[k] - q * b[i]
            for row, factor in lost:
                b[row] = b[row] - factor * b[i]
        for column, j in enumerate(self._plan.unknowns):
            x[j] = sum([row[column] * b[i] for i, row in zip(self._plan.rows, self._inverse, strict=True)])
        for (i, j, *_), per, rest, _, _ in reversed(self._steps):
            for other, factor in rest.items():
                b[i] = b[i] - factor * x[other]
            x[j] = b[i] * per
        return x

    def solve_transposed(self, right: Sequence[Any]) -> list[Any]:
        """The multiplier of each row, from the sums of all rows times their multipliers, by unknown."""
        b, y = [*right], [0.0] * (len(self._steps) + len(self._inverse))
        for (i, j, *_), per, rest, _, _ in self._steps:
            y[i] = b[j] * per
            for other, factor in rest.items():
                b[other] = b[other] - factor * y[i]
        for i, row in zip(self._plan.rows, self._inverse, strict=True):
            y[i] = sum([factor * b[j] for j, factor in zip(self._plan.unknowns, row, strict=True)])
        for (i, _, _, k), _, _, lost, (p, q) in reversed(self._steps):
            for row, factor in lost:
                y[i] = y[i] - factor * y[row]
            if k >= 0:
                y[i], y[k] = p * y[i] - q * y[k], q * y[i] + p * y[k]
        return y


def minus_cofactors(m: Sequence[Sequence[Any]]) -> tuple[list[list[Any]], Any]:
    """The cofactors of a matrix of up to 3 rows with the other sign, and its determinant."""
    if len(m) < 2:
        return [[-1.0] for _ in m], m[0][0] if m else 1.0
    if len(m) < _CRAMER:
        (a, b), (c, d) = m
        return [[-d, c], [b, -a]], a * d - b * c
    a, b, c = m
    minus = [_cross(c, b), _cross(a, c), _cross(b, a)]
    return minus, -sum([x * y for x, y in zip(a, minus[0], strict=True)])


def least_squares(rows: Sequence[Sequence[Any]], weights: Sequence[Any]) -> tuple[list[list[Any]], Any]:
    """By row, its part in each of up to 3 unknowns per right side, with the least sum of `weights` times misfits
    squared; and the determinant of the equations of these unknowns."""
    weighted = [[w * x for x in row] for row, w in zip(rows, weights, strict=True)]
    columns = [*zip(*rows, strict=True)]
    normal = [
        [sum([a * b for a, b in zip(one, other, strict=True)]) for other in columns]
        for one in zip(*weighted, strict=True)
    ]
    minus, det = minus_cofactors(normal)
    minus_per = -1.0 / det
    inverse = [[c * minus_per for c in row] for row in minus]
    return [
        [sum([x * c for x, c in zip(row, part, strict=True)]) for part in inverse] for row in weighted
    ], det


def _cross(a: Sequence[Any], b: Sequence[Any]) -> list[Any]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _eliminated(rows: list[Row], pivot: Pivot) -> _Step:
    """The step of a pivot; the rows lose its unknown, in place."""
    i, j, others, k = pivot
    rest, turn, lost = rows[i], (1, 0), []
    per = rest.pop(j)
    if k >= 0:
        # the opposite of the sum: see `GroupMatrix` on -1/x
        p, q = turn = -per, -rows[k].pop(j)
        one, other, rest = rest, rows[k], {}
        _add(rest, one, p)
        _add(rest, other, q)
        rows[k] = {}
        _add(rows[k], other, p)
        _add(rows[k], one, -q)
        per = -1.0 / (p * p + q * q)
    for row in others:
        factor = rows[row].pop(j) * per
        lost.append((row, factor))
        _add(rows[row], rest, -factor)
    return _Step(pivot, per, rest, lost, turn)


def _add(row: Row, other: Row, factor: Any) -> None:
    """Add another row times a factor, without what is 0 beforehand."""
    for j, x in other.items():
        if j not in row:
            row[j] = x * factor
        else:
            row[j] = row[j] + x * factor
            if type(row[j]) is int and row[j] == 0:
                del row[j]


@cache
def _plan(pattern: tuple[tuple[tuple[int, int | None], ...], ...], yielding: tuple[int, ...] = ()) -> Plan:
    """The plan of a system, from its coefficients that are known beforehand; None is one that is not. The rows that
    are `yielding` are left for least squares."""
    rows: list[Row] = [{j: math.nan if x is None else x for j, x in row} for row in pattern]
    left, pivots = set(range(len(rows))), []
    while pivot := _next(rows, left, yielding):
        pivots.append(pivot)
        left.remove(pivot.row)
        _eliminated(rows, pivot)
    return Plan(pivots, sorted(left), sorted({j for i in left for j in rows[i]}))


def _next(rows: Sequence[Row], left: set[int], yielding: Collection[int]) -> Pivot | None:
    """The pivot that changes least, of equal ones that in the last row; None if the rest is for Cramer's rule."""
    columns: dict[int, list[int]] = {}
    for i in sorted(left):
        for j in rows[i]:
            columns.setdefault(j, []).append(i)
    units = [
        ((len(rows[i]) - 1) * (len(column) - 1), -i, j)
        for j, column in columns.items()
        for i in column
        if i not in yielding and rows[i][j] in (1, -1)
    ]
    changes, i, j = min(units, default=(math.inf, 0, 0))
    if not yielding and len(left) > _CRAMER and changes > _FEW:
        for unknown, column in columns.items():
            if len(column) == 2:
                return Pivot(column[0], unknown, (), column[1])
    return Pivot(-i, j, tuple(k for k in columns[j] if k != -i)) if units else None
