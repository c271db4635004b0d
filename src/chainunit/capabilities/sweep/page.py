"""The report on a sweep: best points, extremes, influences, spread, and maps or curves."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from numbers import Integral
from pathlib import Path
from typing import Any

from ...core.errors import InputError, shown
from ...reading.results import as_data
from ...reading.text import shown_in
from ...report import blocks as b
from ...report.cited import cited, number, table
from ...report.lines import Line, Name, Number, join, line
from ...report.task import Task
from ...study.config import Config
from ...work.progress import TaskProgress
from . import figures as sweep_figures
from .points import run_sweep
from .summary import MOST_GAPS, Row, SweepSummary, SweptStudy

_MOST_COLUMNS = 8
"""Columns of a table on the terminal."""


def report(swept: SweptStudy) -> b.Report:
    """The report on a sweep."""
    summary, config = swept.summary, swept.findings.config
    with shown_in(config.units):
        s = b.Source(as_data(summary), config.machine.model.driver_noun)
        sections = (
            b.Section("influences", "Which parameter moves what", tuple(_influences(s, summary))),
            b.Section("best", "Points in order", tuple(_best(s, summary))),
            b.Section("extremes", "Extremes", tuple(_extremes(summary))),
            b.Section("maps", "Results over the parameters", tuple(sweep_figures.over_parameters(summary))),
            b.Section("spread", _spread_heading(summary), tuple(_spread(s, summary))),
            b.Section("basis", "Basis of the numbers", tuple(_basis(s, summary))),
        )
        return b.Report(
            config.title,
            "Sweep",
            s.result,
            tuple(_opening(s)),
            sections,
            source=s.source_line(),
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


def _opening(s: b.Source) -> Iterator[b.Block]:
    names = list(s.result["parameters"])
    yield b.Text(
        line(
            s.line("{=points} points, {method}, over "),
            join(_range(s, name) for name in names),
            s.line("; {=feasible} of them have results."),
        )
    )
    for i, entry in enumerate(s.result["reasons"]):
        if entry["points"]["value"]:
            path = f"reasons.{i}"
            yield b.Judgement(
                "warning", s.line(f"No result at {{{path}.share}} of the points: {{{path}.reason}}.")
            )
    for i in range(len(s.result["organs"])):
        path = f"organs.{i}"
        sentence = s.line(
            f"{{{path}.text}}: {{{path}.share}} of the points. The limit of the study's machine and feed "
        )
        yield b.Judgement("warning", line(sentence, s.line(f"is {{{path}.limit}}.")))
    if not s.result["feasible"]["value"]:
        yield b.Judgement("bad", "No point of the sweep has a result; take other ranges.", form="both")


def _range(s: b.Source, name: str) -> Line:
    path, title = f"parameters.{name}", Name(name)
    if s.result["parameters"][name]["tolerance"]["value"] is None:
        return line(title, s.line(f" {{={path}.from}} to {{={path}.to}}"))
    return line(title, s.line(f" {{={path}.study}} ± {{={path}.tolerance}}"))


def _columns(names: list[str]) -> tuple[b.Column, ...]:
    """Columns of parameters or results."""
    return tuple(
        b.Column(Name(name), form="both" if k < _MOST_COLUMNS else "long") for k, name in enumerate(names)
    )


def _value(summary: SweepSummary, row: Row, name: str) -> Number:
    """A value of a parameter or result, with so many digits that points differ."""
    return number(row[name], summary.digits(name))


def _best(s: b.Source, summary: SweepSummary) -> Iterator[b.Block]:
    names = [*summary.parameters, *summary.results]
    rows = [
        b.TableRow(
            (number(point["point"], as_given=True), *(_value(summary, point, name) for name in names)),
            form="both" if i < 5 else "long",
        )
        for i, point in enumerate(cited(summary).best)
    ]
    if rows:
        heads = (b.Column("point"), *_columns(names))
        some = len(summary.parameters)
        groups = (tuple(range(1, 1 + some)), tuple(range(1 + some, 1 + len(names))))
        title = s.line("Points with the {best_by} first")
        yield b.Table(tuple(rows), heads, title=title, groups=groups)


def _extremes(summary: SweepSummary) -> Iterator[b.Block]:
    parameters = list(summary.parameters)
    rows = [
        b.TableRow(
            (
                line(Name(name), f", {end}"),
                *(_value(summary, ends[end], column) for column in (name, *parameters)),
            )
        )
        for name, ends in cited(summary).extremes.items()
        for end in ("least", "largest")
    ]
    if rows:
        heads = (b.Column("result"), b.Column("value"), *_columns(parameters))
        yield b.Table(
            tuple(rows), heads, title="Least and largest values, and the points at which they stand"
        )


def _influences(s: b.Source, summary: SweepSummary) -> Iterator[b.Block]:
    parameters, table = list(s.result["parameters"]), s.result["influences"]
    if not table or len(parameters) < 2:
        return
    for name, influences in table.items():
        if not all(influence["share"] for influence in influences.values()):
            continue
        most = max(influences, key=lambda parameter: influences[parameter]["share"]["value"])
        path = f"influences.{name}.{most}"
        sentence = f"{{name}}: {{most}} moves it most; alone it explains {{{path}.share}} of the variance."
        yield b.Text(s.line(sentence, name=Name(name), most=Name(most)), form="long")

    def cell(name: str, parameter: str) -> Line:
        if parameter not in table[name]:
            return "-"
        path = f"influences.{name}.{parameter}"
        if table[name][parameter]["share"] is None:
            return s.line(f"{{{path}.rank:2}}")
        return s.line(f"{{{path}.rank:2}} ({{{path}.share:2}})")

    rows = (
        b.TableRow((Name(parameter), *(cell(name, parameter) for name in table))) for parameter in parameters
    )
    has_shares = any(influence["share"] for row in table.values() for influence in row.values())
    title = "Rank correlation"
    if has_shares:
        title += "; in brackets the share of the variance that the parameter explains alone"
    yield b.Table(tuple(rows), (b.Column("parameter"), *_columns(list(table))), title=title)
    wide = [name for name, gap in summary.gaps.items() if gap > MOST_GAPS]
    if wide:
        worst = max(wide, key=lambda name: summary.gaps[name])
        sentence = (
            "No shares of the variance: up to {gap} of the points have no value, and the parameters of the "
            "others"
        )
        yield b.Text(
            s.line(f"{sentence} are not independent.", gap=number(cited(summary).gaps[worst])), "note"
        )
    if has_shares:
        yield _shares(s, parameters, table)
    yield b.Text(
        "A rank correlation of 1 or -1: the result only rises or only falls with the parameter. Near 0 with a large "
        "share: it rises and falls. Shares that add up to less than 100 %: the parameters act together.",
        "fine",
        "long",
    )
    if len(parameters) > 2:
        yield from sweep_figures.tornado(summary)


def _shares(s: b.Source, parameters: list[str], table: Mapping[str, Any]) -> b.Table:
    """The shares of the variance with their intervals."""

    def cell(name: str, parameter: str, key: str) -> Line:
        if parameter not in table[name] or table[name][parameter][key] is None:
            return "-"
        return s.estimate(f"influences.{name}.{parameter}.{key}", ".low", ".high")

    rows = (
        b.TableRow((line(Name(parameter), f", {kind}"), *(cell(name, parameter, key) for name in table)))
        for parameter in parameters
        for key, kind in (("share", "alone"), ("total", "in all"))
    )
    title = "Shares of the variance: of a parameter alone, and in all with what it does together with others"
    return b.Table(tuple(rows), (b.Column("parameter"), *_columns(list(table))), title=title, form="long")


def _spread_heading(summary: SweepSummary) -> str:
    return "Spread by tolerances and ranges" if summary.spread.evenly else "Spread by tolerances"


def _spread(s: b.Source, summary: SweepSummary) -> Iterator[b.Block]:
    x = cited(summary)
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
                    number(numbers.quantiles[key], summary.digits(name)) if key in numbers.quantiles else "-"
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
        s.line(
            "result.json has the interval of {=confidence} confidence of each quantile, as for points that are drawn "
            "independently; points that fill the space evenly are more exact."
        ),
        "fine",
        "long",
    )
    yield from sweep_figures.distribution(summary)


def _basis(s: b.Source, summary: SweepSummary) -> Iterator[b.Block]:
    yield from table(
        cited(summary).parameters.items(),
        ("parameter", lambda row: Name(row[0])),
        ("meaning", lambda row: row[1].description),
        ("in the study", lambda row: number(row[1].centre, as_given=True)),
        ("from", lambda row: number(row[1].low, as_given=True)),
        ("to", lambda row: number(row[1].high, as_given=True)),
        ("tolerance", lambda row: number(row[1].tolerance, as_given=True)),
        title="Swept quantities; all others have their values of the study",
        form="long",
    )
    rows = (b.TableRow((Name(name), s.words(f"results.{name}.description"))) for name in s.result["results"])
    yield b.Table(tuple(rows), b.heads("result", "meaning"), title="Results", numeric=False, form="long")
    if summary.findings.plan.quantities:
        yield b.Text(
            s.line(
                "Quantities of a turn hold at constant speed of the {driver} with the feed of normal running, at "
                "{=angles} {driver} angles; extremes are those at these angles."
            ),
            "note",
            "long",
        )
    named = {"installed_power", "energy_per_year"} & set(summary.findings.plan.quantities)
    if named:
        yield b.Text(
            s.line(
                "Assumed: {=basis.operating_hours} operating hours in a year, permitted overload {=basis.overload}."
            ),
            "note",
        )
    if summary.findings.plan.measures:
        yield b.Text(
            s.line(
                "Measures are of a run in which {event}: from rest to steady running, then the event, each point by "
                "itself, with the control as tuned for the values of the study."
            ),
            "note",
        )
    if summary.current_limit is not None:
        sentence = (
            "The current is at its limit, {=current_limit}, at the points with the largest current_peak."
        )
        yield b.Text(s.line(sentence), "note")
    if s.result["made_anew"]:
        yield b.Text(s.line("{made_anew}."), "note")
    yield b.Text(s.line("All points: {store} (NetCDF)."), "fine", "long")


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
