"""The table [optimize] of a study file: its numbers, and the wishes that it states."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from pydantic import Field

from ...errors import Faults, InputError, near_name, refusal_prefix, shown
from ...quantities import Quantity, Value, Variable, declaration, quantity
from ...reading import to_number
from ..cycle_quantities import CycleBasis, CycleQuantity, cycle_quantity
from .wishes import SLACK, TurnLimit, Wishes

USUAL_OBJECTIVE = "peak(crank_torque)"
_ENDS = ("min", "max")


@declaration
class Optimize(CycleBasis):
    """The search for the best machine."""

    clearance: Value = quantity(
        "1",
        "least distance from the limits within which the machine turns, as a share of the distance of today",
        default=0.02,
        min=1e-6,
        max=1.0,
        kind="percent",
    )
    slack_free_speed: Value = quantity(
        "rad/s",
        "crank speed up to which the webs keep their pull; with 0 there is no such limit",
        default=0.0,
        min=0.0,
        max=1000.0,
        kind="speed",
    )
    starts: Value = quantity("1", "number of starts, spread over the bounds", default=20.0, min=1.0, max=1e4)
    seed: Value = quantity("1", "seed of the starts", default=1.0, min=0.0, max=1e9)
    pareto_points: Value = quantity(
        "1", "number of points of the front of two objectives", default=9.0, min=2.0, max=200.0
    )


WHOLE = ("starts", "seed", "pareto_points")
"""Quantities of the table that are whole numbers."""

FIELDS: Mapping[str, Any] = {
    "objectives": (
        list[str],
        Field(
            [],
            max_length=2,
            description=f"one or two quantities of the turn that are to be least; without it {USUAL_OBJECTIVE}",
        ),
    ),
    "free": (
        dict[str, Any],
        Field({}, description="parameters of the machine that may change, each with { min, max }"),
    ),
    "limits": (
        dict[str, Any],
        Field({}, description="limits of quantities of the turn, each with { min }, { max } or both"),
    ),
}
"""Keys of the table that are no quantities, as pydantic fields."""


def wishes_of(config: Any) -> Wishes:
    """The wishes of a study.

    Raises
    ------
    InputError
        with a line for each fault: the key, its value and the allowed range.
    """
    table, machine = config.optimize, config.machine
    if table is None:
        raise InputError(
            "optimize: is missing; add [optimize] with objectives, and [optimize.free] with the parameters that may "
            "change, such as r = { min = 0.1, max = 0.2 }",
            key="optimize",
        )
    if not hasattr(machine.model, "linkage"):
        raise InputError(
            "optimize: needs the equations of the machine, which is an FMU; leave it out", "optimize"
        )
    faults = Faults()
    objectives: list[CycleQuantity] = []
    for name in config.choices["optimize.objectives"] or [USUAL_OBJECTIVE]:
        with faults.collected(), refusal_prefix("optimize.objectives: ", "optimize.objectives"):
            objectives.append(cycle_quantity(name, machine.model))
    free: dict[str, tuple[float, float]] = {}
    with faults.collected():
        free = _free(config)
    limits: list[TurnLimit] = []
    for name, ends in config.choices["optimize.limits"].items():
        with faults.collected():
            limits.append(_limit(name, ends, machine.model))
    if table.slack_free_speed and not machine.loaded_sides(config.feed):
        words = "needs webs with mass or load, which this machine has not; leave it out"
        faults.add([InputError(f"optimize.{SLACK}: {words}", f"optimize.{SLACK}")])
    faults.refuse()
    return Wishes(
        machine=machine,
        feed=config.feed,
        crank_speed=float(config.run.crank_speed),
        objectives=tuple(objectives),
        free=free,
        limits=tuple(limits),
        clearance=float(table.clearance),
        slack_free_speed=float(table.slack_free_speed),
        basis=table,
        starts=int(table.starts),
        seed=int(table.seed),
        pareto_points=int(table.pareto_points),
    )


def _free(config: Any) -> dict[str, tuple[float, float]]:
    variables = {v.name: v for v in config.machine.model.parameter_layout.variables}
    faults, free = Faults(), {}
    for name, ends in _leaves(config.choices["optimize.free"], ""):
        key = f"optimize.free.{name}"
        with faults.collected():
            if name not in variables:
                hint = near_name(name, variables) or f"; there are {', '.join(variables)}"
                raise InputError(f"{key}: no such parameter of the machine{hint}", key)
            bounds = _ends(key, ends, variables[name])
            if None in bounds.values():
                raise InputError(f"{key} = {shown(ends)}: must have min and max", key)
            low, high = bounds["min"], bounds["max"]
            if not low < high:
                raise InputError(f"{key}: max = {high:g} must be > min = {low:g}", key)
            if name == "ratio" and config.of_catalogue:
                raise InputError(f"{key}: follows from the motor of the catalogue; leave it out", key)
            free[name] = low, high
    if not free and not faults.errors:
        raise InputError(
            "optimize.free: must name at least one parameter, such as r = { min = 0.1, max = 0.2 }",
            "optimize.free",
        )
    faults.refuse()
    return free


def _leaves(table: Any, prefix: str) -> Iterator[tuple[str, Any]]:
    """The tables of ends in nested tables, with their full names."""
    for name, inner in table.items():
        full = f"{prefix}{name}"
        if isinstance(inner, Mapping) and inner and not set(inner) & set(_ENDS):
            yield from _leaves(inner, f"{full}.")
        else:
            yield full, inner


def _ends(key: str, given: Any, variable: Variable) -> dict[str, Any]:
    """The values of min and max in the declared unit, None for one that is not given."""
    if not isinstance(given, Mapping) or not given or set(given) - set(_ENDS):
        raise InputError(f"{key} = {shown(given)}: must be a table with min, max, or both", key)
    ends: dict[str, Any] = dict.fromkeys(_ENDS)
    for end, value in given.items():
        full = f"{key}.{end}"
        try:
            ends[end] = to_number(Variable(full, variable.description, variable.quantity), value)
        except ValueError as error:
            raise InputError(str(error), full) from None
    return ends


def _limit(name: str, given: Any, model: Any) -> TurnLimit:
    key = f"optimize.limits.{name}"
    with refusal_prefix("optimize.limits: ", key):
        q = cycle_quantity(name, model)
    ends = _ends(key, given, Variable(name, q.description, Quantity(q.unit, q.description)))
    low, high = ends["min"], ends["max"]
    if low is not None and high is not None and not low <= high:
        raise InputError(f"{key}: max = {high:g} must be >= min = {low:g}", key)
    if low is not None and name == "installed_power":
        raise InputError(f"{key}.min: installed_power has an upper limit only; leave it out", f"{key}.min")
    return TurnLimit(q, low, high)
