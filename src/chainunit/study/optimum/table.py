"""The table [optimize] of a study file: its numbers, and the wishes that it states."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import Any

from pydantic import Field

from ...core.errors import Faults, InputError, meant, near_name, refusal_prefix, shown
from ...core.messages import unit_behind
from ...core.quantities import Quantity, Value, Variable, declaration, quantity
from ...machines.machine import Machine
from ...mechanism.models import MachineModel
from ...reading.tables import to_number
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
        "crank speed up to which no web goes slack: its mean pull stays above 0; with 0 there is no such limit",
        default=0.0,
        min=0.0,
        max=1000.0,
        kind="speed",
    )
    starts: Value = quantity(
        "1", "number of starts, spread over the bounds", default=20, min=1, max=10_000, type="Integer"
    )
    seed: Value = quantity("1", "seed of the starts", default=1, min=0, max=1_000_000_000, type="Integer")
    pareto_points: Value = quantity(
        "1", "number of points of the front of two objectives", default=9, min=2, max=200, type="Integer"
    )


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


def read_wishes(
    table: Optimize,
    form: Any,
    model: type[MachineModel],
    machine: Machine | None,
    feed: Any,
    crank_speed: float,
    of_catalogue: bool,
) -> Wishes | None:
    """The wishes of a checked table [optimize]: its declared values `table`, and its `form` with what the file
    gives; None for a machine that was refused. `of_catalogue` tells whether the motor, and so the ratio, is of the
    catalogue.

    Raises
    ------
    InputError
        with a line for each fault: the key, its value and the allowed range.
    """
    faults = Faults()
    objectives: list[CycleQuantity] = []
    for name in form.objectives or [USUAL_OBJECTIVE]:
        with faults.collected(), refusal_prefix("optimize.objectives: ", "optimize.objectives"):
            objectives.append(cycle_quantity(name, model))
    free: dict[str, tuple[float, float]] = {}
    with faults.collected():
        free = _free(form.free, model, of_catalogue)
    limits: list[TurnLimit] = []
    for name, ends in form.limits.items():
        with faults.collected():
            limits.append(_limit(name, ends, model))
    if table.slack_free_speed and machine is not None and not machine.loaded_sides(feed):
        words = "needs webs with mass or load, which this machine has not; leave it out"
        faults.add([InputError(f"optimize.{SLACK}: {words}", f"optimize.{SLACK}")])
    faults.refuse()
    if machine is None:
        return None
    return Wishes(
        machine=machine,
        feed=feed,
        crank_speed=float(crank_speed),
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


def wishes_of(config: Any) -> Wishes:
    """The wishes of a study.

    Raises
    ------
    InputError
        for a study without the table [optimize].
    """
    wishes: Wishes | None = config.plans.get("optimize")
    if wishes is None:
        raise InputError(
            "optimize: is missing; add [optimize] with objectives, and [optimize.free] with the parameters that may "
            "change, such as r = { min = 0.1, max = 0.2 }",
            key="optimize",
        )
    return wishes


def _free(
    tables: Mapping[str, Any], model: type[MachineModel], of_catalogue: bool
) -> dict[str, tuple[float, float]]:
    variables = {v.name: v for v in model.parameter_layout.variables}
    faults, free = Faults(), {}
    for name, ends in _leaves(tables, "", variables):
        key = f"optimize.free.{name}"
        with faults.collected():
            if name not in variables:
                raise InputError(f"{key}: no such parameter of the machine{_hint(name, variables)}", key)
            bounds = _ends(key, ends, variables[name], _ENDS)
            low, high, unit = bounds["min"], bounds["max"], unit_behind(variables[name].unit)
            if not low < high:
                raise InputError(f"{key}: max = {high:g}{unit} must be > min = {low:g}{unit}", key)
            if name == "ratio" and of_catalogue:
                raise InputError(f"{key}: follows from the motor of the catalogue; leave it out", key)
            free[name] = low, high
    if not free and not faults.errors:
        raise InputError(
            "optimize.free: must name at least one parameter, such as r = { min = 0.1, max = 0.2 }",
            "optimize.free",
        )
    faults.refuse()
    return free


def _hint(name: str, known: Collection[str]) -> str:
    """Words on the parameter that was meant, or on all of them."""
    own = name.removeprefix("machine.")
    if own in known:
        return f"; write optimize.free.{own}"
    return near_name(own, known) or f"; there are {', '.join(known)}"


def _leaves(table: Mapping[str, Any], prefix: str, known: Collection[str]) -> Iterator[tuple[str, Any]]:
    """The tables of ends in nested tables, with their full names."""
    for name, inner in table.items():
        full = f"{prefix}{name}"
        is_nested = isinstance(inner, Mapping) and inner and not set(inner) & set(_ENDS)
        if is_nested and full not in known:
            yield from _leaves(inner, f"{full}.", known)
        else:
            yield full, inner


def _ends(key: str, given: Any, variable: Variable, required: Collection[str] = ()) -> dict[str, Any]:
    """The values of min and max in the declared unit, None for one that is not given."""
    if not isinstance(given, Mapping) or not given:
        needed = " and ".join(required) or "min, max, or both"
        raise InputError(f"{key} = {shown(given)}: must be a table with {needed}", key)
    ends: dict[str, Any] = dict.fromkeys(_ENDS)
    faults = Faults()
    for end, value in given.items():
        full = f"{key}.{end}"
        with faults.collected():
            if end not in _ENDS:
                words = f"unknown key{meant(str(end), _ENDS)} known here: {', '.join(_ENDS)}"
                raise InputError(f"{full}: {words}", full)
            try:
                ends[end] = to_number(Variable(full, variable.description, variable.quantity), value)
            except ValueError as error:
                raise InputError(str(error), full) from None
    if not set(required) <= set(given):
        faults.add([InputError(f"{key} = {shown(given)}: must have {' and '.join(required)}", key)])
    faults.refuse()
    return ends


def _limit(name: str, given: Any, model: type[MachineModel]) -> TurnLimit:
    key = f"optimize.limits.{name}"
    with refusal_prefix("optimize.limits: ", key):
        q = cycle_quantity(name, model)
    ends = _ends(key, given, Variable(name, q.description, Quantity(q.unit, q.description)))
    low, high, unit = ends["min"], ends["max"], unit_behind(q.unit)
    if low is not None and high is not None and not low <= high:
        raise InputError(f"{key}: max = {high:g}{unit} must be >= min = {low:g}{unit}", key)
    if low is not None and name == "installed_power":
        raise InputError(f"{key}.min: installed_power has an upper limit only; leave it out", f"{key}.min")
    return TurnLimit(q, low, high)
