"""The plan of the shaft sections of a study file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ...core.errors import Faults
from ...reading.lists import Entry
from ...reading.tables import instance
from .pins import no_pin, pins_named
from .tables import (
    GIVEN_NOTCH,
    NOTCH_KEYS,
    NOTCHES,
    PARTS,
    RATIO,
    SECTION_NEEDS,
    SECTIONS,
    SHOULDER,
    SectionTable,
)

_LEAST_STEP, _LEAST_FILLET = 0.98, 0.03
"""Largest diameter over the outer one of a shoulder, and least radius over its depth, for which DIN 743-2 holds."""
_TEXTS = ("pin", "on", "notch", "steel", "mean_stress", "hard_surface")


@dataclass(frozen=True)
class SectionPlan:
    """A section: the title of its `pin` (empty for the bearing of the crank), the part `on` which it is, the kinds of
    its notch and its steel, a hard surface layer or none, and how mean stress and amplitude grow."""

    table: SectionTable
    pin: str = ""
    on: str = PARTS[0]
    notch: str = "none"
    steel: str = ""
    is_hard: bool = False
    mean_stress: str = RATIO


def read_sections(tables: Mapping[str, Any], titles: list[str], faults: Faults) -> dict[str, SectionPlan]:
    """The sections by name; `titles` are those of the turning pins."""

    def read(entry: Entry, name: str) -> SectionPlan:
        missing = [key for key in SECTION_NEEDS if key not in entry.raw]
        texts = {key: entry.raw.pop(key) for key in _TEXTS if key in entry.raw}
        pin = texts.get("pin", "")
        if pin:
            pins = pins_named(pin, titles)
            if len(pins) == 1:
                pin = pins[0]
            elif pins:
                entry.fault("pin", f"stands for {', '.join(pins)}; give the whole title of one")
            else:
                entry.fault("pin", no_pin(pin, titles))
        for key in missing:
            choice = f", one of {', '.join(NOTCHES)}" if key == "notch" else ""
            entry.fault(key, f"must be given{choice}")
        notch = texts.get("notch", "none")
        for kind, keys in NOTCH_KEYS.items():
            for key in keys:
                if key in entry.raw and kind != notch:
                    entry.fault(key, f"is of the notch {kind}, and the notch is {notch}; leave it out")
                elif key not in entry.raw and kind == notch and kind != GIVEN_NOTCH:
                    entry.fault(key, f"must be given for the notch {kind}")
        entry.refuse()
        table = instance(SectionTable, entry.raw)
        if table.bore >= table.diameter:
            entry.fault("bore", "must be less than the diameter")
        if notch == SHOULDER:
            depth = 0.5 * (table.outer_diameter - table.diameter)
            if table.diameter > _LEAST_STEP * table.outer_diameter:
                entry.fault("outer_diameter", f"must be at least the diameter over {_LEAST_STEP:g}")
            elif table.radius < _LEAST_FILLET * depth:
                entry.fault("radius", f"must be at least {_LEAST_FILLET:g} of the depth of the shoulder")
        return SectionPlan(
            table,
            pin,
            texts.get("on", PARTS[0]),
            notch,
            texts.get("steel", ""),
            bool(texts.get("hard_surface", False)),
            texts.get("mean_stress", RATIO),
        )

    return SECTIONS.read_named(tables, faults, read)
