"""The result of a search for the best machine as data: the content of result.json."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ...core.quantities import narrowed, percentage, quantity
from ...reading.results import OWN, InUnit, part, result
from ...reading.text import Units
from ...study.cycle_quantities import CycleBasis
from ...study.organ_limits import SpeedLimit, limits_of_organs, passed_limits
from ...study.provenance import Heading
from .best import Best
from .checks import STEPS, Neighbours
from .search import Effort
from .wishes import TurnLimit
from .words import (
    Binding,
    bindings,
    clearances,
    conflict_sentences,
    idle_sentence,
    neighbours_sentence,
    starts_sentence,
)

EVERY = 4
"""One of so many angles of the turns is in the result."""
CONFLICT = "no machine meets all limits"
_SMALL = 100.0
"""Power below which powers are shown in W [W]."""


@result
class TodayAndBest:
    """A number of today's machine and of the best one, or of the nearest one, and its limits."""

    today: float = part("its value today", unit=OWN)
    best: float = part("its value of the best machine, or of the nearest one", unit=OWN)
    low: float | None = part("its lower limit", unit=OWN, name="min")
    high: float | None = part("its upper limit", unit=OWN, name="max")
    unit: str
    kind: str


@result
class FreeParameter(TodayAndBest):
    """A free parameter of the machine."""

    title: str = part("its meaning")


@result
class WebPull(TodayAndBest):
    """The least pull in the webs up to the slack-free speed."""

    missed: bool = part("whether the limits are not met")


@result
class SoughtQuantity(FreeParameter, WebPull):
    """An objective or a limited quantity."""


@result
class WhyNone:
    """Why no machine meets all limits."""

    limits: tuple[str, ...] = part("the limits that conflict")
    alone: tuple[str, ...] = part("limits that are impossible alone")
    together: tuple[str, ...] = part("limits that are impossible together")
    bounds: list[str] = part("the bounds that hold the nearest machine")
    sentences: list[str] = part("the reason in words")


@result
class StartsOfSearch:
    """The starts of a search."""

    text: str = part("the starts in words")
    number: int = quantity("1", "number of starts")
    moved: int = quantity("1", "number of starts that were moved until the machine can be assembled")
    feasible: int = quantity("1", "number of starts that ended at a machine that meets all limits")
    agree: int = quantity("1", "number of starts that reached the best value")
    values: InUnit = part("the values that the feasible ones reached, in rising order")
    effort: Effort = part(inline=True)


@result
class NeighbourCheck:
    """Machines near the best one."""

    text: str = part("the comparison in words")
    held: list[str] = part("objectives that are held")
    steps: tuple[float, ...] = quantity("1", "distances, as shares of the distance between the bounds")
    numbers: Neighbours = part(inline=True)


@result
class FrontMachine:
    """A machine of the front of two objectives."""

    chosen: bool = part("whether it is the best machine of the result")
    values: Mapping[str, InUnit] = part("the objectives")
    parameters: Mapping[str, InUnit] = part("the free parameters")


@result
class BestMachine:
    """The result of a search for the best machine: the content of its result.json."""

    heading: Heading = part(inline=True)
    status: str = part("whether a machine meets all limits")
    objectives: list[str] = part("the objectives")
    speed: float = quantity("rad/s", "crank speed", kind="speed")
    clearance: float = percentage("distance from where the machine no longer turns")
    slack_free_speed: float | None = quantity(
        "rad/s", "crank speed up to which no web goes slack", kind="speed"
    )
    basis: CycleBasis = part(inline=True)
    parameters: Mapping[str, FreeParameter] = part("the free parameters")
    without_effect: list[str] = part("free parameters without any effect, which keep their values")
    without_effect_words: str = part("a sentence on them")
    quantities: Mapping[str, SoughtQuantity] = part("objectives and limited quantities")
    least_pull: WebPull | None = part("least pull in the webs, where it is limited")
    organs: list[SpeedLimit] = part("limits of two bars as organs that the best machine passes")
    bindings: list[Binding] = part("limits and bounds that bind, the strongest first")
    clearances: list[str] = part("requirements of the model whose distance binds")
    conflict: WhyNone | None = part("why no machine meets all limits")
    starts: StartsOfSearch = part("the starts")
    neighbours: NeighbourCheck | None = part("machines near the best one")
    front: list[FrontMachine] = part("the front of two objectives")
    over_turn: Mapping[str, InUnit] = part("crank angle and crank torque of today's and of the best machine")


