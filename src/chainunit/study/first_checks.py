"""The checks of the single values of a study file, before the values are checked together."""

from __future__ import annotations

import contextlib
from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from ..core.errors import Faults, InputError, each_refusal, refusal_prefix, shown
from ..drives.catalogue import CatalogueMotor, motor_of_catalogue, offer
from ..models import MACHINES, MOTORS
from ..reading.tables import named_table, read_table
from ..reading.text import chosen_units
from .checks import lower_limits
from .event_table import read_events, read_random_event
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
    readable = data if parts else {name: x for name, x in data.items() if name not in _OF_MACHINE}
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
    """The tables of a file without the refused values; without any event if one of them is refused."""
    # tables on the way to a refused value are copied one by one: a refused value may be nested without end
    rest = dict(data)
    for key in map(_key, faults):
        names = key.split(".")
        if "event" in names:
            names = names[: names.index("event") + 1]
        inner: Any = rest
        while len(names) > 1 and isinstance(inner.get(names[0]), dict):
            name = names.pop(0)
            inner[name] = dict(inner[name])
            inner = inner[name]
        inner.pop(names[0], None)
    return rest


@cache
def _lists() -> tuple[str, ...]:
    return tuple(f"{table}.{key}" for table, section in all_sections().items() for key in section.single_keys)


def _table(key: str) -> str:
    """The table of a key; a list whose faults say nothing of the rest of its table, and each of its entries, count as
    tables by themselves."""
    names = key.split(".")
    return ".".join(names[:3]) if ".".join(names[:2]) in _lists() else names[0]


def _key(fault: InputError) -> str:
    """The key that a fault concerns; a fault in another file concerns the catalogue."""
    return "catalogue" if fault.placed else fault.key


def independent(
    further: Collection[InputError], faults: Collection[InputError], parts: Parts
) -> list[InputError]:
    """The refusals of values that do not fit together, without refusals that depend on a refused value. The
    remaining ones concern other tables, or two limits that are both right."""
    wrong = set(map(_key, faults))
    tables = {_table(key) for key in wrong}
    if tables & {"system", ""}:
        return []
    if "catalogue" in wrong:
        # it is not known whether the catalogue has the motor
        tables.add("system")
    for table, section in all_sections().items():
        for key, decider in section.deciders.items():
            if f"{table}.{decider}" in wrong:
                further = [fault for fault in further if fault.key.split(".")[::3] != [table, key]]
    lower = lower_limits()
    return [
        fault
        for fault in further
        if fault.key not in wrong
        and (_table(fault.key) not in tables or (fault.key in lower and lower[fault.key] not in wrong))
    ]
