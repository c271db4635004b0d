"""The machine of a live page over a turn of its driver, or over its way: its equations, and the data by which the
page draws it and reads its results."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from itertools import product
from typing import Any

import numpy as np

from ...core.printing.javascript import model_text
from ...core.quantities import Variable
from ...core.symbolic_trace import trace
from ...machines.machine import Machine
from ...mechanism.sketch import places
from ...reading.text import Units
from ...study.cycle_quantities import ANGLES
from ...study.verdict import TOPICS
from .. import machine_picture
from ..lines import capital
from .quantities import shown_in_unit

_ON_THE_WAY = 361
"""Places of a driver that does not turn round."""


@dataclass(frozen=True)
class LiveTurn:
    """The `equations` of a machine in JavaScript, and the `data` of its turn as JSON has it."""

    equations: str
    data: dict[str, Any]


def live_turn(machine: Machine, speed: float, units: Units) -> LiveTurn:
    """The turn of a machine at a constant `speed` of its driver [rad/s, m/s]."""
    model = machine.model
    low, high = model.span
    whole = machine.drive(np.linspace(low, high, 121) * machine.ratio)
    # output, joint at which it acts, and name in the picture
    forces = [
        {"title": title, "of": output, "at": joint, "short": short}
        for output, title, joint, short in machine_picture.reactions(machine)
    ]
    model_columns = trace(model).columns
    results = list(_results(machine, forces, model_columns, units))
    shown = [pin for pin in places(whole) if f"x({pin})" in model_columns]
    # by block, the column with the angle of its line
    lines = {name[5:-1]: name for name in model_columns if name.startswith("line(")}
    columns = dict.fromkeys(
        [
            *(result["of"] for result in results),
            *(f"{force['of']}.{axis}" for force in forces for axis in ("fx", "fy")),
            *(f"{axis}({pin})" for pin in shown for axis in "xy"),
            *lines.values(),
            *(name for pull in _pulls(model_columns) for name in pull["columns"]),
        ]
    )
    picture = machine_picture.picture(machine, whole)
    data = {
        "parameters": machine.by_name,
        "turns": bool(model.turns),
        "span": [low, high],
        "places": ANGLES if model.turns else _ON_THE_WAY,
        "speed": speed,
        "driver": model.driver_noun,
        "effort": machine_picture.driver_nouns(machine)[0],
        "place": shown_in_unit("m" if model.slides else "rad", "", units),
        "results": results,
        "pulls": list(_pulls(model_columns)),
        "forces": forces,
        "curves": list(_curves(machine, model_columns, units)),
        "picture": {
            "links": [asdict(link) for link in picture.links],
            "grounds": picture.grounds,
            "hanging": picture.hanging,
            "circles": picture.circles,
            "outlines": picture.outlines,
            "names": picture.names,
            "joints": shown,
            "blocks": {block: name for block, name in lines.items() if block in (*shown, *picture.outlines)},
            "paths": {title: title.removeprefix("path of ") for title in picture.paths},
            "rails": list(picture.rails),
        },
    }
    return LiveTurn(model_text(model, tuple(columns)), data)


def _results(
    machine: Machine, forces: list[dict[str, str]], model_columns: Any, units: Units
) -> Iterator[dict[str, Any]]:
    """The results of a turn: each is a reduction of a column, ``peak``, ``rms``, ``mean``, ``min`` or ``max``, times
    the factors ``by``: the speed of the driver, or the square of the ratio."""
    model = machine.model
    driver, effort, port = model.driver_noun, machine_picture.driver_nouns(machine)[0], model.driver_port.unit
    unit, inertia = port("N.m"), port("kg.m2")
    rows: list[tuple[str, str, str, str, str]] = [
        (f"{driver} {effort}, peak", "peak", "crank_torque", unit, ""),
        (f"{driver} {effort}, RMS", "rms", "crank_torque", unit, ""),
        (f"{driver} {effort}, mean", "mean", "crank_torque", unit, ""),
        ("power, mean", "mean", "crank_torque", "W", "speed"),
        (f"inertia reflected to the {driver}, least", "min", "J", inertia, "ratio2"),
        (f"inertia reflected to the {driver}, largest", "max", "J", inertia, "ratio2"),
    ]
    if "rocker.tau" in model_columns:
        rows.insert(3, ("rocker torque, peak", "peak", "rocker.tau", "N.m", ""))
    if "margin" in model_columns:
        rows.append(("margin from a dead position, least", "min", "margin", "1", ""))
    rows += [(f"{v.description}, peak", "peak", v.name, v.unit, "") for v in _efforts(model)]
    titles = {output: title for title, output in model.pins.items()}
    for contact in model.contacts:
        title = f"contact force of {titles[contact.rpartition('.')[0]]}, least; below 0 it lifts off"
        rows.append((title, "min", contact, "N", ""))
    pins = [(force["title"], "peak", f"force({force['of']})", "N", "") for force in forces]
    for group, (title, reduction, column, row_unit, by) in (*product([""], rows), *product(["pins"], pins)):
        yield {
            "name": f"{reduction}({column})" + (f" {by}" if by else ""),
            "title": title, "reduce": reduction, "of": column, "by": by, "group": group,
            **shown_in_unit(row_unit, "stress" if row_unit == "N/m2" else "", units),
        }  # fmt: skip


def _efforts(model: Any) -> list[Variable]:
    """The outputs that are efforts of drivers beside the first one, or loads of the bar between two rockers."""
    outputs = {v.name: v for part in model.parts for v in part.layout.variables}
    return [
        v
        for name, v in outputs.items()
        for group, _, last in [name.rpartition(".")]
        if group == "bar" or (last == "tau" and f"{group}.power" in outputs)
    ]


def _pulls(model_columns: Any) -> Iterator[dict[str, Any]]:
    """The pulls in the rods of organs, by kind of rod: the columns of both sides, and the words where the least of
    them is below zero."""
    for rod in ("web", "wall"):
        for kind, column, topic in (
            ("mean", "mean_pull({}.{})", "pushed"),
            ("end", "{}.{}_pull", "end pushed"),
        ):
            columns = [column.format(side, rod) for side in ("left", "right")]
            if all(name in model_columns for name in columns):
                title = f"least {kind} pull in a {rod}"
                yield {"title": title, "columns": columns, "words": TOPICS[topic].short}


def _curves(machine: Machine, model_columns: Any, units: Units) -> Iterator[dict[str, Any]]:
    """The plots over the turn: each has curves of one unit."""
    model = machine.model
    driver, effort, port = model.driver_noun, machine_picture.driver_nouns(machine)[0], model.driver_port.unit
    curves = [{"title": capital(f"{effort} at the {driver}"), "of": "crank_torque", "by": ""}]
    if "rocker.tau" in model_columns:
        curves.append({"title": "Rocker torque", "of": "rocker.tau", "by": ""})
    drivers = (v for v in _efforts(model) if v.name.endswith(".tau") and v.unit == port("N.m"))
    curves += [{"title": capital(v.description), "of": v.name, "by": ""} for v in drivers]
    yield {
        "name": "torque",
        "title": capital(effort),
        "curves": curves,
        **shown_in_unit(port("N.m"), "", units),
    }
    yield {
        "name": "inertia",
        "title": f"Inertia reflected to the {driver}",
        "curves": [{"title": "", "of": "J", "by": "ratio2"}],
        **shown_in_unit(port("kg.m2"), "", units),
    }
    yield {
        "name": "forces",
        "title": "Forces in the pins",
        "curves": "forces",
        **shown_in_unit("N", "", units),
    }
