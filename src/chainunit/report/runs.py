"""The section on every run in numbers: all answers, forces in the pins, the speed loop."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any

from ..core.quantities import Layout
from ..study.bearings import hardest_run
from ..study.measures import MEASURES, STARTED, Answers, measures_of
from ..study.record import StudyRecord
from ..study.window import Phase
from . import blocks as b
from . import run_names
from .cited import cited
from .cited import number as cited_number
from .lines import Number, capital, join, line, spoken
from .terminal import plain_line


def blocks(s: b.Source, study: StudyRecord) -> Iterator[b.Block]:
    """Tables of the answers of every run, the forces in the bearings and the speed loop."""
    if s.result["answers"]:
        whole = table_of_runs(s, study)
        yield whole
        yield _beside_the_worst(s, study, whole)
    for run, phase in (("start_up", Phase.START_UP), ("settling", Phase.SETTLING)):
        if s.result.get(run):
            yield from _begin(s, study, run, phase)
    if s.result["pins"]:
        yield _pins(study)
        yield _largest_pin(study)
    if loops := s.result.get("speed_loop"):
        title = "The linearised speed loop; deviation and settling are those after a step of the load torque"
        rows = {loop: spoken(loop) if len(loops) > 1 else "constant inertia" for loop in loops}
        yield matrix(s, "speed_loop", rows, title, first="")


def _begin(s: b.Source, study: StudyRecord, run: str, phase: Phase) -> Iterator[b.Block]:
    """The demands of a phase before the steady turns: the start-up, or the settling."""
    title = study.title_of(run)
    numbers = [(v, s.number(f"{run}.{v.name}")) for v in measures_of(phase)]
    rows = [(v.described(study.driver_noun), size) for v, size in numbers if size.value is not None]
    sizes = join((line(f"{description} ", size) for description, size in rows), "; ")
    yield b.Text(line(f"{capital(title)}: ", sizes, "."), form="short")
    end = f", and of the end of the start-up, from {100.0 * STARTED:g} % of the speed on"
    head = f"Demands of the {title} on the drive{end if phase is Phase.SETTLING else ''}"
    yield b.Table(tuple(map(b.TableRow, rows)), title=head, form="long")


def matrix(s: b.Source, path: str, rows: Mapping[str, str], title: str, first: str, **more: Any) -> b.Table:
    """A table of the numbers below `path`: a row for each entry that has a title in `rows`, a column for each name of
    a number in these entries."""
    sections = b.at(s.result, path)
    names = list(dict.fromkeys(name for section in rows for name in sections[section]))
    cells = (
        b.TableRow(
            (
                row_title,
                *(
                    s.number(f"{path}.{section}.{name}") if name in sections[section] else ""
                    for name in names
                ),
            )
        )
        for section, row_title in rows.items()
    )
    return b.Table(tuple(cells), b.heads(first, *map(spoken, names)), title=title, **more)


def by_side(study: StudyRecord, runs: Iterable[str]) -> list[str]:
    """The runs in an order in which the overloads of each side are neighbours."""
    runs = list(runs)
    sided_runs = [run for group in run_names.groups(study, runs) for run in group]
    return [*(run for run in runs if run not in sided_runs), *sided_runs]


def over_runs(
    study: StudyRecord, runs: list[str], rows: Iterable[b.TableRow], title: str, first: str = ""
) -> b.Table:
    """A table with a column for each run; the columns of the overloads of a side form a group."""
    columns = (b.Column(study.title_of(run), run_names.short(study, run)) for run in runs)
    groups = (tuple(runs.index(run) + 1 for run in group) for group in run_names.groups(study, runs))
    return b.Table(tuple(rows), (b.Column("", first), *columns), title=title, groups=tuple(groups))


def table_of_runs(s: b.Source, study: StudyRecord) -> b.Table:
    """The table of all answers, with a column for each run."""
    answers, unknown_names = s.result["answers"], study.not_known
    runs = by_side(study, answers)
    rows = (
        b.TableRow(
            (v.described(study.driver_noun), *(number(s, study, run, v.name) for run in runs)),
            form="long" if MEASURES[v.name].minor else "both",
        )
        for v in Layout(Answers).variables
        # a coupling that is absent or stayed shut has no row; an answer that the motor does not give has dashes
        if v.name in unknown_names
        or any(answers[run][v.name]["value"] is not None for run in runs)
        or (v.name == "recovery_time" and study.returns and study.overloads)
    )
    head = "{driver} at {answers.steady.speed_mean}" if "steady" in answers else ""
    if not study.reaches:
        head += "; {=run.crank_speed:4} NOT reached"
    title = f"Demands of each run on the drive{_doubt(study)}"
    return over_runs(study, runs, rows, title, plain_line(s.line(head), study.config.units))


def _doubt(study: StudyRecord) -> str:
    return "; the motor is insufficient" if study.insufficient else ""


def _beside_the_worst(s: b.Source, study: StudyRecord, whole: b.Table) -> b.Table:
    """Of the table of all runs, steady running beside the overload with the largest crank torque, for one screen."""
    runs = by_side(study, s.result["answers"])
    shown = [run for run in ("steady",) if run in runs] or runs[:1]
    peaks = {run: study.answers[run].crank_torque_peak for run in study.overloads if run in runs}
    title = whole.title
    if peaks:
        shown.append(max(peaks, key=lambda run: abs(peaks[run])))
        is_bare = study.proposal is not None and study.config.coupling is None
        bare = " (without torque limiter)" if is_bare else ""
        title = f"Steady running beside the worst overload{bare}: {run_names.title(study, shown[-1])}{_doubt(study)}"
    places = [0, *(1 + runs.index(run) for run in shown)]
    rows = (replace(row, cells=tuple(row.cells[i] for i in places)) for row in whole.rows)
    columns = tuple(whole.columns[i] for i in places)
    return replace(whole, rows=tuple(rows), columns=columns, groups=(), title=title, form="screen")


def _largest_pin(study: StudyRecord) -> b.Text:
    """The pin with the largest force of all runs, for one screen."""
    forces = {pin: _peak(study, pin) for pin in next(iter(study.pins.values()))}
    pin = max(forces, key=lambda pin: forces[pin].value or 0.0)
    worst = study.title_of(hardest_run(study.pins, pin))
    return b.Text(line(f"Largest force in a pin: {pin} ", forces[pin], f" ({worst})."), form="screen")


def _peak(study: StudyRecord, pin: str) -> Number:
    """The largest force in a pin of all runs."""
    run = hardest_run(study.pins, pin)
    return Number(study.pins[run][pin]["peak"], "N", path=f"runs.pins.{run}.{pin}.peak")


def _pins(study: StudyRecord) -> b.Table:
    reference = "steady" if "steady" in study.pins else next(iter(study.pins))
    tables = study.pins[reference]
    sizes = list(next(iter(tables.values())))

    def row(pin: str) -> b.TableRow:
        worst = hardest_run(study.pins, pin)
        numbers = (
            Number(tables[pin][size], "N", path=f"runs.pins.{reference}.{pin}.{size}") for size in sizes
        )
        return b.TableRow(
            (pin, *numbers, _peak(study, pin), study.title_of(worst), run_names.short(study, worst))
        )

    columns = (
        b.Column(f"{run_names.title(study, reference)}, {spoken(size)}", f"{reference}, {spoken(size)}")
        for size in sizes
    )
    return b.Table(
        tuple(map(row, tables)),
        (
            b.Column("pin"),
            *columns,
            b.Column("largest peak", "largest"),
            b.Column("in the run", form="long"),
            b.Column("in", form="short"),
        ),
        title="Forces in the bearings (equivalent load: ISO 281, for balls and for rollers)",
    )


def number(s: b.Source, study: StudyRecord, run: str, name: str) -> Number:
    """The answer `name` of a run."""
    back = name == "recovery_time" and run != "steady" and study.returns
    answers = cited(study.answers[run], f"runs.answers.{run}")
    return cited_number(getattr(answers, name), none="not reached" if back else "-")
