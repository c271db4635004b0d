"""The table [usage] of a study file and its entries [[usage.load]], and the plan that they state."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ...core.errors import Faults, InputError
from ...core.quantities import Value, declaration, percentage, quantity
from ...reading.lists import TableList
from ...reading.tables import file_key
from ...study.file_section import numbers
from .inverter import POINTS, InverterTable


@declaration
class Usage:
    """How long the machine runs, at which load, and what its energy costs."""

    hours: Value = quantity("1", "hours of running a day", default=16.0, above=0.0, max=24.0)
    days: Value = quantity("1", "days of running a year", default=250.0, above=0.0, max=366.0)
    tonnes_per_hour: Value = quantity(
        "1", "tonnes an hour, mean over the hours of running; 0: unknown", default=0.0, min=0.0, max=1e6
    )
    price: Value = quantity(
        "1",
        "price of a kWh, in the currency of the motors' prices; 0: unknown",
        default=0.0,
        min=0.0,
        max=1e6,
    )
    co2: Value = quantity(
        "1", "mass of CO2 for a kWh [kg]; 0: unknown", default=0.0, min=0.0, max=100.0, usual=(0.0, 2.0)
    )
    years: Value = quantity("1", "life of the drive in years", default=15.0, above=0.0, max=100.0)
    motor_price: Value = quantity(
        "1",
        "price of the motor; 0: its price in the catalogue, if it has one",
        default=0.0,
        min=0.0,
        max=1e12,
    )
    other_price: Value = quantity(
        "1",
        "price of the other motor; 0: its price in the catalogue, if it has one",
        default=0.0,
        min=0.0,
        max=1e12,
    )


@declaration
class LoadShare:
    """A load, and the share of the running time in which the machine has it."""

    share: Value = percentage("share of the running time", default=1.0, above=0.0, max=1.0)
    factor: Value = quantity(
        "1", "factor on the feed of the study: 1 as it is, 0 running empty", default=1.0, min=0.0, max=10.0
    )


LOADS = TableList(
    "usage.load",
    title="Share of load",
    description="loads of the machine, each with its share of the running time; together they are 100 %",
    most=12,
    declared=LoadShare,
    keys={"name": file_key(str, "", "name of the load", max_length=40)},
    follows={"name": "load 1, load 2, .."},
)
"""The entries [[usage.load]]."""

FIELDS: Mapping[str, Any] = {
    "other": file_key(
        str,
        "",
        "motor of the catalogue that is compared over the life; without it the same motor in the "
        "next efficiency class",
    ),
    "inverter_losses": file_key(
        numbers(InverterTable, "loss", "usage.inverter_losses", len(POINTS)),
        [],
        "losses of the inverter by its maker over its rated apparent power, at the eight operating "
        "points of IEC 61800-9-2 (frequency %; current %): "
        + ", ".join(f"({100 * f:g}; {100 * i:g})" for f, i in POINTS)
        + "; without them three quarters of the losses of the reference drive, the limit of class IE2",
    ),
    "load": LOADS.field,
}
"""Keys of the table that are no quantities, as pydantic fields."""

_WHOLE = 5e-3
"""Deviation from 100 % up to which shares count as complete, as three of 33.3 % do; then they are weights."""


@dataclass(frozen=True)
class UsagePlan:
    """The values of the table, the loads by name, the designation of the `other` motor (empty for the next class),
    and the losses of the inverter at `POINTS` over its apparent power, none to take those of class IE2."""

    table: Usage
    loads: Mapping[str, LoadShare]
    other: str
    inverter_losses: tuple[float, ...]

    @property
    def running(self) -> float:
        """Time of running in a year [s]."""
        return 3600.0 * float(self.table.hours) * float(self.table.days)


def read_usage(table: Usage, form: Any) -> UsagePlan:
    """The plan of a checked table [usage]: its values, and its `form` with what the file gives.

    Raises
    ------
    InputError
        for shares that are not 100 % together, and for a number of losses of the inverter other than eight.
    """
    faults = Faults()
    loads = LOADS.read(
        form.load,
        faults,
        lambda entry, name: LoadShare(**{key: x for key, x in entry.raw.items() if key != "name"}),
        usual="load ",
    )
    faults.refuse()
    whole = sum(load.share for load in loads.values())
    if loads and not math.isclose(whole, 1.0, abs_tol=_WHOLE):
        raise InputError(
            f"usage.load: the shares are {100 * whole:.4g} % together; must be 100 % (an entry with factor = 0 is "
            "running empty; time at rest is left out of usage.hours)",
            "usage.load",
        )
    losses = tuple(form.inverter_losses)
    if losses and len(losses) != len(POINTS):
        raise InputError(
            f"usage.inverter_losses: has {len(losses)} values; must have {len(POINTS)}, or be left out",
            "usage.inverter_losses",
        )
    return UsagePlan(table, loads or {"load 1": LoadShare(share=1.0, factor=1.0)}, form.other.strip(), losses)
