"""The table [sweep] of a study file and its entries [[sweep.parameter]]: declarations only."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

from pydantic import Field

from ...core.quantities import Value, declaration, quantity
from ...reading.lists import TableList
from ...study.cycle_quantities import CycleBasis
from ...study.file_section import Entered, entered, filled_text

SPEED = "run.crank_speed"
METHODS = ("grid", "latin_hypercube", "sobol")
DISTRIBUTIONS = ("uniform", "normal")
MEASURES_OF_SWEEP = (
    "crank_torque_peak",
    "motor_torque_peak",
    "current_peak",
    "rocker_torque_peak",
    "speed_least",
    "speed_dip",
    "stall_time",
    "coupling_trip_time",
)
"""The measures of a run with an event that a sweep can have."""
LOADS_OF_SWEEP = (*MEASURES_OF_SWEEP[:4], "speed_dip", "stall_time")
"""The measures whose largest values are the worst."""
USUAL_QUANTITIES = ("peak(crank_torque)", "rms(crank_torque)")
"""The cycle quantities of a sweep that names neither quantities nor measures."""
MOST_PARAMETERS, MOST_VALUES, MOST_RESULTS = 32, 1000, 40


@declaration
class SweepTable(CycleBasis):
    """A sweep over parameters of the study."""

    points: Value = quantity(
        "1",
        "number of points; of a grid that of its parameters",
        default=1024,
        min=1,
        max=1_000_000_000,
        type="Integer",
    )
    seed: Value = quantity(
        "1", "seed of the points, except of a grid", default=1, min=0, max=1_000_000_000, type="Integer"
    )
    angles: Value = quantity("1", "crank angles of a turn", default=720, min=8, max=100_000, type="Integer")


SWEPT = TableList(
    "sweep.parameter",
    title="Parameter of a sweep",
    description="swept quantities",
    most=MOST_PARAMETERS,
    must_be="the full name of a number of the machine (machine.r), of its feed (feed. ..), of an event of the study "
    f"(event.NAME. ..), or {SPEED}",
    example="machine.r",
    conditions={
        "required": ["name"],
        "oneOf": [
            {"required": ["from", "to"]},
            {"required": ["values"]},
            {"required": ["tolerance"]},
        ],
    },
    keys={
        "name": filled_text(
            'full name of a quantity, such as "machine.r", "run.crank_speed", '
            '"feed.left.material_mass", "event.jam_left.force"'
        ),
        "from": entered("least value"),
        "to": entered("largest value"),
        "points": entered("number of values of a grid between these, 11 by default; of a tolerance 3"),
        "values": (
            list[Entered],
            Field([], max_length=MOST_VALUES, description="values, in place of from and to"),
        ),
        "tolerance": entered("largest difference from the value of the study, in place of from and to"),
        "distribution": (
            Literal[DISTRIBUTIONS],
            Field(
                "uniform",
                description="of a tolerance, where the method is no grid; of a normal one it is 3 standard "
                "deviations",
            ),
        ),
    },
)
"""The entries [[sweep.parameter]]."""


FIELDS: Mapping[str, Any] = {
    "method": (
        Literal[METHODS],
        Field(
            "sobol", description="points: all combinations of values (a grid), or points that fill the space"
        ),
    ),
    "quantities": (
        list[str],
        Field(
            [],
            max_length=MOST_RESULTS,
            description='quantities of a turn, such as "peak(crank_torque)" or "installed_power"',
        ),
    ),
    "measures": (
        list[str],
        Field([], max_length=len(MEASURES_OF_SWEEP), description="measures of a run with the event"),
    ),
    "event": (str, Field("", description="event of the measures, by the name of its run")),
    "best": (str, Field("", description="quantity or measure by which points are ranked")),
    "best_is": (
        Literal["least", "largest"],
        Field(
            "least",
            description="which of its values is best; of a load, where best is not given, the largest",
        ),
    ),
    "parameter": SWEPT.field,
}
"""Keys of the table that are no quantities, as pydantic fields."""
