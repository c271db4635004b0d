"""A sweep in few numbers: reasons, extremes, best points, what moves what, and the spread by tolerances.

Extremes, best points and reasons are of all points, which are read in parts. Correlations and quantiles are of
`SAMPLE` points at most.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ... import __version__
from ...batch.evaluate import StateReason
from ...core.quantities import Layout, Quantity, Variable
from ...reading.text import entry, shown_in
from ...study.limits import limit_reached
from ...study.measures import Answers
from ...study.organ_limits import limits_of_organs
from ...study.quantiles import CONFIDENCE, quantile
from ...study.verdict import SpeedLimit, passed_limits
from ...work.store import made_anew
from .points import SweepFindings
from .table import SPEED

if TYPE_CHECKING:
    import xarray as xr

SAMPLE = 2**20
"""Largest number of points behind correlations and quantiles."""
BEST = 10
"""Number of best points."""
QUANTILES = (0.01, 0.05, 0.5, 0.95, 0.99)
_METHODS = {"grid": "a grid", "latin_hypercube": "a Latin hypercube", "sobol": "Sobol's sequence"}
_PART = 2**18
_BINS = 16
_MOST_CLASSES = 64
_MOST_GAPS = 0.05
"""Share of points without a value from which on the shares of the variance are not defined."""
_LEAST = 8
"""Least number of points of a correlation."""


@dataclass(frozen=True)
class Influence:
    """What a parameter does to a result: their rank correlation (Spearman), and the share of the variance of the
    result that the parameter explains alone (the correlation ratio over classes of the parameter, less its bias). The
    share is None where it is within its own error, and where it is not defined: with many points without a value the
    others are no independent parameters any more."""

    rank: float
    share: float | None


@dataclass(frozen=True)
class SweepSummary:
    """The numbers of a sweep."""

    findings: SweepFindings

    @cached_property
    def variables(self) -> dict[str, Variable]:
        """Parameters and results by name."""
        own = {each.name: each.variable for each in self.findings.plan.parameters}
        for each in self.findings.task.quantities:
            own[each.name] = Variable(
                each.name, each.description, Quantity(each.unit, each.description, kind=each.kind)
            )
        measures = {v.name: v for v in Layout(Answers).variables}
        return own | {name: measures[name] for name in self.findings.plan.measures}

    @property
    def _sign(self) -> float:
        return -1.0 if self.findings.plan.best_is == "largest" else 1.0

    @property
    def _parameters(self) -> list[str]:
        return [each.name for each in self.findings.plan.parameters]

    def _parts(self) -> Iterator[tuple[int, xr.Dataset]]:
        """The points in parts, each with the number of its first point."""
        points = self.findings.points
        for begin in range(0, points.sizes["point"], _PART):
            yield begin, points.isel(point=slice(begin, begin + _PART)).load()

    @cached_property
    def _passed(self) -> tuple[Any, dict[str, tuple[int, int]], list[int]]:
        """Points by reason; the numbers of the points with the least and the largest value of each result; the
        numbers of the best points."""
        names = self.findings.results
        counts = np.zeros(len(self.findings.task.reasons), np.int64)
        ends: dict[str, list[tuple[float, int]]] = {name: [] for name in names}
        best: list[tuple[float, int]] = []
        for begin, part in self._parts():
            counts += np.bincount(part["reason"].values, minlength=len(counts))
            for name in names:
                x = part[name].values
                if np.isfinite(x).any():
                    ends[name] += [(float(x[k]), begin + int(k)) for k in (np.nanargmin(x), np.nanargmax(x))]
            x = self._sign * part[self.findings.plan.best].values
            order = np.argsort(x, kind="stable")[:BEST]
            best += [(float(x[k]), begin + int(k)) for k in order if np.isfinite(x[k])]
            best = sorted(best)[:BEST]
        extremes = {
            name: (min(of)[1], max(of, key=lambda each: (each[0], -each[1]))[1])
            for name, of in ends.items()
            if of
        }
        return counts, extremes, [k for _, k in best]

    @property
    def counts(self) -> dict[StateReason, int]:
        """Number of points without a result by reason, reasons without points left out."""
        counts = zip(self.findings.task.reasons, self._passed[0], strict=True)
        return {reason: int(count) for reason, count in list(counts)[1:] if count}

    @property
    def feasible(self) -> int:
        """Number of points with results."""
        return int(self._passed[0][0])

    @property
    def extremes(self) -> Mapping[str, tuple[int, int]]:
        """By result, the numbers of the points where it is least and largest; only results that have values."""
        return self._passed[1]

    @property
    def best(self) -> list[int]:
        """The numbers of the best points, the best first."""
        return self._passed[2]

    @cached_property
    def sample(self) -> dict[str, Any]:
        """Parameters and results at the points behind correlations and quantiles, shape (points,), without those that
        have a reason."""
        part = self._sampled
        sound = part["reason"].values == 0
        return {name: part[name].values[sound] for name in self.variables}

    @property
    def _sampled(self) -> xr.Dataset:
        points = self.findings.points
        step = -(-points.sizes["point"] // SAMPLE) if self.findings.plan.is_grid else 1
        return points.isel(point=slice(None, None, step)).isel(point=slice(0, SAMPLE))

    def gaps(self, name: str) -> float:
        """The share of the points behind correlations at which a result has no value."""
        return 1.0 - np.count_nonzero(np.isfinite(self.sample[name])) / self._sampled.sizes["point"]

    @property
    def undefined(self) -> dict[str, bool]:
        """By result that varies, whether shares of its variance are not defined."""
        return {name: self.gaps(name) > _MOST_GAPS for name in self.influences}

    @cached_property
    def influences(self) -> dict[str, dict[str, Influence]]:
        """By result and parameter the influence; only results that vary."""
        from scipy.stats import rankdata

        ranks = {name: rankdata(self.sample[name]) for name in self._parameters}
        table: dict[str, dict[str, Influence]] = {}
        for name in self.findings.results:
            y = self.sample[name]
            has = np.isfinite(y)
            if has.sum() < _LEAST or np.ptp(y[has]) <= 1e-12 * np.max(np.abs(y[has])):
                continue
            order = rankdata(y[has])
            defined = self.gaps(name) <= _MOST_GAPS
            table[name] = {
                each: Influence(
                    _correlation(ranks[each][has], order),
                    _sure_share(self.sample[each][has], y[has]) if defined else None,
                )
                for each in self._parameters
                if np.ptp(self.sample[each][has]) > 0.0
            }
        return table

    def digits(self, name: str) -> int:
        """The number of digits with which a hundredth of the range of a parameter or result shows."""
        ends = {each.name: each.ends for each in self.findings.plan.parameters}
        if name in self.extremes:
            part = self.findings.points[name].isel(point=list(self.extremes[name])).values
            ends[name] = (float(part[0]), float(part[1]))
        low, high = ends.get(name, (0.0, 1.0))
        if not high > low:
            return 4
        return min(12, max(4, 3 + math.ceil(math.log10(max(abs(low), abs(high)) / (high - low)))))

    @cached_property
    def nominal(self) -> dict[str, float]:
        """The quantities of a turn at the values of the study, by name."""
        plan, task = self.findings.plan, self.findings.task
        turn = task.turns({each.name: np.array([each.centre]) for each in plan.parameters})
        values = {name: float(np.ravel(turn[name].values)[0]) for name in plan.quantities}
        return {name: x for name, x in values.items() if np.isfinite(x)}

    @cached_property
    def organs(self) -> list[tuple[SpeedLimit, int]]:
        """The limits of the crank speed for two bars as organs, of the study's machine and feed, each with the number
        of points beyond it; only those that a point passes, and none where no result depends on the organs."""
        config, plan, task = self.findings.config, self.findings.plan, self.findings.task
        if config.machine.in_place:
            return []
        units = ["N"] if plan.measures else [self.variables[name].unit for name in plan.quantities]
        empties = bool(plan.event) and config.events[plan.event].empties
        limits = limits_of_organs(task.machine, config.feed, units, empties=empties)
        if not limits or SPEED not in self._parameters:
            return [(each, plan.points) for each in passed_limits(limits, task.crank_speed)]
        counts, all_speeds = np.zeros(len(limits), np.int64), self.findings.points[SPEED]
        for begin in range(0, plan.points, _PART):
            speeds = all_speeds.isel(point=slice(begin, begin + _PART)).values
            counts += [np.count_nonzero(each.passed(speeds)) for each in limits]
        return [(each, int(count)) for each, count in zip(limits, counts, strict=True) if count]

    @cached_property
    def current_limit(self) -> float | None:
        """The limit of the motor's current [A], where the largest current of the points is at it."""
        rig, name = self.findings.task.rig, "current_peak"
        if rig is None or name not in self.extremes:
            return None
        largest = float(self.findings.points[name].isel(point=self.extremes[name][1]).values)
        return limit_reached(rig.drive, [largest])

    @property
    def has_spread(self) -> bool:
        """Whether points are those of tolerances; see `evenly` on the other parameters."""
        plan = self.findings.plan
        return not plan.is_grid and any(each.tolerance is not None for each in plan.parameters)

    @property
    def evenly(self) -> list[str]:
        """The parameters without a tolerance, which the spread counts as evenly distributed."""
        plan = self.findings.plan
        return [each.name for each in plan.parameters if each.tolerance is None] if self.has_spread else []

    def as_dict(self) -> dict[str, Any]:
        """Ready for JSON, each number with its unit."""
        with shown_in(self.findings.config.units):
            return self._as_dict()

    def _as_dict(self) -> dict[str, Any]:
        config, plan = self.findings.config, self.findings.plan
        outcome = self.findings.outcome
        damaged = outcome.damaged_batches
        rows = self._rows(sorted({*self.best, *(k for ends in self.extremes.values() for k in ends)}))
        return {
            "chainunit": __version__,
            "title": config.title,
            "source": config.source,
            "report": dict(config.labels),
            "method": _METHODS[plan.method],
            "points": entry(plan.points, "1"),
            "states": entry(float(plan.points) * plan.angles if plan.quantities else None, "1"),
            "seed": entry(plan.seed, "1"),
            "angles": entry(plan.angles, "1"),
            "feasible": entry(self.feasible, "1"),
            "reasons": [
                {
                    "reason": str(reason),
                    "points": entry(count, "1"),
                    "share": entry(count / plan.points, "1", "percent"),
                }
                for reason, count in self.counts.items()
            ],
            "organs": [
                {
                    "topic": limit.topic,
                    "text": limit.words,
                    "limit": entry(limit.speed, "rad/s", "speed"),
                    "points": entry(count, "1"),
                    "share": entry(count / plan.points, "1", "percent"),
                }
                for limit, count in self.organs
            ],
            "basis": {name: entry(x, "1") for name, x in vars(plan.basis).items()},
            "event": config.events[plan.event].title if plan.event else None,
            "best_by": f"{plan.best_is} {plan.best}",
            "parameters": {
                each.name: {
                    "description": each.variable.description,
                    **{
                        key: self._entry(each.name, x)
                        for key, x in (("from", each.ends[0]), ("to", each.ends[1]), ("study", each.centre))
                    },
                    "tolerance": self._tolerance(each),
                    "distribution": each.distribution
                    if each.tolerance is not None and not plan.is_grid
                    else None,
                }
                for each in plan.parameters
            },
            "results": {
                name: {"description": self.variables[name].description} for name in self.findings.results
            },
            "nominal": {name: self._entry(name, x) for name, x in self.nominal.items()},
            "extremes": {
                name: {"least": rows[low], "largest": rows[high]}
                for name, (low, high) in self.extremes.items()
            },
            "best": [rows[k] for k in self.best],
            "influences": {
                name: {
                    each: {"rank": entry(of.rank, "1"), "share": entry(of.share, "1", "percent")}
                    for each, of in table.items()
                }
                for name, table in self.influences.items()
            },
            "gaps": {name: entry(self.gaps(name), "1", "percent") for name in self.influences},
            "current_limit": entry(self.current_limit, "A"),
            "evenly": self.evenly,
            "spread": self._spread() if self.has_spread else {},
            "confidence": entry(CONFIDENCE, "1", "percent"),
            "made_anew": made_anew(damaged, "points", outcome.file.name) if damaged else None,
            "damaged_batches": entry(damaged, "1"),
            "store": self.findings.outcome.file.name,
        }

    def _entry(self, name: str, value: float | None) -> dict[str, Any]:
        v = self.variables[name]
        return entry(value, v.unit, v.kind)

    def _tolerance(self, parameter: Any) -> dict[str, Any]:
        v = parameter.variable
        return entry(parameter.tolerance, v.unit, "difference" if v.unit == "K" else v.kind)

    def _rows(self, numbers: list[int]) -> dict[int, dict[str, Any]]:
        """Points by their numbers: parameters and results."""
        part = self.findings.points.isel(point=numbers).load() if numbers else None
        return {
            number: {"point": entry(number, "1")}
            | {name: self._entry(name, float(part[name].values[k])) for name in self.variables}
            for k, number in enumerate(numbers)
            if part is not None
        }

    def _spread(self) -> dict[str, Any]:
        spread = {}
        for name in self.findings.results:
            x = self.sample[name][np.isfinite(self.sample[name])]
            if not len(x):
                continue
            estimates = {f"q{100 * q:.0f}": quantile(x, q) for q in QUANTILES}
            v = self.variables[name]
            spread[name] = {
                "mean": self._entry(name, float(np.mean(x))),
                "deviation": self._entry(name, float(np.std(x))),
                **{key: each.as_dict(v.unit, v.kind) for key, each in estimates.items() if each is not None},
            }
        return spread


