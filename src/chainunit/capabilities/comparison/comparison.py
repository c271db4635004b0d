"""Two results of studies side by side: the given values that differ, and every measure of the runs of both."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

from ... import __version__
from ...core.descriptions import USUAL_DRIVER
from ...core.errors import printable
from ...core.quantities import variables
from ...reading.text import entry
from ...study.line.shaft import ShaftAnswers
from ...study.measures import Answers
from ...study.registry import registered
from ...study.sections import all_choices, all_sections
from ...study.stored_result import StoredResult, as_mapping

_ROUNDING = 1e-12
"""Relative difference up to which two given values are the same: that of a unit's factor."""


@cache
def _words(driver: str) -> dict[str, str]:
    """By name, the words on the numbers of a result."""
    words = {name: text for part in registered() for name, text in part.words(driver).items()}
    return words | {v.name: v.described(driver) for of in (ShaftAnswers, Answers) for v in variables(of)}


_SIDES = ("a", "b")


def compare(a: StoredResult, b: StoredResult) -> dict[str, Any]:
    """The comparison, ready for JSON.

    - ``verdict``: by result, those on its model and its motor
    - ``warnings``: by result, the warnings of a kind and of runs of which the other has none
    - ``given``: by the name in a study file, the given values that differ, those of `a` and of `b`
    - ``runs``: by run, each measure of both: the values, the difference b - a, and its share of a's, of
      values that are not negative and no shares themselves
    - ``only``: the runs, events and measures that one of them has alone
    """
    results = {"a": a, "b": b}
    given = {side: dict(_given_values(each.data)) for side, each in results.items()}
    names = list(dict.fromkeys([*given["a"], *given["b"]]))
    different = [name for name in names if not _same(given["a"].get(name), given["b"].get(name))]
    drivers = {each.words("driver") or USUAL_DRIVER for each in results.values()}
    driver = drivers.pop() if len(drivers) == 1 else "driver"
    groups = {side: dict(_groups(each, driver)) for side, each in results.items()}
    both = [name for name in groups["a"] if name in groups["b"]]
    return {
        "chainunit": __version__,
        "a": _head(a),
        "b": _head(b),
        "verdict": {side: _verdicts(each) for side, each in results.items()},
        "warnings": {
            side: _warnings_alone(results[side], results[other]) for side, other in (_SIDES, _SIDES[::-1])
        },
        "given": {
            name: {side: given[side].get(name) for side in _SIDES}
            | {
                f"origin_{side}": as_mapping(each.data.get("origins")).get(name, "")
                for side, each in results.items()
            }
            for name in different
        },
        "given_equal": entry(len(names) - len(different), "1"),
        "runs": {
            name: {
                "title": groups["b"][name].title,
                "measures": _measures(groups["a"][name], groups["b"][name]),
            }
            for name in both
        },
        "only": {
            side: _alone(results[side], groups[side], results[other], groups[other])
            for side, other in (_SIDES, _SIDES[::-1])
        },
    }


def _alone(
    mine: StoredResult, groups: Mapping[str, _Group], theirs: StoredResult, others: Mapping[str, _Group]
) -> dict[str, list[str]]:
    """The runs, events and measures that one result has and the other has not."""
    missing = [name for name in groups if name not in others]
    # the further numbers of a run go with the run
    whole = {name.removeprefix("answers.") for name in missing if name.startswith("answers.")}
    runs = [name for name in missing if name.startswith("answers.") or name.split(".")[-1] not in whole]
    events = as_mapping(theirs.data.get("event"))
    return {
        "runs": [groups[name].title for name in runs],
        "events": [name for name in as_mapping(mine.data.get("event")) if name not in events],
        "measures": [
            f"{group.title}: {words}"
            for name, group in groups.items()
            if name in others
            for measure, (words, _) in group.numbers.items()
            if measure not in others[name].numbers
        ],
    }


def _verdicts(result: StoredResult) -> dict[str, dict[str, str]]:
    """The verdicts of a result by their subject: whether it holds, and the text."""
    verdicts = {}
    for name, verdict in as_mapping(result.data.get("verdict")).items():
        words = {key: as_mapping(verdict).get(key) for key in ("holds", "text")}
        if all(isinstance(each, str) for each in words.values()):
            verdicts[printable(name)] = {key: printable(str(each), 2000) for key, each in words.items()}
    return verdicts


def _warnings_alone(mine: StoredResult, theirs: StoredResult) -> list[str]:
    """The warnings that one result has and the other has not. A kind may have had another name in an earlier version,
    so that a warning in the same words is the same, too."""
    others = {x for known in _warnings(theirs) for x in known}
    return [text for subject, text in _warnings(mine) if subject not in others and text not in others]


def _warnings(result: StoredResult) -> Iterator[tuple[Any, str]]:
    """The warnings of a result, each with its subject: its kind and its runs."""
    warnings = result.data.get("warnings")
    for each in warnings if isinstance(warnings, list) else []:
        text = as_mapping(each).get("text")
        if isinstance(text, str):
            yield (str(each.get("kind")), str(each.get("runs"))), printable(text, 2000)


def _head(result: StoredResult) -> dict[str, str]:
    names = ("title", "status", "chainunit")
    return {"file": printable(str(result.file), 500)} | {name: result.words(name) for name in names}


