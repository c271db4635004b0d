"""Runs with an event: side by side on the compiled system of a drive, in one native loop, or one after the other by
the co-simulation of its FMUs. The latter is the reference; both agree to the error of the coupling.

A run depends on its point alone, whatever the others of its block are.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cached_property
from operator import itemgetter
from typing import Any

import numpy as np

from ..batch.transients import Runs, Transients, signal_table
from ..core.errors import InterruptedRunError, RunError
from ..system import monolithic
from ..system.compiled_simulation import LONGEST, CompiledSimulation, CompiledSystem, is_evaluated
from ..system.signals import at_time
from .arrays import Dataset
from .event import Event, angle_of_begin
from .readings import crank_angle, crank_speed, has_turn
from .rig import Rig
from .start_up import PATIENCE, speeds_up
from .transients import follow, longest_lead
from .window import is_settled, mean, time_at, whole_turns

BLOCK = 64
"""Number of runs that are side by side in memory."""
_ROWS_OF_START = 16
"""Rows of the start of a run, which no measure reads."""


class Cause(Enum):
    """Why a run has no results, with its text."""

    LEFT_BOUNDS = "the states of the drive left all bounds"
    UNSETTLED = f"the motor does not settle in {PATIENCE:g} turns of the crank"
    STOPPED = "an FMU stopped"


@dataclass(frozen=True)
class RunFault:
    """The cause for which a run has no results, the time of its last row [s], if it has one, and what an FMU says."""

    cause: Cause
    time: float = math.nan
    said: str = ""

    def __str__(self) -> str:
        instant = f"at t = {self.time:g} s: " if math.isfinite(self.time) else ""
        return self.said or f"{instant}{self.cause.value}"


@dataclass(frozen=True)
class RunPoint:
    """A run that is asked for.

    Parameters
    ----------
    rig : the drive with the feed and the speed of this run
    event : what happens to it
    duration : time for which it is followed from the begin of the event on [s]
    lead : time from the steady state to the begin of the event [s]; a run from rest waits for the crank angle of its
        event instead
    limit : torque of the motor's shaft that ends the run [N m]
    values : values of the parameters in which points differ, by full name
    """

    rig: Rig
    event: Event
    duration: float
    lead: float = 0.0
    limit: float = math.inf
    values: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class EventRun:
    """A run with an event: its rows, whether the limit ended it, and why it failed, where it did; it may then have no
    rows. A run from rest has the rows from its event on, and the last turns before it, `steady`; others have all rows
    from the steady state on."""

    series: Dataset | None = None
    ended: bool = False
    fault: RunFault | None = None
    steady: Dataset | None = None


def names_read(rig: Rig, events: Iterable[Event]) -> list[str]:
    """Full names of the outputs and states from which the answers of a run and the signals of these events follow;
    the system of the `rig` may not have all."""
    names = [f"motor.{rig.drive.motor.current}", "machine.rocker.tau"]
    names += [f"machine.{name}" for event in events for name in event.reads]
    for bond in rig.graph.bonds:
        for name, terminal in zip((bond.driver, bond.machine), bond.flanges, strict=True):
            members = terminal.members
            names += [f"{name}.{members[x]}" for x in ("phi", "w", "tau") if x in members]
    return list(dict.fromkeys(names))


class _Wait:
    """The wait of a point for steady running, by times since rest [s]: the `time` to which it has run, the length of
    its next run, the `piece`, usually that of the turns that are asked for, and the end of the patience."""

    def __init__(self, time: float, usual: float) -> None:
        self.time, self.piece, self._usual = time, usual, usual
        self._longest = time + PATIENCE * usual

    def goes_on(self, rig: Rig, run: Dataset) -> bool:
        """Whether the point is run on after the last `run`, in which it did not settle."""
        if speeds_up(rig, run, self.time):
            self._longest = self.time + self.piece + max(PATIENCE * self._usual, 2.0 * self.time)
        self.time += self.piece
        # the rise of the speed is read from a turn
        self.piece = self._usual if has_turn(rig.drive, run) else 2.0 * self.piece
        return self.time < self._longest - 0.5 * self._usual


class BlockRuns:
    """The compiled system of a rig, and runs on it.

    Parameters
    ----------
    rig : of models only; its FMUs are not needed
    events : the events that points may have, each with as many changes as it can have
    varying : parameters, by full name, in which points differ; parameters that the system does not have are left out
    start : time of the steady state from which all runs branch [s]; without it each point starts from rest, with feed
        and speed of its own
    states : the states at that time, in the order of the model; by default those of a run from rest

    Raises
    ------
    InputError
        where a component of the system is an FMU.
    """

    def __init__(
        self,
        rig: Rig,
        events: Sequence[Event],
        varying: Sequence[str] = (),
        start: float | None = None,
        states: Any = None,
    ) -> None:
        self.rig = rig
        self.system = CompiledSystem(rig.graph)
        parameter_names = self.system.model.parameter_layout.names
        self._varying = [name for name in varying if name in parameter_names]
        self._events, self._start = events, start
        self._inputs = self.system.inputs | rig.normal
        self._given_states = states

    @cached_property
    def states(self) -> Any:
        """The states from which runs branch, in the order of the model, shape (states,).

        Raises
        ------
        RunError
            where they leave all bounds before that time.
        """
        if self._given_states is not None:
            return self._given_states
        assert self._start is not None
        graph, signals = self.rig.graph, self.rig.signals(ramp=True)
        if all(map(is_evaluated, signals.values())):
            with CompiledSimulation(graph, signals) as simulation:
                simulation.run(self._start, self.rig.step, names=())
                return simulation.states
        # the rate of the reference, which a feed-forward takes, is no profile
        layout = self.system.model.state_layout
        assert layout is not None
        run = monolithic(graph, signals, [0.0, self._start])
        return np.array([float(run[name][-1]) for name in layout.names])

    @cached_property
    def outputs(self) -> list[str]:
        """The outputs and states that the measures of a run with an event read, and the events themselves."""
        names = ["motor.air_gap_tau", *names_read(self.rig, self._events)]
        return sorted(set(names) & set(self.system.outputs))

    @cached_property
    def _driven(self) -> dict[str, int]:
        """By full name of an input that differs between points, or over time, the number of its changes."""
        unknown: Mapping[str, float] = defaultdict(float)
        # a start has a ramp of the reference, and may have a rise of each load
        driven: dict[str, int] = {}
        if self._start is None:
            from_rest = self.rig.signals(ramp=True)
            driven = {full: max(1, len(getattr(x, "changes", ()))) for full, x in from_rest.items()}
        for event in self._events:
            for full, signal in self.rig.event_signals(event, 0.0, unknown).items():
                driven[full] = max(driven.get(full, 0), len(getattr(signal, "changes", ())))
        return driven

    @property
    def _changes(self) -> int:
        return max(self._driven.values(), default=0)

    @cached_property
    def loop(self) -> Transients:
        """The compiled loop."""
        return Transients(
            self.system.model,
            self.outputs,
            varying=self._varying,
            driven=list(self._driven),
            guarded=[self.rig.drive.motor_torque, self.rig.drive.crank_output("phi")[0]],
            changes=self._changes,
        )

    def runs(self, points: Sequence[RunPoint]) -> Iterator[EventRun]:
        """The runs of the points, in order."""
        maker = self._from_rest if self._start is None else self._from_start
        for first in range(0, len(points), BLOCK):
            block = points[first : first + BLOCK]
            # runs that end at nearly the same time share a vector
            order = sorted(range(len(block)), key=lambda k: block[k].lead + block[k].duration)
            runs = maker([block[k] for k in order])
            yield from (run for _, run in sorted(zip(order, runs, strict=True), key=itemgetter(0)))

    def _from_start(self, points: Sequence[RunPoint]) -> Iterator[EventRun]:
        """Runs from the shared steady state on."""
        assert self._start is not None
        begins = self._start + np.array([point.lead for point in points])
        stops = begins + np.array([point.duration for point in points])
        states, time, before = self.states, np.array(self._start), None
        if any(event.reads for event in self._events):
            before = self._run(points, states, time, begins)
            states, time = before.states, begins
        return self._event_runs(self._through(points, states, time, begins, stops, before), stops, before)

    def _from_rest(self, points: Sequence[RunPoint]) -> list[EventRun]:
        """Runs that start from rest, run until they are steady, and then meet their events, at which their clocks
        begin anew."""
        states, faults, last_turns = self._steadied(points)
        results = [EventRun(fault=fault) for fault in faults]
        settled = [k for k, fault in enumerate(faults) if fault is None]
        if not settled:
            return results
        points, states = [points[k] for k in settled], states[:, settled]
        waits = self._waits(points, states, [last_turns[k] for k in settled])
        before = self._run(points, states, 0.0, waits)
        stops = np.array([point.duration for point in points])
        runs = self._through(points, before.states, 0.0, np.zeros(len(settled)), stops, before)
        for place, (k, run) in enumerate(zip(settled, self._event_runs(runs, stops), strict=True)):
            fault = _fault(before, place) or run.fault
            results[k] = replace(run, fault=fault, steady=_turns(points[place], last_turns[k]))
        return results

    def _run(
        self,
        points: Sequence[RunPoint],
        states: Any,
        begin: Any,
        stop: Any,
        signals: Sequence[Mapping[str, Any]] | None = None,
        limits: Any = None,
        step: float | None = None,
    ) -> Runs:
        """Runs of points from `begin` to `stop` [s], by default with the signals of steady running."""
        signals = signals or [point.rig.normal for point in points]
        return self.loop.run(
            self.system.p,
            self._inputs,
            states,
            begin=begin,
            step=step or self.rig.step,
            stop=np.asarray(stop, float),
            varying=np.array([[point.values[name] for point in points] for name in self._varying]),
            signals=signal_table(list(self._driven), signals, self._inputs, self._changes),
            limits=limits,
            longest=LONGEST * self.rig.step,
        )

    def _through(
        self,
        points: Sequence[RunPoint],
        states: Any,
        begin: Any,
        event_times: Any,
        stop: Any,
        before: Runs | None = None,
    ) -> Runs:
        """Runs from `begin` to `stop` through events that begin at the `event_times` [s]; `before` are the runs to
        the events, whose last outputs the events read."""
        signals = []
        for k, point in enumerate(points):
            read = {name: self._last(before, k, name) for name in point.event.reads}
            changed = point.rig.event_signals(point.event, float(event_times[k]), read)
            signals.append({**point.rig.normal, **changed})
        limits = [[point.limit for point in points], [math.inf] * len(points)]
        return self._run(points, states, begin, stop, signals, np.array(limits))

    def _last(self, runs: Runs | None, k: int, name: str) -> float:
        """An output of the machine at the end of a run."""
        assert runs is not None
        return float(runs.rows[self.outputs.index(f"machine.{name}"), k, runs.count[k] - 1])

    def _event_runs(self, runs: Runs, stops: Any, before: Runs | None = None) -> Iterator[EventRun]:
        """The runs that should end at `stops` [s], behind the rows of those `before`."""
        for k, stop in enumerate(stops):
            ended = runs.end(k) < stop - 0.5 * self.rig.step
            yield EventRun(self._series(runs, k, before), ended, _fault(runs, k))

    def _series(self, runs: Runs, k: int, before: Runs | None = None) -> Dataset:
        """A run over its time, with the rows of the one `before`."""
        import xarray as xr

        table = np.concatenate([*([_rows(before, k)[:, :-1]] if before else []), _rows(runs, k)], axis=1)
        # without an index, which would take as long as a tenth of the run
        time = xr.Coordinates({"time": ("time", table[0])}, indexes={})
        return xr.Dataset(
            {name: ("time", row) for name, row in zip(self.outputs, table[1:], strict=True)}, time
        )

    # -- from rest

    def _started(self, points: Sequence[RunPoint]) -> Runs:
        """The start from rest until running should be steady. A machine that starts empty settles twice: at its
        speed, and once the feed has come."""
        signals, states, stops = [], [], []
        for point in points:
            operation = point.rig.operation
            fed_from = operation.steady_begin if operation.empty_start else None
            profiles = replace(point.rig, fed_from=fed_from).signals(ramp=True)
            # the rate of the speed reference, for a feed-forward, is no profile that the loop evaluates
            evaluated = {full: x if is_evaluated(x) else 0.0 for full, x in profiles.items()}
            signals.append(evaluated)
            inputs = self._inputs | {full: at_time(x, 0.0) for full, x in evaluated.items()}
            states.append(self.system.start(inputs, {name: point.values[name] for name in self._varying}))
            turns = operation.run.settle_turns * (2.0 if operation.empty_start else 1.0)
            stops.append(operation.ramp_end + turns * operation.turn)
        step = max(stops) / _ROWS_OF_START
        return self._run(points, np.array(states, float).T, 0.0, stops, signals, step=step)

    def _steadied(self, points: Sequence[RunPoint]) -> tuple[Any, list[RunFault | None], dict[int, Dataset]]:
        """The states in steady running, shape (states, points), the faults of the points, and the run of the last
        turns of each point by its place."""
        start = self._started(points)
        states, faults = start.states, [_fault(start, k) for k in range(len(points))]
        last_turns: dict[int, Dataset] = {}
        waits = {
            k: _Wait(start.end(k), (point.rig.operation.run.turns + 0.1) * point.rig.operation.turn)
            for k, point in enumerate(points)
            if faults[k] is None
        }
        while waits:
            waiting = list(waits)
            stops = [waits[k].piece for k in waiting]
            runs = self._run([points[k] for k in waiting], states[:, waiting], 0.0, stops)
            states[:, waiting] = runs.states
            for place, k in enumerate(waiting):
                faults[k], last_turns[k] = _fault(runs, place), self._series(runs, place)
                if faults[k] is not None or _settles(points[k], last_turns[k]):
                    del waits[k]
                elif not waits[k].goes_on(points[k].rig, last_turns[k]):
                    faults[k] = RunFault(Cause.UNSETTLED)
                    del waits[k]
        return states, faults, last_turns

    def _waits(self, points: Sequence[RunPoint], states: Any, steady: Sequence[Dataset]) -> list[float]:
        """Time to the event of each point [s]: the points are followed from these `states`, at the ends of their
        `steady` runs, until their cranks pass the angles of their events."""
        targets, longest, ends = [], [], []
        for point, run in zip(points, steady, strict=True):
            drive, turns = point.rig.drive, _turns(point, run)
            angle = float(crank_angle(drive, run)[-1])
            targets.append(angle_of_begin(point.event, angle))
            speed = mean(turns, crank_speed(drive, turns))
            longest.append(longest_lead(point.rig, targets[-1] - angle, speed))
            ends.append([math.inf, targets[-1] * drive.crank_output("phi")[1]])
        runs = self._run(points, states, 0.0, longest, limits=np.array(ends).T)
        times = [time_at(p.rig.drive, self._series(runs, k), targets[k]) for k, p in enumerate(points)]
        return [limit if time is None else time for time, limit in zip(times, longest, strict=True)]


def _rows(runs: Runs, k: int) -> Any:
    """Time and outputs of a run, shape (1 + outputs, rows)."""
    n = int(runs.count[k])
    return np.concatenate([runs.times[k : k + 1, :n], runs.rows[:, k, :n]])


def _fault(runs: Runs, k: int) -> RunFault | None:
    return RunFault(Cause.LEFT_BOUNDS, runs.end(k)) if runs.failed[k] else None


def _turns(point: RunPoint, run: Dataset) -> Dataset:
    """The whole turns of a point in steady running."""
    return whole_turns(point.rig.drive, run, point.rig.operation.run.turns)


def _settles(point: RunPoint, run: Dataset) -> bool:
    """Whether a point is in steady running; a crank that makes no whole turn is not: it may creep up to a load, and
    turn on once it is past it."""
    drive = point.rig.drive
    has_turns = has_turn(drive, run) or drive.simulated_machine.model.never_repeats
    return bool(has_turns) and is_settled(drive, _turns(point, run))


class EventSimulation:
    """The co-simulation of a `rig` from rest to its steady state at the time `start` [s], from which runs branch.

    Raises
    ------
    RunError
        where an FMU fails before that time.
    """

    def __init__(self, rig: Rig, start: float) -> None:
        self.rig, self._start = rig, start
        self._simulation = rig.from_rest()
        try:
            self._simulation.run(start, rig.step)
            self._simulation.save()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Free the FMUs."""
        self._simulation.close()

    def runs(self, points: Sequence[RunPoint]) -> Iterator[EventRun]:
        """The runs of the points, in order."""
        shaft = self.rig.drive.motor_torque
        for point in points:
            begin = self._start + point.lead
            stop = begin + point.duration
            guards = {shaft: point.limit} if math.isfinite(point.limit) else None
            try:
                run = follow(self.rig, self._simulation, point.event, begin, stop, guards=guards).run
            except InterruptedRunError:
                raise
            except RunError as error:
                # the next run starts from the saved state again
                yield EventRun(fault=RunFault(Cause.STOPPED, said=str(error) or type(error).__name__))
                continue
            yield EventRun(run, self._simulation.time < stop - 0.5 * self.rig.step)
