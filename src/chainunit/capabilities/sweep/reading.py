"""The reader of the table [sweep]: its entries against the quantities of the study, as a `SweepPlan`."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from ...core.errors import Faults, InputError, near_name, one_of, refusal_prefix, shown
from ...core.messages import unit_behind
from ...core.quantities import Quantity, Variable, named_values, variables
from ...mechanism.models import MachineModel
from ...reading.lists import Entry
from ...study.cycle_quantities import CycleBasis, cycle_quantity
from ...study.event import Event
from .plan import MOST_OF_HYPERCUBE, SweepPlan, SweptParameter
from .table import (
    LOADS_OF_SWEEP,
    MEASURES_OF_SWEEP,
    MOST_VALUES,
    SPEED,
    SWEPT,
    USUAL_QUANTITIES,
    SweepTable,
)

_MOST_OF_GRID = 1_000_000_000
_VALUES, _VALUES_OF_TOLERANCE = 11, 3


@dataclasses.dataclass(frozen=True)
class Sweepable:
    """The quantities of a study that a sweep may vary: by full name its declaration and its value."""

    variables: Mapping[str, Variable]
    values: Mapping[str, float]
    events: Mapping[str, Event]

    @classmethod
    def of(cls, machine: Any, feed: Any, run: Any, events: Mapping[str, Event]) -> Sweepable:
        """Those of a machine with its parameters, its feed, the table [run] and the events of a study."""
        pairs = [
            *named_values(machine.p, "machine."),
            *named_values(feed, "feed."),
            *(pair for pair in named_values(run, "run.") if pair[0].name == SPEED),
            *(
                pair
                for name, event in events.items()
                for pair in named_values(event.p, f"event.{name}.")
                if pair[0].type == "Real"
            ),
        ]
        return cls({v.name: v for v, _ in pairs}, {v.name: x for v, x in pairs}, events)


def read_plan(
    form: Any, table: SweepTable, model: MachineModel, quantities: Sweepable, fixed: Mapping[str, str]
) -> SweepPlan:
    """The plan of a checked table [sweep]: its `form` with what the file gives, and its declared values `table`.

    `fixed` has, by the full name of a quantity that this study sets itself, the reason in words.

    Raises
    ------
    InputError
        with a line for each fault: the key, its value and the allowed range.
    """
    faults = Faults()

    def read(entry: Entry, name: str) -> SweptParameter:
        return _parameter(entry, quantities.variables[name], quantities.values[name], form.method == "grid")

    swept = SWEPT.read(form.parameter, faults, read, names=quantities.variables, fixed=fixed)
    names, parameters = list(swept), list(swept.values())
    with faults.collected():
        _check_results(form, model)
    results = _results(form)
    points = int(table.points)
    with faults.collected():
        points = _points(form, points, parameters)
    event = ""
    with faults.collected():
        event = _event(form, names, quantities.events)
    result_names = (*results[0], *results[1])
    best = form.best or result_names[0]
    if best not in result_names:
        reason = (
            f"must be one of the quantities and measures of the sweep: {', '.join(result_names)}"
            f"{near_name(best, result_names)}"
        )
        faults.add([InputError(f"sweep.best = {shown(best)}: {reason}", "sweep.best")])
    faults.refuse()
    basis = CycleBasis(**{v.name: getattr(table, v.name) for v in variables(CycleBasis)})
    return SweepPlan(
        form.method,
        int(table.seed),
        points,
        tuple(parameters),
        *results,
        event,
        best,
        _best_is(form, best),
        int(table.angles),
        basis,
    )


def _best_is(form: Any, best: str) -> str:
    """Whether the points with the least or the largest values of `best` come first. Where the file does not say, the
    largest loads of runs do: no value of them is wished for."""
    if not form.best and "best_is" not in form.model_fields_set and best in LOADS_OF_SWEEP:
        return "largest"
    return str(form.best_is)


def _check_results(form: Any, model: MachineModel) -> None:
    """Refuse names that are no quantities and no measures."""
    faults = Faults()
    for name in dict.fromkeys(form.quantities):
        with faults.collected(), refusal_prefix("sweep.quantities: ", "sweep.quantities"):
            cycle_quantity(name, model)
    for name in dict.fromkeys(form.measures):
        if name not in MEASURES_OF_SWEEP:
            line = f"sweep.measures: {shown(name)}: must be {one_of(name, MEASURES_OF_SWEEP)}"
            faults.add([InputError(line, "sweep.measures")])
    faults.refuse()


def _results(form: Any) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The names of quantities and measures, each once."""
    quantities, measures = tuple(dict.fromkeys(form.quantities)), tuple(dict.fromkeys(form.measures))
    return (quantities, measures) if quantities or measures else (USUAL_QUANTITIES, ())


