"""The start of a drive until it runs steadily."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..system import Simulation
from ..work.progress import Progress
from .arrays import Dataset
from .measures import STARTED
from .readings import crank_motion, only_whole_turns, turns_made
from .rig import Rig, join
from .window import Phase, Window, is_settled, whole_turns

_LONGEST_START = 30.0
"""Time after the ramp at which an empty machine is fed, unless it would reach its speed in `LONGEST_RISE` [s]."""
LONGEST_RISE = 600.0
"""Time after the ramp at which an empty machine is fed, however slowly it turns, and for which a machine may speed
up [s]."""
RISES = 1e-4
"""Relative change of the speed over a turn from which the machine counts as one that speeds up."""
PATIENCE = 20.0
"""Number of turns, at the requested speed, for which a study runs on until the motor has settled and made its
turns; for a fast machine at least the time `_SETTLES`, and after a long start twice as long as it took."""
_PIECE = 0.1
"""Part of the time since rest that a machine which still speeds up is run on."""
_SETTLES = 5.0
"""Time in which every drive settles, whatever the speed of its crank [s]."""


@dataclass(frozen=True)
class StartUp:
    """Start-up and steady running: the run, the time from which it is steady and the time to which it should
    have run [s], and the `rig` with which the study goes on."""

    run: Dataset
    steady_from: float
    stop: float
    rig: Rig

    @cached_property
    def turns(self) -> Dataset:
        """The turns of steady running that are evaluated, see `whole_turns`."""
        run = self.run.sel(time=slice(self.steady_from, None))
        return whole_turns(self.rig.drive, run, self.rig.operation.run.turns)

    @property
    def windows(self) -> tuple[Window, Window]:
        """The windows of steady running, in whole turns, and of the start before them."""
        drive, operation, turns = self.rig.drive, self.rig.operation, self.turns
        sides = drive.machine.loaded_sides(operation.feed)
        steady = Window(Phase.STEADY, turns, drive, sides, operation.crank_speed)
        before = self.run.sel(time=slice(None, float(turns["time"][0])))
        return steady, replace(steady, phase=Phase.START_UP, run=before, steady=steady)


def _start_empty(
    rig: Rig, simulation: Simulation, progress: Progress, guards: Mapping[str, float]
) -> tuple[Dataset, Rig]:
    """The start of an empty machine, until its crank turns at the share `STARTED` of its speed, until a guard ends
    it, or until it is clear that the machine speeds up too slowly; and the rig that is fed from then on."""
    # behind a shaft line the crank is not where the motor is
    name, ratio = rig.drive.crank_output("w")
    goal = STARTED * rig.operation.crank_speed * ratio
    speed_limit = {**guards, name: goal}
    longest, piece = rig.operation.ramp_end + LONGEST_RISE, max(rig.operation.turn, 1.0)
    stop = rig.operation.ramp_end + _LONGEST_START
    run = simulation.run(stop, rig.step, progress, guards=speed_limit)
    while stop - 0.5 * rig.step <= simulation.time < longest:
        speed = float(run[name][-1])
        acceleration = (speed - float(run[name].sel(time=stop - piece, method="nearest"))) / piece
        if goal - speed > acceleration * (longest - stop):
            break
        stop = min(stop + piece, longest)
        run = join([run, simulation.run(stop, rig.step, progress, guards=speed_limit)])
    if simulation.time < rig.drive.star.end and abs(float(run[name][-1])) >= (1.0 - 1e-9) * goal:
        # in star the motor is too weak for the feed
        run = join([run, simulation.run(rig.drive.star.end, rig.step, progress, guards=guards)])
    rig = replace(rig, fed_from=simulation.time)
    simulation.signals = rig.signals(ramp=True)
    return run, rig


def start_up(rig: Rig, simulation: Simulation, progress: Progress, guards: Mapping[str, float]) -> StartUp:
    """Start-up and steady running to the planned end, which counts from the feed on if the machine starts empty.

    It runs longer while the machine still speeds up, or while turns are missing (see `_missing`) and the patience
    lasts. A run in which an output reaches its limit in `guards` ends there.
    """
    operation, pieces = rig.operation, list[Dataset]()
    steady_from, stop = operation.steady_begin, operation.stop
    if operation.empty_start:
        run, rig = _start_empty(rig, simulation, progress, guards)
        pieces = [run]
        # a motor that follows a ramp is not steady before its end
        feed_time = max(simulation.time, operation.ramp_end) if rig.drive.follows else simulation.time
        delay = feed_time - operation.ramp_end
        stop, steady_from = stop + delay, steady_from + delay
        if any(abs(float(run[name][-1])) >= limit for name, limit in guards.items()):
            return StartUp(run, steady_from, stop, rig)
    patience = max(PATIENCE * operation.turn, _SETTLES)
    longest = stop + patience
    run = join([*pieces, simulation.run(stop, rig.step, progress, guards=guards)])
    # a run that ends before `stop` was ended by a guard
    while stop - 0.5 * rig.step <= simulation.time < longest:
        missing_turns, settled_from = _missing(rig, run, steady_from)
        if missing_turns is None:
            break
        if speeds_up(rig, run):
            # its turns cannot close yet
            steady_from, stop = simulation.time, stop + max(operation.turn, _PIECE * stop)
            longest = stop + max(patience, 2.0 * simulation.time)
        else:
            # the time at the requested speed; if the crank turns slower, the next round finds what is still missing
            steady_from = settled_from
            stop = min(longest, stop + max(missing_turns * operation.turn, rig.step))
        run = join([run, simulation.run(stop, rig.step, progress, guards=guards)])
    return StartUp(run, steady_from, stop, rig)


def speeds_up(rig: Rig, run: Dataset, before: float = 0.0) -> bool:
    """Whether the start has not ended with the last turn of a run, and ends by the rise of its speed over this turn
    within `LONGEST_RISE` after the ramp. `before` is the time from rest to the zero of the run's own time [s]."""
    angle, speed = crank_motion(rig.drive, run)
    time, since = run["time"].values, angle[-1] - 2.0 * math.pi
    if angle[0] > since:
        return False
    # the crank may swing back at rest
    turned = np.maximum.accumulate(angle)
    begin, slower = (float(np.interp(since, turned, x)) for x in (time, speed))
    span = float(time[-1]) - begin
    rise, mean = float(speed[-1]) - slower, 2.0 * math.pi / span
    lack = STARTED * rig.operation.crank_speed - mean
    remaining = rig.operation.ramp_end + LONGEST_RISE - before - float(time[-1])
    return lack > 0.0 and rise > RISES * mean and lack * span <= rise * remaining


