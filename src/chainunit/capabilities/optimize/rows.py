"""The rows of a nonlinear program: each is a sum of a machine's columns and of auxiliary variables, and at most 0.

A peak or a range is no smooth function of the parameters. A limit above it is one row for each crank angle; as an
objective it becomes an auxiliary variable that no angle exceeds. A limit below it needs one angle at which it is
reached: this angle is an auxiliary variable.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from ...study.cycle_quantities import CycleBasis, CycleQuantity
from .columns import Columns

Kind = Literal["turn", "slack", "mean", "rms", "reached", "slope", "distance", "auxiliary"]
OVER_TURN = ("turn", "slack")
_MARGIN = 1e-3
"""Margin of the ends of a range at first, as a share of its scale: IPOPT begins inside the limits."""
SIGNS = {"max": (1.0,), "min": (-1.0,), "peak": (1.0, -1.0)}


@dataclass(frozen=True)
class Row:
    """The sum of `terms` (number of an angle, column, factor) and of `aux` (number, factor), minus `upper`, over
    `scale`, is at most 0, or exactly 0 if it is `equal`. `owner` is the limit that it belongs to, and `side` "min" or
    "max"; `times` the factor of the limit in `upper`.

    A row "turn" or "slack" has one term and stands at each angle of the turn, at the speed or at the speeds of the
    slack-free range; "mean" and "rms" are over the turn; in "reached" and "slope" the angles are auxiliary
    variables, and "slope" is the derivative by them; the term of "distance" is one of the model's requirements.
    """

    kind: Kind
    owner: str
    side: str
    upper: float
    scale: float
    terms: tuple[tuple[int, int, float], ...] = ()
    aux: tuple[tuple[int, float], ...] = ()
    equal: bool = False
    times: float = 1.0


@dataclass
class LimitRows:
    """The rows of limits near a machine: `turn` gives columns over the turn there, shape (columns, angles).

    `begin` and `low` are the value of each auxiliary variable there, and its lower bound; `angles` are the variables
    that are angles.
    """

    columns: Columns
    basis: CycleBasis
    turn: Callable[[Sequence[int]], Any]
    rows: list[Row] = field(default_factory=list)
    begin: list[float] = field(default_factory=list)
    low: list[float] = field(default_factory=list)
    angles: list[int] = field(default_factory=list)

    def auxiliary(self, begin: float, low: float = -math.inf) -> int:
        """The number of a new auxiliary variable."""
        self.begin.append(begin)
        self.low.append(low)
        return len(self.begin) - 1

    def at_most(
        self, q: CycleQuantity, owner: str, scale: float, bound: float = 0.0, objective: int | None = None
    ) -> None:
        """Rows by which a quantity is at most `bound`, or at most `scale` times the auxiliary variable `objective`.
        The rows follow from its reduction: a largest value is a row over the turn, a least one an angle that reaches
        it."""

        def add(kind: Kind, column: int, factor: float, times: float = 1.0) -> None:
            """A row by which `factor` times a column is at most `times` the bound of the quantity."""
            aux = () if objective is None else ((objective, -times * scale),)
            term = ((-1, column, factor),)
            self.rows.append(Row(kind, owner, "max", times * bound, times * scale, term, aux, times=times))

        column, reduction = q.integrands[0].column, q.reduction
        if reduction in ("max", "peak"):
            for sign in SIGNS[reduction]:
                for k in self._smooth(column, sign):
                    add("turn", k, sign)
        elif reduction == "installed_power":
            power = self.columns.whole("power")
            add("rms", power, 1.0)
            for sign in SIGNS["peak"]:
                add("turn", power, sign, self.basis.overload)
        elif reduction == "min":
            self._reached(q, owner, "max", scale, bound, 1.0)
        elif (mean := self._mean(q)) is not None:
            add(*mean)
        else:
            extent = self._extent(q, scale) + (() if objective is None else ((objective, -scale),))
            self.rows.append(Row("auxiliary", owner, "max", bound, scale, (), extent))

    def _extent(self, q: CycleQuantity, scale: float) -> tuple[tuple[int, float], ...]:
        """The largest value of any column of a range or a box less the least one: two auxiliary variables, in units
        of `scale`, between which rows keep all columns at each angle."""
        places = [self.columns.whole(name) for name in dict.fromkeys(i.column for i in q.integrands)]
        values = self.turn(places) / scale
        high = self.auxiliary(float(np.max(values)) + _MARGIN)
        low = self.auxiliary(float(np.min(values)) - _MARGIN)
        for k in places:
            for sign, end in ((1.0, high), (-1.0, low)):
                self.rows.append(
                    Row("turn", "", "max", 0.0, scale, ((-1, k, sign),), ((end, -sign * scale),))
                )
        return (high, scale), (low, -scale)

    def at_least(self, q: CycleQuantity, owner: str, scale: float, bound: float, equal: bool = False) -> None:
        """Rows by which a quantity is at least, or exactly, `bound`."""
        if (mean := self._mean(q)) is not None:
            kind, column, factor = mean
            self.rows.append(Row(kind, owner, "min", -bound, scale, ((-1, column, -factor),), (), equal))
        elif q.reduction == "min" and not equal:
            self.over_turn("turn", self._smooth(q.integrands[0].column, -1.0), owner, scale, -bound)
        else:
            self._reached(q, owner, "min", scale, -bound, -1.0, equal)

    def over_turn(
        self, kind: Kind, places: Sequence[int], owner: str, scale: float, upper: float = 0.0
    ) -> None:
        """Rows by which columns are at least ``-upper`` at each angle."""
        self.rows += [Row(kind, owner, "min", upper, scale, ((-1, k, -1.0),)) for k in places]

    def distances(self, owner: str, clearance: float, sizes: Any, names: Sequence[str]) -> None:
        """Rows by which the distance from each requirement is at least a share of its size of today."""
        for k, (size, name) in enumerate(zip(sizes, names, strict=True)):
            term = ((-1, k, -1.0),)
            self.rows.append(Row("distance", owner, name, -clearance * size, size, term, (), False, size))

    def loosen(self) -> dict[str, int]:
        """Give each limit a slack: an auxiliary variable, at least 0, by which all its rows may be exceeded, in parts
        of their scales. An equality becomes two rows, one for each direction. Returns the slacks by limit."""
        slacks: dict[str, int] = {}
        tight, self.rows = self.rows, []
        for row in tight:
            if not row.owner:
                self.rows.append(row)
                continue
            if row.owner not in slacks:
                slacks[row.owner] = self.auxiliary(0.0, 0.0)
            slack = slacks[row.owner], -row.scale
            if row.equal:
                opposite = tuple((angle, k, -factor) for angle, k, factor in row.terms)
                self.rows.append(replace(row, upper=-row.upper, terms=opposite, aux=(slack,), equal=False))
            self.rows.append(replace(row, aux=(*row.aux, slack), equal=False))
        return slacks

    def _mean(self, q: CycleQuantity) -> tuple[Kind, int, float] | None:
        """The kind, column and factor of a quantity that is a mean."""
        if q.reduction in ("mean", "rms"):
            return (
                ("rms" if q.reduction == "rms" else "mean"),
                self.columns.whole(q.integrands[0].column),
                1.0,
            )
        if q.reduction == "energy_per_year":
            return "mean", self.columns.whole("power"), 3600.0 * self.basis.operating_hours
        return None

    def _smooth(self, column: str, factor: float) -> tuple[int, ...]:
        """The numbers of the columns that are all at most a bound, times `factor`, if the column is."""
        return self.columns.pieces(column, "FMAX" if factor > 0.0 else "FMIN")

    def _reached(
        self,
        q: CycleQuantity,
        owner: str,
        side: str,
        scale: float,
        upper: float,
        factor: float,
        equal: bool = False,
    ) -> None:
        """Rows by which `factor` times a quantity is at most `upper`, or exactly `upper` if it is `equal`, at angles
        that are auxiliary variables: they begin where the extremes of its columns are, and with an equality the
        slopes there are zero."""
        terms: list[tuple[int, str, float]] = []
        for reduction in ("max", "min", "peak"):
            names = [i.column for i in q.integrands if i.reduction == reduction]
            if not names:
                continue
            values = self.turn([self.columns.whole(name) for name in names])
            sign = SIGNS[reduction][0]
            if reduction == "peak":
                sign = 1.0 if np.max(values) >= -np.min(values) else -1.0
            place, angle = divmod(int(np.argmax(sign * values)), values.shape[1])
            number = self.auxiliary(float(grid(values.shape[1])[angle]))
            self.angles.append(number)
            # a range is the largest less the least value
            weight = sign if len(q.integrands) > 1 or reduction == "peak" else 1.0
            terms.append((number, names[place], factor * weight))
        whole = tuple((angle, self.columns.whole(name), weight) for angle, name, weight in terms)
        if equal:
            slopes = [Row("slope", "", "", 0.0, scale, (term,), (), True) for term in whole]
            self.rows += [Row("reached", owner, side, upper, scale, whole, (), True), *slopes]
        elif len(terms) > 1:
            self.rows.append(Row("reached", owner, side, upper, scale, whole))
        else:
            ((angle, name, weight),) = terms
            for k in self._smooth(name, weight):
                self.rows.append(Row("reached", owner, side, upper, scale, ((angle, k, weight),)))


def grid(points: int) -> Any:
    """Angles evenly over the turn [rad], shape (points,)."""
    return np.arange(points) * (2.0 * math.pi / points)
