"""The drive of a live page in its runs: its module, and the data by which the page starts it, feeds it and brings
events. The page goes through a run as `chainunit.study.block_runs` does."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from ...core.quantities import Layout
from ...core.wasm.module import WasmModule, wasm_module
from ...drives.catalogue import CatalogueMotor
from ...reading.text import Units
from ...study.drive import Drive
from ...study.event import Event
from ...study.measures import STARTED, Answers
from ...study.operation import OperatingConditions
from ...study.rig import FEED_RISE, Rig
from ...study.sections import Coupling, Run
from ...study.start_up import PATIENCE
from ...study.window import CLOSED, DRIFT
from ...system.compiled import compiled, input_starts
from ...system.compiled_simulation import LONGEST
from .formulas import event_signals, varied_names
from .quantities import LiveQuantity, shown_in_unit

TOLERANCE = 1e-7
"""Relative tolerance of the integrator: peaks agree with those of a study to its coupling error."""
SHORTEST = 1e-3
"""Least time between two rows [s]."""
_MOST = 30.0
"""Most time in the runs for one answer, as a multiple of that in the runs of the study."""
_MEASURES = ("crank_torque_peak", "rocker_torque_peak", "current_peak", "speed_least", "stall_time")
"""The measures of an event that the page reads."""


@dataclass(frozen=True)
class LiveRuns:
    """The module of a drive, the `data` of its runs as JSON has it, and the quantities that only they have."""

    module: WasmModule
    data: dict[str, Any]
    quantities: tuple[LiveQuantity, ...]


def reason_without_runs(drive: Drive) -> str:
    """Why a page has no runs of this drive, in words; empty where it has."""
    if drive.foreign is not None or drive.foreign_machine is not None:
        return "motor or machine is an FMU of somebody else, whose equations are not known"
    if drive.feed_forward:
        return "the control has feed-forward, which needs the co-simulation"
    if drive.simulated_machine.model is not drive.machine.model:
        return "the organs are chains, whose runs take too long for a page"
    return ""


def live_runs(
    drive: Drive,
    operation: OperatingConditions,
    events: Mapping[str, Event],
    units: Units,
    plate: CatalogueMotor | None = None,
    gear: Any = None,
) -> LiveRuns:
    """The runs of a drive for which `reason_without_runs` is empty; a motor of the catalogue has its `plate` and its
    `gear`."""
    rig = Rig(operation, drive, None).plain
    part = compiled(rig.graph)
    model, layout = part.model, part.model.parameter_layout
    taken = [event for event in events.values() if rig.takes(event)]
    columns = _columns(rig, taken, {v.name for each in model.parts for v in each.layout.variables})
    machine = drive.simulated_machine.model
    shared = machine.derived_count == model.derived_count
    module = wasm_module(model, False, tuple(columns), not (shared and model.derived_count))
    values = layout.by_name(part.parameters) | {"solver.tolerance": TOLERANCE}
    inputs = {v.name: float(v.quantity.start or 0.0) for v in model.input_layout.variables}
    inputs |= input_starts(rig.graph, model) | rig.normal
    bond = drive.machine_bond
    driver, driven = bond.flanges
    sides = ((bond.machine, driven), (bond.driver, driver))
    torques = (f"{name}.{flange.members['tau']}" for name, flange in sides if "tau" in flange.members)
    torque = next(name for name in torques if name in columns)
    run = operation.run
    turns = 2.0 * run.settle_turns + run.turns + 2.0
    followed = max((event.time_followed(operation.turn) for event in taken), default=0.0)
    usual = operation.ramp_end + turns * operation.turn + followed
    data = {
        "parameters": values,
        "inputs": inputs,
        "derived": model.derived_count if shared else 0,
        "names": {
            "torque": torque,
            "motor_torque": drive.motor_torque,
            "motor_speed": drive.motor_speed,
            "angle": drive.crank_output("phi")[0],
            "speed": drive.crank_output("w")[0],
            "current": f"motor.{drive.motor.current}",
            "rocker": "machine.rocker.tau" if "machine.rocker.tau" in columns else None,
        },
        "columns": columns,
        "line_ratio": float(drive.line.ratio),
        "reference": "motor.w_ref" if drive.follows else None,
        "ramp": float(run.ramp),
        "soft_time": operation.soft_time,
        "settle_turns": float(run.settle_turns),
        "turns": float(run.turns),
        "step": max(float(run.step), SHORTEST),
        "longest": LONGEST * float(run.step),
        "most": _MOST * usual,
        "empty_start": operation.empty_start,
        "feed_rise": FEED_RISE,
        "started": STARTED,
        "patience": PATIENCE,
        "closed": CLOSED,
        "drift": DRIFT,
        "trip": None if operation.coupling is None else float(operation.coupling.trip_torque),
        "rotor": {
            "name": "motor.rotor.J",
            "own": float(drive.parameters.rotor.J),
            "added": float(drive.added_inertia),
            "rest": float(drive.gear_inertia),
        },
        "gear_loss": None if plate is None else _gear_loss(plate, gear, drive),
        "events": [_event(rig, event) for event in taken],
        "results": list(_results(drive, units, "machine.rocker.tau" in columns)),
    }
    return LiveRuns(module, data, tuple(_quantities(drive, operation, taken, set(layout.names))))


def _columns(rig: Rig, events: Iterable[Event], known: set[str]) -> list[str]:
    """The outputs that the results and the events read."""
    names = {f"motor.{rig.drive.motor.current}": None, "machine.rocker.tau": None}
    names |= {f"machine.{name}": None for event in events for name in event.reads}
    for bond in rig.graph.bonds:
        for name, terminal in zip((bond.driver, bond.machine), bond.flanges, strict=True):
            names |= {
                f"{name}.{terminal.members[x]}": None for x in ("phi", "w", "tau") if x in terminal.members
            }
    return [name for name in names if name in known]


def _gear_loss(plate: CatalogueMotor, gear: Any, drive: Drive) -> dict[str, Any]:
    """The numbers from which the friction of the shaft follows, see `chainunit.study.catalogue_drive`."""
    nameplate = plate.nameplate
    return {
        "parameter": "motor.rotor.d",
        "friction": float(drive.parameters.rotor.d),
        "efficiency": float(gear.efficiency),
        "drag": float(gear.d),
        "follows": drive.follows,
        "synchronous": float(nameplate.synchronous),
        "rated_speed": float(nameplate.speed),
        "rated_torque": float(nameplate.torque),
    }


def _event(rig: Rig, event: Event) -> dict[str, Any]:
    return {
        "name": event.name,
        "title": event.title,
        "from_rest": event.from_rest,
        "values": {v.name: float(x) for v, x in zip(*_pairs(event), strict=True)},
        "varied": varied_names(event),
        "normal": {name: rig.inputs[name][0] for name in event.inputs(event.side)},
        "reads": {name: f"machine.{name}" for name in event.reads},
        "signals": event_signals(event, lambda name: rig.inputs[name][0]),
    }


def _pairs(event: Event) -> tuple[Any, Any]:
    layout = Layout(type(event.p))
    return layout.variables, layout.values(event.p)


def _results(drive: Drive, units: Units, rocker: bool) -> Iterator[dict[str, Any]]:
    """The results of an event that the page reads, by their measures; `rocker` tells whether there is a rocker."""
    for v in Layout(Answers).variables:
        if v.name in _MEASURES and (v.name != "rocker_torque_peak" or rocker):
            title = v.described(drive.driver_noun)
            yield {"name": v.name, "title": title, **shown_in_unit(v.unit, v.kind, units)}


def _quantities(
    drive: Drive, operation: OperatingConditions, events: Iterable[Event], known: set[str]
) -> Iterator[LiveQuantity]:
    """The quantities that the runs alone have: of the motor, the flywheel, the coupling, the ramp, the events."""
    motor = Layout(type(drive.parameters))
    # the parameters of a motor of the catalogue follow from its plate
    if drive.rated_current is None:
        for v, value in zip(motor.variables, motor.values(drive.parameters), strict=True):
            full = f"motor.{v.name}"
            if (
                v.type == "Real"
                and full in known
                and not v.name.startswith(("solver.", "phi_start", "w_start"))
            ):
                role, runs = ("rotor", ()) if v.name == "rotor.J" else ("", (full,))
                yield LiveQuantity(("motor", *v.name.split(".")), v, float(value), "drive", (), runs, role)
    yield from _tables(drive, operation)
    for event in events:
        for v, value in zip(*_pairs(event), strict=True):
            if v.type == "Real":
                key = ("event", event.name, v.name)
                yield LiveQuantity(
                    key, v, float(value), f"event.{event.name}", role="event", event=event.name
                )


def _tables(drive: Drive, operation: OperatingConditions) -> Iterator[LiveQuantity]:
    run = {v.name: v for v in Layout(Run).variables}
    if drive.follows:
        yield LiveQuantity(("run", "ramp"), run["ramp"], float(operation.run.ramp), "drive", role="ramp")
    if operation.coupling is not None:
        own = {v.name: v for v in Layout(Coupling).variables}
        for name, role in (("trip_torque", "trip"), ("release_time", "release")):
            variable = replace(own[name], template=f"safety coupling: {own[name].template}")
            value = float(getattr(operation.coupling, name))
            yield LiveQuantity(("coupling", name), variable, value, "drive", role=role)
