"""The checks of a study file beyond its form: single values before values together, limits that contradict each
other, loads beyond any machine, and runs without end."""

from __future__ import annotations

import contextlib
from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from ..core.errors import Faults, InputError, each_refusal, near_name, refusal_prefix, shown
from ..core.messages import unit_behind
from ..core.quantities import Layout, Variable
from ..drives.catalogue import CatalogueMotor, motor_of_catalogue, offer
from ..machines.chain_unit import SideLoads
from ..mechanism.models import MachineModel
from ..models import MACHINES, MOTORS
from ..reading.tables import named_table, read_table
from ..reading.text import chosen_units
from ..system.signals import Profile
from .event import Event, OverTime
from .event_table import inputs_of, random_runs, read_events, read_random_event
from .operation import OperatingConditions
from .parts import Parts, beside, catalogues_of, is_designation, parts_of
from .registry import registered
from .rules import refusals
from .sections import all_sections

_OF_MACHINE = ("machine", "ratios", "feed", "motor", "system")
"""Tables that cannot be checked without machine and motor."""


def check_values(data: Mapping[str, Any], source: str) -> tuple[Parts | None, list[InputError]]:
    """The machine and motor of a file, or None if it names wrong ones; and all faults of its single
    values."""
    faults = Faults()
    parts = None
    with faults.collected():
        parts = parts_of(data, source)
    usable_parts = parts or Parts(MACHINES["ChamberForces"], MOTORS["DcMotor"])
    readable: Mapping[str, Any] = {name: x for name, x in data.items() if name not in _OF_MACHINE}
    if parts:
        faults.add(parts.faults)
        readable = without(data, parts.faults)
    places = {
        f"{table}.{key}": x
        for table, section in usable_parts.sections.items()
        for key, x in section.places.items()
    }

    def placed(fault: InputError) -> InputError:
        """The refusal of an unknown key, with the place at which the file has it."""
        place = places.get(fault.key)
        return InputError(f"{fault}; {place}", fault.key) if place else fault

    with faults.collected(), each_refusal(placed):
        read_table(usable_parts.form, readable)
    with faults.collected():
        if isinstance(data.get("event", []), list):
            read_events(data.get("event", []), usable_parts.machine if parts else None)
    for table, section in all_sections().items():
        for key in section.random_events:
            with faults.collected():
                event = named_table(data, table).get(key)
                if isinstance(event, Mapping):
                    read_random_event(event, f"{table}.{key}")
    with faults.collected():
        _check_catalogue(data, source)
    with faults.collected():
        units = named_table(data, "report").get("units", {})
        if isinstance(units, Mapping):
            chosen_units(units)
    if parts is not None:
        faults.add(refusals(data, parts))
    return parts, faults.errors


def _check_catalogue(data: Mapping[str, Any], source: str) -> None:
    """Refuse a catalogue that cannot be read or has wrong values, and a motor that no catalogue has."""
    files: tuple[Path, ...] = ()
    with refusal_prefix("catalogue = ", "catalogue"):
        files = catalogues_of(data.get("catalogue"), source)
        offer(*files)
    motor = named_table(data, "system").get("motor")
    if isinstance(motor, str) and is_designation(motor):
        plate_of(motor, files)


def missing_recordings(data: Mapping[str, Any], source: str) -> Iterator[InputError]:
    """The refusals of recordings that are not there."""
    for file in (file for part in registered() for file in part.files(data) if file.is_recording):
        name = file.table.get(file.name)
        with contextlib.suppress(InputError):
            if isinstance(name, str) and name and not beside(name, source).exists():
                yield InputError(f"{file.key} = {shown(name)}: there is no such file", file.key)


def plate_of(designation: str, files: Sequence[Path]) -> CatalogueMotor | None:
    """The motor of the catalogue that [system] names.

    Raises
    ------
    InputError
        where the catalogue has none of that name.
    """
    if not designation:
        return None
    with refusal_prefix("system.motor = ", "system.motor"):
        return motor_of_catalogue(designation, files, MOTORS)


def without(data: Mapping[str, Any], faults: Collection[InputError]) -> dict[str, Any]:
    """The tables of a file without the refused values, and without inner tables that have no others; without any
    event if one of them is refused."""
    # tables on the way to a refused value are copied one by one: a refused value may be nested without end
    tables = dict(data)
    for key in map(_key, faults):
        names = key.split(".")
        if "event" in names:
            names = names[: names.index("event") + 1]
        above, name, inner = tables, "", tables
        while len(names) > 1 and isinstance(inner.get(names[0]), dict):
            name = names.pop(0)
            inner[name] = dict(inner[name])
            above, inner = inner, inner[name]
        inner.pop(names[0], None)
        if above is not tables and not inner:
            above.pop(name)
    return tables


@cache
def _lists() -> tuple[str, ...]:
    """The full names of the keys whose values are lists that a key of a fault may point into."""
    return tuple(
        f"{table}.{key}" for table, section in all_sections().items() for key in section.lists.single_keys
    )


def _table(key: str) -> str:
    """The table of a key; a list whose faults say nothing of the rest of its table, and each of its entries, count as
    tables by themselves."""
    names = key.split(".")
    return ".".join(names[:3]) if ".".join(names[:2]) in _lists() else names[0]


def _key(fault: InputError) -> str:
    """The key that a fault concerns; a fault in another file concerns the catalogue."""
    return "catalogue" if fault.placed else fault.key


