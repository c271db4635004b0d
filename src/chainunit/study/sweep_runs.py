"""Transients of a sweep, in blocks on the compiled system: each point starts its own drive from rest, runs it until
it is steady, and then meets the event.

A point depends on its own values alone, whatever the others of its block are.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr

from ..batch.transients import Runs, Transients, signal_table
from ..core.errors import Faults, InputError
from ..core.native.compilers import compiler
from ..core.quantities import Layout
from ..system import Profile
from ..system.compiled_simulation import LONGEST, CompiledSystem
from .cycle import no_feed
from .drive import Drive
from .event import Event, angle_of_begin
from .event_block import kept_outputs
from .measures import read_measure
from .rig import FEED_RISE, PATIENCE, Rig
from .sweep_plan import SweepPlan
from .sweep_table import SPEED
from .window import Phase, Trip, Window, is_settled, time_at, whole_turns

REASONS_OF_RUNS = (
    "the states of the drive left all bounds",
    f"the motor does not settle in {PATIENCE:g} turns of the crank",
)
"""The reasons for which a run has no measures; their codes count from 1."""
_LEFT_BOUNDS, _UNSETTLED = 1, 2
_RATIO = "machine.ratio"
_ROWS_OF_START = 16
"""Rows of the start of a run, which no measure reads."""


@dataclass(frozen=True)
class _PointRun:
    """A point: its crank speed [rad/s], its event, and the rig with its feed and drive."""

    speed: float
    event: Event
    rig: Rig

    @property
    def drive(self) -> Drive:
        """Its drive."""
        return self.rig.drive

    @property
    def loads(self) -> dict[str, Any]:
        """Its loads in normal running, by full name."""
        return self.drive.loads(self.rig.config.feed)

    @property
    def turn(self) -> float:
        """Time of a turn [s]."""
        return 2.0 * math.pi / self.speed


def check_drive(rig: Rig, plan: SweepPlan) -> None:
    """Refuse what the transients of a drive cannot have.

    Raises
    ------
    InputError
        for an event that the drive cannot have, for a swept quantity that changes no run or is not one number of the
        drive, and where there is no C compiler.
    """
    event, faults = rig.config.events[plan.event], Faults()
    if not rig.takes(event):
        faults.add([InputError(f"sweep.event = {plan.event}: {event.without}", "sweep.event")])
    known = rig.drive.load_model()[0].parameter_layout.names
    for name in (each.name for each in plan.parameters):
        words = ""
        if name == SPEED and not rig.drive.follows:
            words = "changes no run, as the motor has the speed of its supply"
        elif name.startswith("machine.") and name.partition(".")[2] not in known:
            words = "is not of the drive"
        elif name == _RATIO and (rig.drive.line is not None or rig.drive.gear != 1.0):
            words = "is not one number of the drive"
        if words:
            line = f"sweep.parameter: {name} {words}; leave it out, or sweep it without measures"
            faults.add([InputError(line, "sweep.parameter")])
    if compiler() is None:
        faults.add(
            [
                InputError(
                    "sweep.measures: need a C compiler, and there is none; leave them out", "sweep.measures"
                )
            ]
        )
    faults.refuse()


class SweepBlock:
    """The compiled system of a rig whose values a sweep varies; see `check_drive`."""

    def __init__(self, rig: Rig, plan: SweepPlan) -> None:
        self._rig, self._plan = rig, plan
        self.system = CompiledSystem(rig.graph)
        layout = self.system.model.parameter_layout
        self._inputs = self.system.inputs | rig.drive.loads(rig.config.feed)
        # the machine of the feed-forward has the same parameters
        self._varying = {
            full: each.name
            for each in plan.parameters
            for part in ("machine", "model")
            if each.name.startswith("machine.")
            and (full := f"{part}.{each.name.partition('.')[2]}") in layout.names
        }

    @cached_property
    def outputs(self) -> list[str]:
        """The outputs and states that the measures read."""
        return kept_outputs(self._rig, self.system, self._event.reads)

    @property
    def _event(self) -> Event:
        return self._rig.config.events[self._plan.event]

    @cached_property
    def _driven(self) -> list[str]:
        """The inputs that differ between points, or over time."""
        unknown: Mapping[str, float] = defaultdict(float)
        of_event = self._rig.event_signals(self._event, 0.0, unknown)
        reference = self._rig.drive.reference(self._rig.config.run.crank_speed)
        return [*dict.fromkeys([*self._rig.drive.loads(self._rig.config.feed), *of_event, *reference])]

    @cached_property
    def _changes(self) -> int:
        unknown: Mapping[str, float] = defaultdict(float)
        of_event = self._rig.event_signals(self._event, 0.0, unknown).values()
        return max(1, *(len(getattr(signal, "changes", ())) for signal in of_event))

    @cached_property
    def _loop(self) -> Transients:
        return Transients(
            self.system.model,
            self.outputs,
            varying=list(self._varying),
            driven=self._driven,
            guarded=[self._rig.drive.motor_torque, self._rig.drive.crank_angle[0]],
            changes=self._changes,
        )

    def measures(self, values: Mapping[str, Any], threads: int = 1) -> tuple[dict[str, Any], Any]:
        """The measures of the plan by name, and the codes of `REASONS_OF_RUNS`, 0 for none, of points with these
        values by full name, each of shape (points,)."""
        count = len(next(iter(values.values())))
        points = [self._point({name: float(x[k]) for name, x in values.items()}) for k in range(count)]
        given = np.array([values[name] for name in self._varying.values()]).reshape(len(self._varying), count)
        work = _BlockWork(self, points, given, threads)
        states, codes, steady = work.steady()
        results = {name: np.full(count, np.nan) for name in self._plan.measures}
        good = np.flatnonzero(codes == 0)
        if len(good):
            windows = work.only(good).windows(states[:, good], [steady[k] for k in good])
            for k, window in zip(good, windows, strict=True):
                if window is None:
                    codes[k] = _LEFT_BOUNDS
                    continue
                for name in self._plan.measures:
                    value = read_measure(name, window)
                    results[name][k] = np.nan if value is None else value
        return results, codes

    def _point(self, values: Mapping[str, float]) -> _PointRun:
        rig, event = self._rig, self._event
        feed = {name.removeprefix("feed."): x for name, x in values.items() if name.startswith("feed.")}
        begin = f"event.{event.name}."
        own = {name.removeprefix(begin): x for name, x in values.items() if name.startswith(begin)}
        if _RATIO in values:
            machine = rig.drive.machine.replace(ratio=values[_RATIO])
            rig = replace(rig, drive=replace(rig.drive, machine=machine))
        if feed:
            whole = Layout(type(rig.config.feed)).from_names(feed, rig.config.feed)
            rig = replace(rig, config=replace(rig.config, feed=whole))
        speed = values.get(SPEED, float(rig.config.run.crank_speed))
        return _PointRun(speed, replace(event, p=replace(event.p, **own)), rig)


class _BlockWork:
    """Points of a block in work."""

    def __init__(self, block: SweepBlock, points: Sequence[_PointRun], given: Any, threads: int) -> None:
        self._block, self._points, self._given, self._threads = block, points, given, threads
        self._rig = block._rig
        self._step = self._rig.step

    def only(self, places: Any) -> _BlockWork:
        """Some of the points."""
        return _BlockWork(
            self._block, [self._points[k] for k in places], self._given[:, places], self._threads
        )

    def _run(
        self, states: Any, signals: Sequence[Mapping[str, Any]], stop: Any, step: float, limits: Any = None
    ) -> Runs:
        block = self._block
        table = signal_table(block._driven, signals, block._inputs, block._changes)
        return block._loop.run(
            block.system.p,
            block._inputs,
            states,
            begin=0.0,
            step=step,
            stop=np.asarray(stop, float),
            varying=self._given,
            signals=table,
            limits=limits,
            longest=LONGEST * self._step,
            workers=self._threads,
        )

    def _constant(self, point: _PointRun) -> dict[str, Any]:
        """The signals of a point in steady running."""
        return {**point.loads, **point.drive.reference(point.speed)}

    def _from_rest(self) -> Any:
        """The states at rest, shape (states, points)."""
        block, columns = self._block, []
        for k, point in enumerate(self._points):
            own = dict(zip(block._varying, map(float, self._given[:, k]), strict=True))
            still = dict.fromkeys(point.drive.reference(1.0), 0.0)
            columns.append(block.system.start(block._inputs | self._constant(point) | still, own))
        return np.array(columns, float).T

    def _started(self) -> Runs:
        """The start from rest until running should be steady."""
        config, rest = self._rig.config, self._from_rest()
        ramp, settle = config.run.ramp, config.run.settle_turns
        signals, stops, lasts = [], [], config.ramp_end
        for point in self._points:
            own = self._constant(point)
            for full, w in point.drive.reference(point.speed).items():
                own[full] = Profile(0.0, ((0.0, ramp, w),)) if w else 0.0
            if config.empty_start:
                empty = point.drive.loads(no_feed(config.feed))
                fed = lasts + settle * point.turn
                own |= {
                    full: Profile(empty[full], ((fed, FEED_RISE * point.turn, x),))
                    for full, x in point.loads.items()
                }
            signals.append(own)
            stops.append(lasts + settle * point.turn * (2.0 if config.empty_start else 1.0))
        return self._run(rest, signals, stops, max(stops) / _ROWS_OF_START)

    def steady(self) -> tuple[Any, Any, list[xr.Dataset]]:
        """The states in steady running, shape (states, points), the codes of the reasons, and the run of the last
        turns of each point."""
        runs = self._started()
        states, codes = runs.states, np.where(runs.failed, _LEFT_BOUNDS, 0)
        steady: list[Any] = [None] * len(self._points)
        waiting = np.flatnonzero(codes == 0)
        for _ in range(int(PATIENCE)):
            if not len(waiting):
                break
            part = self.only(waiting)
            stops = [(self._rig.config.run.turns + 0.1) * point.turn for point in part._points]
            runs = part._run(states[:, waiting], [part._constant(p) for p in part._points], stops, self._step)
            states[:, waiting] = runs.states
            unsettled = []
            for k, place in enumerate(waiting):
                point, run = part._points[k], part._series(runs, k)
                if runs.failed[k]:
                    codes[place] = _LEFT_BOUNDS
                    continue
                steady[place] = run
                turns = whole_turns(point.drive, run, self._rig.config.run.turns)
                if self._rig.drive.chain is None and not is_settled(point.drive, turns):
                    unsettled.append(place)
            waiting = np.array(unsettled, int)
        codes[waiting] = _UNSETTLED
        return states, codes, steady

    def windows(self, states: Any, steady: Sequence[xr.Dataset]) -> list[Window | None]:
        """The runs with the event, each from its event on; None for one whose states left all bounds."""
        before = []
        for point, run in zip(self._points, steady, strict=True):
            turns = whole_turns(point.drive, run, self._rig.config.run.turns)
            before.append(Window(Phase.STEADY, turns, point.drive, (), point.speed))
        angles = [
            float(p.drive.crank_motion(run)[0][-1]) for p, run in zip(self._points, steady, strict=True)
        ]
        begins = self._begins(states, angles, [window.speed_mean for window in before])
        constant = [self._constant(point) for point in self._points]
        lead = self._run(states, constant, begins, self._step)
        signals, stops = [], []
        for k, point in enumerate(self._points):
            row = int(lead.count[k]) - 1
            read = {
                name: float(lead.rows[self._block.outputs.index(f"machine.{name}"), k, row])
                for name in point.event.reads
            }
            signals.append(self._constant(point) | point.rig.event_signals(point.event, 0.0, read))
            stops.append(point.event.follow(point.turn))
        limits = np.array([[self._limit(point), math.inf] for point in self._points]).T
        runs = self._run(lead.states, signals, stops, self._step, limits)
        windows: list[Window | None] = []
        for k, point in enumerate(self._points):
            if runs.failed[k] or lead.failed[k]:
                windows.append(None)
                continue
            end = runs.end(k)
            # the energy behind a coupling that opens is not followed
            trip = Trip(end, math.nan, None) if end < stops[k] - 0.5 * self._step else None
            run = self._series(runs, k)
            windows.append(Window(Phase.EVENT, run, point.drive, (), point.speed, 0.0, before[k], trip))
        return windows

    def _begins(self, states: Any, angles: Sequence[float], speeds: Sequence[float]) -> list[float]:
        """Time to the begin of the event of each point [s], from these `states` with its crank at the angle [rad] and
        the mean speed [rad/s]: the points are followed without the event until their cranks pass its angle."""
        targets = [
            angle_of_begin(point.event, angle) for point, angle in zip(self._points, angles, strict=True)
        ]
        limits = [
            point.rig.longest_lead(target - angle, speed)
            for point, target, angle, speed in zip(self._points, targets, angles, speeds, strict=True)
        ]
        ends = [[math.inf, a * p.drive.crank_angle[1]] for a, p in zip(targets, self._points, strict=True)]
        constant = [self._constant(point) for point in self._points]
        runs = self._run(states, constant, limits, self._step, np.array(ends).T)
        times = [
            time_at(point.drive, self._series(runs, k), targets[k]) for k, point in enumerate(self._points)
        ]
        return [limit if time is None else time for time, limit in zip(times, limits, strict=True)]

    def _limit(self, point: _PointRun) -> float:
        """The torque of the motor's shaft at which a safety coupling opens [N m]."""
        coupling = self._rig.config.coupling
        return math.inf if coupling is None else float(coupling.trip_torque / point.drive.ratio)

    def _series(self, runs: Runs, k: int) -> xr.Dataset:
        """A run as a dataset over its time."""
        n = int(runs.count[k])
        rows = {name: ("time", runs.rows[i, k, :n]) for i, name in enumerate(self._block.outputs)}
        return xr.Dataset(rows, {"time": runs.times[k, :n]})
