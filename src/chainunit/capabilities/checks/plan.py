"""The plan of the checks: the tables of a study file, with the pins that they name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from ...core.errors import Faults, meant
from ...reading.lists import Entry
from ...reading.tables import instance
from ...study.file_reading import FileReading
from .tables import BEARINGS, KINDS, NEEDED, OF_PLAIN, OF_ROLLING, PLAIN, STATIC_SAFETY, BearingTable


@dataclass(frozen=True)
class BearingPlan:
    """The `kind` of a bearing, one of `KINDS`, and the values of its table; None for those that it does not give."""

    kind: str
    table: BearingTable


@dataclass(frozen=True)
class CheckPlan:
    """The bearings by the title of their pin."""

    bearings: Mapping[str, BearingPlan] = field(default_factory=dict)


def read_plan(reading: FileReading) -> CheckPlan:
    """The plan of a study file.

    Raises
    ------
    InputError
        with a line for each fault: an unknown pin, a missing key, a key of another kind of bearing.
    """
    faults = Faults()
    plan = CheckPlan()
    if reading.machine is not None:
        plan = CheckPlan(_bearings(reading, faults))
    faults.refuse()
    return plan


def turning_pins(model: Any) -> list[str]:
    """The titles of the pins of a machine that turn."""
    return [title for title, output in model.pins.items() if output in model.joints]


def pins_named(name: str, titles: list[str]) -> list[str]:
    """The pins of these `titles` with a name: a whole title, or its first words. A name that several pins begin with
    stands for each of them."""
    return [title for title in titles if title == name or title.startswith(f"{name} ")]


def _bearings(reading: FileReading, faults: Faults) -> dict[str, BearingPlan]:
    assert reading.machine is not None
    titles = turning_pins(reading.machine.model)
    names = [*dict.fromkeys(each for title in titles for each in (title.split(" ")[0], title))]
    taken: dict[str, str] = {}

    def read(entry: Entry, name: str) -> tuple[list[str], BearingPlan]:
        pins = pins_named(name, titles)
        if not pins:
            entry.fault("", f"is no turning pin{meant(name, names)} there are {', '.join(titles) or 'none'}")
        kind = entry.raw.pop("kind", None)
        if kind is None:
            entry.fault("kind", f"must be given, one of {', '.join(KINDS)}")
            entry.refuse()
        for key in NEEDED[kind]:
            if key not in entry.raw:
                entry.fault(key, f"must be given for a bearing of the kind {kind}")
        for key in OF_ROLLING if kind == PLAIN else OF_PLAIN:
            if key in entry.raw:
                other = "a rolling bearing" if kind == PLAIN else "a plain bearing"
                entry.fault(key, f"is of {other}, and the kind is {kind}; leave it out")
        for pin in pins:
            if pin in taken:
                entry.fault(
                    "", f"the pin {pin} has its bearing in bearing.{taken[pin]}; leave out one of the two"
                )
            taken[pin] = name
        table = instance(BearingTable, entry.raw)
        if table.static_safety is None and kind != PLAIN:
            table = replace(table, static_safety=STATIC_SAFETY[kind])
        return pins, BearingPlan(kind, table)

    found = BEARINGS.read_named(reading.data.get("bearing", {}), faults, read)
    plans = {pin: plan for pins, plan in found.values() for pin in pins}
    return {title: plans[title] for title in titles if title in plans}
