"""The report on a sweep: best points, extremes, influences, spread, and maps or curves."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from numbers import Integral
from pathlib import Path
from typing import Any

from ...core.errors import InputError, shown
from ...reading.results import as_data
from ...reading.text import shown_in
from ...report import blocks as b
from ...report.cited import cited, estimate, exact, number, source_line, table
from ...report.lines import Line, Name, filled, join, line
from ...report.task import Task
from ...study.config import Config
from ...work.progress import TaskProgress
from . import figures as sweep_figures
from .points import run_sweep
from .summary import MOST_GAPS, Influence, SweepSummary, SweptRange, SweptStudy

_MOST_COLUMNS = 8
"""Columns of a table on the terminal."""


def report(swept: SweptStudy) -> b.Report:
    """The report on a sweep."""
    summary, config = swept.summary, swept.findings.config
    x = cited(summary)
    spread_heading = "Spread by tolerances" + (" and ranges" if summary.spread.evenly else "")
    with shown_in(config.units):
        influences = (*_influences(x), *sweep_figures.tornado(summary))
        spread = (*_spread(x), *sweep_figures.distribution(summary))
        sections = (
            b.Section("influences", "Which parameter moves what", influences),
            b.Section("best", "Points in order", tuple(_best(x))),
            b.Section("extremes", "Extremes", tuple(_extremes(x))),
            b.Section("maps", "Results over the parameters", tuple(sweep_figures.over_parameters(summary))),
            b.Section("spread", spread_heading, spread),
            b.Section("basis", "Basis of the numbers", tuple(_basis(x, config.machine.model.driver_noun))),
        )
        return b.Report(
            config.title,
            "Sweep",
            as_data(summary),
            tuple(_opening(x)),
            sections,
            source=source_line(x.heading),
            units=config.units,
            opening_title="The sweep",
        )


def _compute(
    config: Config,
    folder: Path,
    progress: TaskProgress,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    engine: str = "native",
) -> SweptStudy:
    """Run the sweep of a study; a store in the folder that fits is continued. Errors are those of `run_sweep`, and an
    InputError for a number of workers that is none."""
    if workers is not None and (
        isinstance(workers, bool) or not isinstance(workers, Integral) or workers < 1
    ):
        raise InputError(f"workers = {shown(workers)}: must be a whole number >= 1")
    return SweptStudy(run_sweep(config, folder, progress, workers, scheduler, engine))


def _store_in(swept: SweptStudy, folder: Path) -> Path:
    """The store of all points, which is written while the sweep runs."""
    return folder / swept.findings.outcome.file.name


def _opening(x: SweepSummary) -> Iterator[b.Block]:
    """The size of the sweep, points without results, and limits of the organs."""
    ranges = join(_range(name, swept) for name, swept in x.parameters.items())
    size = "{} points, {}, over {}; {} of them have results."
    yield b.Text(filled(size, exact(x.size.points), x.size.method, ranges, exact(x.size.feasible)))
    for gap in x.reasons:
        yield b.Judgement(
            "warning", filled("No result at {} of the points: {}.", number(gap.share), gap.reason)
        )
    for organs in x.organs:
        beyond = "{}: {} of the points. The limit of the study's machine and feed is {}."
        text = filled(beyond, organs.limit.words, number(organs.share), number(organs.limit.speed))
        yield b.Judgement("warning", text)
    if not exact(x.size.feasible).value:
        yield b.Judgement("bad", "No point of the sweep has a result; take other ranges.", form="both")


def _range(name: str, swept: SweptRange) -> Line:
    """A parameter with the range that is swept, or with its tolerance."""
    tolerance = exact(swept.tolerance)
    if tolerance.value is None:
        return filled("{} {} to {}", Name(name), exact(swept.low), exact(swept.high))
    return filled("{} {} ± {}", Name(name), exact(swept.centre), tolerance)


def _columns(names: Iterable[str]) -> tuple[b.Column, ...]:
    """Columns of parameters or results."""
    return tuple(
        b.Column(Name(name), form="both" if k < _MOST_COLUMNS else "long") for k, name in enumerate(names)
    )


def _best(x: SweepSummary) -> Iterator[b.Block]:
    """The best points with their parameters and results."""
    names = [*x.parameters, *x.results]
    rows = []
    for k, point in enumerate(x.best):
        numbers = (number(point[name], x.digits(name)) for name in names)
        rows.append(b.TableRow((exact(point["point"]), *numbers), form="both" if k < 5 else "long"))
    if rows:
        first = 1 + len(x.parameters)
        groups = (tuple(range(1, first)), tuple(range(first, 1 + len(names))))
        title = filled("Points with the {} first", x.best_by)
        yield b.Table(tuple(rows), (b.Column("point"), *_columns(names)), title=title, groups=groups)


def _extremes(x: SweepSummary) -> Iterator[b.Block]:
    """The points with the least and with the largest value of each result."""
    rows = []
    for name, ends in x.extremes.items():
        for end, point in ends.items():
            numbers = (number(point[column], x.digits(column)) for column in (name, *x.parameters))
            rows.append(b.TableRow((line(Name(name), f", {end}"), *numbers)))
    if rows:
        heads = (b.Column("result"), b.Column("value"), *_columns(x.parameters))
        yield b.Table(
            tuple(rows), heads, title="Least and largest values, and the points at which they stand"
        )


def _influences(x: SweepSummary) -> Iterator[b.Block]:
    """The influence of each parameter on each result: rank correlation, and shares of the variance if they are
    known."""
    if not x.influences or len(x.parameters) < 2:
        return
    for name, row in x.influences.items():
        shares = {key: number(influence.share.value) for key, influence in row.items() if influence.share}
        if len(shares) == len(row):
            most = max(shares, key=lambda parameter: shares[parameter].value or 0.0)
            sentence = "{}: {} moves it most; alone it explains {} of the variance."
            yield b.Text(filled(sentence, Name(name), Name(most), shares[most]), form="long")

    def rank(influence: Influence) -> Line:
        size = number(influence.rank, 2)
        return filled("{} ({})", size, number(influence.share.value, 2)) if influence.share else size

    has_shares = any(influence.share for row in x.influences.values() for influence in row.values())
    title = "Rank correlation"
    if has_shares:
        title += "; in brackets the share of the variance that the parameter explains alone"
    yield _influence_table(x, {"": rank}, title=title)
    wide = {name: gap for name, gap in x.gaps.items() if (number(gap).value or 0.0) > MOST_GAPS}
    if wide:
        sentence = (
            "No shares of the variance: up to {} of the points have no value, and the parameters of the others are "
            "not independent."
        )
        yield b.Text(
            filled(sentence, max(map(number, wide.values()), key=lambda gap: gap.value or 0.0)), "note"
        )
    if has_shares:
        yield _influence_table(
            x,
            {
                ", alone": lambda influence: estimate(influence.share) if influence.share else "-",
                ", in all": lambda influence: estimate(influence.total) if influence.total else "-",
            },
            title="Shares of the variance: of a parameter alone, and in all with what it does together with others",
            form="long",
        )
    yield b.Text(
        "A rank correlation of 1 or -1: the result only rises or only falls with the parameter. Near 0 with a large "
        "share: it rises and falls. Shares that add up to less than 100 %: the parameters act together.",
        "fine",
        "long",
    )


def _influence_table(
    x: SweepSummary, cells: Mapping[str, Callable[[Influence], Line]], **more: Any
) -> b.Table:
    """A table with a column for each result, and for each parameter a row for each kind of cell; `cells` has them by
    the words behind the name of the parameter."""
    rows = []
    for parameter in x.parameters:
        for kind, cell in cells.items():
            title = line(Name(parameter), kind) if kind else Name(parameter)
            values = (cell(row[parameter]) if parameter in row else "-" for row in x.influences.values())
            rows.append(b.TableRow((title, *values)))
    return b.Table(tuple(rows), (b.Column("parameter"), *_columns(x.influences)), **more)


def _spread(x: SweepSummary) -> Iterator[b.Block]:
    """Mean, deviation and quantiles of each result of a sweep with tolerances."""
    spread = x.spread.spread
    if not spread:
        return
    keys = list(dict.fromkeys(key for numbers in spread.values() for key in numbers.quantiles))
    rows = []
    for name, numbers in spread.items():
        digits, quantiles = x.digits(name), numbers.quantiles
        nominal = number(x.nominal[name], digits) if name in x.nominal else "-"
        cells = (number(quantiles[key].value, digits) if key in quantiles else "-" for key in keys)
        mean, deviation = number(numbers.mean, digits), number(numbers.deviation)
        rows.append(b.TableRow((Name(name), nominal, mean, deviation, *cells)))
    columns = (
        b.Column("result"),
        b.Column("at the study's values", "study"),
        b.Column("mean"),
        b.Column("standard deviation", "deviation"),
        *(b.Column(f"{key.removeprefix('q')} %") for key in keys),
    )
    groups = ((1, 2, 3), tuple(range(4, len(columns))))
    yield b.Table(tuple(rows), columns, title="Spread of the results and their quantiles", groups=groups)
    if x.spread.evenly:
        ranges = join(Name(str(name)) for name in x.spread.evenly)
        verb = " has no tolerance" if len(x.spread.evenly) == 1 else " have no tolerance"
        yield b.Text(
            line(ranges, verb, ": the spread counts each of their values as equally frequent."), "note"
        )
    yield b.Text(
        filled(
            "result.json has the interval of {} confidence of each quantile, as for points that are drawn "
            "independently; points that fill the space evenly are more exact.",
            exact(x.spread.confidence),
        ),
        "fine",
        "long",
    )


def _basis(x: SweepSummary, driver: str) -> Iterator[b.Block]:
    """The swept parameters, the results, and the assumptions behind them."""
    yield from table(
        x.parameters.items(),
        ("parameter", lambda row: Name(row[0])),
        ("meaning", lambda row: row[1].description),
        ("in the study", lambda row: exact(row[1].centre)),
        ("from", lambda row: exact(row[1].low)),
        ("to", lambda row: exact(row[1].high)),
        ("tolerance", lambda row: exact(row[1].tolerance)),
        title="Swept quantities; all others have their values of the study",
        form="long",
    )
    yield from table(
        x.results.items(),
        ("result", lambda row: Name(row[0])),
        ("meaning", lambda row: row[1]["description"]),
        title="Results",
        numeric=False,
        form="long",
    )
    plan = x.findings.plan
    if plan.quantities:
        held = (
            f"Quantities of a turn hold at constant speed of the {driver} with the feed of normal running, at {{}} "
            f"{driver} angles; extremes are those at these angles."
        )
        yield b.Text(filled(held, exact(x.size.angles)), "note", "long")
    if {"installed_power", "energy_per_year"} & set(plan.quantities):
        assumed = "Assumed: {} operating hours in a year, permitted overload {}."
        hours, overload = exact(x.basis.operating_hours), exact(x.basis.overload)
        yield b.Text(filled(assumed, hours, overload), "note")
    if plan.measures:
        run = (
            "Measures are of a run in which {}: from rest to steady running, then the event, each point by itself, "
            "with the control as tuned for the values of the study."
        )
        yield b.Text(filled(run, x.event or ""), "note")
    limit = exact(x.current_limit)
    if limit.value is not None:
        limited = "The current is at its limit, {}, at the points with the largest current_peak."
        yield b.Text(filled(limited, limit), "note")
    if x.store.made_anew:
        yield b.Text(line(x.store.made_anew, "."), "note")
    yield b.Text(filled("All points: {} (NetCDF).", x.store.store), "fine", "long")


TASK: Task[Config, SweptStudy] = Task(
    "sweep",
    _compute,
    report,
    content=SweepSummary,
    files=("sweep_*.png",),
    writers=lambda swept, report, folder, of_report: [*of_report, lambda: [_store_in(swept, folder)]],
    kept=lambda swept, folder: [_store_in(swept, folder)],
    shortfall=lambda swept: None if swept.summary.size.feasible else "",
)
