"""The table [optimize] of a study file: its numbers, and the wishes that it states."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from typing import Any

from ...core.errors import Faults, InputError, near_name, refusal_prefix
from ...core.messages import unit_behind
from ...core.quantities import Variable, plain_variable
from ...mechanism.models import MachineModel
from ...reading.lists import Entry, leaves, read_entries
from ...reading.tables import file_key
from ...study.config import FileReading
from ...study.cycle_quantities import CycleQuantity, cycle_quantity
from ...study.parts import motor_is_left
from .wishes import SLACK, TurnLimit, Wishes

USUAL_OBJECTIVE = "peak(crank_torque)"
_ENDS = ("min", "max")


FIELDS: Mapping[str, Any] = {
    "objectives": file_key(
        list[str],
        [],
        f"one or two quantities of the turn that are to be least; without it {USUAL_OBJECTIVE}",
        max_length=2,
    ),
    "free": file_key(dict[str, Any], {}, "parameters of the machine that may change, each with { min, max }"),
    "limits": file_key(
        dict[str, Any], {}, "limits of quantities of the turn, each with { min }, { max } or both"
    ),
}
"""Keys of the table that are no quantities, as pydantic fields."""


def read_wishes(reading: FileReading) -> Wishes | None:
    """The wishes of a study with a checked table [optimize]; None for a machine that was refused.

    Raises
    ------
    InputError
        with a line for each fault: the key, its value and the allowed range.
    """
    form, table, model = reading.form.optimize, reading.values["optimize"], reading.parts.machine
    machine, feed, faults = reading.machine, reading.values["feed"], Faults()
    objectives: list[CycleQuantity] = []
    for name in form.objectives or [USUAL_OBJECTIVE]:
        with faults.collected(), refusal_prefix("optimize.objectives: ", "optimize.objectives"):
            objectives.append(cycle_quantity(name, model))
    # the motor, and so the ratio, is of the catalogue
    of_catalogue = bool(reading.parts.designation or motor_is_left(reading.data))
    free = _free(form.free, model, of_catalogue, faults)
    limits = read_entries(
        form.limits.items(), "optimize.limits", faults, lambda entry, name: _limit(entry, name, model)
    )
    if table.slack_free_speed and machine is not None and not machine.loaded_sides(feed):
        reason = "needs webs with mass or load, which this machine has not; leave it out"
        faults.add([InputError(f"optimize.{SLACK}: {reason}", f"optimize.{SLACK}")])
    faults.refuse()
    if machine is None:
        return None
    return Wishes(
        machine=machine,
        feed=feed,
        crank_speed=float(reading.values["run"].crank_speed),
        objectives=tuple(objectives),
        free=free,
        limits=tuple(limits),
        table=table,
    )


def wishes_of(plans: Mapping[str, Any]) -> Wishes:
    """The wishes of a study, among the plans of all capabilities.

    Raises
    ------
    InputError
        for a study without the table [optimize].
    """
    wishes: Wishes | None = plans.get("optimize")
    if wishes is None:
        raise InputError(
            "optimize: is missing; add [optimize] with objectives, and [optimize.free] with the parameters that may "
            "change, such as r = { min = 0.1, max = 0.2 }",
            key="optimize",
        )
    return wishes


def _free(
    tables: Mapping[str, Any], model: MachineModel, of_catalogue: bool, faults: Faults
) -> dict[str, tuple[float, float]]:
    """The bounds of the free parameters by name, of the `tables` [optimize.free.name]."""
    variables = {v.name: v for v in model.parameter_layout.variables}

    def read(entry: Entry, name: str) -> tuple[str, tuple[float, float]]:
        """Name and bounds of a free parameter."""
        if name not in variables:
            entry.fault("", f"no such parameter of the machine{_hint(name, variables)}")
            entry.refuse()
        low, high, unit = _ends(entry, variables[name], "min and max")
        if math.isinf(low) or math.isinf(high):
            entry.wrong("", entry.given, "must have min and max")
        elif high <= low:
            entry.fault("", f"max = {high:g}{unit} must be > min = {low:g}{unit}")
        elif name == "ratio" and of_catalogue:
            entry.fault("", "follows from the motor of the catalogue; leave it out")
        return name, (low, high)

    def is_nested(name: str, inner: Mapping[str, Any]) -> bool:
        return bool(inner) and not set(inner) & set(_ENDS) and name not in variables

    if not tables:
        line = "optimize.free: must name at least one parameter, such as r = { min = 0.1, max = 0.2 }"
        faults.add([InputError(line, "optimize.free")])
    return dict(read_entries(leaves(tables, is_nested), "optimize.free", faults, read))


def _hint(name: str, names: Collection[str]) -> str:
    """Words on the parameter that was meant, or on all of them."""
    parameter = name.removeprefix("machine.")
    if parameter in names:
        return f"; write optimize.free.{parameter}"
    return near_name(parameter, names) or f"; there are {', '.join(names)}"


def _ends(entry: Entry, variable: Variable, needed: str) -> tuple[float, float, str]:
    """The values of min and max in the declared unit, infinite where they are not given, and words on the unit."""
    if not isinstance(entry.raw, Mapping) or not entry.raw:
        entry.wrong("", entry.raw, f"must be a table with {needed}")
        entry.refuse()
    entry.keys("", entry.given, _ENDS)
    low_end, high_end = _ENDS
    low = entry.quantity(low_end, variable, entry.given[low_end]) if low_end in entry.given else -math.inf
    high = entry.quantity(high_end, variable, entry.given[high_end]) if high_end in entry.given else math.inf
    return low, high, unit_behind(variable.unit)


def _limit(entry: Entry, name: str, model: MachineModel) -> TurnLimit:
    """The limit that a table states for the quantity of that name."""
    with refusal_prefix("optimize.limits: ", entry.place):
        q = cycle_quantity(name, model)
    variable = plain_variable(name, q.unit, q.description)
    low, high, unit = _ends(entry, variable, "min, max, or both")
    if low > high:
        entry.fault("", f"max = {high:g}{unit} must be >= min = {low:g}{unit}")
    elif "min" in entry.given and name == "installed_power":
        entry.fault("min", "installed_power has an upper limit only; leave it out")
    return TurnLimit(q, low if "min" in entry.given else None, high if "max" in entry.given else None)
