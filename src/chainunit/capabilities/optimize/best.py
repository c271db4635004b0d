"""The best machine of a study: the search from many starts, the front of two objectives, checks, and conflicts."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ...core.brief import briefly_shown
from ...machines.machine import Machine
from ...study.cycle import cycle
from ...study.cycle_quantities import CycleQuantity
from ...work.progress import TaskProgress, quiet
from .checks import Neighbours, neighbours
from .conflict import Conflict, conflict, nearest
from .effects import effective_search
from .search import Answer, Effort, Search
from .wishes import TurnLimit, Wishes

AGREES = 1e-6
"""Share of the best value within which a start counts as one that found it."""
_RETRIES = 6
"""Number of starts of the search for a feasible machine, where no start found one."""


@dataclass(frozen=True)
class FrontPoint:
    """A machine of the front of two objectives, with their values."""

    x: Any
    values: tuple[float, float]


@briefly_shown
@dataclass(frozen=True)
class Best:
    """What a search found. Without a machine that meets all limits, `answer` is None and `conflict` says why."""

    wishes: Wishes
    starts: int
    moved: int
    """starts that were moved until the machine can be assembled"""
    today: Mapping[str, float]
    """quantities of today's machine, by name"""
    effort: Effort
    idle: Mapping[str, tuple[float, float]]
    """bounds of the free parameters without any effect, which keep their values; `wishes` has the others"""
    found: Mapping[str, float] = field(default_factory=dict)
    """quantities of the best machine, or of the nearest one"""
    pulls: tuple[float, float] | None = None
    """least mean pull along a web up to the slack-free speed, of today's machine and of the best or nearest one [N];
    None without that wish"""
    conflict: Conflict | None = None
    answer: Answer | None = None
    feasible: int = 0
    """starts that ended at a machine that meets all limits"""
    agree: int = 0
    """starts that reached the best value"""
    values: tuple[float, ...] = ()
    """the values that the feasible starts reached, in rising order"""
    neighbours: Neighbours | None = None
    front: tuple[FrontPoint, ...] = ()
    turns: Mapping[str, Any] = field(default_factory=dict)
    """crank angle [rad] and crank torque [N m] of today's machine and of the best one"""

    @property
    def quantities(self) -> dict[str, CycleQuantity]:
        """Objectives and limited quantities by name."""
        return quantities_of(self.wishes)

    @property
    def machine(self) -> Machine | None:
        """The best machine."""
        return None if self.answer is None else machine_at(self.wishes, self.answer.x)

    @property
    def is_limited(self) -> bool:
        """Whether the study has limits beside the one that the machine turns."""
        return bool(self.wishes.limits or self.wishes.table.slack_free_speed)

    @property
    def met(self) -> bool:
        """Whether a machine was found that meets all limits."""
        return self.answer is not None


def quantities_of(wishes: Wishes) -> dict[str, CycleQuantity]:
    """Objectives and limited quantities by name."""
    return {q.name: q for q in (*wishes.objectives, *(limit.quantity for limit in wishes.limits))}


def machine_at(wishes: Wishes, x: Any) -> Machine:
    """The machine with the free parameters `x`.

    Raises
    ------
    GeometryError
        for one that does not turn.
    """
    return wishes.machine.replace(dict(zip(wishes.names, map(float, x), strict=True)))


def find_best(wishes: Wishes, progress: TaskProgress = quiet) -> Best:
    """Search for the best machine, and check it.

    Raises
    ------
    InputError, RunError
        see `effective_search`.
    """
    search, idle = effective_search(wishes)
    wishes = search.wishes
    starts, moved = search.starts(int(wishes.table.starts))
    answers = _from_starts(search, starts, wishes.objectives[0], progress)
    good = [answer for answer in answers if answer.feasible]
    failure = None
    if not good:
        progress("a machine that meets all limits", 0.0, 1.0)
        good, failure = _repaired(search, starts)
    base = Best(wishes, len(starts), moved, _values(search, search.today), search.effort, idle)
    if not good:
        assert failure is not None
        closest = failure.nearest.x
        return replace(base, conflict=failure, found=_values(search, closest), pulls=_pulls(search, closest))
    best = min(good, key=lambda answer: answer.value)
    front: tuple[FrontPoint, ...] = ()
    if len(wishes.objectives) > 1:
        front = _front(search, best, starts, progress)
        best = _compromise(search, front)
    agree = sum(answer.value - good_value(good) <= AGREES * abs(good_value(good)) for answer in good)
    progress("the checks", 0.0, 1.0)
    objective, limits = _checked(wishes, best, search)
    around = neighbours(search, best.x, objective, limits, search.value(objective, best.x))
    return replace(
        base,
        answer=best,
        found=_values(search, best.x),
        pulls=_pulls(search, best.x),
        feasible=len(good),
        agree=agree,
        values=tuple(sorted(answer.value for answer in good)),
        neighbours=around,
        front=front,
        turns=_turns(wishes, machine_at(wishes, best.x)),
    )


def good_value(answers: Sequence[Answer]) -> float:
    """The least value of some answers."""
    return min(answer.value for answer in answers)


