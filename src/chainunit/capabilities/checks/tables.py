"""The tables of the checks in a study file: declarations only."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from ...core.quantities import Value, declaration, quantity
from ...reading.lists import TableList

ROLLING, PLAIN = ("ball", "roller"), "plain"
KINDS = (*ROLLING, PLAIN)
"""The kinds of bearings."""
STATIC_SAFETY = {"ball": 1.5, "roller": 3.0}
"""Static safety by kind of rolling bearing that is asked for where a file does not give one: that of shocks."""


@declaration
class BearingTable:
    """A bearing in the place of a pin: the ratings of a rolling bearing, or sizes and limits of a plain one."""

    C: Value = quantity("N", "dynamic load rating of a rolling bearing", above=0.0, max=1e9)
    C0: Value = quantity("N", "static load rating of a rolling bearing", above=0.0, max=1e9)
    life: Value = quantity(
        "s", "rating life that is asked for", default=7.2e7, min=0.0, max=1e11, kind="hours"
    )
    life_factor: Value = quantity(
        "1",
        "factor a1 aISO of the modified rating life, for reliability, lubrication and contamination",
        default=1.0,
        above=0.0,
        max=50.0,
    )
    static_safety: Value = quantity("1", "static safety C0/F that is asked for", above=0.0, max=100.0)
    elements: Value = quantity(
        "1", "number of rolling elements of a row", min=3.0, max=1000.0, type="Integer"
    )
    diameter_ratio: Value = quantity(
        "1",
        "diameter of a rolling element, times the cosine of the contact angle, over the pitch diameter",
        default=0.2,
        min=0.0,
        max=0.9,
    )
    diameter: Value = quantity("m", "diameter of a plain bearing", above=0.0, max=10.0)
    width: Value = quantity("m", "width of a plain bearing", above=0.0, max=10.0)
    pressure: Value = quantity("N/m2", "permitted pressure p of a plain bearing", above=0.0, kind="stress")
    speed: Value = quantity("m/s", "permitted sliding speed v of a plain bearing", above=0.0)
    pv: Value = quantity(
        "W/m2", "permitted mean of pressure times sliding speed of a plain bearing", above=0.0, kind="pv"
    )


OF_ROLLING = ("C", "C0", "life", "life_factor", "static_safety", "elements", "diameter_ratio")
OF_PLAIN = ("diameter", "width", "pressure", "speed", "pv")
NEEDED = {"ball": ("C",), "roller": ("C",), PLAIN: ("diameter", "width")}
"""By kind, the keys that a bearing must have."""

BEARINGS = TableList(
    "bearing",
    title="Bearing that a pin gets, by the name of the pin",
    description="bearings",
    most=100,
    declared=BearingTable,
    keys={
        "kind": (Literal[KINDS], Field(None, description="kind of the bearing")),
    },
    conditions={
        "required": ["kind"],
        "allOf": [
            {
                "if": {"properties": {"kind": {"enum": list(of)}}, "required": ["kind"]},
                "then": {
                    "required": list(NEEDED[of[0]]),
                    "not": {"anyOf": [{"required": [key]} for key in others]},
                },
            }
            for of, others in ((ROLLING, OF_PLAIN), ((PLAIN,), OF_ROLLING))
        ],
    },
    follows={"static_safety": "1.5 for balls, 3 for rollers"},
)
