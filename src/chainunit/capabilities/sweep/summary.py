"""A sweep in few numbers: reasons, extremes, best points, what moves what, and the spread by tolerances.

Extremes, best points and reasons are of all points, which are read in parts. Correlations and quantiles are of
`SAMPLE` points at most.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import zip_longest
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ...core.brief import briefly_shown
from ...core.quantities import percentage, quantity
from ...reading.results import OWN, Estimate, InUnit, part, result
from ...reading.text import shown_in
from ...study.cycle_quantities import CycleBasis
from ...study.limits import limit_reached
from ...study.organ_limits import SpeedLimit, limits_of_organs, passed_limits
from ...study.provenance import Heading
from ...study.quantiles import CONFIDENCE, quantile
from ...work.job import made_anew
from .plan import SweptParameter
from .points import SweepFindings
from .shares import LEAST_POINTS, Shares, shares_of_points, shares_on_grid
from .table import SPEED

if TYPE_CHECKING:
    import pandas as pd

BEST = 10
"""Number of best points."""
SAMPLE = 2**20
"""Largest number of points behind correlations and quantiles."""
QUANTILES = (0.01, 0.05, 0.5, 0.95, 0.99)
_METHODS = {"grid": "a grid", "latin_hypercube": "a Latin hypercube", "sobol": "Sobol's sequence"}
MOST_GAPS = 0.05
"""Share of points without a value from which on the shares of the variance are not defined."""
_LEAST = 8
"""Least number of points of a correlation."""


@result
class ReasonShare:
    """A reason for which points have no result."""

    reason: str = part("the reason")
    points: int = quantity("1", "number of points")
    share: float = percentage("share of all points")


@result
class OrganShare:
    """A limit of the crank speed for two bars as organs, of the study's machine and feed, which points pass."""

    limit: SpeedLimit = part(inline=True)
    points: int = quantity("1", "number of points beyond it")
    share: float = percentage("share of all points")


@result
class SweptRange:
    """The range of a swept parameter."""

    description: str = part("meaning of the parameter")
    unit: str
    kind: str
    low: float = part("least value", unit=OWN, name="from")
    high: float = part("largest value", unit=OWN, name="to")
    centre: float = part("value in the study", unit=OWN, name="study")
    tolerance: InUnit = part("tolerance, if there is one")
    distribution: str | None = part("distribution in the tolerance")


@result
class Influence:
    """What a parameter does to a result. Shares are None where they are not defined: with few points, and with many
    points without a value, as the others are no independent parameters any more."""

    rank: float = quantity("1", "rank correlation (Spearman)")
    share: Estimate | None = part(
        "share of the variance of the result that the parameter explains alone (first order), with its interval"
    )
    total: Estimate | None = part(
        "share that it explains alone and together with other parameters (total order), with its interval"
    )


@result
class ResultSpread:
    """The spread of a result over the points."""

    mean: InUnit = part("mean")
    deviation: InUnit = part("standard deviation")
    quantiles: Mapping[str, Estimate] = part(inline=True)


@result
class SweepSize:
    """How many points there are, and how they are chosen."""

    method: str = part("how the points are chosen")
    points: int = quantity("1", "number of points")
    states: float | None = quantity("1", "number of states of the machine that were computed")
    seed: int = quantity("1", "seed of the random numbers")
    angles: int = quantity("1", "number of crank angles of a turn")
    feasible: int = quantity("1", "number of points with results")


@result
class SweepSpread:
    """The spread of all results."""

    evenly: list[str] = part("parameters without a tolerance, which the spread counts as evenly distributed")
    spread: Mapping[str, ResultSpread] = part("spread by tolerances")
    confidence: float = part("confidence of the intervals", unit="1", kind="percent", default=CONFIDENCE)


@result
class PointStore:
    """The store of all points."""

    made_anew: str | None = part("a sentence on damaged batches")
    damaged_batches: int = quantity("1", "number of damaged batches, which were made anew")
    store: str = part("name of the store")


Row = Mapping[str, InUnit]
"""Number, parameters and results of a point."""


