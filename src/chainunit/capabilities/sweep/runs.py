"""The runs of a sweep: each point starts its own drive from rest, and meets the event once it is steady."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from ...batch.transients import can_run
from ...core.errors import Faults, InputError
from ...core.native.compilers import COMPILERS
from ...core.quantities import Layout
from ...study.block_runs import BlockRuns, Cause, EventRun, RunPoint
from ...study.event import Event
from ...study.measures import read_measure
from ...study.rig import Rig
from ...study.window import Phase, Trip, Window
from .plan import SweepPlan
from .table import SPEED

_RATIO = "machine.ratio"


def check_drive(rig: Rig, plan: SweepPlan, event: Event) -> None:
    """Refuse what the transients of a drive with this `event` cannot have.

    Raises
    ------
    InputError
        for an event that the drive cannot have, for a swept quantity that changes no run or is not one number of the
        drive, and without a C compiler.
    """
    faults = Faults()
    if not rig.takes(event):
        faults.add([InputError(f"sweep.event = {plan.event}: {event.without}", "sweep.event")])
    names = rig.drive.simulated_machine.model.parameter_layout.names
    for name in (parameter.name for parameter in plan.parameters):
        reason = ""
        if name == SPEED and not rig.drive.follows:
            reason = "changes no run, as the motor has the speed of its supply"
        elif name.startswith("machine.") and name.partition(".")[2] not in names:
            reason = "is not of the drive"
        elif name == _RATIO and rig.drive.whole_line:
            reason = "is not one number of the drive"
        if reason:
            line = f"sweep.parameter: {name} {reason}; leave it out, or sweep it without measures"
            faults.add([InputError(line, "sweep.parameter")])
    if not can_run():
        line = f"sweep.measures: need a C compiler ({COMPILERS}); install one, or leave them out"
        faults.add([InputError(line, "sweep.measures")])
    faults.refuse()


def measures(
    block: BlockRuns, plan: SweepPlan, event: Event, values: Mapping[str, Any]
) -> Iterator[Cause | dict[str, float]]:
    """By point, the measures of the plan by name, or the cause for which there are none. The points have these values
    by full name, each of shape (points,)."""
    count = len(next(iter(values.values())))
    points = [
        _point(block.rig, event, {name: float(x[k]) for name, x in values.items()}) for k in range(count)
    ]
    for point, run in zip(points, block.runs(points), strict=True):
        if run.fault is not None:
            yield run.fault.cause
        else:
            window = _window(point, run)
            measured = {name: read_measure(name, window) for name in plan.measures}
            yield {name: math.nan if value is None else value for name, value in measured.items()}


def of_system(name: str) -> list[str]:
    """The parameters of the compiled system that a swept quantity sets, by full name."""
    part, _, short = name.partition(".")
    # the machine of the feed-forward has the same parameters
    return [name, f"model.{short}"] if part == "machine" else []


def _point(rig: Rig, event: Event, values: Mapping[str, float]) -> RunPoint:
    """The run with these values by full name."""
    operation = rig.operation
    feed = {name.removeprefix("feed."): x for name, x in values.items() if name.startswith("feed.")}
    begin = f"event.{event.name}."
    of_event = {name.removeprefix(begin): x for name, x in values.items() if name.startswith(begin)}
    event = replace(event, p=replace(event.p, **of_event))
    if _RATIO in values:
        machine = rig.drive.machine.replace(ratio=values[_RATIO])
        rig = replace(rig, drive=replace(rig.drive, machine=machine))
    if feed or SPEED in values:
        loads = Layout(type(operation.feed)).from_names(feed, operation.feed)
        run = replace(operation.run, crank_speed=values.get(SPEED, operation.crank_speed))
        rig = replace(rig, operation=replace(operation, feed=loads, run=run))
    limit = rig.guards.get(rig.drive.motor_torque, math.inf)
    system_values = {full: x for name, x in values.items() for full in of_system(name)}
    return RunPoint(rig, event, event.time_followed(rig.operation.turn), limit=limit, values=system_values)


def _window(point: RunPoint, run: EventRun) -> Window:
    """The rows of a run from its event on."""
    assert run.series is not None and run.steady is not None
    drive, speed = point.rig.drive, point.rig.operation.crank_speed
    steady = Window(Phase.STEADY, run.steady, drive, (), speed)
    # the energy behind a coupling that opens is not followed
    trip = Trip(float(run.series["time"][-1]), math.nan, None) if run.ended else None
    return Window(Phase.EVENT, run.series, drive, (), speed, 0.0, steady, trip)
