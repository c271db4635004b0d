"""Two results of studies side by side: the given values that differ, and every measure of the runs of both."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Mapping
from typing import Any

from ... import __version__
from ...core.descriptions import USUAL_DRIVER
from ...core.errors import printable
from ...core.quantities import finite, quantity, variables
from ...reading.result_entries import as_mapping
from ...reading.results import GIVEN, InUnit, part, result
from ...study.line.shaft import ShaftAnswers
from ...study.measures import Answers
from ...study.sections import all_choices, all_sections
from ...study.stored_result import StoredResult

SIDES = ("a", "b")
_ROUNDING = 1e-12
"""Relative difference up to which two given values are the same: that of a unit's factor."""
_RUNS = {"answers": "", "shaft": ": driveline", "pins": ": forces in the bearings"}
"""By table of a result with numbers of each run, what follows the title of the run."""
_RANDOM = "monte_carlo.quantiles"

_TEXTS = ("unit", "kind", "title")
"""The texts beside the value of a number."""

Numbers = dict[str, InUnit]
"""Numbers of a run by their dotted names."""


@result
class ComparedFile:
    """A result that is compared."""

    file: str = part("its file")
    title: str = part("title of the study")
    status: str = part("whether the study is complete")
    chainunit: str = part("version of chainunit")


@result
class ComparedVerdict:
    """A verdict of one result."""

    holds: str = part("whether it holds")
    text: str = part("the verdict in words")


@result
class ComparedValue:
    """A given value that differs, by "a" and "b"; a number is an `InUnit`."""

    values: Mapping[str, Any] = part("the value, or null", unit=GIVEN, inline=True)
    origins: Mapping[str, str] = part("its origin, by origin_a and origin_b", inline=True)


@result
class ComparedMeasure:
    """A measure of a run of both results."""

    title: str = part("the measure in words")
    a: InUnit = part("its value in A")
    b: InUnit = part("its value in B")
    difference: InUnit = part("difference B - A")
    relative: InUnit = part("share of A's, of values that are not negative and no shares themselves")


@result
class ComparedRun:
    """A run of both results."""

    title: str = part("the run in words")
    measures: Mapping[str, ComparedMeasure] = part("the measures with a value in one of them")


@result
class Alone:
    """What one result has alone."""

    runs: list[str] = part("runs, by their titles")
    events: list[str] = part("events, by their names")
    measures: list[str] = part("measures of runs of both, in words")


@result
class StudyComparison:
    """Two results of studies side by side: the content of comparison.json."""

    chainunit: str = part("version of chainunit")
    files: Mapping[str, ComparedFile] = part("both results", inline=True)
    verdict: Mapping[str, Mapping[str, ComparedVerdict]] = part("by result, the verdicts on model and motor")
    warnings: Mapping[str, list[str]] = part(
        "by result, the warnings of a kind and of runs of which the other has none"
    )
    given: Mapping[str, ComparedValue] = part("by the name in a study file, the given values that differ")
    given_equal: float = quantity("1", "number of given values that are the same")
    runs: Mapping[str, ComparedRun] = part("the runs of both")
    only: Mapping[str, Alone] = part("by result, what it has alone")


def compare(a: StoredResult, b: StoredResult) -> StudyComparison:
    """Both results side by side."""
    results, pairs = {"a": a, "b": b}, (SIDES, SIDES[::-1])
    values = {side: dict(_given_values(stored.data)) for side, stored in results.items()}
    runs = {side: _runs(stored.data) for side, stored in results.items()}
    drivers = {stored.words("driver") or USUAL_DRIVER for stored in results.values()}
    driver = drivers.pop() if len(drivers) == 1 else "driver"
    descriptions = {v.name: v.described(driver) for kind in (ShaftAnswers, Answers) for v in variables(kind)}
    names = dict.fromkeys([*values["a"], *values["b"]])
    different = [name for name in names if not _same(*(values[side].get(name) for side in SIDES))]
    origins = {side: as_mapping(stored.data.get("origins")) for side, stored in results.items()}
    return StudyComparison(
        __version__,
        {side: _head(stored) for side, stored in results.items()},
        {side: _verdicts(stored) for side, stored in results.items()},
        {side: _warnings_alone(results[side], results[other]) for side, other in pairs},
        {
            name: ComparedValue(
                {side: values[side].get(name) for side in SIDES},
                {f"origin_{side}": origins[side].get(name, "") for side in SIDES},
            )
            for name in different
        },
        float(len(names) - len(different)),
        {
            run: ComparedRun(_title(b, run), _measures(numbers, runs["b"][run], descriptions))
            for run, numbers in runs["a"].items()
            if run in runs["b"]
        },
        {
            side: _alone(results[side], runs[side], results[other], runs[other], descriptions)
            for side, other in pairs
        },
    )


