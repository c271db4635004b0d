"""The report on two results of studies side by side."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from ...report import blocks as b
from ...report.lines import Aside, Line, Name, capital, line
from ...report.task import Task
from ...study.measures import MEASURES
from ...study.stored_result import StoredResult
from .comparison import compare

_SIDES = ("a", "b")
_FOLLOWS = {"tuned": "tuned", "catalogue": "of the catalogue", "sizing": "by sizing"}
"""By origin, the words beside a given value that the file does not give."""


def comparison_report(result: Mapping[str, Any]) -> b.Report:
    """The report on a comparison, see `compare`."""
    s = b.Source(result)
    return b.Report(
        "Two studies side by side",
        "Comparison",
        result,
        tuple(_given(s)),
        (
            b.Section("only", "What only one of them has", tuple(_only(s))),
            b.Section("runs", "Every run in numbers", tuple(_runs(s))),
        ),
        source=s.line("chainunit {chainunit}"),
        opening_title="Verdicts, and what differs in the given values",
    )


def _given(s: b.Source) -> Iterator[b.Block]:
    for side in _SIDES:
        head = s.result[side]
        title = s.line(f": {{{side}.title}}") if head["title"] else ()
        yield b.Text(
            line(side.upper(), title, s.line(f" ({{{side}.file}}, chainunit {{{side}.chainunit}})"), ".")
        )
        if head["status"] != "complete":
            yield b.Judgement("warning", line(f"{side.upper()}: ", s.words(f"{side}.status"), "."))
    yield from _verdicts(s)
    names = s.result["given"]
    if not names:
        yield b.Text(s.line("All {=given_equal} given values are the same."))
        return
    alone = tuple(f"event.{event}." for side in _SIDES for event in s.result["only"][side]["events"])
    rows = (
        # of an event that one of them has alone the terminal gives the name of its run
        b.TableRow(
            (Name(name), *(_value(s, name, side) for side in _SIDES)),
            form="long" if name.startswith(alone) else "both",
        )
        for name in names
    )
    of_both = any(not name.startswith(alone) for name in names)
    if not of_both:
        yield b.Text(s.line("All {=given_equal} given values that both have are the same."), form="short")
    yield b.Table(
        tuple(rows),
        b.heads("key", "A", "B"),
        title=s.line("Given values that differ; {=given_equal} are the same"),
        form="both" if of_both else "long",
    )


_SEVERITY: dict[str, b.Severity] = {"true": "good", "in part": "partly", "false": "bad"}


def _verdicts(s: b.Source) -> Iterator[b.Block]:
    """The verdicts of both, and the warnings that only one has."""
    for side in _SIDES:
        for name, verdict in s.result["verdict"][side].items():
            severity = _SEVERITY.get(verdict["holds"], "warning")
            yield b.Judgement(severity, line(f"{side.upper()}: ", s.words(f"verdict.{side}.{name}.text")))
    for side in _SIDES:
        for words in s.lines(f"warnings.{side}"):
            yield b.Judgement("warning", line(f"only {side.upper()}: ", words))


def _value(s: b.Source, name: str, side: str) -> Line:
    """A given value, with its origin where the study file does not give it."""
    path = f"given.{name}.{side}"
    value = s.result["given"][name][side]
    if value is None:
        return "-"
    shown: Line
    if isinstance(value, Mapping) and isinstance(value["value"], list):
        ends = [s.number(path, i, as_given=True) for i in range(len(value["value"]))]
        shown = line(*(piece for end in ends for piece in (" to ", end)))[1:]
    elif isinstance(value, Mapping):
        shown = s.number(path, as_given=True, digits=_digits(s.result["given"][name]))
    elif isinstance(value, bool):
        shown = "yes" if value else "no"
    elif isinstance(value, list):
        shown = ", ".join(f"{x:g}" if isinstance(x, float) else str(x) for x in value) or "none"
    else:
        shown = s.words(path)
    origin = _FOLLOWS.get(s.result["given"][name][f"origin_{side}"])
    return line(shown, Aside(origin)) if origin else shown


def _digits(pair: Mapping[str, Any]) -> int:
    """The number of digits by which two given numbers differ; 0, the usual number, for other values."""
    values = [pair[side]["value"] if isinstance(pair[side], Mapping) else None for side in _SIDES]
    if not all(isinstance(value, int | float) for value in values):
        return 0
    texts = ({f"{value:.{digits}g}" for value in values} for digits in (6, 9, 12, 15))
    return next((digits for digits, each in zip((0, 9, 12, 15), texts, strict=True) if len(each) > 1), 15)


def _only(s: b.Source) -> Iterator[b.Block]:
    for side in _SIDES:
        for what in ("runs", "measures"):
            titles = s.result["only"][side][what]
            if titles:
                yield b.Text(f"Only {side.upper()} has the {what}: {'; '.join(titles)}.")


def _runs(s: b.Source) -> Iterator[b.Block]:
    equal = []
    for run, entries in s.result["runs"].items():
        names = entries["measures"]
        different = [name for name, each in names.items() if each["a"]["value"] != each["b"]["value"]]
        short = [name for name in different if _is_short(run, name)]
        if not different:
            equal.append(entries["title"])
        if names:
            rows = (_row(s, run, name, name in short) for name in names)
            yield b.Table(
                tuple(rows),
                b.heads("", "A", "B", "B - A", "relative"),
                title=capital(entries["title"]),
                form="both" if short else "long",
            )
    if equal:
        yield b.Text(f"Every number is the same in: {'; '.join(equal)}.")


def _is_short(run: str, name: str) -> bool:
    """Whether a measure that differs is shown where there is little room, too."""
    measure = MEASURES.get(name)
    return not run.startswith("pins.") and (measure is None or not measure.minor)


def _row(s: b.Source, run: str, name: str, is_short: bool) -> b.TableRow:
    path = f"runs.{run}.measures.{name}"
    numbers = (s.number(f"{path}.{of}") for of in (*_SIDES, "difference", "relative"))
    title = s.result["runs"][run]["measures"][name]["title"]
    return b.TableRow((title, *numbers), form="both" if is_short else "long")


TASK: Task[tuple[StoredResult, StoredResult], Mapping[str, Any]] = Task(
    "compare", lambda pair, folder, progress: compare(*pair), comparison_report
)
