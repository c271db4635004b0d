"""The report on a sweep: best points, extremes, influences, spread, and maps or curves."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from numbers import Integral
from pathlib import Path

from ...core.errors import InputError, shown
from ...reading.results import as_data
from ...reading.text import shown_in
from ...report import blocks as b
from ...report.cited import cited, estimate, exact, number, source_line, table
from ...report.lines import Line, Name, Number, filled, join, line
from ...report.task import Task
from ...study.config import Config
from ...work.progress import TaskProgress
from . import figures as sweep_figures
from .points import run_sweep
from .summary import MOST_GAPS, Influence, Row, SweepSummary, SweptRange, SweptStudy

_MOST_COLUMNS = 8
"""Columns of a table on the terminal."""


def report(swept: SweptStudy) -> b.Report:
    """The report on a sweep."""
    summary, config = swept.summary, swept.findings.config
    x, driver = cited(summary), config.machine.model.driver_noun
    with shown_in(config.units):
        sections = (
            b.Section("influences", "Which parameter moves what", tuple(_influences(x, summary))),
            b.Section("best", "Points in order", tuple(_best(x, summary))),
            b.Section("extremes", "Extremes", tuple(_extremes(x, summary))),
            b.Section("maps", "Results over the parameters", tuple(sweep_figures.over_parameters(summary))),
            b.Section("spread", _spread_heading(summary), tuple(_spread(x, summary))),
            b.Section("basis", "Basis of the numbers", tuple(_basis(x, summary, driver))),
        )
        return b.Report(
            config.title,
            "Sweep",
            as_data(summary),
            tuple(_opening(x, summary)),
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


def _opening(x: SweepSummary, summary: SweepSummary) -> Iterator[b.Block]:
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
    if not summary.size.feasible:
        yield b.Judgement("bad", "No point of the sweep has a result; take other ranges.", form="both")


def _range(name: str, swept: SweptRange) -> Line:
    tolerance = exact(swept.tolerance)
    if tolerance.value is None:
        return filled("{} {} to {}", Name(name), exact(swept.low), exact(swept.high))
    return filled("{} {} ± {}", Name(name), exact(swept.centre), tolerance)


def _columns(names: list[str]) -> tuple[b.Column, ...]:
    """Columns of parameters or results."""
    return tuple(
        b.Column(Name(name), form="both" if k < _MOST_COLUMNS else "long") for k, name in enumerate(names)
    )


def _value(summary: SweepSummary, row: Row, name: str) -> Number:
    """A value of a parameter or result, with so many digits that points differ."""
    return number(row[name], summary.digits(name))


def _best(x: SweepSummary, summary: SweepSummary) -> Iterator[b.Block]:
    names = [*summary.parameters, *summary.results]
    rows = [
        b.TableRow(
            (exact(point["point"]), *(_value(summary, point, name) for name in names)),
            form="both" if i < 5 else "long",
        )
        for i, point in enumerate(x.best)
    ]
    if rows:
        heads = (b.Column("point"), *_columns(names))
        some = len(summary.parameters)
        groups = (tuple(range(1, 1 + some)), tuple(range(1 + some, 1 + len(names))))
        title = filled("Points with the {} first", x.best_by)
        yield b.Table(tuple(rows), heads, title=title, groups=groups)


def _extremes(x: SweepSummary, summary: SweepSummary) -> Iterator[b.Block]:
    parameters = list(summary.parameters)
    rows = [
        b.TableRow(
            (
                line(Name(name), f", {end}"),
                *(_value(summary, ends[end], column) for column in (name, *parameters)),
            )
        )
        for name, ends in x.extremes.items()
        for end in ("least", "largest")
    ]
    if rows:
        heads = (b.Column("result"), b.Column("value"), *_columns(parameters))
        yield b.Table(
            tuple(rows), heads, title="Least and largest values, and the points at which they stand"
        )


def _influences(x: SweepSummary, summary: SweepSummary) -> Iterator[b.Block]:
    parameters, influences = list(summary.parameters), x.influences
    if not influences or len(parameters) < 2:
        return
    for name, row in influences.items():
        shares = {parameter: influence.share for parameter, influence in row.items() if influence.share}
        if len(shares) == len(row):
            most = max(shares, key=lambda parameter: number(shares[parameter].value).value or 0.0)
            sentence = "{}: {} moves it most; alone it explains {} of the variance."
            yield b.Text(filled(sentence, Name(name), Name(most), number(shares[most].value)), form="long")

    def cell(name: str, parameter: str) -> Line:
        influence = influences[name].get(parameter)
        if influence is None:
            return "-"
        rank = number(influence.rank, 2)
        return filled("{} ({})", rank, number(influence.share.value, 2)) if influence.share else rank

    rows = (
        b.TableRow((Name(parameter), *(cell(name, parameter) for name in influences)))
        for parameter in parameters
    )
    has_shares = any(influence.share for row in influences.values() for influence in row.values())
    title = "Rank correlation"
    if has_shares:
        title += "; in brackets the share of the variance that the parameter explains alone"
    yield b.Table(tuple(rows), (b.Column("parameter"), *_columns(list(influences))), title=title)
    wide = [name for name, gap in summary.gaps.items() if gap > MOST_GAPS]
    if wide:
        worst = max(wide, key=lambda name: summary.gaps[name])
        sentence = (
            "No shares of the variance: up to {} of the points have no value, and the parameters of the others are "
            "not independent."
        )
        yield b.Text(filled(sentence, number(x.gaps[worst])), "note")
    if has_shares:
        yield _shares(parameters, influences)
    yield b.Text(
        "A rank correlation of 1 or -1: the result only rises or only falls with the parameter. Near 0 with a large "
        "share: it rises and falls. Shares that add up to less than 100 %: the parameters act together.",
        "fine",
        "long",
    )
    if len(parameters) > 2:
        yield from sweep_figures.tornado(summary)


def _shares(parameters: list[str], influences: Mapping[str, Mapping[str, Influence]]) -> b.Table:
    """The shares of the variance with their intervals."""

    def cell(influence: Influence | None, kind: str) -> Line:
        share = influence and (influence.share if kind == "alone" else influence.total)
        return estimate(share) if share else "-"

    rows = (
        b.TableRow(
            (
                line(Name(parameter), f", {kind}"),
                *(cell(row.get(parameter), kind) for row in influences.values()),
            )
        )
        for parameter in parameters
        for kind in ("alone", "in all")
    )
    title = "Shares of the variance: of a parameter alone, and in all with what it does together with others"
    return b.Table(
        tuple(rows), (b.Column("parameter"), *_columns(list(influences))), title=title, form="long"
    )


def _spread_heading(summary: SweepSummary) -> str:
    return "Spread by tolerances and ranges" if summary.spread.evenly else "Spread by tolerances"


def _spread(x: SweepSummary, summary: SweepSummary) -> Iterator[b.Block]:
    spread = x.spread.spread
    if not spread:
        return
    quantiles = list(
        dict.fromkeys(key for numbers in summary.spread.spread.values() for key in numbers.quantiles)
    )
    rows = (
        b.TableRow(
            (
                Name(name),
                _value(summary, x.nominal, name) if name in x.nominal else "-",
                number(numbers.mean, summary.digits(name)),
                number(numbers.deviation),
                *(
                    number(numbers.quantiles[key].value, summary.digits(name))
                    if key in numbers.quantiles
                    else "-"
                    for key in quantiles
                ),
            )
        )
        for name, numbers in spread.items()
    )
    of_study = (
        b.Column("at the study's values", "study"),
        b.Column("mean"),
        b.Column("standard deviation", "deviation"),
    )
    columns = (b.Column("result"), *of_study, *(b.Column(f"{key.removeprefix('q')} %") for key in quantiles))
    groups = ((1, 2, 3), tuple(range(4, len(columns))))
    yield b.Table(tuple(rows), columns, title="Spread of the results and their quantiles", groups=groups)
    if summary.spread.evenly:
        ranges = join(map(Name, summary.spread.evenly))
        verb = " has no tolerance" if len(summary.spread.evenly) == 1 else " have no tolerance"
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
    yield from sweep_figures.distribution(summary)


def _basis(x: SweepSummary, summary: SweepSummary, driver: str) -> Iterator[b.Block]:
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
    plan = summary.findings.plan
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
    if summary.current_limit is not None:
        limited = "The current is at its limit, {}, at the points with the largest current_peak."
        yield b.Text(filled(limited, exact(x.current_limit)), "note")
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
    shortfall=lambda swept: None if swept.findings.passed.counts[0] else "",
)
