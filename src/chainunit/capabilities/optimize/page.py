"""The report on a search for the best machine: its values beside today's, what binds, the starts, and the checks."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...core.files import scratch, write_file
from ...reading.results import as_data
from ...reading.text import Units, shown_in
from ...report import blocks as b
from ...report import figure as fig
from ...report.cited import cited, exact, number, source_line, table
from ...report.lines import Aside, Line, Name, filled, join, line
from ...report.live.page import live_of_config
from ...report.task import Task, Writer
from ...study.config import Config, FileContents, of_tables
from ...study.provenance import Heading
from ...study.study_file import changed_tables, toml_text
from ...work.progress import TaskProgress
from .best import Best, find_best
from .result import BestMachine, TodayAndBest, WebPull, best_machine, units_of
from .table import wishes_of
from .words import conflict_sentences

PICTURES = ("torque.png", "front.png")
FILE = "best.toml"
"""The study file with the best machine."""


def optimum_report(
    best: Best, title: str, file: FileContents, units: Units, live: tuple[b.Block, ...] = ()
) -> b.Report:
    """The report on a search for a study with that title, file and units; `live` are the blocks of the live
    machine."""
    units = units_of(best, file.tables, units)
    with shown_in(units):
        machine = best_machine(best, Heading.of(title, file))
        result, x = as_data(machine), cited(machine)
    sections = [b.Section("parameters", "Parameters and limits", tuple(_machine(best, x)))]
    if live:
        sections.append(b.Section("live", "Try it", live))
    if best.met:
        sections.append(b.Section("binding", "What binds", tuple(_binding(x))))
    if best.front:
        sections.append(b.Section("front", "Two objectives", tuple(_front(best, x))))
    sections.append(b.Section("checks", "Starts and checks", tuple(_checks(best, x))))
    return b.Report(
        _title(best, title),
        "Search for the best machine",
        result,
        tuple(_opening(best, x)),
        tuple(sections),
        source=source_line(x.heading),
        units=units,
        opening_title="The answer",
        status="complete" if best.met else "no machine found",
    )


def _title(best: Best, title: str) -> str:
    """The title of the report, which says whether a machine was found."""
    if best.met:
        return title or "The best machine"
    return f"{title}: no machine found" if title else "No machine found"


class OptimizedStudy(NamedTuple):
    """A study, and what the search for its best machine found."""

    config: Config
    best: Best

    @property
    def report(self) -> b.Report:
        """The report on the search."""
        config = self.config
        live = (b.Live(self._live, "the best machine"),) if self.best.met else ()
        return optimum_report(self.best, config.title, config.file, config.units, live)

    def _live(self) -> b.LiveMachine:
        """The live machine of the study with the best machine."""
        source, tables = self.as_file()
        with scratch() as folder:
            return live_of_config(of_tables(tables, str(source)), folder)

    @property
    def conflict(self) -> str:
        """Why no machine meets all limits."""
        return " ".join(conflict_sentences(self.best))

    def tables(self, folder: Path) -> dict[str, Any]:
        """The tables of the study file with the best machine, as a file in `folder` has them."""
        assert self.best.machine is not None
        by_name = self.best.machine.by_name
        values = {f"machine.{name}": by_name[name] for name in self.best.wishes.names}
        return changed_tables(self.config, values, "the best machine", folder)

    def as_file(self) -> tuple[Path, dict[str, Any]]:
        """The study file with the best machine, beside that of the study: its name, and its tables."""
        source = Path(self.config.file.source).parent / FILE
        return source, self.tables(source.parent)


def _compute(config: Config, folder: Path | None, progress: TaskProgress) -> OptimizedStudy:
    """Search for the best machine of a study."""
    return OptimizedStudy(config, find_best(wishes_of(config.plans), progress))


def _accept(config: Config, **options: Any) -> None:
    wishes_of(config.plans)


def _writers(
    outcome: OptimizedStudy, report: b.Report, folder: Path, of_report: list[Writer]
) -> list[Writer]:
    """With the study file of the best machine, where there is one."""

    def study_file() -> list[Path]:
        return write_file(folder / FILE, toml_text(outcome.tables(folder)))

    return [*([study_file] if outcome.best.met else []), *of_report]


TASK: Task[Config, OptimizedStudy] = Task(
    "optimize",
    _compute,
    lambda outcome: outcome.report,
    content=BestMachine,
    files=(*PICTURES, FILE),
    accept=_accept,
    writers=_writers,
    shortfall=lambda outcome: None if outcome.best.met else "",
)


def _opening(best: Best, x: BestMachine) -> Iterator[b.Block]:
    """The best machine beside that of today, or the reason why there is none."""
    if x.conflict is not None:
        first, *others = x.conflict.sentences
        yield b.Judgement("bad", first)
        yield from map(b.Text, others)
        return
    for k, objective in enumerate(best.wishes.objectives):
        sought = x.quantities[objective.name]
        values = number(sought.best), number(sought.today), _share(sought)
        text = filled(f"{objective.name}: {{}}, today {{}}{{}}.", *values)
        yield b.Judgement("good", text) if k == 0 else b.Text(text)
    parts = (
        line(Name(free), " ", number(parameter.best, 5), Aside(line("today ", number(parameter.today, 5))))
        for free, parameter in x.parameters.items()
    )
    yield b.Text(line("The best machine has ", join(parts), "."))
    for organs in x.organs:
        beyond = "{}: the crank turns at {}, and the limit of the best machine is {}."
        yield b.Judgement("warning", filled(beyond, organs.words, number(x.speed), number(organs.speed)))
    yield _turns(best)


def _share(x: TodayAndBest) -> Line:
    """The change from today in per cent, to follow a number; nothing without both numbers."""
    today, value = number(x.today).value, number(x.best).value
    if not today or value is None:
        return ()
    change = 100.0 * (value - today) / abs(today)
    return f" ({change:+.1f} %)".replace("-", "\u2212")


def _turns(best: Best) -> fig.Figure:
    """The torque over the turn of the best machine and of that of today."""
    angle = fig.Axis("crank angle", "rad", step=45.0)
    curves = tuple(
        fig.Curve(name, best.turns["angle"], best.turns[key], look)
        for look, (name, key) in enumerate((("best", "best"), ("today", "today")))
    )
    torque = fig.Axis(f"torque at the {best.wishes.machine.model.driver_noun}", "N.m")
    return fig.Figure(
        "best-torque",
        "Torque over the turn, today and best",
        "The torque over a turn at constant speed of today's machine and of the best one.",
        ((fig.Panel(angle, torque, curves),),),
        file=PICTURES[0],
    )


def _machine(best: Best, x: BestMachine) -> Iterator[b.Block]:
    """The free parameters, the objectives and the limits, of today and of the best or nearest machine."""
    head = "best" if best.met else "nearest"
    yield from table(
        x.parameters.items(),
        ("parameter", lambda row: Name(row[0])),
        ("today", lambda row: number(row[1].today, 5)),
        (head, lambda row: number(row[1].best, 5)),
        ("least", lambda row: exact(row[1].low)),
        ("largest", lambda row: exact(row[1].high)),
        title="Free parameters",
    )
    if best.idle:
        yield b.Text(x.without_effect_words)
    limited: list[tuple[Line, WebPull]] = [
        (Name(sought), quantity) for sought, quantity in x.quantities.items()
    ]
    if x.least_pull is not None:
        limited.append(("web mean pull, least", x.least_pull))
    # if no machine meets all limits, a column marks the limits that the nearest machine misses
    missed: Any = ("limit", lambda row: "missed" if row[1].missed else "")
    yield from table(
        limited,
        ("quantity", lambda row: row[0]),
        ("today", lambda row: number(row[1].today, 4)),
        (head, lambda row: number(row[1].best, 4)),
        ("least", lambda row: exact(row[1].low)),
        ("largest", lambda row: exact(row[1].high)),
        *(() if best.met else (missed,)),
        title=line("Objectives and limits, of a turn at ", exact(x.speed, 4)),
    )
    if x.least_pull is not None:
        pull = "The web mean pull is the least at crank speeds up to {}."
        yield b.Text(filled(pull, exact(x.slack_free_speed, 4)))


def _binding(x: BestMachine) -> Iterator[b.Block]:
    """Sentences on the limits and bounds that hold the best machine back."""
    if not x.bindings:
        yield b.Text("No limit and no bound holds the best machine back.")
    for binding in x.bindings:
        yield b.Text(line(binding.text, "."))
    for clearance in x.clearances:
        yield b.Text(
            line("It is as near as the clearance allows to a limit within which it turns: ", clearance, ".")
        )


def _front(best: Best, x: BestMachine) -> Iterator[b.Block]:
    """The machines of the front in a table and in a figure."""
    first, second = best.wishes.objectives
    names = best.wishes.names
    yield b.Text(
        "No machine is better than one of the front in one objective without being worse in the other. The best "
        "machine of this report is the one nearest to the least values of both.",
        "lead",
    )
    columns: list[Any] = [
        (Name(objective.name), lambda point, key=objective.name: number(point.values[key], 4))
        for objective in (first, second)
    ]
    columns += [(Name(key), lambda point, key=key: number(point.parameters[key], 4)) for key in names]
    chosen_file: Any = ("file", lambda point: FILE if point.chosen else "")
    yield from table(x.front, *columns, chosen_file, title="Front of the two objectives")
    values = np.array([point.values for point in best.front])
    chosen = [[best.found[q.name]] for q in (first, second)]
    items: tuple[Any, ...] = (
        fig.Curve("front", values[:, 0], values[:, 1], marker="o"),
        fig.Curve("best of this report", chosen[0], chosen[1], 1, marker="s", has_line=False),
    )
    yield fig.Figure(
        "front",
        "Front of the two objectives",
        "The values of both objectives along the front.",
        ((fig.Panel(fig.Axis(first.name, first.unit), fig.Axis(second.name, second.unit), items),),),
        file=PICTURES[1],
    )


def _checks(best: Best, x: BestMachine) -> Iterator[b.Block]:
    """How many starts agree, the effort, and whether a machine near the best one is better."""
    yield b.Text(x.starts.text)
    effort, counts = x.starts.effort, "{} programs, {} iterations, {} turns computed."
    sizes = map(exact, (effort.programs, effort.iterations, effort.evaluations))
    yield b.Text(filled(counts, *sizes), "fine", form="long")
    if x.neighbours is not None:
        severity: b.Severity = "warning" if best.neighbours and best.neighbours.better else "good"
        yield b.Judgement(severity, x.neighbours.text)
