"""The report on two results of studies side by side."""

from __future__ import annotations

from collections.abc import Iterator

from ...reading.results import InUnit, as_data
from ...report import blocks as b
from ...report.cited import cited, exact, number
from ...report.lines import Aside, Line, Name, capital, filled, join, line
from ...report.task import Task
from ...study.measures import MEASURES
from ...study.stored_result import StoredResult
from .comparison import SIDES, ComparedValue, StudyComparison, compare

_FOLLOWS = {"tuned": "tuned", "catalogue": "of the catalogue", "sizing": "by sizing"}
"""By origin, the words beside a given value that the file does not give."""
_SEVERITY: dict[str, b.Severity] = {"true": "good", "in part": "partly", "false": "bad"}
_DIGITS = (0, 9, 12, 15)
"""Digits with which two given values are shown until they differ; 0 is the usual number."""


def comparison_report(comparison: StudyComparison) -> b.Report:
    """The report on a comparison."""
    x = cited(comparison)
    return b.Report(
        "Two studies side by side",
        "Comparison",
        as_data(comparison),
        (*_opening(x), *_given(x, comparison)),
        (
            b.Section("only", "What only one of them has", tuple(_only(comparison))),
            b.Section("runs", "Every run in numbers", tuple(_runs(x, comparison))),
        ),
        source=line("chainunit ", x.chainunit),
        opening_title="Verdicts, and what differs in the given values",
    )


def _opening(x: StudyComparison) -> Iterator[b.Block]:
    """Both files, their verdicts, and the warnings that only one has."""
    for side, compared in x.files.items():
        titled = line(side.upper(), ": ", compared.title) if compared.title else side.upper()
        yield b.Text(filled("{} ({}, chainunit {}).", titled, compared.file, compared.chainunit))
        if compared.status != "complete":
            yield b.Judgement("warning", filled("{}: {}.", side.upper(), compared.status))
    for side, verdicts in x.verdict.items():
        for verdict in verdicts.values():
            severity = _SEVERITY.get(verdict.holds, "warning")
            yield b.Judgement(severity, line(f"{side.upper()}: ", verdict.text))
    for side, warnings in x.warnings.items():
        for warning in warnings:
            yield b.Judgement("warning", line(f"only {side.upper()}: ", warning))


def _given(x: StudyComparison, comparison: StudyComparison) -> Iterator[b.Block]:
    """The given values that differ; in the long form also those of events that one study has alone, and how many are
    equal."""
    names, equal = comparison.given, exact(x.given_equal)
    # of an event that one of them has alone the terminal gives the name of its run
    alone = tuple(f"event.{event}." for side in comparison.only.values() for event in side.events)
    forms: dict[str, b.Form] = {name: "long" if name.startswith(alone) else "both" for name in names}
    form: b.Form = "both" if "both" in forms.values() else "long"
    if form == "long":
        have = " that both have" if names else ""
        shown: b.Form = "short" if names else "both"
        yield b.Text(filled(f"All {{}} given values{have} are the same.", equal), form=shown)
    if names:
        rows = (
            b.TableRow(
                (Name(name), *(_value(x.given[name], compared, side) for side in SIDES)), form=forms[name]
            )
            for name, compared in names.items()
        )
        title = filled("Given values that differ; {} are the same", equal)
        yield b.Table(tuple(rows), b.heads("key", "A", "B"), title=title, form=form)


def _value(x: ComparedValue, compared: ComparedValue, side: str) -> Line:
    """A given value, with its origin where the study file does not give it."""
    value, piece = compared.values[side], x.values[side]
    shown: Line = "-"
    if isinstance(value, InUnit) and isinstance(value.value, list):
        shown = join(map(exact, piece), " to ")
    elif isinstance(value, InUnit):
        shown = exact(piece, _digits(compared))
    elif isinstance(value, bool):
        shown = "yes" if value else "no"
    elif isinstance(value, list):
        shown = (
            ", ".join(f"{entry:g}" if isinstance(entry, float) else str(entry) for entry in value) or "none"
        )
    elif value is not None:
        shown = piece
    origin = _FOLLOWS.get(compared.origins[f"origin_{side}"]) if value is not None else None
    return line(shown, Aside(origin)) if origin else shown


def _digits(compared: ComparedValue) -> int:
    """The number of digits by which two given numbers differ; the usual one for other values."""
    values = [value.value if isinstance(value, InUnit) else None for value in compared.values.values()]
    if not all(isinstance(value, int | float) for value in values):
        return 0
    differ = (digits for digits in _DIGITS if len({f"{value:.{digits or 6}g}" for value in values}) > 1)
    return next(differ, _DIGITS[-1])


def _only(comparison: StudyComparison) -> Iterator[b.Block]:
    """The runs and the measures that only one result has."""
    for side, single in comparison.only.items():
        for noun, titles in (("runs", single.runs), ("measures", single.measures)):
            if titles:
                yield b.Text(f"Only {side.upper()} has the {noun}: {'; '.join(titles)}.")


def _runs(x: StudyComparison, comparison: StudyComparison) -> Iterator[b.Block]:
    """A table of the measures of each run; the runs in which all are equal are only named."""
    equal = []
    for run, compared in comparison.runs.items():
        measures = compared.measures.items()
        different = [name for name, measure in measures if measure.a.value != measure.b.value]
        # with little room the minor measures and the pins are left out
        minor = {name for name, measure in MEASURES.items() if measure.minor}
        short = set() if run.startswith("pins.") else {*different} - minor
        if not different:
            equal.append(compared.title)
        rows = []
        for name, shown in x.runs[run].measures.items():
            numbers = map(number, (shown.a, shown.b, shown.difference, shown.relative))
            rows.append(b.TableRow((str(shown.title), *numbers), form="both" if name in short else "long"))
        if rows:
            heads, title = b.heads("", "A", "B", "B - A", "relative"), capital(compared.title)
            yield b.Table(tuple(rows), heads, title=title, form="both" if short else "long")
    if equal:
        yield b.Text(f"Every number is the same in: {'; '.join(equal)}.")


TASK: Task[tuple[StoredResult, StoredResult], StudyComparison] = Task(
    "compare",
    lambda pair, folder, progress: compare(*pair),
    comparison_report,
    sources=lambda pair: [stored.file for stored in pair],
)
