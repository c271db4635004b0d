"""The rows of a nonlinear program: each is a function of the machine, plus auxiliary variables, and is at most 0.

A peak or a range is no smooth function of the parameters. A limit above it is one row for each crank angle; as an
objective it becomes an auxiliary variable that no angle exceeds. A limit below it is a row with the extreme itself,
whose derivatives follow from those at its angle.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from ...core.errors import InputError
from ...machines.machine import Machine
from ...study.cycle_quantities import CycleBasis, CycleQuantity
from .extremes import Sense
from .kernel import pieces, symbols_of


@dataclass(frozen=True)
class Row:
    """A row: its value plus the sum of `aux` (factors by auxiliary variable), minus `upper`, over `scale`, is at
    most 0, or exactly 0 where it is `equal`. `owner` is the limit that it belongs to, and `side` "min" or "max"."""

    owner: str
    side: str
    upper: float
    scale: float
    aux: Mapping[int, float] = field(default_factory=dict)
    equal: bool = False
    times: float = 1.0
    """factor of the limit in `upper`"""

    @property
    def per_unit(self) -> float:
        """Change of the row by one unit of the limit, without its sign."""
        return self.times / self.scale


@dataclass(frozen=True)
class PointRow(Row):
    """A column times `factor` at each angle; `slack` rows stand at the speeds of the slack-free range."""

    column: int = 0
    factor: float = 1.0
    slack: bool = False


@dataclass(frozen=True)
class MeanRow(Row):
    """The mean of a column, or its RMS, times `factor`."""

    column: int = 0
    factor: float = 1.0
    rms: bool = False


@dataclass(frozen=True)
class ExtremeRow(Row):
    """The sum of extremes of columns, each with its factor."""

    terms: tuple[tuple[tuple[int, ...], Sense, float], ...] = ()


@dataclass(frozen=True)
class AuxRow(Row):
    """Auxiliary variables alone."""


@dataclass(frozen=True)
class RequirementRow(Row):
    """A distance of a requirement of the model, by its place among all of them, times -1."""

    place: int = 0


class Columns:
    """The columns that some quantities need, as expressions for a `Kernel`: the columns themselves, and the smooth
    pieces of the rows that are a choice."""

    def __init__(self, machine: Machine) -> None:
        self._machine = machine
        self.expressions: list[Any] = []
        self._places: dict[tuple[str, str], tuple[int, ...]] = {}

    def whole(self, column: str) -> int:
        """The place of a column."""
        return self._of(column, "")[0]

    def lower(self, column: str) -> tuple[int, ...]:
        """The places of the pieces whose least value a column is."""
        return self._of(column, "FMIN")

    def mean(self, column: str) -> int:
        """The place of the mean of the pieces whose least value a column is."""
        if (column, "mean") not in self._places:
            own = [self.expressions[k] for k in self.lower(column)]
            self._places[column, "mean"] = (len(self.expressions),)
            self.expressions.append(sum(own[1:], own[0]) / len(own))
        return self._places[column, "mean"][0]

    def upper(self, column: str) -> tuple[int, ...]:
        """The places of the pieces whose largest value a column is."""
        return self._of(column, "FMAX")

    def _of(self, column: str, kind: str) -> tuple[int, ...]:
        if (column, kind) not in self._places:
            (expression,) = symbols_of(self._machine, [column])
            own = pieces(expression, kind) if kind else [expression]
            if len(own) == 1 and kind:
                self._places[column, kind] = self._of(column, "")
            else:
                first = len(self.expressions)
                self.expressions += own
                self._places[column, kind] = tuple(range(first, len(self.expressions)))
        return self._places[column, kind]


@dataclass
class RowMaker:
    """Makes the rows of limits. `new_aux` makes an auxiliary variable of that scale and returns its number."""

    columns: Columns
    basis: CycleBasis
    new_aux: Any
    rows: list[Row] = field(default_factory=list)

    def at_most(
        self, q: CycleQuantity, owner: str, scale: float, bound: float = 0.0, objective: int | None = None
    ) -> None:
        """Rows by which a quantity is at most `bound`, or at most the auxiliary variable `objective`."""
        own: dict[str, Any] = {"owner": owner, "side": "max", "scale": scale}

        def less(factor: float = 1.0) -> dict[str, Any]:
            aux = {} if objective is None else {objective: -factor}
            return own | {"upper": factor * bound, "aux": aux}

        column = q.integrands[0].column
        reduction = q.reduction
        if reduction == "max":
            self.rows += [PointRow(**less(), column=k) for k in self.columns.upper(column)]
        elif reduction == "peak":
            places = (self.columns.upper(column), 1.0), (self.columns.lower(column), -1.0)
            self.rows += [PointRow(**less(), column=k, factor=f) for those, f in places for k in those]
        elif reduction in ("mean", "rms"):
            self._mean(less(), column, 1.0, reduction == "rms")
        elif reduction == "energy_per_year":
            self._mean(less(), "power", 3600.0 * self.basis.operating_hours, False)
        elif reduction == "installed_power":
            self._mean(less(), "power", 1.0, True)
            power = self.columns.whole("power")
            over = self.basis.overload
            self.rows += [
                PointRow(**less(over) | {"scale": over * scale, "times": over}, column=power, factor=f)
                for f in (1.0, -1.0)
            ]
        elif reduction in ("range", "box.width", "box.height"):
            high, low = self.new_aux(scale), self.new_aux(scale)
            own |= {"upper": 0.0}
            for column in dict.fromkeys(each.column for each in q.integrands):
                k = self.columns.whole(column)
                self.rows.append(PointRow(**own, aux={high: -1.0}, column=k))
                self.rows.append(PointRow(**own, aux={low: 1.0}, column=k, factor=-1.0))
            aux = {high: 1.0, low: -1.0} | ({} if objective is None else {objective: -1.0})
            self.rows.append(AuxRow(**own | {"upper": bound, "aux": aux}))
        else:
            self.rows.append(ExtremeRow(**less(), terms=self._terms(q, 1.0)))

    def at_least(self, q: CycleQuantity, owner: str, scale: float, bound: float) -> None:
        """Rows by which a quantity is at least `bound`."""
        own: dict[str, Any] = {"owner": owner, "side": "min", "scale": scale, "upper": -bound}
        column = q.integrands[0].column
        reduction = q.reduction
        if reduction == "min":
            self.rows += [PointRow(**own, column=k, factor=-1.0) for k in self.columns.lower(column)]
        elif reduction in ("mean", "rms"):
            self._mean(own, column, -1.0, reduction == "rms")
        elif reduction == "energy_per_year":
            self._mean(own, "power", -3600.0 * self.basis.operating_hours, False)
        elif reduction == "installed_power":
            raise InputError("installed_power: has an upper limit only; leave min out")
        else:
            self.rows.append(ExtremeRow(**own, terms=self._terms(q, -1.0)))

    def exactly(self, q: CycleQuantity, owner: str, scale: float, bound: float) -> None:
        """The row by which a quantity is equal to `bound`."""
        first = len(self.rows)
        if q.reduction in ("mean", "rms", "energy_per_year", "installed_power"):
            self.at_least(q, owner, scale, bound)
            self.rows[first] = _equal(self.rows[first])
            return
        self.rows.append(ExtremeRow(owner, "min", -bound, scale, equal=True, terms=self._terms(q, -1.0)))

    def slack_free(self, columns: Sequence[str], owner: str, scale: float) -> None:
        """Rows by which the mean pull along each web, of those at its two ends, stays above 0 at the speeds of the
        slack-free range."""
        places = map(self.columns.mean, columns)
        self.rows += [PointRow(owner, "min", 0.0, scale, column=k, factor=-1.0, slack=True) for k in places]

    def _mean(self, own: dict[str, Any], column: str, factor: float, rms: bool) -> None:
        self.rows.append(MeanRow(**own, column=self.columns.whole(column), factor=factor, rms=rms))

    def _terms(self, q: CycleQuantity, factor: float) -> tuple[tuple[tuple[int, ...], Sense, float], ...]:
        terms = []
        for sense, sign in (("max", 1.0), ("min", -1.0), ("peak", 1.0)):
            places = tuple(self.columns.whole(i.column) for i in q.integrands if i.reduction == sense)
            if places:
                # a range is the largest less the least value
                terms.append((places, sense, factor * (sign if len(q.integrands) > 1 else 1.0)))
        return tuple(terms)  # type: ignore[arg-type]


def _equal(row: Row) -> Row:
    import dataclasses

    return dataclasses.replace(row, equal=True)
