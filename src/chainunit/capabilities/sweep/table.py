"""The table [sweep] of a study file and its entries [[sweep.parameter]]: their declarations, and their reader."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np

from ...core.errors import Faults, InputError, near_name, one_of, refusal_prefix, shown
from ...core.messages import unit_behind
from ...core.quantities import (
    Value,
    Variable,
    declaration,
    named_values,
    plain_variable,
    variables,
    whole_number,
)
from ...reading.lists import Entry, TableList
from ...reading.tables import file_key
from ...study.config import FileReading
from ...study.cycle_quantities import CycleBasis, cycle_quantity
from ...study.event import Event
from ...study.file_section import Entered, entered, filled_text
from .plan import MOST_OF_HYPERCUBE, SweepPlan, SweptParameter

SPEED = "run.crank_speed"
METHODS = ("grid", "latin_hypercube", "sobol")
DISTRIBUTIONS = ("uniform", "normal")
MEASURES_OF_SWEEP = (
    "crank_torque_peak",
    "motor_torque_peak",
    "current_peak",
    "rocker_torque_peak",
    "speed_least",
    "speed_dip",
    "stall_time",
    "coupling_trip_time",
)
"""The measures of a run with an event that a sweep can have."""
LOADS_OF_SWEEP = (*MEASURES_OF_SWEEP[:4], "speed_dip", "stall_time")
"""The measures whose largest values are the worst."""
USUAL_QUANTITIES = ("peak(crank_torque)", "rms(crank_torque)")
"""The cycle quantities of a sweep that names neither quantities nor measures."""
MOST_PARAMETERS, MOST_VALUES, MOST_RESULTS = 32, 1000, 40


@declaration
class SweepTable(CycleBasis):
    """A sweep over parameters of the study."""

    points: Value = whole_number(
        "number of points; of a grid that of its parameters", default=1024, min=1, max=1_000_000_000
    )
    seed: Value = whole_number("seed of the points, except of a grid", default=1, min=0, max=1_000_000_000)
    angles: Value = whole_number("crank angles of a turn", default=720, min=8, max=100_000)


SWEPT = TableList(
    "sweep.parameter",
    title="Parameter of a sweep",
    description="swept quantities",
    most=MOST_PARAMETERS,
    must_be="the full name of a number of the machine (machine.r), of its feed (feed. ..), of an event of the study "
    f"(event.NAME. ..), or {SPEED}",
    example="machine.r",
    conditions={
        "required": ["name"],
        "oneOf": [
            {"required": ["from", "to"]},
            {"required": ["values"]},
            {"required": ["tolerance"]},
        ],
    },
    keys={
        "name": filled_text(
            'full name of a quantity, such as "machine.r", "run.crank_speed", '
            '"feed.left.material_mass", "event.jam_left.force"'
        ),
        "from": entered("least value"),
        "to": entered("largest value"),
        "points": entered("number of values of a grid between these, 11 by default; of a tolerance 3"),
        "values": file_key(list[Entered], [], "values, in place of from and to", max_length=MOST_VALUES),
        "tolerance": entered("largest difference from the value of the study, in place of from and to"),
        "distribution": file_key(
            Literal[DISTRIBUTIONS],
            "uniform",
            "of a tolerance, where the method is no grid; of a normal one it is 3 standard deviations",
        ),
    },
)
"""The entries [[sweep.parameter]]."""


FIELDS: Mapping[str, Any] = {
    "method": file_key(
        Literal[METHODS],
        "sobol",
        "points: all combinations of values (a grid), or points that fill the space",
    ),
    "quantities": file_key(
        list[str],
        [],
        'quantities of a turn, such as "peak(crank_torque)" or "installed_power"',
        max_length=MOST_RESULTS,
    ),
    "measures": file_key(
        list[str], [], "measures of a run with the event", max_length=len(MEASURES_OF_SWEEP)
    ),
    "event": file_key(str, "", "event of the measures, by the name of its run"),
    "best": file_key(str, "", "quantity or measure by which points are ranked"),
    "best_is": file_key(
        Literal["least", "largest"],
        "least",
        "which of its values is best; of a load, where best is not given, the largest",
    ),
    "parameter": SWEPT.field,
}
"""Keys of the table that are no quantities, as pydantic fields."""

_MOST_OF_GRID = 1_000_000_000
_VALUES, _VALUES_OF_TOLERANCE = 11, 3
_WAYS = {"from and to": ("from", "to"), "values": ("values",), "tolerance": ("tolerance",)}
"""By way to give the values of a parameter, its keys."""


def read_plan(reading: FileReading) -> SweepPlan:
    """The plan of a checked table [sweep].

    Raises
    ------
    InputError
        with a line for each fault: the key, its value and the allowed range.
    """
    form, parts = reading.form.sweep, reading.parts
    table: SweepTable = reading.values["sweep"]
    faults, quantities = Faults(), _sweepable(reading)

    def read(entry: Entry, name: str) -> SweptParameter:
        return _parameter(entry, *quantities[name], form.method == "grid")

    fixed = {"machine.ratio": "follows from the motor's rated speed"} if parts.designation else {}
    swept = SWEPT.read(form.parameter, faults, read, names=quantities, fixed=fixed)
    cycle_names, measures = tuple(dict.fromkeys(form.quantities)), tuple(dict.fromkeys(form.measures))
    for name in cycle_names:
        with faults.collected(), refusal_prefix("sweep.quantities: ", "sweep.quantities"):
            cycle_quantity(name, parts.machine)
    for name in measures:
        if name not in MEASURES_OF_SWEEP:
            line = f"sweep.measures: {shown(name)}: must be {one_of(name, MEASURES_OF_SWEEP)}"
            faults.add([InputError(line, "sweep.measures")])
    if not (cycle_names or measures):
        cycle_names = USUAL_QUANTITIES
    points, event = int(table.points), ""
    with faults.collected():
        points = _points(form.method, points, list(swept.values()))
    with faults.collected():
        event = _event(form, list(swept), reading.events)
    results = *cycle_names, *measures
    best = form.best or results[0]
    if best not in results:
        reason = f"must be one of the quantities and measures of the sweep: {', '.join(results)}"
        line = f"sweep.best = {shown(best)}: {reason}{near_name(best, results)}"
        faults.add([InputError(line, "sweep.best")])
    faults.refuse()
    # no value of a load is wished for: if the file does not say what is best, the largest ones come first
    is_load = not form.best and "best_is" not in form.model_fields_set and best in LOADS_OF_SWEEP
    return SweepPlan(
        method=form.method,
        seed=int(table.seed),
        points=points,
        parameters=tuple(swept.values()),
        quantities=cycle_names,
        measures=measures,
        event=event,
        best=best,
        best_is="largest" if is_load else form.best_is,
        angles=int(table.angles),
        basis=CycleBasis(**{v.name: getattr(table, v.name) for v in variables(CycleBasis)}),
    )


def _sweepable(reading: FileReading) -> dict[str, tuple[Variable, float]]:
    """The quantities of a study that a sweep may vary: by full name the declaration and the value."""
    assert reading.machine is not None
    pairs = [*named_values(reading.machine.p, "machine."), *named_values(reading.values["feed"], "feed.")]
    pairs += (pair for pair in named_values(reading.values["run"], "run.") if pair[0].name == SPEED)
    for name, event in reading.events.items():
        pairs += (pair for pair in named_values(event.p, f"event.{name}.") if pair[0].type == "Real")
    return {v.name: (v, x) for v, x in pairs}


def _points(method: str, points: int, parameters: Sequence[SweptParameter]) -> int:
    """The number of points."""
    if method == "latin_hypercube" and points > MOST_OF_HYPERCUBE:
        raise InputError(
            f"sweep.points = {points}: of a Latin hypercube must be <= {MOST_OF_HYPERCUBE}, as each point "
            'depends on all others; take method = "sobol"',
            "sweep.points",
        )
    if method != "grid":
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
    """A parameter of the sweep, in the one of three ways that its entry has."""
    content = entry.given
    ways = [way for way, keys in _WAYS.items() if any(key in content for key in keys)]
    if len(ways) != 1:
        reason = "take one of these ways only" if ways else "has no values"
        line = f"{entry.place} ({variable.name}): {reason}: from and to, values, or tolerance"
        raise InputError(line, entry.place)
    (way,), entry.more = ways, f" ({variable.name})"
    if way == "values":
        _without(entry, "points", "is of from and to, or of a tolerance; leave it out")
        _without(entry, "distribution", "is of a tolerance; leave it out")
        values = tuple(entry.quantity("values", variable, value) for value in content["values"])
        if not values:
            entry.fault("values", "must have at least one value")
        if len(set(values)) < len(values):
            entry.fault("values", "has a value twice; take one out")
        return SweptParameter(variable, centre, values)
    wide, usual = None, _VALUES
    if way == "tolerance":
        wide = entry.quantity("tolerance", _tolerance_of(variable), content["tolerance"])
        usual = _VALUES_OF_TOLERANCE
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
    count = entry.quantity("points", _COUNT, content.get("points", usual))
    entry.refuse()
    values = tuple(float(x) for x in np.linspace(low, high, int(count)))
    return SweptParameter(variable, centre, values, low, high, wide)


_COUNT = plain_variable("", "1", "number of values", low=2.0, high=float(MOST_VALUES), type="Integer")


def _tolerance_of(v: Variable) -> Variable:
    """The declaration of a tolerance of a quantity."""
    kind = "difference" if v.unit == "K" else ""
    text = f"tolerance of: {v.description}"
    return plain_variable(v.name, v.unit, text, low=0.0, open_low=True, kind=kind)


def _end(entry: Entry, name: str, variable: Variable) -> float:
    """The value of an end of a range; not a number, with a fault, where it is wrong or missing."""
    if name in entry.given:
        return entry.quantity(name, variable, entry.given[name])
    entry.fault(name, "must be given, beside the other end")
    return math.nan


def _without(entry: Entry, key: str, reason: str) -> None:
    if key in entry.given:
        entry.fault(key, reason)
