"""The TOML table of an event::

    [[event]]
    type = "jam"
    side = "right"
    force = "2 kN"

A quantity that the table does not name has its declared default. The key ``name`` gives the name of the run.
Without it, the name is made from type and side, with a number for further events of the same kind
(``jam_right_2``). The event of random overloads is such a table, too. There a quantity may be a range,
``force = ["1 kN", "3 kN"]``, and the side is drawn if the table does not name it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from pydantic import BaseModel

from ..core.errors import Faults, InputError, each_refusal, near_name
from ..core.quantities import Layout, Variable, variables
from ..machines.chain_unit import SIDES
from ..mechanism.models import MachineModel
from ..reading.lists import Entry, read_entries
from ..reading.tables import given_values, instance, read_table, schema
from .event import TYPES, AnySide, Event, filled
from .events import Jam
from .rig import Rig

RESERVED = ("start_up", "settling", "steady", "constant", "unfinished")
"""Names that an event may not have, as other runs of a study have them."""
LONGEST_NAME = 40
"""letters"""
_NAME = re.compile(rf"[a-z][a-z0-9_]{{0,{LONGEST_NAME - 1}}}")


def inputs_of(machine: MachineModel) -> str:
    """Words on the inputs of a machine, and on the event that lets one of them rise."""
    names = Layout(machine.Feed).names
    if not names:
        return "it has no inputs"
    return f'its inputs: {", ".join(names)} (type = "surge" with input = "{names[0]}" lets one rise)'


def read_events(tables: Sequence[Any], machine: MachineModel | None = None) -> dict[str, Event]:
    """Events by the names of their runs, in the order of the tables; of the `machine`, where it is known.

    Raises
    ------
    InputError
        with a line for each fault that names the event, the key, its value and the allowed range.
    """
    events: dict[str, Event] = {}
    faults = Faults()

    def read(entry: Entry, number: int) -> None:
        """Add the event of a table, with its side and its input, or the faults of the table."""
        event_type = _type(entry)
        entry.title += f" ({event_type.kind})"
        input_name, side = _input(event_type, entry), _side(event_type, entry)
        if "side" not in entry.given and event_type.has_side:
            if machine is None or machine.sides:
                entry.fault("side", 'must be given, "left" or "right"')
            else:
                line = f"{entry.title}: the {machine.name} has no sides; {inputs_of(machine)}"
                entry.add([InputError(line, entry.place)])
        usual = event_type.kind
        if side or not event_type.has_side:
            usual = event_type.usual_name(side, input_name)
        name = _name(entry, usual, events)
        p = _parameters(event_type, entry.given, f"event.{name}.", f"{entry.place}.")
        events[name] = event_type.on(side, p, name, input_name)

    read_entries(enumerate(tables, 1), "event", faults, read, "event")
    faults.refuse()
    return events


@dataclass(frozen=True)
class RandomEvent:
    """The event of random overloads: the fixed quantities, and the ranges of the drawn ones. Without a side,
    the side is drawn, too."""

    of: type[Event]
    side: AnySide
    p: Any
    ranges: Mapping[str, tuple[float, float]]
    input: str = ""

    @property
    def title(self) -> str:
        """The event as a clause of a sentence."""
        if self.side or not self.of.has_side:
            return filled(self.of.words, self.side, self.input)
        return self.of.words.format(side="left or the right", other="right or the left")

    @property
    def heading(self) -> str:
        """The event in two or three words."""
        if self.side or not self.of.has_side:
            return filled(self.of.heading, self.side, self.input)
        return self.of.heading.format(side="left or right", other="right or left")

    def draw(self, random: np.random.Generator) -> dict[str, float]:
        """Values of the drawn quantities, uniformly distributed over their ranges."""
        return {name: float(random.uniform(low, high)) for name, (low, high) in self.ranges.items()}

    def event(self, side: AnySide, values: Mapping[str, float]) -> Event:
        """The event on that side, with these `values` of the drawn quantities."""
        return self.of.on(side, replace(self.p, **values), input_name=self.input)

    def hardest(self) -> list[Event]:
        """The event on each possible side, with every drawn quantity at the upper end of its range."""
        sides = (self.side,) if self.side or not self.of.has_side else SIDES
        return [self.event(side, {name: high for name, (_, high) in self.ranges.items()}) for side in sides]

    def identity(self) -> dict[str, Any]:
        """All values on which a drawn event depends."""
        fixed = Layout(type(self.p)).by_name(self.p)
        input_entry = {"input": self.input} if self.input else {}
        return {
            "type": self.of.kind,
            **input_entry,
            "side": self.side,
            "p": fixed,
            "ranges": dict(self.ranges),
        }


@dataclass(frozen=True)
class RandomRuns:
    """Runs in which an event comes at random: the plan of a capability that makes them. The `event` stands under the
    `key` of the study file, the number of the `runs`, which follow it for `duration` [s], may be 0."""

    key: str
    event: RandomEvent
    runs: int
    duration: float

    @property
    def table(self) -> str:
        """Name of their table of the study file."""
        return self.key.partition(".")[0]

    def check(self, rig: Rig) -> None:
        """Refuse an event for which the drive has no inputs.

        Raises
        ------
        InputError
            for the type of the event.
        """
        for event in self.event.hardest() if self.runs else ():
            if not rig.takes(event):
                raise InputError(f'{self.key}.type = "{event.kind}": {event.without}')


def random_runs(plans: Mapping[str, Any]) -> list[RandomRuns]:
    """The plans of random overloads among the `plans` of a study."""
    return [plan for plan in plans.values() if isinstance(plan, RandomRuns)]


PLACED = ("crank_angle", "turns")
"""Quantities that a random event does not have."""


def read_random_event(table: Mapping[str, Any], where: str) -> RandomEvent:
    """The event of random overloads; by default a jam. A quantity for which the table gives neither a range
    nor a number is drawn if the declaration of the event says so.

    Raises
    ------
    InputError
        see `read_events`.
    """
    entry = Entry(where, {"type": Jam.kind, **table})
    event_type = _type(entry)
    input_name = _input(event_type, entry)
    if event_type.from_rest:
        entry.wrong("type", event_type.kind, "must be an event in steady running")
        entry.refuse()
    for name in (*PLACED, "name"):
        if name in table:
            entry.fault(name, "is not of random overloads, which come at any crank angle")
    ranges = {name: ends for name, ends in event_type.draws.items() if name not in table}
    range_variables = [v for v in variables(event_type.Parameters) if isinstance(table.get(v.name), list)]
    for v in range_variables:
        ranges[v.name] = _range(entry, v)
    drawn = {*ranges, *(v.name for v in range_variables), *PLACED, "name", "input"}
    ordered = {name: ranges[name] for name in Layout(event_type.Parameters).names if name in ranges}
    side = _side(event_type, entry)
    with entry.collected():
        fixed = {name: value for name, value in table.items() if name not in drawn}
        p = _parameters(event_type, fixed, f"{where}.")
    entry.refuse()
    return RandomEvent(event_type, side, p, ordered, input_name)


def _range(entry: Entry, variable: Variable) -> tuple[float, float]:
    """The range from which a quantity is drawn."""
    name, ends = variable.name, entry.given[variable.name]
    if len(ends) != 2:
        entry.wrong(name, ends, "must be a number, or two: from where to where")
        return math.nan, math.nan
    low, high = (entry.quantity(name, variable, end) for end in ends)
    if high < low:
        entry.wrong(name, ends, "the second must be >= the first")
    return low, high


def _type(entry: Entry) -> type[Event]:
    """The type that the table names."""
    event_type = entry.choice("type", TYPES)
    entry.refuse()
    assert event_type is not None
    return event_type


def _input(event_type: type[Event], entry: Entry) -> str:
    """The input that the table names; empty, with a fault, for a wrong one."""
    name = entry.given.get("input")
    if event_type.has_input and isinstance(name, str) and name:
        return name
    if event_type.has_input and name is None:
        entry.fault("input", "must be given, the name of an input, as [feed] has it")
    elif event_type.has_input:
        entry.wrong("input", name, "must be the name of an input, as [feed] has it")
    elif name is not None:
        entry.fault("input", "this event has none; leave it out")
    return ""


def _side(event_type: type[Event], entry: Entry) -> AnySide:
    """The side that the table names; empty, with a fault, for a wrong one."""
    side = entry.given.get("side", "")
    if "side" in entry.given and not event_type.has_side:
        entry.fault("side", "this event has none; leave it out")
    elif "side" in entry.given and side not in SIDES:
        entry.wrong("side", side, f'must be "left" or "right"{near_name(str(side), SIDES)}')
    else:
        return side
    return ""


def _name(entry: Entry, usual: str, others: Mapping[str, Event]) -> str:
    """The name of the run; the usual name, with a fault, in place of a wrong one."""
    if "name" in entry.given:
        name = entry.given["name"]
        if not isinstance(name, str) or not _NAME.fullmatch(name) or name.endswith("_coasting"):
            message = f"must be small letters, digits and _, at most {LONGEST_NAME}, with a letter first"
        elif name in others or name in RESERVED:
            message = "is the name of another run; give it another"
        else:
            return name
        entry.wrong("name", name, message)
    numbers = (usual if k == 1 else f"{usual}_{k}" for k in range(1, len(others) + 2))
    return next(name for name in numbers if name not in others)


_TEXTS = ("type", "side", "name", "input")
"""Keys of an event that are no quantities."""


@cache
def _form(declared: type) -> type[BaseModel]:
    """The form of an event with these quantities."""
    texts: dict[str, Any] = dict.fromkeys(_TEXTS, (str, ""))
    return schema(declared, "event", "", **texts)


def _parameters(event_type: type[Event], table: Mapping[str, Any], prefix: str, place: str = "") -> Any:
    """The quantities of an event by its `table` in a file. A refusal begins with `prefix`, and its key with `place`
    or, without it, with `prefix`."""
    declared = event_type.Parameters
    quantities = {name: x for name, x in table.items() if name not in _TEXTS}
    with each_refusal(lambda fault: InputError(f"{prefix}{fault}", (place or prefix) + fault.key)):
        return instance(declared, given_values(read_table(_form(declared), quantities)))