def _points(form: Any, points: int, parameters: list[SweptParameter]) -> int:
    """The number of points."""
    if form.method != "grid":
        if form.method == "latin_hypercube" and points > MOST_OF_HYPERCUBE:
            raise InputError(
                f"sweep.points = {points}: of a Latin hypercube must be <= {MOST_OF_HYPERCUBE}, as each point "
                'depends on all others; take method = "sobol"',
                "sweep.points",
            )
        return points
    product = math.prod(len(parameter.values) for parameter in parameters)
    if product > _MOST_OF_GRID:
        raise InputError(
            f"sweep.parameter: the grid has {product:.3g} points: must be <= {_MOST_OF_GRID:.0e}; give fewer points, "
            'or method = "sobol"',
            "sweep.parameter",
        )
    return product


def _event(form: Any, names: list[str], events: Mapping[str, Event]) -> str:
    """The name of the run of the event of the measures; empty without measures."""
    swept = list(dict.fromkeys(name.split(".")[1] for name in names if name.startswith("event.")))
    if not form.measures:
        if form.event:
            raise InputError(
                "sweep.event: is of measures; add sweep.measures, or leave it out", "sweep.event"
            )
        if swept:
            raise InputError(
                f"sweep.parameter: event.{swept[0]} changes no turn without an event; add sweep.measures",
                "sweep.parameter",
            )
        return ""
    running = [name for name, event in events.items() if not event.from_rest]
    candidates = [form.event] if form.event else swept or running
    wrong = [name for name in (*candidates, *swept) if name not in running]
    if wrong or not candidates:
        shown_name, hint = (shown(wrong[0]), near_name(wrong[0], running)) if wrong else ('""', "")
        reason = f"must be one of the events in steady running: {', '.join(running) or 'none'}{hint}"
        raise InputError(f"sweep.event = {shown_name}: {reason}", "sweep.event")
    if len({*candidates, *swept}) != 1:
        reason = f"must be given, one of {', '.join(dict.fromkeys((*candidates, *swept)))}; a sweep follows one event"
        raise InputError(f"sweep.event: {reason}", "sweep.event")
    return candidates[0]


def _parameter(entry: Entry, variable: Variable, centre: float, of_grid: bool) -> SweptParameter:
    """A parameter of the sweep, in the one of three forms that its entry has."""
    content = entry.given
    forms = [
        form
        for form in ("from", "values", "tolerance")
        if form in content or (form == "from" and "to" in content)
    ]
    if len(forms) != 1:
        reason = "take one of these ways only" if forms else "has no values"
        line = f"{entry.place} ({variable.name}): {reason}: from and to, values, or tolerance"
        raise InputError(line, entry.place)
    entry.more = f" ({variable.name})"
    if forms == ["values"]:
        _without(entry, "points", "is of from and to, or of a tolerance; leave it out")
        _without(entry, "distribution", "is of a tolerance; leave it out")
        values = tuple(entry.quantity("values", variable, value) for value in content["values"])
        if not values:
            entry.fault("values", "must have at least one value")
        if len(set(values)) < len(values):
            entry.fault("values", "has a value twice; take one out")
        return SweptParameter(variable, centre, values)
    wide = None
    if forms == ["tolerance"]:
        wide = entry.quantity("tolerance", _tolerance_of(variable), content["tolerance"])
        low, high = centre - wide, centre + wide
    else:
        low, high = (_end(entry, name, variable) for name in ("from", "to"))
        if not high > low and not entry.errors:
            entry.fault("to", f"must be > from, {low:g}{unit_behind(variable.unit)}")
    if wide is None or of_grid:
        _without(entry, "distribution", "is of a tolerance with points that are no grid; leave it out")
    if not of_grid:
        _without(entry, "points", "is of a grid; the number of all points is sweep.points")
        distribution = content.get("distribution", "uniform")
        return SweptParameter(variable, centre, (), low, high, wide, distribution)
    usual = _VALUES if wide is None else _VALUES_OF_TOLERANCE
    count = entry.quantity("points", _COUNT, content.get("points", usual))
    entry.refuse()
    values = tuple(float(x) for x in np.linspace(low, high, int(count)))
    return SweptParameter(variable, centre, values, low, high, wide)


_COUNT = Variable(
    "",
    "number of values",
    Quantity("1", "number of values", low=2.0, high=float(MOST_VALUES), type="Integer"),
)


def _tolerance_of(v: Variable) -> Variable:
    """The declaration of a tolerance of a quantity."""
    kind = "difference" if v.unit == "K" else ""
    q = Quantity(v.unit, f"tolerance of: {v.description}", low=0.0, open_low=True, kind=kind)
    return Variable(v.name, q.description, q)


def _end(entry: Entry, name: str, variable: Variable) -> float:
    """The value of an end of a range; not a number, with a fault, where it is wrong or missing."""
    if name in entry.given:
        return entry.quantity(name, variable, entry.given[name])
    entry.fault(name, "must be given, beside the other end")
    return math.nan


def _without(entry: Entry, key: str, reason: str) -> None:
    if key in entry.given:
        entry.fault(key, reason)
