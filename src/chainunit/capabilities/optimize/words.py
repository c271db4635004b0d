"""The sentences of an answer: what binds, what one unit more of a limit would bring, and why there is none."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from ...reading.results import OWN, InUnit, part, result
from ...reading.text import number
from .best import Best
from .effects import no_effect
from .wishes import SLACK, TURNS, TurnLimit

_UNITS = {
    "m": (1e-3, "1 mm"),
    "rad": (math.radians(1.0), "1 deg"),
    "N": (100.0, "100 N"),
    "J": (3.6e6, "1 kWh"),
    "W": (100.0, "100 W"),
    "1": (0.01, "0.01"),
    "kg.m2": (0.1, "0.1 kg m2"),
}
"""By unit, a step of a limit that a reader knows, in the unit and in words."""
_TELLING = 1e-4
"""Least change of the objective, as a share of it, by which a clearance counts as one that binds."""
_ACTIVE = 1e-6
"""Least change of the objective, as a share of it, by a step of a limit that binds."""


@result
class Binding:
    """A limit or bound that binds."""

    name: str = part("name of the limit, or of the parameter")
    side: str = part('"min" or "max"')
    value: float = part("its value", unit=OWN)
    step: float = part("a step of it", unit=OWN)
    change: InUnit = part("change of the objective by a step")
    text: str = part("the change in words")
    unit: str
    slope: float
    """change of the objective by one unit"""


def bindings(best: Best) -> list[Binding]:
    """The limits, the slack-free speed and the bounds of parameters that bind, the strongest first."""
    assert best.answer is not None
    wishes, entries = best.wishes, []
    size = abs(best.answer.value) or 1.0
    limits = {limit.name: limit for limit in wishes.limits}
    for (name, side), slope in best.answer.sensitivities.items():
        if name in limits:
            limit = limits[name]
            value = limit.low if side == "min" else limit.high
            entries.append(_binding(best, name, side, value, limit.quantity.unit, slope))
        elif name == SLACK:
            # the limit is a pull of 0: its slope is that by the pull
            entries.append(_binding(best, name, side, 0.0, "N", slope))
    units = {v.name: v.unit for v in wishes.machine.model.parameter_layout.variables}
    for (name, side), slope in best.answer.at_bounds.items():
        entries.append(_binding(best, name, side, wishes.free[name][side == "max"], units[name], slope))
    active = [binding for binding in entries if abs(binding.change.value) > _ACTIVE * size]
    return sorted(active, key=lambda binding: -abs(binding.change.value))


def _binding(best: Best, name: str, side: str, value: Any, unit: str, slope: float) -> Binding:
    """A binding with its words: ``1 mm more of r.max lowers peak(crank_torque) by 0.3 N m``."""
    objective, *others = best.wishes.objectives
    step, step_words = _UNITS.get(unit, (1.0, number(1.0, unit, full=False)))
    change = slope * step
    verb, amount = "lowers" if change < 0.0 else "raises", number(abs(change), objective.unit, objective.kind)
    held = "".join(f", with {q.name} held at {number(best.found[q.name], q.unit, q.kind)}" for q in others)
    more = "of web mean pull at that speed" if name == SLACK else f"more of {name}.{side}"
    text = f"{step_words} {more} {verb} {objective.name} by {amount}{held}"
    return Binding(name, side, float(value), step, InUnit(change, objective.unit), text, unit, slope)


def clearances(best: Best) -> list[str]:
    """The requirements of the model that bind: whose clearance, if it were given up, would change the objective by
    more than `_TELLING` of it."""
    assert best.answer is not None
    least = _TELLING * (abs(best.answer.value) or 1.0)
    slopes = {
        subject: slope for (owner, subject), slope in best.answer.sensitivities.items() if owner == TURNS
    }
    return [subject for subject, slope in slopes.items() if abs(slope) * best.wishes.table.clearance > least]


def idle_sentence(best: Best) -> str:
    """On free parameters without an effect; empty where there are none."""
    if not best.idle:
        return ""
    keep = "they keep their values" if len(best.idle) > 1 else "it keeps its value"
    return f"{no_effect(best.wishes, tuple(best.idle))}: {keep} of today."


def limit_words(limit: TurnLimit) -> str:
    """A limit in words: ``range(rocker.psi) from 16 deg to 20 deg``."""
    q = limit.quantity
    low = None if limit.low is None else number(limit.low, q.unit, q.kind, full=False)
    high = None if limit.high is None else number(limit.high, q.unit, q.kind, full=False)
    if low is not None and high is not None:
        return f"{q.name} = {low}" if limit.low == limit.high else f"{q.name} from {low} to {high}"
    return f"{q.name} of at least {low}" if low is not None else f"{q.name} of at most {high}"


def conflict_sentences(best: Best) -> Iterator[str]:
    """Why no machine meets the limits: which of them conflict, and how near the nearest machine comes."""
    assert best.conflict is not None
    wishes, conflict = best.wishes, best.conflict
    quantities = {limit.name: limit.quantity for limit in wishes.limits}
    alone = [_wish_words(best, name) for name in conflict.alone]
    together = [_wish_words(best, name) for name in conflict.together]
    if alone:
        remark = " Each of these limits is impossible alone." if len(alone) > 1 else ""
        yield f"No machine within the bounds has {'; none has '.join(alone)}.{remark}"
    if together:
        begin = "Beside that, no machine" if alone else "No machine within the bounds"
        yield (
            f"{begin} has {' and '.join(filter(None, (', '.join(together[:-1]), together[-1])))} together; without "
            "any one of them the others can be met."
        )
    # limits that are impossible alone have a nearest machine each
    several = bool(conflict.alone) and len(conflict.names) > 1
    values = conflict.alone if several else {n: best.found.get(n, math.nan) for n in conflict.names}
    reached = ", ".join(
        f"{name} = {number(value, quantities[name].unit, quantities[name].kind)}"
        for name, value in values.items()
        if name in quantities and not math.isnan(value)
    )
    machines = "machine that comes nearest has"
    if several and len(conflict.alone) == 1:
        machines = "machine that comes nearest to the first of these limits alone has"
    elif several:
        machines = "machines that come nearest to each of these limits alone have"
    if reached:
        yield f"The {machines} {reached}."
    if conflict.bounds:
        units = {v.name: v.unit for v in wishes.machine.model.parameter_layout.variables}
        bounds = (
            f"{name}.{side} = {number(wishes.free[name][side == 'max'], units[name], full=False)}"
            for name, side in conflict.bounds
        )
        yield f"The bounds that hold {'the nearest to all of them' if several else 'it'}: {', '.join(bounds)}."


def _wish_words(best: Best, name: str) -> str:
    """A limit, the slack-free speed, or the need to turn, in words."""
    if name == SLACK:
        return (
            f"webs that keep their pull up to {number(best.wishes.table.slack_free_speed, 'rad/s', 'speed')}"
        )
    if name == TURNS:
        return f"a distance of {number(best.wishes.table.clearance, '1', 'percent')} from where it no longer turns"
    return limit_words(next(limit for limit in best.wishes.limits if limit.name == name))


def starts_sentence(best: Best) -> str:
    """How the starts ended."""
    moved = f", {best.moved} of them moved until the machine closes" if best.moved else ""
    begin = f"{best.starts} {'starts' if best.starts > 1 else 'start'} over the bounds{moved}"
    if not best.met:
        return f"{begin}: none ended at a machine that meets all limits."
    goal = "that meets all limits" if best.is_limited else "with a least value"
    return (
        f"{begin}: {best.feasible} ended at a machine {goal}, {best.agree} at the best value to a millionth."
    )


def neighbours_sentence(best: Best) -> str:
    """How the machines around the best one compare with it."""
    neighbours = best.neighbours
    assert neighbours is not None
    held = " and ".join(f"have no more {q.name}" for q in best.wishes.objectives[1:])
    conditions = " and ".join(filter(None, ("meet all limits" if best.is_limited else "", held))) or "turn"
    first = f" in {best.wishes.objectives[0].name}" if held else ""
    better = f"{neighbours.better} of these {'is' if neighbours.better == 1 else 'are'} better{first}"
    return f"Of {neighbours.number} machines around it {neighbours.feasible} {conditions}, and {better}."