@result
class SweepSummary:
    """The numbers of a sweep: the content of its result.json."""

    findings: SweepFindings
    sample: Mapping[str, Any]
    """parameters and results at the points behind correlations and quantiles, shape (points,), without points that
    have a reason"""
    heading: Heading = part(inline=True)
    size: SweepSize = part(inline=True)
    reasons: list[ReasonShare] = part("why points have no result")
    organs: list[OrganShare] = part("limits of two bars as organs that points pass")
    basis: CycleBasis = part("assumptions behind installed power and energy")
    event: str | None = part("the event of the measures")
    best_by: str = part("the result by which points are best")
    parameters: Mapping[str, SweptRange] = part("the swept parameters")
    results: Mapping[str, Mapping[str, str]] = part("the meaning of each result")
    nominal: Row = part("quantities of a turn at the values of the study")
    extremes: Mapping[str, Mapping[str, Row]] = part(
        "the points where a result that has values is least and largest"
    )
    best: list[Row] = part("the best points, the best first")
    influences: Mapping[str, Mapping[str, Influence]] = part(
        "influence of each parameter on each result that varies"
    )
    gaps: Mapping[str, float] = part(
        "share of the points behind correlations at which a result has no value", unit="1", kind="percent"
    )
    current_limit: float | None = quantity(
        "A", "limit of the motor's current, where the largest current of the points is at it"
    )
    spread: SweepSpread = part(inline=True)
    store: PointStore = part(inline=True)

    def digits(self, name: str) -> int:
        """The number of significant digits, 4 to 12, with which a hundredth of the range of a parameter or result
        shows: one more than the powers of ten between that hundredth and the largest value."""
        low, high = 0.0, 0.0
        if name in self.extremes:
            low, high = (self.extremes[name][end][name].value for end in ("least", "largest"))
        elif name in self.parameters:
            low, high = self.parameters[name].low, self.parameters[name].high
        if not high > low:
            return 4
        largest = max(abs(low), abs(high))
        return min(12, max(4, 3 + math.ceil(math.log10(largest / (high - low)))))


@briefly_shown
@dataclass(frozen=True)
class SweptStudy:
    """A study whose sweep was run. Its numbers are made once, for report and Python, when they are asked for."""

    findings: SweepFindings

    @cached_property
    def summary(self) -> SweepSummary:
        """The numbers, with texts in the units of the study."""
        with shown_in(self.findings.config.units):
            return summary_of(self.findings)