def _from_starts(
    search: Search, starts: Sequence[Any], objective: CycleQuantity, progress: TaskProgress
) -> list[Answer]:
    """The answer from each start, with the least value of the objective that it leads to."""
    answers = []
    for k, x in enumerate(starts):
        progress(f"starts, least {objective.name}", float(k), float(len(starts)))
        answers.append(search.solve(x, objective))
    progress(f"starts, least {objective.name}", float(len(starts)), float(len(starts)))
    return answers


def _repaired(search: Search, starts: Sequence[Any]) -> tuple[list[Answer], Conflict | None]:
    """The answer of a search from the machine nearest to the limits, where no start led to one that meets them; where
    this one does not meet them either, the conflict of the limits."""
    near, met = nearest(search, starts)
    if near is None or not met:
        return [], conflict(search, starts[:_RETRIES], near or search.solve(search.base, None))
    objective = search.wishes.objectives[0]
    answer = search.solve(near.x, objective)
    if not answer.feasible:
        # where the limits leave hardly any room, the machine that meets them is the answer
        answer = replace(answer, x=near.x, value=search.value(objective, near.x), feasible=True)
    return [answer], None


def _values(search: Search, x: Any) -> dict[str, float]:
    """The quantities of a machine; NaN where it cannot be assembled."""
    quantities = quantities_of(search.wishes)
    if not search.turns(x):
        return dict.fromkeys(quantities, math.nan)
    return {name: search.value(q, x) for name, q in quantities.items()}


def _pulls(search: Search, x: Any) -> tuple[float, float] | None:
    """The least mean pull along a web up to the slack-free speed, of today's machine and of the machine with the free
    parameters `x` [N], see `Best.pulls`; NaN where one does not turn."""
    if not search.wishes.table.slack_free_speed:
        return None
    today, here = (search.least_pull(p) if search.turns(p) else math.nan for p in (search.today, x))
    return today, here


# -- two objectives


def _front(
    search: Search, best: Answer, starts: Sequence[Any], progress: TaskProgress
) -> tuple[FrontPoint, ...]:
    """The front of two objectives: the first is least while the second is limited, step by step."""
    first, second = search.wishes.objectives
    answers = [answer for answer in _from_starts(search, starts, second, progress) if answer.feasible]
    limits, total = list(search.wishes.limits), int(search.wishes.table.pareto_points)
    ends = [best, min(answers, key=lambda answer: answer.value)] if answers else [best]
    # at either end the other objective is as small as it can be
    corner = search.solve(best.x, second, [*limits, TurnLimit(first, None, best.value * (1.0 + AGREES))])
    points = [_point(search, corner.x if corner.feasible else best.x)]
    high = points[0].values[1]
    if len(ends) > 1:
        low = ends[1].value
        near = [points[0].x]
        for k in range(1, total):
            progress("front of two objectives", float(k), float(total))
            bound = high + (low - high) * k / (total - 1)
            allowed = TurnLimit(
                second, None, bound * (1.0 + math.copysign(AGREES, bound)) if k == total - 1 else bound
            )
            solutions = [
                search.solve(x, first, [*limits, allowed]) for x in (near[-1], ends[1].x, *starts[:2])
            ]
            solutions = [answer for answer in solutions if answer.feasible]
            if solutions:
                least = min(solutions, key=lambda answer: answer.value)
                points.append(_point(search, least.x))
                near.append(least.x)
    return tuple(p for p in points if not any(_dominates(other, p) for other in points))


def _point(search: Search, x: Any) -> FrontPoint:
    first, second = search.wishes.objectives
    return FrontPoint(x, (search.value(first, x), search.value(second, x)))


def _dominates(a: FrontPoint, b: FrontPoint) -> bool:
    margins = [1e-6 * abs(y) for y in b.values]
    return all(x < y - m for x, y, m in zip(a.values, b.values, margins, strict=True))


def _compromise(search: Search, front: Sequence[FrontPoint]) -> Answer:
    """The point of the front that is nearest to the least values of both objectives, each counted over its range;
    solved again for the first one, with the second one limited to its value there."""
    values = np.array([point.values for point in front])
    span = np.ptp(values, axis=0)
    shares = (values - np.min(values, axis=0)) / np.where(span > 0.0, span, 1.0)
    point = front[int(np.argmin(np.hypot(*shares.T)))]
    first, second = search.wishes.objectives
    # rounding must not forbid the point itself
    highest = point.values[1] * (1.0 + math.copysign(1e-9, point.values[1]))
    answer = search.solve(point.x, first, [*search.wishes.limits, TurnLimit(second, None, highest)])
    return answer if answer.feasible else replace(answer, x=point.x, value=point.values[0], feasible=True)


def _checked(wishes: Wishes, best: Answer, search: Search) -> tuple[CycleQuantity, list[TurnLimit]]:
    """The objective and the limits under which the answer is the best: of two objectives the second is a limit."""
    limits = list(wishes.limits)
    if len(wishes.objectives) > 1:
        second = wishes.objectives[1]
        limits.append(TurnLimit(second, None, search.value(second, best.x)))
    return wishes.objectives[0], limits


def _turns(wishes: Wishes, machine: Machine) -> dict[str, Any]:
    """The crank torque over a turn of today's machine and of the best one."""
    today = cycle(wishes.machine, wishes.crank_speed, wishes.feed)
    then = cycle(machine, wishes.crank_speed, wishes.feed)
    return {"angle": today.angle, "today": today.crank_torque, "best": then.crank_torque}
