"""The drive of a live page in its runs: its equations, and the data by which the page starts it, feeds it and brings
events. The page goes through a run as `chainunit.study.block_runs` does."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from ...core.printing.javascript import model_text
from ...core.quantities import Layout, named_values, variable_of
from ...reading.text import Units
from ...study.block_runs import names_read
from ...study.drive import Drive
from ...study.event import Event
from ...study.limits import SPEED_DEVIATION
from ...study.measures import STARTED, Answers
from ...study.operation import OperatingConditions
from ...study.rig import FEED_RISE, Rig
from ...study.sections import Coupling, Run
from ...study.start_up import LONGEST_RISE, PATIENCE, RISES
from ...study.window import CLOSED, DRIFT
from ...system.certificate import torque_names
from ...system.compiled_simulation import LONGEST, CompiledSystem
from .formulas import event_signals
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
    """The `equations` of a drive in JavaScript, the `data` of its runs as JSON has it, the `names` of its parameters
    and inputs, and the quantities that only runs have."""

    equations: str
    data: dict[str, Any]
    names: Collection[str]
    quantities: tuple[LiveQuantity, ...]


def reason_without_runs(drive: Drive) -> str:
    """Why a page has no runs of this drive, in words; empty where it has."""
    if drive.foreign is not None or drive.foreign_machine is not None:
        return "motor or machine is an FMU of somebody else, whose equations are not known"
    if drive.feed_forward:
        return "the control has feed-forward, which needs the co-simulation"
    if stand_in(drive):
        return "the organs are chains, whose runs take too long for a page"
    return ""


def stand_in(drive: Drive) -> str:
    """The organs of the turn on a page, if the study has other ones; else empty."""
    return "" if drive.simulated_machine.model is drive.machine.model else "two bars"


def whole_of(organs: str) -> str:
    """What has the values that a reader changes, by the organs of `stand_in`."""
    return f"the study's machine with {organs} in place of its chains" if organs else "the study"


def live_runs(
    drive: Drive,
    operation: OperatingConditions,
    events: Mapping[str, Event],
    units: Units,
) -> LiveRuns:
    """The runs of a drive for which `reason_without_runs` is empty."""
    rig = Rig(operation, drive, None).plain
    system = CompiledSystem(rig.graph)
    model = system.model
    taken = [event for event in events.values() if rig.takes(event)]
    outputs = {v.name for part in model.parts for v in part.layout.variables}
    columns = [name for name in names_read(rig, taken) if name in outputs]
    machine = drive.simulated_machine.model
    shared = machine.derived_count == model.derived_count
    equations = model_text(model, columns, not (shared and model.derived_count))
    values = model.parameter_layout.by_name(system.p) | {"solver.tolerance": TOLERANCE}
    inputs = system.inputs | rig.normal
    torque = next(name for name in torque_names(drive.machine_bond) if name in columns)
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
        "line_ratio": float(drive.whole_line.ratio),
        "reference": "motor.w_ref" if drive.follows else None,
        "droop_speed": drive.droop_speed,
        "ramp": float(run.ramp),
        "switching": {
            full: {"start": float(x.start), "changes": [list(map(float, change)) for change in x.changes]}
            for full, x in drive.star.signals().items()
        },
        "switched_until": drive.star.end,
        "starter_time": operation.starter_time,
        "settle_turns": float(run.settle_turns),
        "turns": float(run.turns),
        "step": max(float(run.step), SHORTEST),
        "longest": LONGEST * float(run.step),
        "most": _MOST * usual,
        "empty_start": operation.empty_start,
        "feed_rise": FEED_RISE,
        "started": STARTED,
        "patience": PATIENCE,
        "rises": RISES,
        "longest_rise": LONGEST_RISE,
        "closed": CLOSED,
        "drift": DRIFT,
        "speed_deviation": SPEED_DEVIATION,
        "behind_port": {"loss": drive.loss_behind_port, "drag": drive.line.drag},
        "trip": None if operation.coupling is None else float(operation.coupling.trip_torque),
        "rotor": {
            "name": "motor.rotor.J",
            "own": float(drive.parameters.rotor.J),
            "added": float(drive.inertia_on_rotor),
            "rest": float(drive.gear_at_rotor.J),
        },
        "slips": drive.line.before_gear is not None,
        "events": [_event(rig, event) for event in taken],
        "results": list(_results(drive, units, "machine.rocker.tau" in columns)),
    }
    names = {*model.parameter_layout.names, *system.inputs}
    return LiveRuns(equations, data, names, tuple(_quantities(drive, operation, taken, names)))


def _event(rig: Rig, event: Event) -> dict[str, Any]:
    """The data by which the page brings an event: its quantities, the `normal` values of the inputs that it changes,
    the outputs that it `reads` at its begin, and the formulas of its `signals`."""
    return {
        "name": event.name,
        "title": event.title,
        "from_rest": event.from_rest,
        "values": {v.name: x for v, x in named_values(event.p)},
        "normal": {name: rig.inputs[name][0] for name in event.inputs},
        "reads": {name: f"machine.{name}" for name in event.reads},
        "signals": event_signals(event, lambda name: rig.inputs[name][0]),
    }


def _results(drive: Drive, units: Units, rocker: bool) -> Iterator[dict[str, Any]]:
    """The results of an event that the page reads, by their measures; `rocker` tells whether there is a rocker."""
    for v in Layout(Answers).variables:
        if v.name in _MEASURES and (v.name != "rocker_torque_peak" or rocker):
            title = v.described(drive.driver_noun)
            yield {"name": v.name, "title": title, **shown_in_unit(v.unit, v.kind, units)}


def _quantities(
    drive: Drive, operation: OperatingConditions, events: Iterable[Event], model_names: Collection[str]
) -> Iterator[LiveQuantity]:
    """The quantities that the runs alone have: of the motor, the flywheel, the coupling, the ramp, the events."""
    # the parameters of a motor of the catalogue follow from its plate
    if drive.rated_current is None:
        for v, value in named_values(drive.parameters):
            full = f"motor.{v.name}"
            if (
                v.type == "Real"
                and full in model_names
                and not v.name.startswith(("solver.", "phi_start", "w_start"))
            ):
                role, runs = ("rotor", ()) if v.name == "rotor.J" else ("", (full,))
                yield LiveQuantity(("motor", *v.name.split(".")), v, value, "drive", (), runs, role)
    yield from _tables(drive, operation)
    for event in events:
        for v, value in named_values(event.p):
            if v.type == "Real":
                key = ("event", event.name, v.name)
                yield LiveQuantity(key, v, value, f"event.{event.name}", role="event", event=event.name)


def _tables(drive: Drive, operation: OperatingConditions) -> Iterator[LiveQuantity]:
    """The ramp and the torque limiter, if the drive has them."""
    if drive.follows:
        ramp = variable_of(Run, "ramp")
        yield LiveQuantity(("run", "ramp"), ramp, float(operation.run.ramp), "drive", role="ramp")
    if operation.coupling is not None:
        for name, role in (("trip_torque", "trip"), ("release_time", "release")):
            declared = variable_of(Coupling, name)
            variable = replace(declared, template=f"torque limiter: {declared.template}")
            value = float(getattr(operation.coupling, name))
            yield LiveQuantity(("coupling", name), variable, value, "drive", role=role)
