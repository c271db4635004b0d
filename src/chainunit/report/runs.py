"""The section on every run in numbers: all answers, forces in the pins, the speed loop."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any

from ..core.quantities import Layout, finite
from ..study.bearings import hardest_run
from ..study.measures import MEASURES, STARTED, Answers, measures_of
from ..study.record import StudyRecord, StudyRuns, StudySetup
from ..study.window import Phase
from . import blocks as b
from . import run_names
from .cited import cited, numbers
from .cited import number as cited_number
from .given_numbers import asked_speed
from .lines import Line, Number, capital, filled, join, line, spoken
from .terminal import plain_line


def blocks(study: StudyRecord) -> Iterator[b.Block]:
    """Tables of the answers of every run, the forces in the bearings and the speed loop."""
    if study.runs.answers:
        whole = table_of_runs(study)
        yield whole
        yield _beside_the_worst(study, whole)
    if study.runs.start is not None:
        yield from _begin(study.runs, "start_up", study.runs.start, Phase.START_UP)
    if study.runs.settling is not None:
        yield from _begin(study.runs, "settling", study.runs.settling, Phase.SETTLING)
    if study.runs.pins:
        yield _pins(study.runs)
        yield from _largest_pin(study.runs)
    if loops := cited(study.setup.statics.loops, "findings.speed_loop"):
        title = "The linearised speed loop; deviation and settling are those after a step of the load torque"
        rows = {
            spoken(loop) if len(loops) > 1 else "constant inertia": numbers(x) for loop, x in loops.items()
        }
        yield matrix(rows, title, first="")


def _begin(runs: StudyRuns, run: str, answers: Answers, phase: Phase) -> Iterator[b.Block]:
    """The demands of a phase before the steady turns: the start-up, or the settling."""
    title, x = runs.title_of(run), numbers(cited(answers, f"runs.{run}"))
    sizes = [(v.described(runs.drive.driver_noun), x[v.name]) for v in measures_of(phase)]
    rows = [row for row in sizes if row[1].value is not None]
    numbers_read = join((line(f"{description} ", size) for description, size in rows), "; ")
    yield b.Text(line(f"{capital(title)}: ", numbers_read, "."), form="short")
    end = f", and of the end of the start-up, from {100.0 * STARTED:g} % of the speed on"
    head = f"Demands of the {title} on the drive{end if phase is Phase.SETTLING else ''}"
    yield b.Table(tuple(map(b.TableRow, rows)), title=head, form="long")


def matrix(rows: Mapping[str, Mapping[str, Number]], title: str, first: str, **more: Any) -> b.Table:
    """A table of numbers by the title of their row and by their name, which is that of the column."""
    names = list(dict.fromkeys(name for sizes in rows.values() for name in sizes))
    cells = (b.TableRow((head, *(sizes.get(name, "") for name in names))) for head, sizes in rows.items())
    return b.Table(tuple(cells), b.heads(first, *map(spoken, names)), title=title, **more)


def by_side(runs: StudyRuns, names: Iterable[str]) -> list[str]:
    """The runs in an order in which the overloads of each side are neighbours."""
    names = list(names)
    sided_runs = [run for group in run_names.groups(runs, names) for run in group]
    return [*(run for run in names if run not in sided_runs), *sided_runs]


def over_runs(
    runs: StudyRuns, names: list[str], rows: Iterable[b.TableRow], title: str, first: str = ""
) -> b.Table:
    """A table with a column for each run; the columns of the overloads of a side form a group."""
    columns = (b.Column(runs.title_of(run), run_names.short(runs, run)) for run in names)
    groups = (tuple(names.index(run) + 1 for run in group) for group in run_names.groups(runs, names))
    return b.Table(tuple(rows), (b.Column("", first), *columns), title=title, groups=tuple(groups))


def table_of_runs(study: StudyRecord) -> b.Table:
    """The table of all answers, with a column for each run."""
    setup, runs, answers = study.setup, study.runs, study.runs.answers
    names, unknown_names = by_side(runs, answers), runs.not_known
    rows = []
    for v in Layout(Answers).variables:
        has_value = any(finite(getattr(answers[run], v.name)) is not None for run in names)
        is_recovery = v.name == "recovery_time" and runs.returns and runs.overloads
        # a coupling that is absent or stayed shut has no row; an answer that the motor does not give has dashes
        if has_value or is_recovery or v.name in unknown_names:
            numbers = (number(runs, run, v.name) for run in names)
            form: b.Form = "long" if MEASURES[v.name].minor else "both"
            rows.append(b.TableRow((v.described(setup.driver_noun), *numbers), form=form))
    head: Line = ()
    if "steady" in answers:
        head = line(setup.driver_noun, " at ", number(runs, "steady", "speed_mean"))
    if not runs.reaches:
        over = study.runs.answers["steady"].speed_mean > setup.config.run.crank_speed
        head = filled("{}; {} NOT {}", head, asked_speed(setup), "kept, too fast" if over else "reached")
    title = f"Demands of each run on the drive{_doubt(setup)}"
    return over_runs(runs, names, rows, title, plain_line(head, setup.config.units))


def _doubt(setup: StudySetup) -> str:
    return "; the motor is insufficient" if setup.insufficient else ""


def _beside_the_worst(study: StudyRecord, whole: b.Table) -> b.Table:
    """Of the table of all runs (`whole`), steady running beside the overload with the largest crank torque, for one
    screen."""
    runs, setup = study.runs, study.setup
    names = by_side(runs, runs.answers)
    shown = ["steady"] if "steady" in names else names[:1]
    peaks = {run: runs.answers[run].crank_torque_peak for run in runs.overloads if run in names}
    title = whole.title
    if peaks:
        shown.append(max(peaks, key=lambda run: abs(peaks[run])))
        is_bare = setup.proposal is not None and setup.config.coupling is None
        bare = " (without torque limiter)" if is_bare else ""
        worst = f"{run_names.title(runs, shown[-1])}{_doubt(setup)}"
        title = f"Steady running beside the worst overload{bare}: {worst}"
    # the first column has the descriptions
    columns_shown = [0, *(1 + names.index(run) for run in shown)]
    rows = (replace(row, cells=tuple(row.cells[k] for k in columns_shown)) for row in whole.rows)
    columns = tuple(whole.columns[k] for k in columns_shown)
    return replace(whole, rows=tuple(rows), columns=columns, groups=(), title=title, form="screen")


def _largest_pin(runs: StudyRuns) -> Iterator[b.Text]:
    """The pin with the largest force of all runs, for one screen; nothing if the pins bear no force."""
    forces = {pin: _peak(runs, pin) for pin in next(iter(runs.pins.values()))}
    pin = max(forces, key=lambda pin: forces[pin].value or 0.0)
    if forces[pin].value:
        worst = runs.title_of(hardest_run(runs.pins, pin))
        yield b.Text(line(f"Largest force in a pin: {pin} ", forces[pin], f" ({worst})."), form="screen")


def _peak(runs: StudyRuns, pin: str) -> Number:
    """The largest force in a pin of all runs."""
    run = hardest_run(runs.pins, pin)
    return Number(runs.pins[run][pin]["peak"], "N", path=f"runs.pins.{run}.{pin}.peak")


def _pins(runs: StudyRuns) -> b.Table:
    """The forces in the bearings: in steady running, or else in the first run, and the largest peak of all runs."""
    reference = "steady" if "steady" in runs.pins else next(iter(runs.pins))
    tables = runs.pins[reference]
    sizes = list(next(iter(tables.values())))

    def row(pin: str) -> b.TableRow:
        """The forces of a pin, and the run with its largest peak."""
        worst = hardest_run(runs.pins, pin)
        numbers = (
            Number(tables[pin][size], "N", path=f"runs.pins.{reference}.{pin}.{size}") for size in sizes
        )
        return b.TableRow(
            (pin, *numbers, _peak(runs, pin), runs.title_of(worst), run_names.short(runs, worst))
        )

    columns = (
        b.Column(f"{run_names.title(runs, reference)}, {spoken(size)}", f"{reference}, {spoken(size)}")
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


def number(runs: StudyRuns, run: str, name: str) -> Number:
    """The answer `name` of a run."""
    back = name == "recovery_time" and run != "steady" and runs.returns
    answers = cited(runs.answers[run], f"runs.answers.{run}")
    return cited_number(getattr(answers, name), none="not reached" if back else "-")
