"""The reader of the table [sweep]: its entries against the quantities of the study, as a `SweepPlan`."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..core.errors import Faults, InputError, near_name, refusal_prefix, shown
from ..core.messages import unit_behind
from ..core.quantities import Quantity, Variable, named_values, variables
from ..mechanism.models import MachineModel
from ..reading.tables import given_values, read_table, to_number
from .cycle_quantities import CycleBasis, cycle_quantity
from .event import Event
from .sweep_plan import MOST_OF_HYPERCUBE, SweepPlan, SweptParameter
from .sweep_table import (
    LOADS_OF_SWEEP,
    MEASURES_OF_SWEEP,
    MOST_VALUES,
    USUAL_QUANTITIES,
    SweepEntry,
    SweepTable,
)

SPEED = "run.crank_speed"
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
        own = [
            *named_values(machine.p, "machine."),
            *named_values(feed, "feed."),
            *(each for each in named_values(run, "run.") if each[0].name == SPEED),
            *(
                each
                for name, event in events.items()
                for each in named_values(event.p, f"event.{name}.")
                if each[0].type == "Real"
            ),
        ]
        return cls({v.name: v for v, _ in own}, {v.name: x for v, x in own}, events)


def read_plan(
    form: Any, table: SweepTable, model: type[MachineModel], quantities: Sweepable, fixed: Mapping[str, str]
) -> SweepPlan:
    """The plan of a checked table [sweep]: its `form` with what the file gives, and its declared values `table`.

    `fixed` has, by the full name of a quantity that this study sets itself, the reason in words.

    Raises
    ------
    InputError
        with a line for each fault: the key, its value and the allowed range.
    """
    faults = Faults()
    parameters: list[SweptParameter] = []
    for k, entry in enumerate(form.parameter, 1):
        with faults.collected():
            parameters.append(_parameter(entry, k, form.method == "grid", quantities, fixed))
    names = [each.name for each in parameters]
    for name in sorted({name for name in names if names.count(name) > 1}):
        faults.add(
            [InputError(f"sweep.parameter: {name} stands there twice; take one out", "sweep.parameter")]
        )
    with faults.collected():
        _check_results(form, model)
    results = _results(form)
    points = int(table.points)
    with faults.collected():
        points = _points(form, points, parameters)
    event = ""
    with faults.collected():
        event = _event(form, names, quantities.events)
    known = (*results[0], *results[1])
    best = form.best or known[0]
    if best not in known:
        words = f"must be one of the quantities and measures of the sweep: {', '.join(known)}{near_name(best, known)}"
        faults.add([InputError(f"sweep.best = {shown(best)}: {words}", "sweep.best")])
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


def _check_results(form: Any, model: type[MachineModel]) -> None:
    """Refuse names that are no quantities and no measures."""
    faults = Faults()
    for name in dict.fromkeys(form.quantities):
        with faults.collected(), refusal_prefix("sweep.quantities: ", "sweep.quantities"):
            cycle_quantity(name, model)
    for name in dict.fromkeys(form.measures):
        if name not in MEASURES_OF_SWEEP:
            hint = near_name(name, MEASURES_OF_SWEEP)
            line = f"sweep.measures: {shown(name)}: must be one of {', '.join(MEASURES_OF_SWEEP)}{hint}"
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
    product = math.prod(len(each.values) for each in parameters)
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
        given, hint = (shown(wrong[0]), near_name(wrong[0], running)) if wrong else ('""', "")
        words = f"must be one of the events in steady running: {', '.join(running) or 'none'}{hint}"
        raise InputError(f"sweep.event = {given}: {words}", "sweep.event")
    if len({*candidates, *swept}) != 1:
        words = f"must be given, one of {', '.join(dict.fromkeys((*candidates, *swept)))}; a sweep follows one event"
        raise InputError(f"sweep.event: {words}", "sweep.event")
    return candidates[0]


def _parameter(
    entry: Any, k: int, of_grid: bool, quantities: Sweepable, fixed: Mapping[str, str]
) -> SweptParameter:
    """A parameter of the sweep from the entry with the number `k`."""
    place = f"sweep.parameter.{k}"
    if not isinstance(entry, Mapping):
        raise InputError(f"{place} = {shown(entry)}: must be a table", place)
    given = given_values(read_table(SweepEntry, entry, f"{place}."))
    name = given.get("name", "")
    if not name:
        raise InputError(f'{place}.name: must be given, such as "machine.r"', f"{place}.name")
    if name not in quantities.variables:
        raise InputError(
            f"{place}.name = {shown(name)}: must be the full name of a number of the machine (machine.r), of its "
            f"feed (feed. ..), of an event of the study (event.NAME. ..), or {SPEED}"
            f"{near_name(name, quantities.variables)}",
            f"{place}.name",
        )
    if name in fixed:
        raise InputError(f"{place}.name = {shown(name)}: {fixed[name]}", f"{place}.name")
    variable, centre = quantities.variables[name], quantities.values[name]
    reader = _EntryReader(place, variable, given)
    forms = [
        form
        for form in ("from", "values", "tolerance")
        if form in given or (form == "from" and "to" in given)
    ]
    if len(forms) != 1:
        words = "take one of these ways only" if forms else "has no values"
        raise InputError(f"{place} ({name}): {words}: from and to, values, or tolerance", place)
    parameter = reader.parameter(forms[0], centre, of_grid)
    reader.refuse()
    return parameter


class _EntryReader(Faults):
    """The numbers of an entry, with the faults among them."""

    def __init__(self, place: str, variable: Variable, given: Mapping[str, Any]) -> None:
        super().__init__()
        self._place, self._variable, self._given = place, variable, given

    def parameter(self, form: str, centre: float, of_grid: bool) -> SweptParameter:
        """The parameter that is given in this form."""
        variable, given = self._variable, self._given
        if form == "values":
            self._without("points", "is of from and to, or of a tolerance; leave it out")
            self._without("distribution", "is of a tolerance; leave it out")
            values = tuple(self._number("values", each) for each in given["values"])
            if not values:
                self._fault("values", "must have at least one value")
            if len(set(values)) < len(values):
                self._fault("values", "has a value twice; take one out")
            return SweptParameter(variable, centre, values or (centre,))
        if form == "tolerance":
            wide = self._number("tolerance", given["tolerance"], self._of_tolerance())
            low, high = centre - wide, centre + wide
        else:
            low, high = (self._number(name, given.get(name)) for name in ("from", "to"))
            wide = None
            if not high > low and not self.errors:
                self._fault("to", f"must be > from, {low:g}{unit_behind(variable.unit)}")
        distribution = given.get("distribution", "uniform")
        if wide is None or of_grid:
            self._without("distribution", "is of a tolerance with points that are no grid; leave it out")
        if not of_grid:
            self._without("points", "is of a grid; the number of all points is sweep.points")
            return SweptParameter(variable, centre, (), low, high, wide, distribution)
        count = self._count(_VALUES if wide is None else _VALUES_OF_TOLERANCE)
        values = tuple(float(x) for x in np.linspace(low, high, count)) if not self.errors else (centre,)
        return SweptParameter(variable, centre, values, low, high, wide)

    def _of_tolerance(self) -> Variable:
        """The declaration of a tolerance of the quantity."""
        v = self._variable
        kind = "difference" if v.unit == "K" else ""
        q = Quantity(v.unit, f"tolerance of: {v.description}", low=0.0, open_low=True, kind=kind)
        return Variable(v.name, q.description, q)

    def _number(self, key: str, given: Any, variable: Variable | None = None) -> float:
        own = dataclasses.replace(variable or self._variable, name=f"{self._place}.{key}")
        if given is None:
            self._fault(key, "must be given, beside the other end")
            return math.nan
        try:
            return to_number(own, given)
        except ValueError as error:
            self.add([InputError(f"{error} ({self._variable.name})", own.name)])
            return math.nan

    def _count(self, default: int) -> int:
        q = Quantity("1", "number of values", low=2.0, high=float(MOST_VALUES), type="Integer")
        count = self._number("points", self._given.get("points", default), Variable("", q.description, q))
        return int(count) if math.isfinite(count) else default

    def _without(self, key: str, words: str) -> None:
        if key in self._given:
            self._fault(key, words)

    def _fault(self, key: str, words: str) -> None:
        name = f"{self._place}.{key}"
        self.add([InputError(f"{name}: {words} ({self._variable.name})", name)])
