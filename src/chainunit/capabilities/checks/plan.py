"""The plan of the checks: the tables of a study file, with the pins that they name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from ...core.errors import Faults
from ...drives.catalogue import offer
from ...drives.catalogue_flexible import CatalogueFlexible
from ...reading.lists import Entry
from ...reading.tables import instance
from ...study.file_reading import FileReading
from ...study.parts import catalogues_of
from .pins import no_pin, pins_named, turning_pins
from .section_plan import SectionPlan, read_sections
from .tables import (
    BEARINGS,
    IN_PHASES,
    KINDS,
    NEEDED,
    OF_PLAIN,
    OF_ROLLING,
    PLAIN,
    STATIC_SAFETY,
    BearingTable,
    FlexibleCouplingTable,
    GearRatingTable,
    MotorShaftTable,
    RelayTable,
    StartingTable,
)


@dataclass(frozen=True)
class BearingPlan:
    """The `kind` of a bearing, one of `KINDS`, and the values of its table; None for those that it does not give."""

    kind: str
    table: BearingTable


@dataclass(frozen=True)
class RelayPlan:
    """The values of the table [relay], the name of the trip class, empty where the file gives none, and whether the
    relay of a star-delta starter is in the phases of the delta."""

    table: RelayTable = field(default_factory=RelayTable)
    trip_class: str = ""
    is_in_phases: bool = True


@dataclass(frozen=True)
class CheckPlan:
    """The bearings by the title of their pin, and the tables of the other checks."""

    bearings: Mapping[str, BearingPlan] = field(default_factory=dict)
    relay: RelayPlan = field(default_factory=RelayPlan)
    starting: StartingTable = field(default_factory=StartingTable)
    starts_per_hour: float = 0.0
    """the starts an hour that the file asks for; 0 where it does not say"""
    gear: GearRatingTable = field(default_factory=GearRatingTable)
    motor_shaft: MotorShaftTable = field(default_factory=MotorShaftTable)
    coupling: FlexibleCouplingTable | None = None
    coupling_place: str = "motor"
    coupling_name: str = ""
    """the designation of the coupling of a catalogue; empty where the file does not name one"""
    couplings: tuple[CatalogueFlexible, ...] = ()
    """the flexible couplings of the catalogues among which it is"""
    sections: Mapping[str, SectionPlan] = field(default_factory=dict)
    separate_bearing: bool = False
    """whether the file says that the crank has bearings of its own, so that the gear does not carry its reaction"""


def read_plan(reading: FileReading) -> CheckPlan:
    """The plan of a study file.

    Raises
    ------
    InputError
        with a line for each fault: an unknown pin, a missing key, a key of another kind of bearing.
    """
    faults = Faults()
    bearings, sections = {}, dict[str, SectionPlan]()
    if reading.machine is not None:
        titles = turning_pins(reading.machine.model)
        bearings = _bearings(reading.data.get("bearing", {}), titles, faults)
        sections = read_sections(reading.data.get("section", {}), titles, faults)
    faults.refuse()
    starting = reading.values.get("starting") or StartingTable()
    # the table of another capability, if the program has it
    demands = reading.values.get("sizing") if "sizing" in reading.data else None
    form = getattr(reading.form, "sizing", None)
    asked = starting.per_hour or getattr(demands, "starts_per_hour", 0.0)
    return CheckPlan(
        bearings,
        _relay(reading),
        starting,
        float(asked),
        reading.values.get("gear_rating") or GearRatingTable(),
        reading.values.get("motor_shaft") or MotorShaftTable(),
        *_coupling(reading),
        sections,
        getattr(form, "separate_bearing", False),
    )


def _relay(reading: FileReading) -> RelayPlan:
    if "relay" not in reading.data:
        return RelayPlan()
    form = reading.form.relay
    return RelayPlan(reading.values["relay"], form.trip_class or "", form.place == IN_PHASES)


def _coupling(
    reading: FileReading,
) -> tuple[FlexibleCouplingTable | None, str, str, tuple[CatalogueFlexible, ...]]:
    """The flexible coupling, if the file has one, its place, its designation in a catalogue, and those of the
    catalogues."""
    name = "flexible_coupling"
    if name not in reading.data:
        return None, "motor", "", ()
    form = reading.form.flexible_coupling
    couplings = offer(*catalogues_of(reading.form.catalogue, reading.source)).flexible
    return reading.values[name], form.place, form.designation, tuple(couplings)


def _bearings(tables: Mapping[str, Any], titles: list[str], faults: Faults) -> dict[str, BearingPlan]:
    taken: dict[str, str] = {}

    def read(entry: Entry, name: str) -> tuple[list[str], BearingPlan]:
        pins = pins_named(name, titles)
        if not pins:
            entry.fault("", no_pin(name, titles))
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

    entries = BEARINGS.read_named(tables, faults, read)
    plans = {pin: plan for pins, plan in entries.values() for pin in pins}
    return {title: plans[title] for title in titles if title in plans}