def summary_of(findings: SweepFindings) -> SweepSummary:
    """The numbers of a sweep."""
    plan, config, task = findings.plan, findings.config, findings.task
    ends = _ends(findings)
    rows: dict[int, Row] = {
        number: {"point": InUnit(number, "1")} | {name: findings.in_unit(name, x) for name, x in row.items()}
        for number, row in ends.points.to_dict("index").items()
    }
    step = -(-plan.points // SAMPLE) if plan.is_grid else 1
    sampled = findings.points.isel(point=slice(None, step * SAMPLE, step))
    sound = sampled["reason"].values == 0
    sample = {name: sampled[name].values[sound] for name in findings.variables}
    gaps = {name: 1.0 - np.isfinite(sample[name]).sum() / len(sound) for name in findings.results}
    influences = _influences(findings, sample, gaps)
    # points are those of tolerances; a parameter without one is evenly distributed
    has_spread = not plan.is_grid and any(parameter.tolerance is not None for parameter in plan.parameters)
    evenly = [parameter.name for parameter in plan.parameters if parameter.tolerance is None]
    damaged, file = findings.outcome.damaged_batches, findings.outcome.file.name
    return SweepSummary(
        findings=findings,
        sample=sample,
        heading=Heading.of(config.title, config.file),
        size=SweepSize(
            method=_METHODS[plan.method],
            points=plan.points,
            states=float(plan.points) * plan.angles if plan.quantities else None,
            seed=plan.seed,
            angles=plan.angles,
            feasible=ends.counts[0],
        ),
        reasons=[
            ReasonShare(str(reason), count, count / plan.points)
            for reason, count in zip(task.reasons[1:], ends.counts[1:], strict=True)
            if count
        ],
        organs=_organs(findings),
        basis=plan.basis,
        event=config.events[plan.event].title if plan.event else None,
        best_by=f"{plan.best_is} {plan.best}",
        parameters={parameter.name: _range(parameter, plan.is_grid) for parameter in plan.parameters},
        results={name: {"description": findings.variables[name].description} for name in findings.results},
        nominal={name: findings.in_unit(name, x) for name, x in _nominal(findings).items()},
        extremes={
            name: {"least": rows[low], "largest": rows[high]} for name, (low, high) in ends.extremes.items()
        },
        best=[rows[k] for k in ends.best],
        influences=influences,
        gaps={name: gaps[name] for name in influences},
        current_limit=limit_reached(task.rig.drive, ends.points["current_peak"].dropna())
        if task.rig is not None and "current_peak" in ends.points
        else None,
        spread=SweepSpread(
            evenly if has_spread else [], dict(_spread(findings, sample)) if has_spread else {}
        ),
        store=PointStore(made_anew(damaged, "points", file) if damaged else None, damaged, file),
    )


class _Ends(NamedTuple):
    """The ends of all points: `counts` by the code of their reason; by result that has values, the numbers of the
    `points` with its least and its largest value (`extremes`); the numbers of the `best` ones, the best first."""

    counts: list[int]
    extremes: dict[str, tuple[int, int]]
    best: list[int]
    points: pd.DataFrame


def _ends(findings: SweepFindings) -> _Ends:
    """The ends of all points, which are read in parts; of the parts that went by only the ends stay in memory."""
    import pandas as pd

    plan = findings.plan
    counts = np.zeros(len(findings.task.reasons), np.int64)
    kept: list[pd.DataFrame] = []
    extremes, best = {}, []
    for begin, points in findings.parts([*findings.variables, "reason"]):
        counts += np.bincount(points["reason"].values, minlength=len(counts))
        frame = points.to_dataframe()[[*findings.variables]]
        frame.index += begin
        candidates = pd.concat([*kept, frame])
        present = [name for name in findings.results if np.isfinite(candidates[name]).any()]
        extremes = {n: (int(candidates[n].idxmin()), int(candidates[n].idxmax())) for n in present}
        ranked = candidates[plan.best][np.isfinite(candidates[plan.best])]
        best = (ranked if plan.best_is == "least" else -ranked).nsmallest(BEST).index.tolist()
        kept = [candidates.loc[sorted({*best, *(k for pair in extremes.values() for k in pair)})]]
    return _Ends(counts.tolist(), extremes, best, kept[0])


def _range(parameter: SweptParameter, is_grid: bool) -> SweptRange:
    """The range of a parameter, for the result."""
    v, (low, high) = parameter.variable, parameter.ends
    return SweptRange(
        description=v.description,
        unit=v.unit,
        kind=v.kind,
        low=low,
        high=high,
        centre=parameter.centre,
        tolerance=InUnit(parameter.tolerance, v.unit, "difference" if v.unit == "K" else v.kind),
        distribution=parameter.distribution if parameter.tolerance is not None and not is_grid else None,
    )


def _influences(
    findings: SweepFindings, sample: Mapping[str, Any], gaps: Mapping[str, float]
) -> dict[str, dict[str, Influence]]:
    """By result and parameter the influence; only results that vary."""
    from scipy.stats import rankdata

    plan = findings.plan
    ranks = {parameter.name: rankdata(sample[parameter.name]) for parameter in plan.parameters}
    influences: dict[str, dict[str, Influence]] = {}
    for name in findings.results:
        y = sample[name]
        has = np.isfinite(y)
        if has.sum() < _LEAST or np.ptp(y[has]) <= 1e-12 * np.max(np.abs(y[has])):
            continue
        order, shares = rankdata(y[has]), list[Shares]()
        varying = [parameter for parameter in plan.parameters if np.ptp(sample[parameter.name][has]) > 0.0]
        if plan.is_grid and len(y) == plan.points and has.all():
            shares = shares_on_grid(y.reshape([n for n in plan.shape if n > 1]))
        elif gaps[name] <= MOST_GAPS and has.sum() >= LEAST_POINTS:
            x = np.stack([sample[parameter.name][has] for parameter in varying], axis=1)
            shares = shares_of_points(varying, x, y[has])
        influences[name] = {
            parameter.name: Influence(
                float(np.corrcoef(ranks[parameter.name][has], order)[0, 1]), *(pair or (None, None))
            )
            for parameter, pair in zip_longest(varying, shares)
        }
    return influences


def _nominal(findings: SweepFindings) -> dict[str, float]:
    """The quantities of a turn at the values of the study, by name."""
    plan, task = findings.plan, findings.task
    turn = task.turns({parameter.name: np.array([parameter.centre]) for parameter in plan.parameters})
    values = {name: float(np.ravel(turn[name].values)[0]) for name in plan.quantities}
    return {name: x for name, x in values.items() if np.isfinite(x)}


def _organs(findings: SweepFindings) -> list[OrganShare]:
    """The limits of the crank speed for two bars as organs, each with the number and the share of the points that
    pass it; only limits that a point passes, and none where no result depends on the organs."""
    config, plan, task = findings.config, findings.plan, findings.task
    if config.machine.in_place:
        return []
    units = ["N"] if plan.measures else [q.unit for q in task.quantities]
    empties = bool(plan.event) and config.events[plan.event].empties
    limits = limits_of_organs(task.machine, config.feed, units, empties=empties)
    if limits and SPEED in findings.variables:
        counts = np.zeros(len(limits), np.int64)
        for _, points in findings.parts([SPEED]):
            counts += [np.count_nonzero(limit.passed(points[SPEED].values)) for limit in limits]
    else:
        # all points have the crank speed of the study
        limits = tuple(passed_limits(limits, task.crank_speed))
        counts = np.full(len(limits), plan.points)
    return [
        OrganShare(limit, int(count), int(count) / plan.points)
        for limit, count in zip(limits, counts, strict=True)
        if count
    ]


def _spread(findings: SweepFindings, sample: Mapping[str, Any]) -> Iterator[tuple[str, ResultSpread]]:
    """Mean, deviation and quantiles of each result that has finite values."""
    for name in findings.results:
        x, v = sample[name][np.isfinite(sample[name])], findings.variables[name]
        if len(x):
            sizes = ((f"q{100 * q:.0f}", quantile(x, q)) for q in QUANTILES)
            yield (
                name,
                ResultSpread(
                    findings.in_unit(name, float(np.mean(x))),
                    findings.in_unit(name, float(np.std(x))),
                    {key: replace(size, unit=v.unit, kind=v.kind) for key, size in sizes if size is not None},
                ),
            )