def _head(stored: StoredResult) -> ComparedFile:
    texts = (stored.words(name) for name in ("title", "status", "chainunit"))
    return ComparedFile(printable(str(stored.file), 500), *texts)


def _verdicts(stored: StoredResult) -> dict[str, ComparedVerdict]:
    """The verdicts of a result by their subject."""
    verdicts = {}
    for name, verdict in as_mapping(stored.data.get("verdict")).items():
        texts = [as_mapping(verdict).get(key) for key in ("holds", "text")]
        if all(isinstance(text, str) for text in texts):
            verdicts[printable(name)] = ComparedVerdict(*(printable(str(text), 2000) for text in texts))
    return verdicts


def _warnings_alone(mine: StoredResult, theirs: StoredResult) -> list[str]:
    """The warnings that one result has and the other has not."""
    others = dict(_warnings(theirs))
    return [text for subject, text in _warnings(mine) if subject not in others]


def _warnings(stored: StoredResult) -> Iterator[tuple[Any, str]]:
    """The warnings of a result, each with its code and its runs. An earlier version has a kind in place of a code."""
    warnings = stored.data.get("warnings")
    for warning in map(as_mapping, warnings if isinstance(warnings, list) else []):
        if isinstance(text := warning.get("text"), str):
            code = str(warning.get("code") or warning.get("kind")).replace(" ", "-")
            yield (code, str(warning.get("runs"))), printable(text, 2000)


# -- the numbers of a result by their names


def _leaves(node: Any, path: str) -> Iterator[tuple[str, Any]]:
    """All values below a node with their dotted names: numbers in their units, switches, lists of numbers, texts."""
    if _is_entry(node):
        yield path.removeprefix("."), InUnit(*(node.get(key, "") for key in ("value", *_TEXTS)))
    elif isinstance(node, Mapping):
        for name, below in node.items():
            yield from _leaves(below, f"{path}.{printable(name)}")
    elif node is not None:
        plain = isinstance(node, bool) or (isinstance(node, list) and all(map(_is_finite, node)))
        yield path.removeprefix("."), node if plain else printable(str(node))