def best_machine(best: Best, heading: Heading) -> BestMachine:
    """The result of a search as data; its sentences have the units of `shown_in`."""
    wishes, objective = best.wishes, best.wishes.objectives[0]
    return BestMachine(
        heading=heading,
        status="complete" if best.met else CONFLICT,
        objectives=[q.name for q in wishes.objectives],
        speed=wishes.crank_speed,
        clearance=wishes.table.clearance,
        slack_free_speed=wishes.table.slack_free_speed or None,
        basis=narrowed(wishes.table, CycleBasis),
        parameters=dict(_parameters(best)),
        without_effect=list(best.idle),
        without_effect_words=idle_sentence(best),
        quantities={name: _quantity(best, name) for name in best.quantities},
        # in comparison with the weight of the webs a millionth of a newton is none
        least_pull=best.pulls and WebPull(*best.pulls, 0.0, None, "N", "", not best.pulls[1] >= -1e-6),
        organs=_organs(best),
        bindings=bindings(best) if best.met else [],
        clearances=clearances(best) if best.met else [],
        conflict=_conflict(best),
        starts=StartsOfSearch(
            text=starts_sentence(best),
            number=best.starts,
            moved=best.moved,
            feasible=best.feasible,
            agree=best.agree,
            values=InUnit(best.values, objective.unit),
            effort=best.effort,
        ),
        neighbours=None
        if best.neighbours is None
        else NeighbourCheck(
            neighbours_sentence(best), [q.name for q in wishes.objectives[1:]], STEPS, best.neighbours
        ),
        front=_front(best),
        over_turn={
            name: InUnit(y[::EVERY], "rad" if name == "angle" else "N.m") for name, y in best.turns.items()
        },
    )


def units_of(best: Best, tables: Mapping[str, Any], units: Units) -> Units:
    """The units of the report: the `units` of the study, and W for powers where one is below 100 W and the `tables`
    of the study do not name a unit."""
    powers: list[float | None] = []
    for name, q in best.quantities.items():
        if q.unit == "W":
            powers += [best.today[name], best.found[name]]
            powers += [limit.low, limit.high] if (limit := _limit_of(best, name)) is not None else []
    is_small = any(abs(power) < _SMALL for power in powers if power)
    named_units = tables.get("report", {}).get("units", {})
    return {**units, "power": ("W",)} if is_small and "power" not in named_units else units


def _limit_of(best: Best, name: str) -> TurnLimit | None:
    return next((limit for limit in best.wishes.limits if limit.name == name), None)


def _parameters(best: Best) -> Iterator[tuple[str, FreeParameter]]:
    """Each free parameter by its name."""
    wishes, by_name = best.wishes, best.wishes.machine.by_name
    x = wishes.today
    if best.answer is not None:
        x = best.answer.x
    elif best.conflict:
        x = best.conflict.nearest.x
    numbers = {
        name: (today, value, *wishes.free[name])
        for name, today, value in zip(wishes.names, wishes.today, x, strict=True)
    } | {name: (by_name[name], by_name[name], *bounds) for name, bounds in best.idle.items()}
    variables = {v.name: v for v in wishes.machine.model.parameter_layout.variables}
    for name, entries in numbers.items():
        v = variables[name]
        today, value, low, high = map(float, entries)
        yield name, FreeParameter(today, value, low, high, v.unit, v.kind, v.description)


def _quantity(best: Best, name: str) -> SoughtQuantity:
    """An objective or a limited quantity, of the machine of today and of the best one."""
    q, limit = best.quantities[name], _limit_of(best, name)
    return SoughtQuantity(
        title=q.description,
        today=best.today[name],
        best=best.found[name],
        low=limit.low if limit else None,
        high=limit.high if limit else None,
        missed=limit is not None and limit.is_missed(best.found[name]),
        unit=q.unit,
        kind=q.kind,
    )


def _organs(best: Best) -> list[SpeedLimit]:
    """The limits of the crank speed for two bars as organs that the best machine passes."""
    wishes = best.wishes
    if best.machine is None:
        return []
    limits = limits_of_organs(best.machine, wishes.feed, [q.unit for q in best.quantities.values()])
    return passed_limits(limits, wishes.crank_speed)


def _conflict(best: Best) -> WhyNone | None:
    """The limits that conflict, ready for the result; None where a machine meets all limits."""
    conflict = best.conflict
    if conflict is None:
        return None
    bounds = [f"{name}.{side}" for name, side in conflict.bounds]
    return WhyNone(
        conflict.names, tuple(conflict.alone), conflict.together, bounds, list(conflict_sentences(best))
    )


def _front(best: Best) -> list[FrontMachine]:
    """The machines of the front; chosen is the one nearest to the best machine in both objectives."""
    if not best.front:
        return []
    names, objectives = best.wishes.names, best.wishes.objectives
    values = np.array([point.values for point in best.front])
    # the best machine is solved again from its point of the front
    distances = np.abs(values / [best.found[q.name] for q in objectives] - 1.0)
    chosen = best.front[int(np.argmin(np.max(distances, axis=1)))]
    units = {v.name: v.unit for v in best.wishes.machine.model.parameter_layout.variables}
    return [
        FrontMachine(
            point is chosen,
            {q.name: InUnit(value, q.unit) for q, value in zip(objectives, point.values, strict=True)},
            {name: InUnit(float(x), units[name]) for name, x in zip(names, point.x, strict=True)},
        )
        for point in best.front
    ]
