"""The quantities that a live page lets its reader change: their declarations, their values, and their names in the
equations of the page."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from typing import Any

from ...core.descriptions import of_driver
from ...core.quantities import Variable, named_values, variable_of
from ...reading.text import Units, scales, unit_text
from ...study.sections import Run


@dataclass(frozen=True)
class LiveQuantity:
    """A quantity of the page.

    `key` is its path in a study file. `turn` and `runs` are the full names of the parameters and inputs of the two
    models that have its value. `role` is set where its value takes another way: ``speed``, ``ratio``, ``ramp``,
    ``rotor``, ``added``, ``trip``, ``release``, or ``event``, a quantity of the event `event`.
    """

    key: tuple[str, ...]
    variable: Variable
    value: float
    group: str
    turn: tuple[str, ...] = ()
    runs: tuple[str, ...] = ()
    role: str = ""
    event: str = ""

    def data(self, units: Units, driver: str) -> dict[str, Any]:
        """The quantity as JSON has it, with the noun of the `driver`; bounds are in SI units, as the value."""
        q = self.variable.quantity
        return {
            "key": list(self.key),
            "name": self.variable.name,
            "title": of_driver(self.variable.template, driver),
            **shown_in_unit(self.variable.unit, self.variable.kind, units),
            "value": self.value,
            "low": q.low if math.isfinite(q.low) else None,
            "high": q.high if math.isfinite(q.high) else None,
            "above": q.open_low,
            "group": self.group,
            "turn": list(self.turn),
            "runs": list(self.runs),
            "role": self.role,
            "event": self.event,
        }


def of_machine(table: str, declared: Any, model_names: Collection[str] = ()) -> Iterator[LiveQuantity]:
    """The real numbers that a `table` of a study file has of a machine: its parameters, or its loads in normal
    running; `model_names` are the parameters and inputs of the model of runs. The ratio is a quantity of the
    drive."""
    for v, value in named_values(declared):
        if v.type == "Real" and v.name != "ratio":
            full = f"machine.{v.name}"
            runs = (full,) if full in model_names else ()
            yield LiveQuantity((table, *v.name.split(".")), v, value, table, (v.name,), runs)


def speed_of_crank(value: float, has_droop: bool = False) -> LiveQuantity:
    """The speed of the crank [rad/s]; behind an inverter with a droop, the page sets its reference higher by the fall
    with the load of the study, whatever the load is."""
    variable = variable_of(Run, "crank_speed")
    if has_droop:
        variable = replace(variable, template=f"{variable.template}, under the load of the study (droop)")
    return LiveQuantity(("run", "crank_speed"), variable, value, "drive", role="speed")


def shown_in_unit(unit: str, kind: str, units: Units) -> dict[str, Any]:
    """The unit in which a quantity is shown, with factor and offset, as JSON has it: shown = factor * value +
    offset."""
    name, factor, offset = scales(unit, kind, units)[0]
    return {"unit": unit_text(name), "factor": factor, "offset": offset}