def _is_finite(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= sys.float_info.max


def _is_entry(node: Any) -> bool:
    """Whether a node is a number or a list of numbers with its unit, as this program writes it."""
    if not isinstance(node, Mapping) or "value" not in node:
        return False
    value, texts = node["value"], (node.get("unit"), *(node.get(key, "") for key in _TEXTS[1:]))
    numbers = value if isinstance(value, list) else [] if value is None else [value]
    return all(map(_is_finite, numbers)) and all(
        isinstance(text, str) and text.isprintable() for text in texts
    )


def _given_values(data: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """The given values of a result, by their names in a study file."""
    for name in (*all_choices(), "system", "machine", "feed", "motor", "event"):
        yield from _leaves(data.get(name), name)
    for table, section in all_sections().items():
        node = as_mapping(data.get(table))
        if section.apart:
            yield from _leaves(node.get("asked"), table)
            continue
        # the result may have its findings in the same place
        keys = {v.name for v in variables(section.declaration)} | set(section.keys)
        yield from _leaves({name: value for name, value in node.items() if name in keys}, table)


def _same(a: Any, b: Any) -> bool:
    """Whether two given values are equal, numbers but for rounding."""
    if all(isinstance(x, InUnit) and _is_finite(x.value) for x in (a, b)):
        return a.unit == b.unit and math.isclose(a.value, b.value, rel_tol=_ROUNDING)
    return bool(a == b)


def _runs(data: Mapping[str, Any]) -> dict[str, Numbers]:
    """The numbers of each run of a result, by their place in it; one that is not known has the value None."""
    tables = {table: as_mapping(data.get(table)) for table in (*_RUNS, "monte_carlo")}
    nodes = {run: data.get(run) for run in ("start_up", "settling")}
    nodes |= {f"{table}.{run}": node for table in _RUNS for run, node in tables[table].items()}
    nodes[_RANDOM] = tables["monte_carlo"].get("quantiles")
    runs = {}
    for run, node in nodes.items():
        leaves = {name: value for name, value in _leaves(node, "") if isinstance(value, InUnit)}
        if numbers := {name: x for name, x in leaves.items() if not isinstance(x.value, list)}:
            runs[run] = numbers
    return runs


# -- their words


def _spoken(name: str, descriptions: Mapping[str, str]) -> str:
    """The name of a number in words: ``crank_torque_peak.q95`` -> crank torque, peak, 95 %."""
    first, _, suffix = name.partition(".")
    is_quantile = suffix[1:].isdigit() and suffix[0] == "q"
    suffix = f"{suffix[1:]} % of runs below" if is_quantile else suffix.replace(".", ", ")
    return ", ".join(filter(None, (descriptions.get(first, first.replace("_", " ")), suffix)))


def _title(stored: StoredResult, run: str) -> str:
    table, _, name = run.rpartition(".")
    return "overloads at random" if run == _RANDOM else stored.title_of(name) + _RUNS.get(table, "")


# -- both


def _measures(a: Numbers, b: Numbers, descriptions: Mapping[str, str]) -> dict[str, ComparedMeasure]:
    """The measures that both have and that have a value in one of them."""
    return {
        name: _measure(_spoken(name, descriptions), a[name], b[name])
        for name in a
        if name in b and not a[name].value is b[name].value is None
    }


def _measure(title: str, a: InUnit, b: InUnit) -> ComparedMeasure:
    """Two values of a measure with their difference and its share, which are None where they have no meaning."""
    is_share = a.kind in ("percent", "dip", "used")
    of_difference = "points" if is_share else "difference" if a.unit == "K" else a.kind
    x, y, difference, share = finite(a.value), finite(b.value), None, None
    if x is not None and y is not None and a.unit == b.unit:
        difference = y - x
        # a temperature in K has a zero that says nothing, and so has a value of either sign
        if x > 0.0 and y >= 0.0 and a.unit != "K" and not is_share:
            share = difference / x
    return ComparedMeasure(
        title,
        InUnit(x, a.unit, a.kind),
        InUnit(y, b.unit, b.kind),
        InUnit(difference, a.unit, of_difference),
        InUnit(share, "1", "percent"),
    )


def _alone(
    mine: StoredResult,
    runs: Mapping[str, Numbers],
    theirs: StoredResult,
    others: Mapping[str, Numbers],
    descriptions: Mapping[str, str],
) -> Alone:
    """The runs, events and measures that one result has and the other has not."""
    answered = {
        run.removeprefix("answers.") for run in runs if run.startswith("answers.") and run not in others
    }
    titles, measures = list[str](), list[str]()
    for run, numbers in runs.items():
        if run in others:
            names = (name for name in numbers if name not in others[run])
            measures += [f"{_title(mine, run)}: {_spoken(name, descriptions)}" for name in names]
        elif run.startswith("answers.") or run.split(".")[-1] not in answered:
            # the further numbers of a run go with its answers
            titles.append(_title(mine, run))
    events = as_mapping(theirs.data.get("event"))
    return Alone(
        titles, [name for name in as_mapping(mine.data.get("event")) if name not in events], measures
    )
