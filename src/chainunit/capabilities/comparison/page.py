"""The report on two results of studies side by side."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from ...report import blocks as b
from ...report.lines import Aside, Line, Name, capital, join, line
from ...report.task import Task
from ...study.measures import MEASURES
from ...study.stored_result import StoredResult
from .comparison import SIDES, compare

_FOLLOWS = {"tuned": "tuned", "catalogue": "of the catalogue", "sizing": "by sizing"}
"""By origin, the words beside a given value that the file does not give."""
_SEVERITY: dict[str, b.Severity] = {"true": "good", "in part": "partly", "false": "bad"}
_DIGITS = (0, 9, 12, 15)
"""Digits with which two given values are shown until they differ; 0 is the usual number."""


def comparison_report(result: Mapping[str, Any]) -> b.Report:
    """The report on a comparison, see `compare`."""
    s = b.Source(result)
    return b.Report(
        "Two studies side by side",
        "Comparison",
        result,
        (*_opening(s), *_given(s)),
        (
            b.Section("only", "What only one of them has", tuple(_only(s))),
            b.Section("runs", "Every run in numbers", tuple(_runs(s))),
        ),
        source=s.line("chainunit {chainunit}"),
        opening_title="Verdicts, and what differs in the given values",
    )


def _opening(s: b.Source) -> Iterator[b.Block]:
    """Both files, their verdicts, and the warnings that only one has."""
    for side in SIDES:
        head, name = s.result[side], side.upper()
        titled = f"{name}: {{{side}.title}}" if head["title"] else name
        yield b.Text(s.line(titled + f" ({{{side}.file}}, chainunit {{{side}.chainunit}})."))
        if head["status"] != "complete":
            yield b.Judgement("warning", s.line(f"{name}: {{{side}.status}}."))
    for side in SIDES:
        for subject, verdict in s.result["verdict"][side].items():
            severity = _SEVERITY.get(verdict["holds"], "warning")
            yield b.Judgement(severity, line(f"{side.upper()}: ", s.words(f"verdict.{side}.{subject}.text")))
    for side in SIDES:
        for warning in s.lines(f"warnings.{side}"):
            yield b.Judgement("warning", line(f"only {side.upper()}: ", warning))


def _given(s: b.Source) -> Iterator[b.Block]:
    names = s.result["given"]
    # of an event that one of them has alone the terminal gives the name of its run
    alone = tuple(f"event.{event}." for side in SIDES for event in s.result["only"][side]["events"])
    forms: dict[str, b.Form] = {name: "long" if name.startswith(alone) else "both" for name in names}
    form: b.Form = "both" if "both" in forms.values() else "long"
    if form == "long":
        have = " that both have" if names else ""
        shown: b.Form = "short" if names else "both"
        yield b.Text(s.line(f"All {{=given_equal}} given values{have} are the same."), form=shown)
    if names:
        rows = (
            b.TableRow((Name(name), *(_value(s, name, side) for side in SIDES)), form=forms[name])
            for name in names
        )
        title = s.line("Given values that differ; {=given_equal} are the same")
        yield b.Table(tuple(rows), b.heads("key", "A", "B"), title=title, form=form)


def _value(s: b.Source, name: str, side: str) -> Line:
    """A given value, with its origin where the study file does not give it."""
    path, pair = f"given.{name}.{side}", s.result["given"][name]
    value = pair[side]
    shown: Line = "-"
    if isinstance(value, Mapping) and isinstance(value["value"], list):
        shown = join([s.number(path, i, as_given=True) for i in range(len(value["value"]))], " to ")
    elif isinstance(value, Mapping):
        shown = s.number(path, as_given=True, digits=_digits(pair))
    elif isinstance(value, bool):
        shown = "yes" if value else "no"
    elif isinstance(value, list):
        shown = ", ".join(f"{x:g}" if isinstance(x, float) else str(x) for x in value) or "none"
    elif value is not None:
        shown = s.words(path)
    origin = _FOLLOWS.get(pair[f"origin_{side}"]) if value is not None else None
    return line(shown, Aside(origin)) if origin else shown


def _digits(pair: Mapping[str, Any]) -> int:
    """The number of digits by which two given numbers differ; the usual one for other values."""
    values = [pair[side]["value"] if isinstance(pair[side], Mapping) else None for side in SIDES]
    if not all(isinstance(value, int | float) for value in values):
        return 0
    differ = (digits for digits in _DIGITS if len({f"{value:.{digits or 6}g}" for value in values}) > 1)
    return next(differ, _DIGITS[-1])


def _only(s: b.Source) -> Iterator[b.Block]:
    for side in SIDES:
        for what in ("runs", "measures"):
            if titles := s.result["only"][side][what]:
                yield b.Text(f"Only {side.upper()} has the {what}: {'; '.join(titles)}.")


def _runs(s: b.Source) -> Iterator[b.Block]:
    equal = []
    for run, entries in s.result["runs"].items():
        measures = entries["measures"]
        different = [name for name, pair in measures.items() if pair["a"]["value"] != pair["b"]["value"]]
        short = {name for name in different if _is_short(run, name)}
        if not different:
            equal.append(entries["title"])
        rows = []
        for name, pair in measures.items():
            columns = (
                s.number(f"runs.{run}.measures.{name}.{column}")
                for column in (*SIDES, "difference", "relative")
            )
            rows.append(b.TableRow((pair["title"], *columns), form="both" if name in short else "long"))
        if rows:
            heads, title = b.heads("", "A", "B", "B - A", "relative"), capital(entries["title"])
            yield b.Table(tuple(rows), heads, title=title, form="both" if short else "long")
    if equal:
        yield b.Text(f"Every number is the same in: {'; '.join(equal)}.")


def _is_short(run: str, name: str) -> bool:
    """Whether a measure that differs is shown where there is little room, too."""
    measure = MEASURES.get(name)
    return not run.startswith("pins.") and (measure is None or not measure.minor)


TASK: Task[tuple[StoredResult, StoredResult], Mapping[str, Any]] = Task(
    "compare",
    lambda pair, folder, progress: compare(*pair),
    comparison_report,
    sources=lambda pair: [stored.file for stored in pair],
)
