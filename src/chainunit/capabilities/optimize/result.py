"""The result of a search for the best machine as data: the content of result.json."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ... import __version__
from ...core.quantities import finite
from ...reading.text import Units, array_entry, entry, shown_in
from ...study.config import Config
from ...study.organ_limits import limits_of_organs
from ...study.study_file import changed_tables
from ...study.verdict import passed_limits
from .best import Best
from .checks import STEPS
from .wishes import TurnLimit
from .words import (
    bindings,
    clearances,
    conflict_sentences,
    idle_sentence,
    neighbours_sentence,
    sentence,
    starts_sentence,
)

EVERY = 4
"""One of so many angles of the turns is in the result."""
CONFLICT = "no machine meets all limits"
_SMALL = 100.0
"""Power below which powers are shown in W [W]."""


def as_dict(best: Best, config: Config) -> dict[str, Any]:
    """All results, ready for JSON, each number with its unit."""
    with shown_in(units_of(best, config)):
        return _as_dict(best, config)


def best_tables(best: Best, config: Config, folder: Path) -> dict[str, Any]:
    """The tables of the study file with the best machine, as a file in `folder` has them."""
    assert best.machine is not None
    own = best.machine.by_name
    values = {f"machine.{name}": own[name] for name in best.wishes.names}
    return changed_tables(config, values, "the best machine", folder)


def units_of(best: Best, config: Config) -> Units:
    """The units of the report: those of the study, and W for powers where one is below 100 W and the study does not
    name a unit."""
    powers = [
        abs(x)
        for name, q in best.quantities.items()
        for limit in (_limit_of(best, name),)
        for x in (best.today[name], best.found[name], limit and limit.low, limit and limit.high)
        if q.unit == "W" and x
    ]
    named = config.tables.get("report", {}).get("units", {})
    if "power" in named or not any(x < _SMALL for x in powers):
        return config.units
    return {**config.units, "power": ("W",)}


def _limit_of(best: Best, name: str) -> TurnLimit | None:
    return next((each for each in best.wishes.limits if each.name == name), None)


def _as_dict(best: Best, config: Config) -> dict[str, Any]:
    wishes = best.wishes
    variables = {v.name: v for v in wishes.machine.model.parameter_layout.variables}
    x = (
        best.answer.x
        if best.answer is not None
        else best.conflict.nearest.x
        if best.conflict
        else wishes.today
    )
    return {
        "chainunit": __version__,
        "title": config.title,
        "source": config.source,
        "report": dict(config.labels),
        "status": "complete" if best.met else CONFLICT,
        "objectives": [q.name for q in wishes.objectives],
        "speed": entry(wishes.crank_speed, "rad/s", "speed"),
        "clearance": entry(wishes.clearance, "1", "percent"),
        "slack_free_speed": entry(wishes.slack_free_speed or None, "rad/s", "speed"),
        "operating_hours": entry(wishes.basis.operating_hours, "1"),
        "overload": entry(wishes.basis.overload, "1"),
        "parameters": {
            name: {"title": v.description}
            | {
                key: entry(float(number), v.unit, v.kind)
                for key, number in zip(("today", "best", "min", "max"), numbers, strict=True)
            }
            for name, numbers in _parameters(best, x)
            for v in (variables[name],)
        },
        "without_effect": list(best.idle),
        "without_effect_words": idle_sentence(best),
        "quantities": {name: _quantity(best, name) for name in best.quantities},
        "least_pull": _pull(best),
        "organs": _organs(best),
        "bindings": _bindings(best),
        "clearances": clearances(best) if best.met else [],
        "conflict": _conflict(best),
        "starts": _starts(best),
        "neighbours": _neighbours(best),
        "front": _front(best),
        "over_turn": {
            name: array_entry(y[::EVERY], "rad" if name == "angle" else "N.m")
            for name, y in best.turns.items()
        },
    }


def _parameters(best: Best, x: Any) -> Iterator[tuple[str, tuple[float, ...]]]:
    """Each free parameter with its values today and in the answer, and its bounds."""
    wishes, by_name = best.wishes, best.wishes.machine.by_name
    for name, today, value in zip(wishes.names, wishes.today, x, strict=True):
        yield name, (today, value, *wishes.free[name])
    for name, bounds in best.idle.items():
        yield name, (by_name[name], by_name[name], *bounds)


def _quantity(best: Best, name: str) -> dict[str, Any]:
    q = best.quantities[name]
    limit = _limit_of(best, name)
    fmu = best.fmu.get(name)
    return {
        "title": q.description,
        "today": entry(best.today[name], q.unit, q.kind),
        "best": entry(best.found[name], q.unit, q.kind),
        "min": entry(limit.low if limit else None, q.unit, q.kind),
        "max": entry(limit.high if limit else None, q.unit, q.kind),
        "missed": limit is not None and limit.is_missed(best.found[name]),
        "fmu": entry(fmu.fmu if fmu else None, q.unit, q.kind),
        "fmu_deviation": entry(fmu.deviation if fmu else None, "1"),
    }


def _pull(best: Best) -> dict[str, Any] | None:
    """The least pull in the webs up to the slack-free speed, and its limit."""
    if best.pulls is None:
        return None
    numbers = {"today": best.pulls[0], "best": best.pulls[1], "min": 0.0, "max": None}
    # in comparison with the weight of the webs a millionth of a newton is none
    missed = not best.pulls[1] >= -1e-6
    return {name: entry(finite(x), "N") for name, x in numbers.items()} | {"missed": missed}


def _organs(best: Best) -> list[dict[str, Any]]:
    """The limits of the crank speed for two bars as organs that the best machine passes."""
    wishes = best.wishes
    if best.machine is None:
        return []
    limits = limits_of_organs(best.machine, wishes.feed, [q.unit for q in best.quantities.values()])
    return [
        {"topic": each.topic, "text": each.words, "limit": entry(each.speed, "rad/s", "speed")}
        for each in passed_limits(limits, wishes.crank_speed)
    ]


def _bindings(best: Best) -> list[dict[str, Any]]:
    if not best.met:
        return []
    objective = best.wishes.objectives[0]
    return [
        {
            "name": each.name,
            "side": each.side,
            "value": entry(each.value, each.unit),
            "step": entry(each.step, each.unit),
            "change": entry(each.change, objective.unit),
            "text": sentence(best, each),
        }
        for each in bindings(best)
    ]


def _conflict(best: Best) -> dict[str, Any] | None:
    if best.conflict is None:
        return None
    return {
        "limits": list(best.conflict.names),
        "alone": list(best.conflict.alone),
        "together": list(best.conflict.together),
        "bounds": [f"{name}.{side}" for name, side in best.conflict.bounds],
        "sentences": list(conflict_sentences(best)),
    }


def _starts(best: Best) -> dict[str, Any]:
    objective = best.wishes.objectives[0]
    return {
        "text": starts_sentence(best),
        "number": entry(float(best.starts), "1"),
        "moved": entry(float(best.moved), "1"),
        "feasible": entry(float(best.feasible), "1"),
        "agree": entry(float(best.agree), "1"),
        "values": array_entry(best.values, objective.unit),
        "programs": entry(float(best.effort.programs), "1"),
        "iterations": entry(float(best.effort.iterations), "1"),
        "evaluations": entry(float(best.effort.evaluations), "1"),
    }


def _neighbours(best: Best) -> dict[str, Any] | None:
    if best.neighbours is None:
        return None
    own = best.neighbours
    return {
        "text": neighbours_sentence(best),
        "held": [q.name for q in best.wishes.objectives[1:]],
        "steps": array_entry(STEPS, "1"),
        "number": entry(float(own.number), "1"),
        "feasible": entry(float(own.feasible), "1"),
        "better": entry(float(own.better), "1"),
    }


def _front(best: Best) -> list[dict[str, Any]]:
    if not best.front:
        return []
    names, objectives = best.wishes.names, best.wishes.objectives
    values = np.array([point.values for point in best.front])
    # the best machine is solved again from its point of the front
    distances = np.abs(values / [best.found[q.name] for q in objectives] - 1.0)
    chosen = best.front[int(np.argmin(np.max(distances, axis=1)))]
    units = {v.name: v.unit for v in best.wishes.machine.model.parameter_layout.variables}
    return [
        {
            "chosen": point is chosen,
            "values": {
                q.name: entry(value, q.unit)
                for q, value in zip(best.wishes.objectives, point.values, strict=True)
            },
            "parameters": {
                name: entry(float(x), units[name]) for name, x in zip(names, point.x, strict=True)
            },
        }
        for point in best.front
    ]
