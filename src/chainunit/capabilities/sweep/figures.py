"""The figures of a sweep: maps over two parameters, curves over one, influences, and the spread."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator, Sequence
from itertools import pairwise, zip_longest
from typing import Any

import numpy as np

from ...core.quantities import Variable
from ...reading.text import number
from ...report import figure as fig
from ...report.style import WIDE
from .points import plain_name
from .summary import SweepSummary

_CLASSES = 7
_MOST_VALUES = 0.9  # share of the values that one class of a map may hide
_MOST_ROWS, _MOST_PANELS = 6, 8
_MOST_OF_AXIS = 400
"""Largest numbers of panels of a figure, of rows and of both columns, and of values on an axis of a map."""
_NARROW = 80
"""Letters of a reason in a legend."""


def _numbered(name: str, items: Sequence[Any], size: int) -> Iterator[tuple[str, str, Sequence[Any]]]:
    """The items in figures of this size at most: name and file of each figure, and its items."""
    for k, first in enumerate(range(0, len(items), size)):
        file = f"sweep_{name}_{k + 1}.png" if k else f"sweep_{name}.png"
        yield f"{name}-{k}" if k else name, file, items[first : first + size]


def _axis(v: Variable, **more: Any) -> fig.Axis:
    return fig.Axis(v.name, v.unit, v.kind, **more)


def over_parameters(summary: SweepSummary) -> Iterator[fig.Figure]:
    """Maps of a grid over two parameters, curves over one parameter; none over more."""
    plan = summary.findings.plan
    if len(plan.parameters) == 1:
        yield from _curves(summary)
    elif plan.is_grid and len(plan.parameters) == 2:
        for name in summary.findings.results:
            if name in summary.extremes:
                yield _map(summary, name)


def _levels(z: Any) -> tuple[float, ...]:
    """Even levels around the finite values, in rounded steps, at most `_CLASSES` + 1; levels that grow where values
    reach over decades, or where most of them would stand in one even class."""
    low, below_most, high = (float(level) for level in np.nanquantile(z, (0.0, _MOST_VALUES, 1.0)))
    if not high - low > 1e-9 * max(abs(low), abs(high)):
        # all values are equal
        margin = max(abs(low), 1e-9)
        return (low - margin, low, low + margin)
    exact_step = (high - low) / _CLASSES
    if low > 0.0 and (high > WIDE * low or (below_most < low + exact_step and high > 4.0 * low)):
        return _wide_levels(low, high)
    power_of_ten = 10.0 ** np.floor(np.log10(exact_step))
    for factor in (1.0, 2.0, 2.5, 5.0, 10.0, 20.0, 25.0, 50.0):
        step = factor * power_of_ten
        first, last = np.floor(low / step + 1e-9), np.ceil(high / step - 1e-9)
        if last - first <= _CLASSES:
            break
    return tuple(float(step * k) for k in np.arange(first, max(last, first + 2) + 1))


def _wide_levels(low: float, high: float) -> tuple[float, ...]:
    """Levels around values of several decades: 1, 2, 5, 10, .., or the powers of 10, or some of these."""
    decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    for steps in ((1.0, 2.0, 5.0), (1.0, 3.0), (1.0,)):
        levels = [step * 10.0**k for k in decades for step in steps]
        first = max(k for k, x in enumerate(levels) if x <= low)
        last = min(k for k, x in enumerate(levels) if x >= high)
        if last - first <= _CLASSES:
            return tuple(levels[first : last + 1])
    thinned = {*levels[first : last : -(-(last - first) // _CLASSES)], levels[last]}
    return tuple(sorted(thinned))


def _map(summary: SweepSummary, name: str) -> fig.Figure:
    """The map of a result over two parameters; a long axis is thinned."""
    plan, dataset = summary.findings.plan, summary.findings.dataset
    across, up = plan.parameters
    order = {
        parameter.name: np.argsort(parameter.values)[:: -(-len(parameter.values) // _MOST_OF_AXIS)]
        for parameter in plan.parameters
    }
    part = dataset.isel(order).transpose(up.name, across.name)
    x, y, z = part[across.name].values, part[up.name].values, part[name].values
    v, levels = summary.findings.variables[name], _levels(part[name].values)
    names = tuple(
        f"{number(low, v.unit, v.kind, full=False, beside=False)} to "
        f"{number(high, v.unit, v.kind, full=False, beside=False)}"
        for low, high in pairwise(levels)
    )
    items: list[fig.Item] = [fig.Field(x, y, z, levels, names)]
    items += _infeasible(summary, x, y, part["reason"].values)
    items.append(fig.Curve("the study", [across.centre], [up.centre], 1, "o", has_line=False))
    if summary.best and name == plan.best:
        best = summary.best[0][across.name].value, summary.best[0][up.name].value
        items.append(fig.Curve(plan.best_is, [best[0]], [best[1]], 3, "s", has_line=False))
    ends = [{"low": float(axis[0]), "high": float(axis[-1])} for axis in (x, y)]
    panel = fig.Panel(_axis(across.variable, **ends[0]), _axis(up.variable, **ends[1]), tuple(items))
    return fig.Figure(
        f"map-{plain_name(name)}",
        f"Map of {name}: {v.description}",
        f"Map of {name} over {across.name} and {up.name}; points without a result are hatched.",
        ((panel,),),
        file=f"sweep_{plain_name(name)}.png",
        heights=(1.7,),
    )


def _reason(summary: SweepSummary, code: Any) -> str:
    """The reason with that code, as a legend has it."""
    return textwrap.shorten(str(summary.findings.task.reasons[int(code)]), _NARROW, placeholder=" ...")


def _infeasible(summary: SweepSummary, x: Any, y: Any, reason: Any) -> Iterator[fig.Hatch]:
    """The cells of a map with a corner that has no result, by their reasons."""
    worst = np.max([reason[:-1, :-1], reason[1:, :-1], reason[:-1, 1:], reason[1:, 1:]], axis=0)
    for look, code in enumerate(np.unique(worst[worst > 0])):
        yield fig.Hatch(_reason(summary, code), x, y, worst == code, look)


def _curves(summary: SweepSummary) -> Iterator[fig.Figure]:
    """The results over the only parameter, some rows of panels a figure; many points are thinned."""
    findings = summary.findings
    (parameter,), points = findings.plan.parameters, findings.points
    part = points.isel(point=slice(None, None, -(-points.sizes["point"] // 20_000)))
    part = part.isel(point=np.argsort(part[parameter.name].values, kind="stable"))
    x = part[parameter.name].values
    marks: list[fig.Item] = [
        fig.Mark(parameter.centre, "the study", look="mark"),
        *_gaps(summary, x, part["reason"].values),
    ]
    dots = "o" if len(x) <= 40 else ""
    names = [name for name in findings.results if name in summary.extremes]
    for figure_name, file, shown_names in _numbered("curves", names, _MOST_ROWS):
        rows = []
        for name in shown_names:
            curve = fig.Curve(name, x, part[name].values, 0, dots, in_legend=False)
            rows.append((_axis(findings.variables[name]), [curve, *marks]))
        yield fig.Figure(
            figure_name,
            f"Results over {parameter.name}: {parameter.variable.description}",
            f"Results over {parameter.name}; ranges without a result are shaded.",
            fig.stacked(_axis(parameter.variable), rows),
            file=file,
        )


def _gaps(summary: SweepSummary, x: Any, reason: Any) -> Iterator[fig.Shade]:
    """The ranges of a parameter without a result."""
    for rows in np.split(np.arange(len(x)), np.flatnonzero(np.diff(reason)) + 1):
        first, last = rows[0], rows[-1]
        if code := reason[first]:
            low, high = x[max(0, first - 1)], x[min(len(x) - 1, last + 1)]
            look = ("dark", "pale", "band")[code % 3]
            yield fig.Shade(0.5 * (x[first] + low), 0.5 * (x[last] + high), _reason(summary, code), look=look)


def _in_pairs(panels: list[fig.Panel]) -> tuple[tuple[fig.Panel | None, ...], ...]:
    """Panels in rows of two; a panel alone has the whole width."""
    if len(panels) == 1:
        return ((panels[0],),)
    return tuple(zip_longest(panels[::2], panels[1::2]))


def tornado(summary: SweepSummary) -> Iterator[fig.Figure]:
    """Bars of the rank correlation of each result with each parameter, the largest share of the variance first; none
    of two parameters."""
    parameters = summary.findings.plan.parameters
    results = list(summary.influences.items()) if len(parameters) > 2 else []
    for figure_name, file, shown_results in _numbered("tornado", results, _MOST_PANELS):
        panels = []
        for name, influences in shown_results:
            size = {
                parameter: (influence.share.value if influence.share else 0.0, abs(influence.rank))
                for parameter, influence in influences.items()
            }
            order = sorted(influences, key=size.__getitem__, reverse=True)
            shares = [influences[parameter].share for parameter in order]
            labels = tuple("" if x is None else f"{100.0 * x.value:.0f} %" for x in shares)
            ranks = [influences[parameter].rank for parameter in order]
            bars = fig.Bars("rank correlation", np.arange(len(order)), ranks, 0.7, 1, words=labels)
            # beside the longest bars there is room for the words
            x = fig.Axis("rank correlation", low=-1.3, high=1.3, ticks=(-1.0, -0.5, 0.0, 0.5, 1.0))
            y = fig.Axis("parameter", names=tuple(order))
            panels.append(fig.Panel(x, y, (bars, fig.Mark(0.0)), name))
        rows = _in_pairs(panels)
        yield fig.Figure(
            figure_name,
            "Which parameter moves what; beside the bars shares of the variance that they explain alone",
            "Bars of the rank correlation between each result and each parameter.",
            rows,
            file=file,
            heights=(max(0.6, 0.16 * len(parameters)),) * len(rows),
        )


def distribution(summary: SweepSummary) -> Iterator[fig.Figure]:
    """The share of the points below each value of each result; none of a sweep without a spread."""
    shares, sample = np.linspace(0.0, 1.0, 201), summary.sample
    names = [name for name in summary.influences if summary.spread.spread and len(sample[name])]
    for figure_name, file, shown_names in _numbered("spread", names, _MOST_PANELS):
        panels = []
        for name in shown_names:
            x = np.quantile(sample[name][np.isfinite(sample[name])], shares)
            items: list[fig.Item] = [fig.Curve("share of the points below", x, shares, in_legend=False)]
            items += [fig.Mark(q, "5 %, 95 %", axis="y", look="thin") for q in (0.05, 0.95)]
            if name in summary.nominal:
                items.append(fig.Mark(summary.nominal[name].value, "at the values of the study"))
            y = fig.Axis("share below", "1", "percent", low=0.0, high=1.0)
            panels.append(fig.Panel(_axis(summary.findings.variables[name]), y, tuple(items)))
        yield fig.Figure(
            figure_name,
            "Distribution of the results",
            "The share of the points below each value of each result.",
            _in_pairs(panels),
            file=file,
        )
