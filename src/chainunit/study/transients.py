"""Events of a running drive: the wait for the angle of the crank, the run, the machine behind an open coupling, and
the comparison with the monolithic solution."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..system import Jump, ModelComponent, Profile, Simulation, System, monolithic
from ..work.progress import Progress
from .arrays import Dataset
from .drive_fmus import coasting_model, coasting_parameters
from .event import Event, Signals, angle_of_begin
from .readings import machine_series
from .rig import Rig, join
from .window import time_at

DIFFERENCE = "_difference_to_monolithic"
"""Suffix of the name of a variable for its largest difference to the monolithic solution, over its peak."""
_UNEVEN = 2.0
"""Ratio of the time that a crank takes to an angle over the time at its mean speed, up to which an event waits."""


@dataclass(frozen=True)
class Transient:
    """A run with an event that began at `begin` [s]. `signals` are its signals from there on. `jumps` are
    those among them that the event sets to a number at its begin; `lead` is then the run up to the begin."""

    event: Event
    begin: float
    run: Dataset
    signals: Signals
    jumps: dict[str, Jump]
    lead: Dataset | None = None


def lead_times(
    rig: Rig, simulation: Simulation, events: Sequence[Event], angle: float, speed: float
) -> list[float]:
    """Time from the saved state to the begin of each event [s]: the machine is followed without an event until
    its crank, now at the `angle` [rad] with the mean `speed` [rad/s], passes their angles."""
    if not events:
        return []
    simulation.restore()
    simulation.signals = rig.signals()
    begin, (name, ratio) = simulation.time, rig.drive.crank_output("phi")
    targets = [angle_of_begin(event, angle) for event in events]
    limits = [longest_lead(rig, target - angle, speed) for target in targets]
    run = simulation.run(begin + max(limits), rig.step, guards={name: max(targets) * ratio})
    times = (time_at(rig.drive, run, target) for target in targets)
    return [limit if time is None else time - begin for time, limit in zip(times, limits, strict=True)]


def longest_lead(rig: Rig, ahead: float, speed: float) -> float:
    """Time in which a crank of the mean `speed` [rad/s] passes the angle `ahead` [rad], however uneven its turn
    is [s]. An event does not wait longer, as the crank may hardly turn."""
    return float(_UNEVEN * ahead / max(speed, 0.5 * rig.operation.crank_speed))


def follow(
    rig: Rig,
    simulation: Simulation,
    event: Event,
    begin: float,
    stop: float,
    progress: Progress | None = None,
    guards: Mapping[str, float] | None = None,
) -> Transient:
    """Run an event from the saved state to the time `stop` [s], or until a guard ends it. An event that reads outputs
    of the machine at its begin needs a run to there first; its inputs may jump then."""
    simulation.restore()
    normal_inputs, outputs, pieces = dict[str, float](), dict[str, float](), []
    if event.reads:
        normal_inputs = dict(rig.inputs[name] for name in event.inputs)
        simulation.signals = rig.signals(normal_inputs)
        pieces.append(simulation.run(begin, rig.step, progress))
        outputs = {name: float(pieces[0][f"machine.{name}"][-1]) for name in event.reads}
    signals = rig.event_signals(event, begin, outputs)
    simulation.signals = rig.signals(signals)
    pieces.append(simulation.run(stop, rig.step, progress, guards=guards))
    jumps = {}
    for full, value in normal_inputs.items():
        after = signals[full]
        if not isinstance(after, Profile):
            jumps[full] = Jump(begin, value, after)
    return Transient(event, begin, join(pieces), signals, jumps, pieces[0] if jumps else None)


def follow_each(
    rig: Rig, simulation: Simulation, events: Sequence[Event], angle: float, speed: float
) -> Iterator[tuple[Event, Dataset]]:
    """Each of the `events` with its run from its begin on, without guards. The simulation is at its saved state; for
    `angle` and `speed` see `lead_times`."""
    saved = simulation.time
    for event, lead in zip(events, lead_times(rig, simulation, events, angle, speed), strict=True):
        begin = saved + lead
        run = follow(rig, simulation, event, begin, begin + event.time_followed(rig.operation.turn)).run
        yield event, run.sel(time=slice(begin, None))


def coast(rig: Rig, transient: Transient, run: Dataset, stop: float, file: Path) -> Dataset:
    """The run of the machine (FMU `file`) behind the coupling that opened at the end of `run`, with the
    same loads. It ends a second after the time `stop` [s] to which the motor would have been followed."""
    begin = float(run["time"][-1])
    model = coasting_model(rig.drive)
    start = model.start_from({k: float(x[-1]) for k, x in machine_series(run).items()})
    p = model.parameter_layout.from_names(coasting_parameters(rig.drive) | start)
    machine_alone = System({"machine": ModelComponent(model, p, file)})
    loads = rig.drive.loads(rig.operation.feed) | transient.signals
    loads = {full: x for full, x in loads.items() if full.startswith("machine.")}
    with rig.simulation(machine_alone, {**loads, "machine.tau": 0.0}, begin) as simulation:
        return simulation.run(max(stop, begin) + 1.0, rig.step)


def release(rig: Rig, simulation: Simulation, run: Dataset, time: float) -> tuple[Dataset, float]:
    """A run that ended when the coupling opened, continued for the `time` [s] until no torque passes the
    coupling; and the energy that passes in that time [J]."""
    if time <= 0.0:
        return run, 0.0
    decay = simulation.run(simulation.time + time, min(rig.step, time))
    torque, speed = (decay[name] for name in (rig.drive.motor_torque, rig.drive.motor_speed))
    energy = float(np.trapezoid(torque * speed, decay["time"]))
    return join([run, decay]), energy


def compare(
    rig: Rig, run: Dataset, transient: Transient | None = None, start: Mapping[str, float] | None = None
) -> tuple[dict[str, float], dict[str, float]]:
    """Compare a run with the monolithic solution of the same signals, from the states `start` on or from rest.
    Returns the differences of torque and speed, relative to their peaks, and the states at the end."""
    profiles = transient.signals if transient else {}
    signals: dict[str, Any] = dict(rig.signals(profiles, ramp=start is None))
    if transient:
        signals |= transient.jumps
    time = run["time"].values
    rows = np.unique(np.append(np.arange(0, len(time), 10), len(time) - 1))
    if transient and transient.jumps:
        # at the jump itself the torque has two values
        rows = rows[time[rows] != transient.begin]
    reference = monolithic(rig.graph, signals, time[rows], start=start)
    differences = {}
    for output in ("machine.tau", "motor.w"):
        difference = np.abs(run[output].values[rows] - reference[output].values)
        differences[output + DIFFERENCE] = float(
            np.max(difference) / np.max(np.abs(reference[output].values))
        )
    return differences, {full: float(reference[full][-1]) for full in map(str, reference.data_vars)}
