"""Plain bearings in the place of pins: pressure p, sliding speed v, and the mean of p v over the real cycle.

The pressure is that on the projected area, F/(d b), as the specific load of ISO 7902-1. The limits are those of the
maker of the bearing. The mean of p v over time is what heats it: friction times it is the heat of each area.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ...core.quantities import Value, declaration, quantity
from ...reading.results import part, result
from .row import CheckRow, CheckRule, NotChecked

_MAKER = "Limits of the maker of the bearing"
_RULES = (
    CheckRule(
        "pressure", "pressure ({run})", "Specific load of ISO 7902-1; limit of the maker of the bearing",
        "p = F/(d b), F: largest force of all runs", "F = largest_force; d = diameter; b = width",
    ),
    CheckRule("speed", "sliding speed", _MAKER, "v = d/2 |dphi/dt|, largest of steady running", "d = diameter"),
    CheckRule(
        "pv", "pressure times speed", _MAKER, "mean of F/(d b) d/2 |dphi/dt| over the time of steady running",
        "d = diameter; b = width",
    ),
)  # fmt: skip


@declaration
class PlainNumbers:
    """The bearing in steady running, and its pressure under the largest force of all runs."""

    diameter: Value = quantity("m", "diameter d", kind="millimetres")
    width: Value = quantity("m", "width b", kind="millimetres")
    largest_force: Value = quantity("N", "largest force of all runs")
    pressure: Value = quantity("N/m2", "pressure under it", kind="stress")
    speed: Value = quantity("m/s", "largest sliding speed of steady running")
    pv: Value = quantity(
        "W/m2", "mean of pressure times sliding speed over the time of steady running", kind="pv"
    )


@result
class PlainBearing:
    """A plain bearing; `run` has the largest force."""

    run: str = part("the run with the largest force")
    numbers: PlainNumbers = part(inline=True)


def pressure(force: Any, diameter: float, width: float) -> Any:
    """Pressure on the projected area [N/m2] under a `force` [N]."""
    return force / (diameter * width)


def plain_bearing(table: Any, time: Any, force: Any, angle: Any, largest: float, run: str) -> PlainBearing:
    """The bearing with the values of its `table`: `time` [s], `force` [N] and `angle` [rad] of the pin, each of shape
    (n,); its `largest` force [N] comes in `run`."""
    step, way = np.diff(time), np.abs(np.diff(angle))
    middle, slid = 0.5 * (force[1:] + force[:-1]), 0.5 * table.diameter * way
    mean = float(np.sum(pressure(middle, table.diameter, table.width) * slid) / np.sum(step))
    numbers = PlainNumbers(
        diameter=table.diameter,
        width=table.width,
        largest_force=largest,
        pressure=pressure(largest, table.diameter, table.width),
        speed=float(np.max(slid / step)),
        pv=mean,
    )
    return PlainBearing(run, numbers)


def checks(
    pin: str, bearing: PlainBearing, table: Any, path: str, run: str
) -> Iterator[CheckRow | NotChecked]:
    """The checks of a bearing whose numbers stand at `path` of the result; `run` is the title of the run with the
    largest force."""
    for rule in _RULES:
        if (limit := getattr(table, rule.value)) is None:
            yield NotChecked(
                f"{pin}, {rule.title.format(run=run)}", f"the file gives no permitted {rule.value}"
            )
        else:
            yield rule.row(pin, path, bearing.numbers, limit, run)