def _is_finite(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= sys.float_info.max


def _is_entry(node: Any) -> bool:
    """Whether a node is a number or a list of numbers with its unit, as this program writes it."""
    if not isinstance(node, Mapping) or "value" not in node:
        return False
    value, words = node["value"], (node.get("unit"), node.get("kind", ""))
    numbers = value if isinstance(value, list) else [] if value is None else [value]
    return all(map(_is_finite, numbers)) and all(isinstance(x, str) and x.isprintable() for x in words)


def _is_number(node: Any) -> bool:
    return _is_entry(node) and _is_finite(node["value"])


# -- given values


def _given_values(data: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """The given values of a result, by their names in a study file: entries, texts, switches and lists."""
    for name in all_choices():
        yield from _leaves(data.get(name), name)
    for table in ("system", "machine", "feed", "motor", "event"):
        yield from _leaves(data.get(table), table)
    for table, section in all_sections().items():
        node = as_mapping(data.get(table))
        if section.apart:
            yield from _leaves(node.get("asked"), table)
            continue
        # the result may have its findings in the same place
        own = {v.name for v in variables(section.declaration)} | set(section.keys)
        yield from _leaves({name: each for name, each in node.items() if name in own}, table)


def _leaves(node: Any, path: str) -> Iterator[tuple[str, Any]]:
    if isinstance(node, Mapping) and not _is_entry(node):
        for name, inner in node.items():
            yield from _leaves(inner, f"{path}.{printable(name)}")
    elif node is not None:
        plain = isinstance(node, bool | Mapping) or (isinstance(node, list) and all(map(_is_finite, node)))
        yield path, node if plain else printable(str(node))


def _same(a: Any, b: Any) -> bool:
    if _is_number(a) and _is_number(b):
        same = math.isclose(a["value"], b["value"], rel_tol=_ROUNDING)
        return bool(a["unit"] == b["unit"] and same)
    return bool(a == b)


# -- measures


@dataclass(frozen=True)
class _Group:
    """Numbers that belong to one run, by name, each with its words and its entry."""

    title: str
    numbers: Mapping[str, tuple[str, Mapping[str, Any]]]


def _groups(result: StoredResult, driver: str) -> Iterator[tuple[str, _Group]]:
    """The numbers of each run of a result, by their place in it; their words name the `driver`."""
    data = result.data
    for run in ("start_up", "settling"):
        yield from _group(run, result.title_of(run), data.get(run), driver)
    for run, numbers in as_mapping(data.get("answers")).items():
        yield from _group(f"answers.{run}", result.title_of(run), numbers, driver)
    for run, numbers in as_mapping(data.get("shaft")).items():
        yield from _group(f"shaft.{run}", f"{result.title_of(run)}: driveline", numbers, driver)
    for run, pins in as_mapping(data.get("pins")).items():
        yield from _group(f"pins.{run}", f"{result.title_of(run)}: forces in the bearings", pins, driver)
    random = as_mapping(data.get("monte_carlo")).get("quantiles")
    yield from _group("monte_carlo.quantiles", "overloads at random", random, driver)


def _group(place: str, title: str, node: Any, driver: str) -> Iterator[tuple[str, _Group]]:
    numbers = {
        name.removeprefix("."): (_spoken(name.removeprefix("."), driver), each)
        for name, each in _leaves(node, "")
        if _is_entry(each) and (each["value"] is None or _is_number(each))
    }
    if numbers:
        yield place, _Group(title, numbers)


def _spoken(name: str, driver: str) -> str:
    """The name of a number in words: ``crank_torque_peak.q95`` -> crank torque, peak, 95 %."""
    first, _, rest = name.partition(".")
    rest = f"{rest[1:]} % of runs below" if rest[1:].isdigit() and rest[0] == "q" else rest.replace(".", ", ")
    return ", ".join(filter(None, (_words(driver).get(first, first.replace("_", " ")), rest)))


def _measures(a: _Group, b: _Group) -> dict[str, Any]:
    """The measures that both have and that have a value in one of them."""
    return {
        name: {"title": words} | _pair(one, b.numbers[name][1])
        for name, (words, one) in a.numbers.items()
        if name in b.numbers and not one["value"] is b.numbers[name][1]["value"] is None
    }


def _pair(a: Mapping[str, Any], b: Mapping[str, Any]) -> dict[str, Any]:
    """Two values of a measure with their difference and its share, which are None where they have no meaning."""
    kind, unit = str(a.get("kind", "")), a["unit"]
    is_share = kind in ("percent", "dip", "used")
    of_difference = "points" if is_share else "difference" if unit == "K" else kind
    difference = share = None
    if a["value"] is not None and b["value"] is not None and unit == b["unit"]:
        difference = b["value"] - a["value"]
        # a temperature in K has a zero that says nothing, and so has a value of either sign
        if a["value"] > 0.0 and b["value"] >= 0.0 and unit != "K" and not is_share:
            share = difference / a["value"]
    return {
        "a": entry(a["value"], unit, kind),
        "b": entry(b["value"], b["unit"], str(b.get("kind", ""))),
        "difference": entry(difference, unit, of_difference),
        "relative": entry(share, "1", "percent"),
    }
