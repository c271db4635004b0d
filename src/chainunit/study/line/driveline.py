"""The cardan driveline: a shaft line on the crank's shaft behind the gear, or on the motor's shaft before it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Literal

import numpy as np

from ...core.errors import refusal_prefix
from ...core.quantities import Layout, Value, declaration, quantity
from ...drives.cardan import check, with_damping_ratio
from ...drives.driveline import CardanDriveline, Mounted
from ...drives.line_table import CORNER, SHAFTS, Damping, form, line_values
from ...drives.shafts import SECTIONS as PROFILES
from ...drives.shafts import Shaft
from ...reading.tables import file_key
from ..analysis import Analysis
from ..conditions import Schema, is_one_of
from ..config import FileReading
from ..cycle import Cycle
from ..drive import Drive
from ..file_section import FileSection, TableForm
from ..keys import Key
from ..record import StudyRecord
from .part import PartOfLine
from .placed import PlacedPart

PLACES = ("crank", "motor")
"""The places of a driveline: on the crank's shaft behind the gear, or on the motor's shaft before it."""


@declaration
class Driveline(Mounted):
    """A cardan driveline between motor and machine. The start values are those of this package, as the paper
    prints no dimensions."""

    exponent: Value = quantity(
        "1",
        "exponent of Woehler's line for the damage of torque cycles; assumed",
        default=5.0,
        min=1.0,
        max=20.0,
    )


@dataclass(frozen=True)
class DrivelinePlan:
    """The driveline of a study, and its `place`, one of `PLACES`."""

    table: Driveline
    place: str
    damping_ratio: float | None
    """its damping ratio, in place of d2 and d3"""


def _shaft_keys() -> Iterator[Key]:
    """The keys of the profiles of its shafts."""
    from ..keys import Key, quantity_keys

    for shaft, stiffness in SHAFTS.items():
        description = f"its profile, in place of {stiffness}"
        yield Key(f"{shaft}.section", description, words=tuple(f'"{name}"' for name in PROFILES), sort="text")
        yield from quantity_keys(Shaft, prefix=f"{shaft}.")
        description = "corners of a profile of any form, as pairs [m]"
        yield Key(f"{shaft}.outline", description, sort="list", items=CORNER)
        yield Key(f"{shaft}.holes", "outlines of the holes in it", sort="list", items=CORNER)


def _conditions() -> Schema:
    """The keys of the line that do not go together."""
    pairs = [*SHAFTS.items(), ("damping_ratio", "d2"), ("damping_ratio", "d3")]
    twice = [{"required": list(pair)} for pair in pairs]
    shafts = {shaft: {"required": ["section"], "allOf": list(_of_shaft())} for shaft in SHAFTS}
    return {"not": {"anyOf": twice}, "properties": shafts}


def _of_shaft() -> Iterator[Schema]:
    """The dimensions that go with a profile."""
    for name, profile in PROFILES.items():
        needed = [*profile.takes, "length"]
        allowed = [*needed, *profile.also, "section", "shear_modulus"]
        then: dict[str, Any] = {"required": needed, "propertyNames": {"enum": allowed}}
        yield {"if": is_one_of("section", name).schema(), "then": then}


class DrivelinePart(PartOfLine):
    """The part, with the table [driveline]."""

    name = "driveline"
    order = 10
    model = CardanDriveline
    tables = {  # noqa: RUF012
        "driveline": FileSection(
            Driveline,
            optional=True,
            keys={"place": file_key(Literal[PLACES], "crank", "shaft that it is on")},
            form=TableForm(
                form,
                partial(line_values, prefix="driveline."),
                Damping,
                _shaft_keys,
                _conditions,
                {"damping_ratio": ("d2", "d3"), **{shaft: (shaft, c) for shaft, c in SHAFTS.items()}},
            ),
            title="Driveline",
            follows={"d2": "from damping_ratio", "d3": "from damping_ratio"},
        )
    }

    def plan(self, reading: FileReading) -> DrivelinePlan | None:
        """The plan of the table."""
        if self.name not in reading.data:
            return None
        table, read = reading.values[self.name], reading.form.driveline
        with refusal_prefix("driveline.", self.name):
            check(table)
        return DrivelinePlan(table, read.place, read.damping_ratio)

    def not_with_foreign_motor(self, plan: DrivelinePlan | None) -> str:
        """Its vibration follows from the inertia of the rotor."""
        return "" if plan is None else "the inertia of its rotor is not known; leave [driveline] out"

    def placed(self, plan: DrivelinePlan | None, drive: Drive, turn: Cycle) -> PlacedPart | None:
        """The driveline, with the damping that its damping ratio asks for."""
        from .placed import PlacedPart
        from .shaft import two_masses

        if plan is None:
            return None
        values = Layout(Driveline).by_name(plan.table)
        del values["exponent"]
        ratio = drive.ratio / drive.line.ratio if plan.place == "crank" else 1.0
        p = self.model.parameter_layout.from_names(values | {"ratio": ratio})
        part = PlacedPart(self.name, self.model, p, ratio, p.J4)
        if plan.damping_ratio is None:
            return part
        inertia = float(np.mean(turn.inertia_at(drive.ratio)))
        masses = two_masses(replace(drive, line=drive.line.behind(part)), inertia)
        damped = with_damping_ratio(masses, plan.damping_ratio)
        return replace(part, parameters=replace(p, d2=damped.d2, d3=damped.d3))

    def settled(self, tables: Mapping[str, Any], placed: PlacedPart) -> dict[str, Any]:
        """The damping in place of the ratio from which it follows."""
        table = dict(tables[self.name])
        if table.pop("damping_ratio", None) is not None:
            table |= {name: float(getattr(placed.parameters, name)) for name in ("d2", "d3")}
        return {**tables, self.name: table}

    def analyses(self) -> Iterable[type[Analysis]]:
        """The same runs with a rigid shaft."""
        from .shaft_runs import ShaftAnalysis

        return (ShaftAnalysis,)

    def remark(self, study: StudyRecord) -> None:
        """Its damping, its unevenness, its resonance with the control, its amplification."""
        from .shaft_runs import remark

        remark(study)


PART = DrivelinePart()
