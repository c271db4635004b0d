"""The tables of a study with a gear of a catalogue."""

from __future__ import annotations

import dataclasses

from ...drives.catalogue_gears import CatalogueGear
from ...study.operation import DriveTables


def with_gear(tables: DriveTables, gear: CatalogueGear) -> DriveTables:
    """The tables of a study with this gear; its drag that grows with speed is that of the file."""
    transmission = dataclasses.replace(gear.transmission, d=tables.gear.d)
    keys = {f"gear.{name}" for name in ("ratio", "efficiency", "J", "torque_limit", "start_factor")}
    return dataclasses.replace(tables, gear=transmission, given=tables.given | keys)
