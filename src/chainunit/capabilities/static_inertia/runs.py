"""Runs of a drive whose machine has one inertia: start-up, steady running without and with the terms of inertia, and
the events of a study."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ...batch.transients import can_run
from ...core.native.compilers import COMPILERS
from ...core.quantities import Value, declaration, quantity
from ...machines.machine import Machine
from ...mechanism.models import InverseMachine
from ...study.drive import Drive
from ...study.event import Event
from ...study.measures import read_measure, same_measure
from ...study.readings import crank_angle
from ...study.rig import Rig, worst_residual
from ...study.start_up import StartUp, start_up, until_settled
from ...study.torques import at_gear, gear_torque
from ...study.transients import follow_each
from ...study.window import Window, whole_turns
from ...system import Profile, Simulation
from ...work.progress import Progress
from .twin import SPEED

if TYPE_CHECKING:
    import xarray as xr

_OF_STEADY = (
    "motor_torque_peak",
    "motor_torque_rms",
    "current_peak",
    "current_rms",
    "winding_temperature",
    "speed_ripple",
)
_COMES = 1.0
"""Turns in which the terms of inertia come to the torque."""


@declaration
class DutyNumbers:
    """The demands of a duty on the drive. The gear torque is that at its output."""

    gear_torque_peak: Value = quantity("N.m", "gear torque, peak")
    gear_torque_rms: Value = quantity("N.m", "gear torque, RMS")
    motor_torque_peak: Value = same_measure("motor_torque_peak")
    motor_torque_rms: Value = same_measure("motor_torque_rms")
    current_peak: Value = same_measure("current_peak")
    current_rms: Value = same_measure("current_rms")
    winding_temperature: Value = same_measure("winding_temperature")
    speed_ripple: Value = same_measure("speed_ripple")
    start_time: Value = same_measure("start_time")
    start_gear_torque: Value = quantity("N.m", "start-up, gear torque, peak")
    start_current: Value = quantity("A", "start-up, motor current, peak")


@declaration
class EventNumbers:
    """The peaks of an event; the gear torque is that at its output."""

    gear_torque: Value = quantity("N.m", "gear torque, peak")
    current: Value = quantity("A", "motor current, peak")


@dataclass(frozen=True)
class TwinRuns:
    """The runs of a `drive` whose machine has one inertia: whole `turns` of steady running without terms of inertia,
    and `turns_with_terms`; the numbers of both, the numbers of events by name, and the largest energy residual of
    start-up and steady running, with either, over the energy moved."""

    drive: Drive
    turns: xr.Dataset
    turns_with_terms: xr.Dataset
    numbers: DutyNumbers
    numbers_with_terms: DutyNumbers
    events: Mapping[str, EventNumbers]
    residual: float


def obstacle(drive: Drive) -> str:
    """Why a drive cannot be run with one inertia of its machine; empty where it can."""
    machine = drive.machine
    model = machine.model
    if drive.foreign_titles:
        return f"the equations of {' and '.join(drive.foreign_titles)} are not known"
    if not issubclass(model, InverseMachine) or machine.simulated is not machine or model.States is not None:
        return "the inertia of the machine does not belong to its angle alone"
    if not model.turns:
        return f"the {drive.driver_noun} goes to and fro, and makes no turn at constant speed"
    if not can_run():
        return f"it needs a C compiler ({COMPILERS})"
    return ""


def numbers_of(steady: Window, start: Window | None) -> DutyNumbers:
    """The numbers of steady running and, if it is given, of a start."""
    drive, turns = steady.drive, steady.turns
    begun: dict[str, float | None] = dict.fromkeys(("start_time", "start_gear_torque", "start_current"))
    if start is not None:
        begun = {
            "start_time": read_measure("start_time", start),
            "start_gear_torque": at_gear(drive, start.run),
            "start_current": read_measure("current_peak", start),
        }
    return DutyNumbers(
        gear_torque_peak=at_gear(drive, turns),
        gear_torque_rms=steady.rms(gear_torque),
        **{name: read_measure(name, steady) for name in _OF_STEADY},
        **begun,
    )


def event_numbers(rig: Rig, run: xr.Dataset) -> EventNumbers:
    """The peaks of a run from the begin of its event on."""
    current = np.abs(run[f"motor.{rig.drive.motor.current}"].values)
    return EventNumbers(gear_torque=at_gear(rig.drive, run), current=float(np.max(current)))


def with_machine(rig: Rig, machine: Machine) -> Rig:
    """The rig on the compiled system with another machine, without an observer."""
    drive = replace(rig.drive, machine=machine, observer=None, observed={})
    return replace(rig, drive=drive, files=None, fed_from=None)


def run_twin(rig: Rig, events: Sequence[Event], progress: Progress) -> TwinRuns:
    """All runs of a `rig` whose machine has one inertia, in the `events` that it takes.

    Raises
    ------
    RunError
        where a run fails.
    """
    with rig.from_rest() as simulation:
        started = start_up(rig, simulation, progress, {})
        rig, begin = started.rig, simulation.save()
        steady, start = started.windows
        angle = float(crank_angle(rig.drive, started.run)[-1])
        running = [event for event in events if not event.from_rest]
        own = {
            event.name: event_numbers(rig, run)
            for event, run in follow_each(rig, simulation, running, angle, steady.speed_mean)
        }
        last = _with_terms(rig, simulation, begin)
    with_terms = replace(steady, run=whole_turns(rig.drive, last, rig.operation.run.turns))
    own |= {event.name: _loaded_start(rig, event, started) for event in events if event.from_rest}
    return TwinRuns(
        rig.drive,
        steady.run,
        with_terms.run,
        numbers_of(steady, start),
        numbers_of(with_terms, None),
        own,
        max(worst_residual(rig.residuals(run)) for run in (started.run, last)),
    )


def _loaded_start(rig: Rig, event: Event, started: StartUp) -> EventNumbers:
    rig = replace(rig, fed_from=None)
    with rig.from_rest(event) as simulation:
        return event_numbers(rig, simulation.run(started.stop, rig.step))


def _with_terms(rig: Rig, simulation: Simulation, begin: float) -> xr.Dataset:
    """Steady running with the terms of inertia, from the saved state at the time `begin` [s] on: the run whose turns
    close."""
    operation = rig.operation
    speed, turn = operation.crank_speed, operation.turn
    simulation.restore()
    comes = Profile(0.0, ((begin, _COMES * turn, speed),))
    simulation.signals = {**rig.signals(), f"machine.{SPEED}": comes}
    settles, wanted = _COMES + operation.run.settle_turns, operation.run.turns
    simulation.run(begin + settles * turn, rig.step)
    length = wanted + 0.1
    *_, last = until_settled(rig, simulation, simulation.time + length * turn, length, wanted)
    return last
