"""The report on an identification: its numbers, sums that are determined, further runs, measured over simulated."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from ...core.files import write_file
from ...reading.results import as_data
from ...reading.text import shown_in
from ...recordings.measurands import MEASURANDS
from ...report import blocks as b
from ...report import figure as fig
from ...report.cited import as_name, cited, exact, number, source_line, table
from ...report.lines import Name, filled, join, line
from ...report.task import Task, Writer
from ...study.config import Config
from ...study.study_file import toml_text
from .identification import IdentifiedMachine, identify
from .result import IdentificationSummary, identified_notes, identified_tables, sentences, summary_of

FILE = "identified.toml"
"""The study file with the identified values."""


def identification_report(machine: IdentifiedMachine) -> b.Report:
    """The report on an identification."""
    config = machine.config
    with shown_in(config.units):
        x = cited(summary := summary_of(machine))
        return b.Report(
            config.title or "Identified machine",
            "Identification from recordings",
            as_data(summary),
            tuple(_opening(x, machine)),
            (
                b.Section("numbers", "Identified numbers", tuple(_numbers(x))),
                b.Section("limits", "Limits of these recordings", tuple(_limits(x))),
                b.Section("courses", "Measured and simulated", (*_residuals(x), *_figures(machine, summary))),
                b.Section("runs", "Recordings and sensors", tuple(_runs(x))),
            ),
            source=source_line(x.heading),
            failure=str(machine.failure or ""),
            units=config.units,
            opening_title="The answer",
            status=summary.status,
        )


def pictures(machine: IdentifiedMachine) -> tuple[str, ...]:
    """The names of the pictures, one for each run."""
    return tuple(f"course_{run.name}.png" for run in machine.plan.runs)


def _writers(
    machine: IdentifiedMachine, report: b.Report, folder: Path, of_report: list[Writer]
) -> list[Writer]:
    """With the study file of the identified values; without it if they do not describe the machine."""

    def study_file() -> list[Path]:
        text = toml_text(identified_tables(machine, folder), identified_notes(machine))
        return write_file(folder / FILE, text)

    return [study_file, *of_report] if machine.is_described else of_report


TASK: Task[Config, IdentifiedMachine] = Task(
    "identify",
    lambda config, folder, progress, **options: identify(config, progress, **options),
    identification_report,
    files=(FILE, "course_*.png"),
    writers=_writers,
    content=IdentificationSummary,
    failure=lambda machine: machine.failure,
    shortfall=lambda machine: None if machine.is_described else "",
)


def _opening(x: IdentificationSummary, machine: IdentifiedMachine) -> Iterator[b.Block]:
    """Whether the model describes the recordings, and how many numbers these determine."""
    if machine.is_described:
        sentence = (
            "The model describes the recordings: their residuals are noise. These recordings determine {} of {} "
            "numbers."
        )
        yield b.Judgement("good", filled(sentence, exact(x.told), exact(x.sought)))
    else:
        sentence = "The model does not describe the recordings. No number is determined, and"
        yield b.Judgement("bad", f"{sentence} {FILE} is not written.")
    for sentence in sentences(machine):
        yield b.Judgement("warning", f"{sentence}.")
    for remark in x.remarks:
        yield b.Judgement("remark", line(remark, "."))


def _suspects(x: IdentificationSummary) -> Iterator[b.Block]:
    """The sets of known numbers that would explain the recordings, if they were wrong."""
    rows = [
        (i, suspected.describes, suspect)
        for i, suspected in enumerate(x.suspects, 1)
        for suspect in suspected.suspects
    ]
    yield from table(
        rows,
        ("set", lambda row: str(row[0])),
        ("number", lambda row: as_name(row[2].name)),
        ("known", lambda row: number(row[2].known, 4)),
        ("would be", lambda row: number(row[2].preferred, 4)),
        (b.Column("stated in the study", "stated", "long"), lambda row: "yes" if row[2].stated else "no"),
        (
            b.Column("the model describes the recordings with it", "describes"),
            lambda row: {True: "yes", False: "no", None: ""}[row[1]],
        ),
        title="Suspects: known numbers that may be wrong, the best set first",
    )
    if rows:
        yield b.Text(
            "Measure these numbers, or seek them: a set with the values of the table explains the recordings."
            if any(suspected.describes for suspected in x.suspects)
            else "No set explains the recordings; the nearest one stands first.",
            "note",
        )


def _numbers(x: IdentificationSummary) -> Iterator[b.Block]:
    """The sought numbers before and after the recordings, or else the suspects."""
    if not x.is_described:
        yield from _suspects(x)

    yield from table(
        x.numbers.items(),
        ("number", lambda row: Name(row[0])),
        ("value", lambda row: number(row[1].fitted, 4) if row[1].told else "not determined"),
        (
            b.Column("standard deviation", "deviation"),
            lambda row: number(row[1].deviation, 2) if row[1].told else "",
        ),
        (b.Column("95 %: from", "from"), lambda row: number(row[1].low, 4)),
        ("to", lambda row: number(row[1].high, 4)),
        (b.Column("deviation expected before the fit", form="long"), lambda row: number(row[1].expected, 2)),
        (
            b.Column("known before", form="long"),
            lambda row: line(number(row[1].given, 4), " ± ", number(row[1].given_deviation, 2)),
        ),
    )
    if x.is_described:
        yield _meaning()
    yield from table(
        x.correlations,
        ("pair", lambda pair: line(as_name(pair.first), ", ", as_name(pair.second))),
        ("correlation", lambda pair: number(pair.correlation, 2)),
        title="Numbers whose errors go together",
        form="long",
    )


def _meaning() -> b.Text:
    """What the table of a model that describes the recordings says of its numbers."""
    return b.Text(
        f"A value is that of the best fit, as {FILE} has it. Its interval is that of the distribution which the "
        "recordings leave. A number is determined where the recordings alone give it with less than half the "
        "standard deviation that was known before. The interval of 95 % of a number that is not determined is that "
        "of bounds, weighing and recordings together: it is only as right as the weighing. Before the fit, a number "
        "is at its start, such as the middle of its bounds, and the noise is as stated: so the expected deviation "
        "may differ from the reached one.",
        "note",
    )


def _limits(x: IdentificationSummary) -> Iterator[b.Block]:
    """Changes that leave no trace, sums that are determined, and further runs that would tell more."""
    for change in x.blind:
        yield b.Judgement("partly", line("No trace in any column: ", change.text, "."))
    yield from table(
        x.combinations,
        ("sum", lambda combination: combination.text),
        ("value", lambda combination: number(combination.value, 4)),
        ("standard deviation", lambda combination: number(combination.deviation, 2)),
        title="Sums that are determined, of numbers that are not",
    )
    before, is_whole = exact(x.told_at_start), number(x.told).value == number(x.sought).value
    title = "Further runs, the best first; without one {} numbers can be determined"
    yield from table(
        x.proposals,
        ("further run", lambda proposal: proposal.words),
        ("deviations fall by the factor", lambda proposal: number(proposal.factor, 3)),
        ("numbers determined", lambda proposal: exact(proposal.determined)),
        title="Further runs that would make the numbers sharper, the best first"
        if is_whole
        else filled(title, before),
    )
    more = (number(proposal.determined).value for proposal in x.proposals)
    if x.proposals and not is_whole and all((size or 0) <= (before.value or 0) for size in more):
        yield b.Text("None of these runs determines one more number: weigh a part, or know a gain.", "note")


def _residuals(x: IdentificationSummary) -> Iterator[b.Block]:
    """The tests of the residuals of each column."""
    yield from table(
        x.residuals,
        ("column", lambda residual: line(as_name(residual.run), " ", as_name(residual.column))),
        ("noise, in parts of the stated one", lambda residual: number(residual.noise, 3)),
        (
            "orders of the crank",
            lambda residual: number(residual.statistic, 3, over=not residual.is_noise),
        ),
        ("limit", lambda residual: number(residual.limit, 3)),
        (
            "largest order",
            lambda residual: filled(
                "{} ({})",
                exact(residual.largest_orders[0].order),
                number(residual.largest_orders[0].amplitude, 2),
            ),
        ),
        title="Residuals",
    )
    yield b.Text(
        "Orders of the crank: the sum of the squares of up to twenty orders in the residuals, in parts of those of "
        "noise.",
        "note",
        "long",
    )


def _figures(machine: IdentifiedMachine, summary: IdentificationSummary) -> Iterator[b.Block]:
    """For each run its measured and simulated columns, over the angle or over time."""
    for run, file in zip(machine.plan.runs, pictures(machine), strict=True):
        panels = []
        steady = machine.is_steady(run.name)
        for name, course in summary.courses[run.name].items():
            x, measured, simulated = (values.value for values in course.values())
            place = fig.Axis("crank angle", "rad", step=45.0) if steady else fig.Axis("time", "s")
            panels.append(
                (
                    fig.Panel(
                        place,
                        fig.Axis(MEASURANDS[name].description, MEASURANDS[name].unit),
                        (
                            fig.Curve("measured", x, measured, 1, marker="o", has_line=False),
                            fig.Curve("simulated", x, simulated, 0),
                        ),
                    ),
                )
            )
        yield fig.Figure(
            f"course-{run.name}",
            f"Run {run.name}: measured and simulated",
            "Means in classes of the crank angle over all turns of the run."
            if steady
            else "Means in classes of time.",
            tuple(panels),
            file=file,
        )


def _runs(x: IdentificationSummary) -> Iterator[b.Block]:
    """A row for each run with its recording."""
    yield from table(
        x.runs.items(),
        ("run", lambda row: Name(row[0])),
        ("file", lambda row: row[1].file),
        ("duration", lambda row: number(row[1].duration, 4)),
        ("rows a second", lambda row: number(row[1].rate, 4)),
        ("crank speed", lambda row: exact(row[1].crank_speed)),
        ("feed", lambda row: row[1].feed),
        ("columns", lambda row: join(map(as_name, row[1].columns))),
        title="Recordings",
        numeric=False,
        form="long",
    )
    yield from table(
        x.sensors.items(),
        ("quantity", lambda row: Name(row[0])),
        ("value", lambda row: number(row[1].value, 4)),
        ("standard deviation", lambda row: number(row[1].deviation, 2)),
        title="Start, clock and sensors, as fitted",
        form="long",
    )
    fit, rounds = x.fit, filled("The fit took {} rounds", exact(x.fit.rounds))
    agree = filled("; {} of {} starts agree.", exact(fit.agreeing), exact(fit.starts))
    yield b.Text(line(rounds, "." if number(fit.starts).value == 1.0 else agree), "fine", "long")
