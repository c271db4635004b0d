"""The plan of the checks: the tables of a study file, with the pins that they name."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from ...core.errors import Faults, meant, near_name
from ...drives.catalogue import offer
from ...drives.catalogue_flexible import CatalogueFlexible
from ...reading.lists import Entry
from ...reading.tables import instance
from ...study.config import FileReading
from ...study.parts import catalogues_of
from . import tables as t

_LEAST_STEP, _LEAST_FILLET = 0.98, 0.03
"""Largest diameter over the outer one of a shoulder, and least radius over its depth, for which DIN 743-2 holds."""


class BearingPlan(NamedTuple):
    """The `kind` of a bearing, one of `KINDS`, and the values of its table, None for a missing key."""

    kind: str
    table: t.BearingTable


@dataclass(frozen=True)
class SectionPlan:
    """A section with the other keys of its table, see `SECTIONS`; `pin` is the title of its pin, empty for the
    bearing of the crank."""

    table: t.SectionTable
    pin: str = ""
    on: str = t.PARTS[0]
    notch: str = "none"
    steel: str = ""
    hard_surface: bool = False
    mean_stress: str = t.RATIO


@dataclass(frozen=True)
class CheckPlan:
    """The tables of the checks: bearings by the title of their pin, sections by their name."""

    bearings: Mapping[str, BearingPlan]
    sections: Mapping[str, SectionPlan]
    relay: t.RelayTable
    trip_class: str
    """name of the trip class of the relay; empty where the file gives none"""
    relay_in_phases: bool
    """whether the relay of a star-delta starter is in the phases of the delta"""
    starting: t.StartingTable
    starts_per_hour: float
    """the starts an hour that the file asks for; 0 where it does not say"""
    gear: t.GearRatingTable
    separate_bearing: bool
    """whether the file says that the crank has bearings of its own, so that the gear does not carry its reaction"""
    motor_shaft: t.MotorShaftTable
    coupling: t.FlexibleCouplingTable | None
    coupling_place: str
    coupling_name: str
    """the designation of the coupling of a catalogue; empty where the file does not name one"""
    couplings: tuple[CatalogueFlexible, ...]
    """the flexible couplings of the catalogues among which it is"""


def read_plan(reading: FileReading) -> CheckPlan:
    """The plan of a study file.

    Raises
    ------
    InputError
        with a line for each fault: an unknown pin, a missing key, a key of another kind of bearing or notch, a
        flexible coupling that no catalogue has, a value beside that of a catalogue.
    """
    faults, data, form, values = Faults(), reading.data, reading.form, reading.values
    bearings, sections = dict[str, BearingPlan](), dict[str, SectionPlan]()
    if reading.machine is not None:
        titles = turning_pins(reading.machine.model)
        bearings = _bearings(data.get("bearing", {}), titles, faults)
        sections = _sections(data.get("section", {}), titles, faults)
    coupling = data.get("flexible_coupling")
    couplings = () if coupling is None else offer(*catalogues_of(form.catalogue, reading.source)).flexible
    with faults.collected():
        _check_coupling(Entry("flexible_coupling", coupling or {}), tuple(x.designation for x in couplings))
    faults.refuse()
    starting = values.get("starting") or t.StartingTable()
    # the table of another capability, if the program has it
    sizing = values.get("sizing") if "sizing" in data else None
    return CheckPlan(
        bearings,
        sections,
        relay=values.get("relay") or t.RelayTable(),
        trip_class=form.relay.trip_class or "",
        relay_in_phases=form.relay.place == t.IN_PHASES,
        starting=starting,
        starts_per_hour=float(starting.per_hour or getattr(sizing, "starts_per_hour", 0.0)),
        gear=values.get("gear_rating") or t.GearRatingTable(),
        separate_bearing=getattr(getattr(form, "sizing", None), "separate_bearing", False),
        motor_shaft=values.get("motor_shaft") or t.MotorShaftTable(),
        coupling=None if coupling is None else values["flexible_coupling"],
        coupling_place=form.flexible_coupling.place,
        coupling_name=form.flexible_coupling.designation,
        couplings=tuple(couplings),
    )


def turning_pins(model: Any) -> list[str]:
    """The titles of the pins of a machine that turn."""
    return [title for title, output in model.pins.items() if output in model.joints]


def first_word(title: str) -> str:
    """The short name of a pin."""
    return title.partition(" ")[0]


def _pins_named(name: str, titles: list[str]) -> list[str]:
    """The pins of these `titles` with a name: a whole title, or its first words. A name that several pins begin with
    stands for each of them."""
    return [title for title in titles if title == name or title.startswith(f"{name} ")]


def _no_pin(name: str, titles: list[str]) -> str:
    """The words on a name that no pin has."""
    names = [*dict.fromkeys(spelling for title in titles for spelling in (first_word(title), title))]
    return f"is no turning pin{meant(name, names)} there are {', '.join(titles) or 'none'}"


def _check_coupling(entry: Entry, designations: Collection[str]) -> None:
    """Refuse a designation that is not one of these of the catalogues, and beside them the values of a row."""
    name = entry.given.get("designation", "")
    if name and name not in designations:
        choices = f"must be one of {', '.join([*designations][:5])}{near_name(name, designations)}"
        entry.wrong(
            "designation",
            name,
            f"not in the catalogue; {choices if designations else 'no catalogue has flexible couplings'}",
        )
    for key in t.OF_ROW if designations else ():
        if key in entry.given:
            entry.fault(key, "each flexible coupling of the catalogue has its own; leave it out")
    entry.refuse()


def _check_keys(
    entry: Entry, key: str, kind: str, needed: Collection[str], keys: Mapping[str, Collection[str]]
) -> None:
    """Refuse an entry that lacks `needed` keys of its `kind`, which it names by `key`, or has `keys` of other kinds
    alone."""
    for name in needed:
        if name not in entry.raw:
            entry.fault(name, f"must be given for the {key} {kind}")
    for kinds, names in keys.items():
        for name in names:
            if name in entry.raw and kind not in kinds.split(" or "):
                entry.fault(name, f"is of the {key} {kinds}, and the {key} is {kind}; leave it out")


def _bearings(tables: Mapping[str, Any], titles: list[str], faults: Faults) -> dict[str, BearingPlan]:
    """By title of its pin, the bearing of each of the `tables` [bearing.name]: a name that several pins begin with
    stands for a bearing in each of them."""
    owner: dict[str, str] = {}

    def read(entry: Entry, name: str) -> tuple[list[str], BearingPlan]:
        """The pins that the name of a table stands for, and the bearing in each of them."""
        pins = _pins_named(name, titles)
        if not pins:
            entry.fault("", _no_pin(name, titles))
        kind = entry.raw.pop("kind", None)
        if kind is None:
            entry.fault("kind", f"must be given, one of {', '.join(t.KINDS)}")
            entry.refuse()
        _check_keys(entry, "kind", kind, t.NEEDED[kind], t.BEARING_KEYS)
        for pin in pins:
            if pin in owner:
                entry.fault(
                    "", f"the pin {pin} has its bearing in bearing.{owner[pin]}; leave out one of the two"
                )
            owner[pin] = name
        table = instance(t.BearingTable, entry.raw)
        if table.static_safety is None and kind != t.PLAIN:
            table = replace(table, static_safety=t.STATIC_SAFETY[kind])
        return pins, BearingPlan(kind, table)

    entries = t.BEARINGS.read_named(tables, faults, read)
    plans = {pin: plan for pins, plan in entries.values() for pin in pins}
    return {title: plans[title] for title in titles if title in plans}


def _sections(tables: Mapping[str, Any], titles: list[str], faults: Faults) -> dict[str, SectionPlan]:
    """By name, the section of each of the `tables` [section.name], with the whole title of its pin."""

    def read(entry: Entry, name: str) -> SectionPlan:
        """The section of a table: texts (pin, notch and the like), and quantities by `SectionTable`."""
        for key in t.SECTION_NEEDS:
            if key not in entry.raw:
                choice = f", one of {', '.join(t.NOTCHES)}" if key == "notch" else ""
                entry.fault(key, f"must be given{choice}")
        texts = {key: entry.raw.pop(key) for key in t.SECTIONS.keys if key in entry.raw}
        if pin := texts.get("pin"):
            texts["pin"] = _only_pin(entry, pin, titles)
        notch = texts.get("notch", "none")
        needed = t.NOTCH_KEYS[t.SHOULDER] if notch == t.SHOULDER else ()
        _check_keys(entry, "notch", notch, needed, t.NOTCH_KEYS)
        entry.refuse()
        table = instance(t.SectionTable, entry.raw)
        if table.bore >= table.diameter:
            entry.fault("bore", "must be less than the diameter")
        if notch == t.SHOULDER:
            _check_shoulder(entry, table)
        return SectionPlan(table, **texts)

    return t.SECTIONS.read_named(tables, faults, read)


def _only_pin(entry: Entry, name: str, titles: list[str]) -> str:
    """The title of the one pin with a name; a fault of the entry if there is none or more than one."""
    pins = _pins_named(name, titles)
    if len(pins) > 1:
        entry.fault("pin", f"stands for {', '.join(pins)}; give the whole title of one")
    elif not pins:
        entry.fault("pin", _no_pin(name, titles))
    return pins[0] if len(pins) == 1 else name


def _check_shoulder(entry: Entry, table: t.SectionTable) -> None:
    """Refuse a shoulder for which DIN 743-2 does not hold: one that is too low, or whose fillet is too sharp."""
    depth = 0.5 * (table.outer_diameter - table.diameter)
    if table.diameter > _LEAST_STEP * table.outer_diameter:
        entry.fault("outer_diameter", f"must be at least the diameter over {_LEAST_STEP:g}")
    elif table.radius < _LEAST_FILLET * depth:
        entry.fault("radius", f"must be at least {_LEAST_FILLET:g} of the depth of the shoulder")