def independent(further: Collection[InputError], faults: Collection[InputError]) -> list[InputError]:
    """The refusals of values that do not fit together, without refusals that depend on a refused value. The
    remaining ones concern other tables, or two limits that are both right."""
    wrong = set(map(_key, faults))
    tables = {_table(key) for key in wrong}
    if tables & {"system", ""}:
        return []
    if "catalogue" in wrong:
        # it is not known whether the catalogue has the motor
        tables.add("system")
    undecided = {
        (table, key)
        for table, section in all_sections().items()
        for key, decider in section.lists.deciders.items()
        if f"{table}.{decider}" in wrong
    }
    lower = {high: low for low, _, high in _order()}

    def stands(key: str) -> bool:
        """Whether the refusal of a key depends on no refused value."""
        if key in wrong or tuple(key.split(".")[::3]) in undecided:
            return False
        return _table(key) not in tables or (key in lower and lower[key] not in wrong)

    return [fault for fault in further if stands(fault.key)]


@cache
def _order() -> tuple[tuple[str, str, str], ...]:
    """Triples (low, relation, high): the value of `high` has to have this relation to that of `low`."""
    return tuple(
        (f"{table}.{low}", relation, f"{table}.{high}")
        for table, section in all_sections().items()
        for low, relation, high in section.order
    )


def check_order(values: Mapping[str, Any]) -> Iterator[InputError]:
    """Refusals of limits with no value between them."""

    def value(name: str) -> tuple[float, str]:
        """The value of a key by its full name, and as text with its unit."""
        section, _, key = name.partition(".")
        x, declaration = getattr(values[section], key), type(values[section])
        unit = next(v.unit for v in Layout(declaration).variables if v.name == key)
        return x, f"{x:g}" + unit_behind(unit)

    for low, relation, high in _order():
        (least, limit), (most, text) = value(low), value(high)
        if most < least or (most == least and relation == ">"):
            yield InputError(f"{high} = {text}: must be {relation} {low}, {limit}", key=high)


MOST_STEPS = 1e6
"""Most steps of a study."""


def loads_beyond(
    model: MachineModel,
    feed: Any,
    events: Mapping[str, Event],
    plans: Mapping[str, Any],
    *,
    known_motor: bool,
) -> Iterator[InputError]:
    """Refusals of loads that are beyond any machine together: all on one side, and at the height of each event. A
    motor that is not a `known_motor` may have any input."""
    for v in Layout(SideLoads).variables if model.sides else ():
        most = getattr(feed.left, v.name) + getattr(feed.right, v.name)
        if not v.quantity.admits(most):
            unit = unit_behind(v.unit)
            yield InputError(
                f"feed: {v.name} of both sides = {most:.9g}{unit}: must be <= {v.quantity.high:g}{unit} "
                "together, as an overload may lay all of it on one side",
                key="feed",
            )
    inputs = {v.name: v for v in model.input_layout.variables}
    normal = {name: v.quantity.start or 0.0 for name, v in inputs.items()} | Layout(model.Feed).by_name(feed)
    hardest = [(f"event.{name}", f"event.{k}", event) for k, (name, event) in enumerate(events.items(), 1)]
    randoms = random_runs(plans)
    hardest += [(runs.key, runs.key, event) for runs in randoms for event in runs.event.hardest()]
    unused = {runs.key for runs in randoms if not runs.runs}
    of_motors = {name for motor in MOTORS.values() for name in motor.input_layout.names}
    for where, key, event in hardest:
        needed = set(event.inputs)
        if not needed <= set(inputs):
            if where not in unused and known_motor and not needed <= {*inputs, *of_motors}:
                near = "".join(near_name(name, Layout(model.Feed).names) for name in needed)
                yield InputError(
                    f"{where}: the {model.name} has no input {' or '.join(sorted(needed))}{near}; "
                    f"{inputs_of(model)}",
                    key=key,
                )
            # an input of the motor: the study checks whether the motor has it
            continue
        if fault := event.fault(normal):
            yield InputError(f"{where}: {fault}", key=key)
        for name, signal in event.signals(normal, 0.0, dict.fromkeys(event.reads, 0.0)).items():
            if fault := _fault_of_signal(signal, inputs[name]):
                yield InputError(f"{where}: {name} {fault}", key=key)


def _fault_of_signal(signal: OverTime, v: Variable) -> str:
    """Why an input cannot take the values of a signal, in words; empty if it can."""
    changes = signal.changes if isinstance(signal, Profile) else ()
    if v.quantity.type != "Real" and changes:
        kind = "whole number" if v.quantity.type == "Integer" else "switch"
        return f"is a {kind}, and the event changes its input smoothly; name another input"
    most = max([signal.start, *(x for *_, x in changes)]) if isinstance(signal, Profile) else signal
    if v.quantity.admits(most):
        return ""
    return f"comes to {most:.9g}{unit_behind(v.unit)} with the feed: must be {v.quantity.allowed_range}"


def endless(
    operation: OperatingConditions, events: Mapping[str, Event], plans: Mapping[str, Any]
) -> Iterator[InputError]:
    """The refusal of a study that would never end."""
    run, turn = operation.run, operation.turn
    seconds = operation.steady_begin + run.turns * turn
    seconds += sum(event.time_followed(turn) + 2.0 * turn for event in events.values())
    steps = max(seconds, *(runs.duration for runs in random_runs(plans) if runs.runs), 0.0) / run.step
    if not steps <= MOST_STEPS:
        yield InputError(
            f"run.step = {run.step:g} s: the study would take {steps:.2g} steps, more than {MOST_STEPS:.0e}; "
            "lengthen the step, raise the speed, or lessen the turns",
            key="run.step",
        )