def until_settled(rig: Rig, simulation: Simulation, stop: float, length: float, late: float) -> list[Dataset]:
    """Runs of a turning drive, the first to the time `stop` [s], each further one of the `length` [turns], until the
    whole turns of a run close, it makes none, or `PATIENCE` has passed; a start that has not ended is awaited up to
    the time `late` [s]."""
    turn, drive = rig.operation.turn, rig.drive
    runs = [simulation.run(stop, rig.step)]
    longest = stop + PATIENCE * turn
    while simulation.time < longest:
        turns = only_whole_turns(drive, runs[-1])
        if turns is None or is_settled(drive, turns):
            break
        if speeds_up(rig, runs[-1]):
            if simulation.time > late:
                break
            longest = simulation.time + max(PATIENCE * turn, 2.0 * simulation.time)
        runs.append(simulation.run(simulation.time + length * turn, rig.step))
    return runs


def _missing(rig: Rig, run: Dataset, steady_from: float) -> tuple[float | None, float]:
    """The number of turns that are still missing for the evaluation, as the crank turns too slowly or the motor
    has not settled, or None where none is missing; and the time from which running is steady [s], a turn later
    if the motor has not settled."""
    turns_asked = rig.operation.run.turns
    since = run.sel(time=slice(steady_from, None))
    turns = only_whole_turns(rig.drive, since, turns_asked)
    if turns is not None and turns_made(rig.drive, turns) > turns_asked - 0.5:
        if is_settled(rig.drive, turns):
            return None, steady_from
        # as if one turn more had been waited for
        steady_from = float(whole_turns(rig.drive, since, 1)["time"][-1])
        since = run.sel(time=slice(steady_from, None))
    return turns_asked + 0.1 - turns_made(rig.drive, since), steady_from
