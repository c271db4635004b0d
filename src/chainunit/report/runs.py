"""The section on every run in numbers: all answers, what the pins carry, overloads at random, the speed loop."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from ..quantities import Layout
from ..study.measures import MEASURES, Answers, measures_of
from ..study.monte_carlo import Sample
from ..study.record import StudyRecord
from ..study.window import Phase
from . import blocks as b
from . import run_names as read
from .lines import Line, Number, capital, joined, line, spoken
from .terminal import plain_line


def blocks(s: b.Source, study: StudyRecord) -> Iterator[b.Block]:
    """Every answer of every run, what the pins carry, and where the model ends."""
    if s.result["answers"]:
        yield table_of_runs(s, study)
    for run, phase in (("start_up", Phase.START_UP), ("settling", Phase.SETTLING)):
        if s.result.get(run):
            yield from _begin(s, study, run, phase)
    if s.result["pins"]:
        yield _pins(s, study)
    if study.monte_carlo is not None:
        yield from _random(s)
    if loops := s.result.get("speed_loop"):
        title = "The speed loop, linearised; deviation and settling: after a step of the load torque"
        rows = {loop: spoken(loop) if len(loops) > 1 else "constant inertia" for loop in loops}
        yield matrix(s, "speed_loop", rows, title, first="")


def _begin(s: b.Source, study: StudyRecord, run: str, phase: Phase) -> Iterator[b.Block]:
    """What a part of the run before the steady turns asks."""
    title = study.called(run)
    numbers = [(v, s.number(f"{run}.{v.name}")) for v in measures_of(phase)]
    rows = [(v.description, size) for v, size in numbers if size.value is not None]
    sizes = joined((line(f"{words} ", size) for words, size in rows), "; ")
    yield b.Text(line(f"{capital(title)}: ", sizes, "."), form="short")
    yield b.Table(tuple(map(b.TableRow, rows)), title=f"What the {title} asks of the drive", form="long")


def matrix(s: b.Source, path: str, rows: Mapping[str, str], title: str, first: str, **more: Any) -> b.Table:
    """A table of all that stands below `path`: what has a title in `rows`, by what each has."""
    sections = b.at(s.result, path)
    names = list(dict.fromkeys(name for section in rows for name in sections[section]))
    cells = (
        b.TableRow(
            (words, *(s.number(f"{path}.{of}.{name}") if name in sections[of] else "" for name in names))
        )
        for of, words in rows.items()
    )
    return b.Table(tuple(cells), b.heads(first, *map(spoken, names)), title=title, **more)


def ordered(study: StudyRecord, runs: Iterable[str]) -> list[str]:
    """Runs with the overloads of each side beside each other."""
    runs = list(runs)
    by_side = [run for group in read.groups(study, runs) for run in group]
    return [*(run for run in runs if run not in by_side), *by_side]


def over_runs(
    study: StudyRecord, runs: list[str], rows: Iterable[b.TableRow], title: str, first: str = ""
) -> b.Table:
    """A table with a column for each run; those of the overloads of a side belong together."""
    columns = (b.Column(study.called(run), read.short(study, run)) for run in runs)
    groups = (tuple(runs.index(run) + 1 for run in group) for group in read.groups(study, runs))
    return b.Table(tuple(rows), (b.Column("", first), *columns), title=title, groups=tuple(groups))


def table_of_runs(s: b.Source, study: StudyRecord) -> b.Table:
    """Every answer, with a column for each run."""
    answers, unknown = s.result["answers"], study.not_known
    runs = ordered(study, answers)
    rows = (
        b.TableRow(
            (v.description, *(number(s, study, run, v.name) for run in runs)),
            form="long" if MEASURES[v.name].minor else "both",
        )
        for v in Layout(Answers).variables
        # nothing to say of a coupling that is not there, or that did not open; a dash for what a motor does not tell
        if v.name in unknown
        or any(answers[run][v.name]["value"] is not None for run in runs)
        or (v.name == "recovery_time" and study.returns and study.overloads)
    )
    head = "crank at {=run.crank_speed}"
    if not study.reaches:
        head = "crank at {answers.steady.speed_mean}; {=run.crank_speed} NOT reached"
    title = f"What each run asks of the drive{'; the motor is insufficient' if study.insufficient else ''}"
    return over_runs(study, runs, rows, title, plain_line(s.line(head), study.config.units))


def _pins(s: b.Source, study: StudyRecord) -> b.Table:
    tables = s.result["pins"]
    reference = "steady" if "steady" in tables else next(iter(tables))
    sizes = list(next(iter(tables[reference].values())))

    def row(pin: str) -> b.TableRow:
        worst = max(tables, key=lambda run: tables[run][pin]["peak"]["value"])
        own = (s.number(f"pins.{reference}.{pin}.{size}") for size in sizes)
        return b.TableRow(
            (pin, *own, s.number(f"pins.{worst}.{pin}.peak"), study.called(worst), read.short(study, worst))
        )

    columns = (
        b.Column(f"{read.title(study, reference)}, {spoken(size)}", f"{reference}, {spoken(size)}")
        for size in sizes
    )
    return b.Table(
        tuple(map(row, tables[reference])),
        (
            b.Column("pin"),
            *columns,
            b.Column("largest peak", "largest"),
            b.Column("in", form="long"),
            b.Column("in", form="short"),
        ),
        title="What the bearings carry (equivalent: ISO 281)",
    )


def _random(s: b.Source) -> Iterator[b.Block]:
    """The quantiles of overloads at random."""
    quantiles = {name: sizes for name, sizes in s.result["monte_carlo"]["quantiles"].items() if sizes}
    declared = {v.name: v.description.removeprefix("1 where ") for v in Layout(Sample).variables}
    columns = list(dict.fromkeys(k for sizes in quantiles.values() for k in sizes))

    def cell(name: str, k: str) -> Line:
        return (
            s.estimate(f"monte_carlo.quantiles.{name}.{k}", ".low", ".high") if k in quantiles[name] else ""
        )

    rows = tuple(b.TableRow((declared[name], *(cell(name, k) for k in columns))) for name in quantiles)
    heads = (f"{k[1:]} % of runs below" if k.startswith("q") else "share of runs" for k in columns)
    sides = joined(
        s.line(f"{{=monte_carlo.sides.{side}}} {side}") for side in s.result["monte_carlo"]["sides"]
    )
    of_sides = line(" (", sides, ")") if sides else ()
    title = s.line(
        "Overloads at random, {=monte_carlo.runs} runs{sides}; in brackets: interval of {=monte_carlo.confidence} "
        "confidence",
        sides=of_sides,
    )
    if rows:
        yield b.Table(rows, b.heads("", *heads), title=title)


def number(s: b.Source, study: StudyRecord, run: str, name: str) -> Number:
    """An answer of a run."""
    back = name == "recovery_time" and run != "steady" and study.returns
    return s.number(f"answers.{run}.{name}", none="not reached" if back else "-")