def _correlation(a: Any, b: Any) -> float:
    a, b = a - np.mean(a), b - np.mean(b)
    size = np.sqrt(np.sum(a * a) * np.sum(b * b))
    return float(np.sum(a * b) / size) if size > 0.0 else 0.0


def _sure_share(x: Any, y: Any) -> float | None:
    """The share of `_explained`; None where it is within its error."""
    share, error = _explained(x, y)
    return share if share > error else None


def _explained(x: Any, y: Any) -> tuple[float, float]:
    """The share of the variance of `y` that is one of classes of `x`, between 0 and 1, corrected for the number of
    classes; and its error: two standard deviations of the share of an `x` that explains nothing."""
    values, bins = np.unique(x), min(_BINS, round(math.sqrt(len(x))))
    # the values of a grid are classes themselves
    repeat = len(values) <= max(bins, len(x) // 4) and len(values) <= _MOST_CLASSES
    edges = values if repeat else np.quantile(x, np.arange(bins) / bins)
    place = np.searchsorted(edges, x, "right") - 1
    count = np.bincount(place, minlength=len(edges))
    used = count > 0
    means = np.bincount(place, y, len(edges))[used] / count[used]
    between = np.sum(count[used] * (means - np.mean(y)) ** 2) / np.sum((y - np.mean(y)) ** 2)
    freedom, count_less_one = np.count_nonzero(used) - 1, max(1, len(y) - 1)
    chance = freedom / count_less_one
    if chance >= 1.0:
        return 0.0, 1.0
    share = min(1.0, max(0.0, (between - chance) / (1.0 - chance)))
    return float(share), 2.0 * math.sqrt(2.0 * freedom) / count_less_one / (1.0 - chance)
