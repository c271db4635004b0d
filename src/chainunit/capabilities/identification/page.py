"""The report on an identification: its numbers, sums that are determined, further runs, measured over simulated."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from ...core.files import write_file
from ...reading.results import as_data
from ...reading.text import shown_in
from ...recordings.measurands import MEASURANDS
from ...report import blocks as b
from ...report import figure as fig
from ...report.lines import Line, Name, line
from ...report.task import Task, Writer
from ...study.config import Config
from ...study.study_file import toml_text
from .identification import IdentifiedMachine, identify
from .result import IdentificationSummary, identified_notes, identified_tables, sentences, summary_of

FILE = "identified.toml"
"""The study file with the identified values."""


def identification_report(machine: IdentifiedMachine) -> b.Report:
    """The report on an identification."""
    result = as_data(summary_of(machine))
    s = b.Source(result)
    config = machine.config
    with shown_in(config.units):
        figures = tuple(_figures(s, machine))
        return b.Report(
            config.title or "Identified machine",
            "Identification from recordings",
            result,
            tuple(_opening(s, machine)),
            (
                b.Section("numbers", "Identified numbers", tuple(_numbers(s))),
                b.Section("limits", "Limits of these recordings", tuple(_limits(s))),
                b.Section("courses", "Measured and simulated", (*_residuals(s), *figures)),
                b.Section("runs", "Recordings and sensors", tuple(_runs(s))),
            ),
            source=s.line("Study file: {source} · chainunit {chainunit}"),
            failure=str(machine.failure or ""),
            units=config.units,
            opening_title="The answer",
            status=result["status"],
        )


def pictures(machine: IdentifiedMachine) -> tuple[str, ...]:
    """The names of the pictures, one for each run."""
    return tuple(f"course_{run.name}.png" for run in machine.plan.runs)


def _writers(
    machine: IdentifiedMachine, report: b.Report, folder: Path, of_report: list[Writer]
) -> list[Writer]:
    """With the study file of the identified values; without it if they are not those of the machine."""

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


def _opening(s: b.Source, machine: IdentifiedMachine) -> Iterator[b.Block]:
    if machine.is_described:
        words = s.line("These recordings determine {=told} of {=sought} numbers.")
        yield b.Judgement(
            "good", line("The model describes the recordings: their residuals are noise. ", words)
        )
    else:
        sentence = "The model does not describe the recordings. No number is determined, and"
        yield b.Judgement("bad", f"{sentence} {FILE} is not written.")
    for sentence in sentences(machine):
        yield b.Judgement("warning", f"{sentence}.")
    for each in s.lines("remarks"):
        yield b.Judgement("remark", line(each, "."))


def _suspects(s: b.Source) -> Iterator[b.Block]:
    rows = []
    for i, each in enumerate(s.result["suspects"]):
        for k, suspect in enumerate(each["suspects"]):
            path = f"suspects.{i}.suspects.{k}"
            rows.append(
                b.TableRow(
                    (
                        str(i + 1),
                        Name(suspect["name"]),
                        s.number(f"{path}.known", digits=4),
                        s.number(f"{path}.preferred", digits=4),
                        "yes" if suspect["stated"] else "no",
                        {True: "yes", False: "no", None: ""}[each["describes"]],
                    )
                )
            )
    if not rows:
        return
    columns = (
        b.Column("set"),
        b.Column("number"),
        b.Column("known"),
        b.Column("would be"),
        b.Column("stated in the study", "stated", form="long"),
        b.Column("the model describes the recordings with it", "describes"),
    )
    yield b.Table(tuple(rows), columns, title="Suspects: known numbers that may be wrong, the best set first")
    yield b.Text(
        "Measure these numbers, or seek them: a set with the values of the table explains the recordings."
        if any(suspects["describes"] for suspects in s.result["suspects"])
        else "No set explains the recordings; the nearest one stands first.",
        "note",
    )


def _numbers(s: b.Source) -> Iterator[b.Block]:
    if not s.result["is_described"]:
        yield from _suspects(s)
    rows = []
    for name, each in s.result["numbers"].items():
        path = f"numbers.{name}"
        estimate: tuple[Line, ...] = ("not determined", "")
        if each["told"]:
            estimate = s.number(f"{path}.fitted", digits=4), s.number(f"{path}.deviation", digits=2)
        ends = (s.number(f"{path}.{end}", digits=4) for end in ("from", "to"))
        rows.append(
            b.TableRow(
                (Name(name), *estimate, *ends, s.number(f"{path}.expected", digits=2), _given(s, path))
            )
        )
    columns = (
        b.Column("number"),
        b.Column("value"),
        b.Column("standard deviation", "deviation"),
        b.Column("95 %: from", "from"),
        b.Column("to"),
        b.Column("deviation expected before the fit", form="long"),
        b.Column("known before", form="long"),
    )
    yield b.Table(tuple(rows), columns)
    yield b.Text(
        f"A value is that of the best fit, as {FILE} has it. Its interval is that of the distribution which the "
        "recordings leave. A number is determined where the recordings alone give it with less than half the "
        "standard deviation that was known before. The interval of 95 % of a number that is not determined is that "
        "of bounds, weighing and recordings together: it is only as right as the weighing. Before the fit, a number "
        "is at its start, such as the middle of its bounds, and the noise is as stated: so the expected deviation "
        "may differ from the reached one.",
        "note",
    )
    rows = [
        b.TableRow(
            (
                line(Name(pair["first"]), ", ", Name(pair["second"])),
                s.number(f"correlations.{k}.correlation", digits=2),
            )
        )
        for k, pair in enumerate(s.result["correlations"])
    ]
    if rows:
        yield b.Table(
            tuple(rows),
            b.heads("pair", "correlation"),
            title="Numbers whose errors go together",
            form="long",
        )


def _given(s: b.Source, path: str) -> Line:
    given, deviation = s.value(f"{path}.given"), s.value(f"{path}.given_deviation")
    assert given is not None and deviation is not None
    return line(s.number(f"{path}.given", digits=4), " ± ", s.number(f"{path}.given_deviation", digits=2))


def _limits(s: b.Source) -> Iterator[b.Block]:
    for each in s.lines("blind"):
        yield b.Judgement("partly", line("No trace in any column: ", each, "."))
    rows = [
        b.TableRow(
            (
                s.words(f"combinations.{k}.text"),
                s.number(f"combinations.{k}.value", digits=4),
                s.number(f"combinations.{k}.deviation", digits=2),
            )
        )
        for k in range(len(s.result["combinations"]))
    ]
    if rows:
        yield b.Table(
            tuple(rows),
            b.heads("sum", "value", "standard deviation"),
            title="Sums that are determined, of numbers that are not",
        )
    rows = [
        b.TableRow(
            (
                s.words(f"proposals.{k}.text"),
                s.number(f"proposals.{k}.factor", digits=3),
                s.number(f"proposals.{k}.told", as_given=True),
            )
        )
        for k in range(len(s.result["proposals"]))
    ]
    if rows:
        before = s.result["told_at_start"]["value"]
        is_whole = s.result["told"]["value"] == s.result["sought"]["value"]
        words = "Further runs, the best first; without one {=told_at_start} numbers can be determined"
        yield b.Table(
            tuple(rows),
            b.heads("further run", "deviations fall by the factor", "numbers determined"),
            title="Further runs that would make the numbers sharper, the best first"
            if is_whole
            else s.line(words),
        )
        if not is_whole and all(each["told"]["value"] <= before for each in s.result["proposals"]):
            yield b.Text(
                "None of these runs determines one more number: weigh a part, or know a gain.", "note"
            )


def _residuals(s: b.Source) -> Iterator[b.Block]:
    rows = []
    for k, each in enumerate(s.result["residuals"]):
        path = f"residuals.{k}"
        orders = line(
            s.number(f"{path}.orders.0.order", as_given=True),
            " (",
            s.number(f"{path}.orders.0.amplitude", digits=2),
            ")",
        )
        rows.append(
            b.TableRow(
                (
                    line(Name(each["run"]), " ", Name(each["column"])),
                    s.number(f"{path}.noise", digits=3),
                    s.number(f"{path}.statistic", digits=3, over=not each["is_noise"]),
                    s.number(f"{path}.limit", digits=3),
                    orders,
                )
            )
        )
    yield b.Table(
        tuple(rows),
        b.heads(
            "column", "noise, in parts of the stated one", "orders of the crank", "limit", "largest order"
        ),
        title="Residuals",
    )
    yield b.Text(
        "Orders of the crank: the sum of the squares of up to twenty orders in the residuals, in parts of those of "
        "noise.",
        "note",
        "long",
    )


def _figures(s: b.Source, machine: IdentifiedMachine) -> Iterator[b.Block]:
    for run, file in zip(machine.plan.runs, pictures(machine), strict=True):
        panels = []
        for name, course in s.result["courses"][run.name].items():
            y, simulated = (course[key]["value"] for key in ("measured", "simulated"))
            steady = "angle" in course
            x = course["angle" if steady else "time"]["value"]
            angle = fig.Axis("crank angle", "rad", step=45.0) if steady else fig.Axis("time", "s")
            panels.append(
                (
                    fig.Panel(
                        angle,
                        fig.Axis(MEASURANDS[name].description, MEASURANDS[name].unit),
                        (
                            fig.Curve("measured", x, y, 1, marker="o", has_line=False),
                            fig.Curve("simulated", x, simulated, 0),
                        ),
                    ),
                )
            )
        yield fig.Figure(
            f"course-{run.name}",
            f"Run {run.name}: measured and simulated",
            "Means in classes of the crank angle over all turns of the run."
            if machine.is_steady(run.name)
            else "Means in classes of time.",
            tuple(panels),
            file=file,
        )


def _listed(names: Sequence[str]) -> list[Line]:
    """Names with commas between them."""
    return [part for k, name in enumerate(names) for part in (", " if k else "", Name(name))]


def _runs(s: b.Source) -> Iterator[b.Block]:
    rows = [
        b.TableRow(
            (
                Name(name),
                s.words(f"runs.{name}.file"),
                s.number(f"runs.{name}.duration", digits=4),
                s.number(f"runs.{name}.rate", digits=4),
                s.number(f"runs.{name}.crank_speed", as_given=True),
                s.words(f"runs.{name}.feed"),
                line(*_listed(s.result["runs"][name]["columns"])),
            )
        )
        for name in s.result["runs"]
    ]
    yield b.Table(
        tuple(rows),
        b.heads("run", "file", "duration", "rows a second", "crank speed", "feed", "columns"),
        title="Recordings",
        numeric=False,
        form="long",
    )
    rows = [
        b.TableRow(
            (
                Name(name),
                s.number(f"sensors.{name}.value", digits=4),
                s.number(f"sensors.{name}.deviation", digits=2),
            )
        )
        for name in s.result["sensors"]
    ]
    yield b.Table(
        tuple(rows),
        b.heads("quantity", "value", "standard deviation"),
        title="Start, clock and sensors, as fitted",
        form="long",
    )
    yield b.Text(
        s.line(
            "The fit took {=fit.rounds} rounds"
            + ("." if s.value("fit.starts") == 1.0 else "; {=fit.agreeing} of {=fit.starts} starts agree.")
        ),
        "fine",
        "long",
    )
