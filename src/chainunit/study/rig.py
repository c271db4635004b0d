"""The drive of a study in its co-simulation: the start, the runs through events, and the machine behind an
open coupling."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from ..core.errors import refusal_prefix
from ..system import (
    CompiledSimulation,
    CoSimulation,
    Jump,
    ModelComponent,
    ModelExchange,
    Profile,
    Simulation,
    System,
    certify,
    monolithic,
    rigid,
    without,
)
from ..work.progress import Progress
from .config import Config
from .cycle import no_feed
from .drive import Drive
from .event import Event, OverTime, Signals, Values, angle_of_begin
from .measures import STARTED
from .window import is_settled, time_at, whole_turns

_LONGEST_START = 30.0
"""Time after the ramp at which an empty machine is fed, unless it would reach its speed in `_LONGEST_RISE`
[s]."""
_LONGEST_RISE = 600.0
"""Time after the ramp at which an empty machine is fed, however slowly it turns [s]."""
FEED_RISE = 0.1
"""Share of a turn in which the feed comes to a machine that starts empty."""
PATIENCE = 20.0
"""Number of turns, at the requested speed, for which a study runs on until the motor has settled and made its
turns; for a fast machine at least the time `_SETTLES`."""
_UNEVEN = 2.0
"""Ratio of the time that a crank takes to an angle over the time at its mean speed, up to which an event waits."""
_SETTLES = 5.0
"""Time in which every drive settles, whatever the speed of its crank [s]."""


@dataclass(frozen=True)
class Transient:
    """A run with an event that began at `begin` [s]. `signals` are its signals from there on. `jumps` are
    those among them that the event sets to a number at its begin; `lead` is then the run up to the begin."""

    event: Event
    begin: float
    run: xr.Dataset
    signals: Signals
    jumps: dict[str, Jump]
    lead: xr.Dataset | None = None


@dataclass(frozen=True)
class StartUp:
    """Start-up and steady running: the run, the time from which it is steady and the time to which it should
    have run [s], and the `rig` with which the study goes on."""

    run: xr.Dataset
    steady_from: float
    stop: float
    rig: Rig


@dataclass(frozen=True)
class Rig:
    """A drive as the FMUs of `files`, with the loads and the speed of the study; or, with a `twin`, the drive
    whose system that function has changed, so that a part is left out."""

    config: Config
    drive: Drive
    files: Mapping[str, Path] | None
    """by component; None for the compiled system, which needs no FMUs"""
    twin: Callable[[System], System] | None = None
    fed_from: float | None = None
    """time at which the feed came to a machine that starts empty [s], once it is known"""

    @property
    def step(self) -> float:
        """Communication step [s]."""
        return float(self.config.run.step)

    def _twin(self, system: System) -> System:
        return system if self.twin is None else self.twin(system)

    @property
    def system(self) -> System:
        """The FMUs and their connections."""
        return self.graph if self.files is None else self._twin(self.drive.system(self.files))

    @cached_property
    def graph(self) -> System:
        """The models and their connections."""
        return self._twin(self.drive.graph)

    @property
    def rigid(self) -> Rig:
        """The same rig without the elasticity and unevenness of the driveline."""
        return replace(self, twin=partial(rigid, line="driveline"))

    @property
    def plain(self) -> Rig:
        """The same rig without feed-forward, and without an observer."""
        beside = [name for name in ("model", "observer") if name in self.graph.components]
        return replace(self, twin=partial(without, names=beside))

    @property
    def guards(self) -> dict[str, float]:
        """The variable on the motor's shaft at which a safety coupling opens, with its limit."""
        coupling = self.config.coupling
        return {self.drive.motor_torque: coupling.trip_torque / self.drive.ratio} if coupling else {}

    @cached_property
    def _inputs(self) -> dict[str, tuple[str, float]]:
        """By input that an event may act on, its full name and its value in normal running."""
        inputs = {
            c.name: (f"{name}.{c.name}", c.start)
            for name in ("motor", "machine")
            for c in self.graph.components[name].connectors.values()
            if c.causality == "input"
        }
        for full, value in self.drive.loads(self.config.feed).items():
            instance, _, name = full.partition(".")
            if instance == "machine":
                inputs[name] = full, value
        return inputs

    def takes(self, event: Event) -> bool:
        """Whether the drive has the inputs that the event acts on."""
        machine = self.graph.components["machine"].connectors
        return set(event.inputs(event.side)) <= set(self._inputs) and set(event.reads) <= set(machine)

    def event_signals(self, event: Event, begin: float, state: Values) -> Signals:
        """The signals of the event, by full name, if it begins at `begin` [s] with the outputs `state`."""
        normal = {name: value for name, (_, value) in self._inputs.items()}
        signals = event.signals(normal, begin, state)
        return {self._inputs[name][0]: signal for name, signal in signals.items()}

    def signals(self, changes: Mapping[str, OverTime] | None = None, *, ramp: bool = False) -> Signals:
        """Loads of normal running, or the `changes` in their place, and the speed reference, with `ramp` from
        rest."""
        run = self.config.run
        loads = self.drive.loads(self.config.feed)
        if ramp and self.config.empty_start:
            empty = self.drive.loads(no_feed(self.config.feed))
            loads = {full: self._coming(empty[full], value) for full, value in loads.items()}
        signals = {
            **loads,
            **(changes or {}),
            **self.drive.reference(run.crank_speed, run.ramp if ramp else None),
        }
        # a twin lacks the inputs of the part that is left out
        return {full: x for full, x in signals.items() if full.partition(".")[0] in self.graph.components}

    @cached_property
    def normal(self) -> dict[str, float]:
        """The inputs in steady running without an event, by full name."""
        signals: dict[str, Any] = self.signals()
        return {full: float(value) for full, value in signals.items()}

    def _coming(self, empty: float, value: float) -> OverTime:
        """A load of a machine that starts empty, over time."""
        if self.fed_from is None:
            return empty
        return Profile(empty, ((self.fed_from, FEED_RISE * self.config.turn, value),))

    def from_rest(self, event: Event | None = None) -> Simulation:
        """The simulation from rest on, with the `event` of a start, if one is given."""
        changes = self.event_signals(event, 0.0, {}) if event else {}
        return self.simulation(self.system, self.signals(changes, ramp=True))

    def simulation(self, system: System, signals: Mapping[str, Any], begin: float = 0.0) -> Simulation:
        """The simulation of a system by the method of the study.

        Raises
        ------
        InputError
            for an FMU without Model Exchange, if the study uses Model Exchange.
        """
        if self.files is None:
            return CompiledSimulation(system, signals, begin)
        if self.config.simulation == "cs":
            return CoSimulation(system, signals, begin)
        with refusal_prefix('simulation = "me": '):
            return ModelExchange(system, signals, begin)

    def leads(
        self, simulation: Simulation, events: Sequence[Event], angle: float, speed: float
    ) -> list[float]:
        """Time from the saved state to the begin of each event [s]: the machine is followed without an event until
        its crank, now at the `angle` [rad] with the mean `speed` [rad/s], passes their angles."""
        if not events:
            return []
        simulation.restore()
        simulation.signals = self.signals()
        begin, (name, ratio) = simulation.time, self.drive.crank_angle
        targets = [angle_of_begin(event, angle) for event in events]
        limits = [self.longest_lead(target - angle, speed) for target in targets]
        run = simulation.run(begin + max(limits), self.step, guards={name: max(targets) * ratio})
        times = (time_at(self.drive, run, target) for target in targets)
        return [limit if time is None else time - begin for time, limit in zip(times, limits, strict=True)]

    def longest_lead(self, ahead: float, speed: float) -> float:
        """Time in which a crank of the mean `speed` [rad/s] passes the angle `ahead` [rad], however uneven its turn
        is [s]. An event does not wait longer, as the crank may hardly turn."""
        return float(_UNEVEN * ahead / max(speed, 0.5 * self.config.run.crank_speed))

    def start_empty(
        self, simulation: Simulation, progress: Progress, guards: Mapping[str, float]
    ) -> tuple[xr.Dataset, Rig]:
        """The start of an empty machine, until its crank turns at the share `STARTED` of its speed, until a
        guard ends it, or until it is clear that the machine speeds up too slowly; and the rig that is fed
        from then on."""
        # behind a shaft line the crank is not where the motor is
        name, ratio = self.drive.crank_speed
        goal = STARTED * self.config.run.crank_speed * ratio
        speed_limit = {**guards, name: goal}
        longest, piece = self.config.ramp_end + _LONGEST_RISE, max(self.config.turn, 1.0)
        stop = self.config.ramp_end + _LONGEST_START
        run = simulation.run(stop, self.step, progress, guards=speed_limit)
        while stop - 0.5 * self.step <= simulation.time < longest:
            speed = float(run[name][-1])
            before = float(run[name].sel(time=stop - piece, method="nearest"))
            if goal - speed > (speed - before) / piece * (longest - stop):
                break
            stop = min(stop + piece, longest)
            run = join([run, simulation.run(stop, self.step, progress, guards=speed_limit)])
        rig = replace(self, fed_from=simulation.time)
        simulation.signals = rig.signals(ramp=True)
        return run, rig

    def start_up(
        self, simulation: Simulation, stop: float, progress: Progress, guards: Mapping[str, float]
    ) -> StartUp:
        """Start-up and steady running to the time `stop` [s], or longer, see `_missing`; a machine that
        starts empty runs so long after it is fed."""
        rig, pieces, steady_from = self, [], self.config.steady_begin
        if self.config.empty_start:
            run, rig = self.start_empty(simulation, progress, guards)
            pieces = [run]
            # a motor that follows a ramp is not steady before its end
            feed_time = max(simulation.time, self.config.ramp_end) if self.drive.follows else simulation.time
            later = feed_time - self.config.ramp_end
            stop, steady_from = stop + later, steady_from + later
            if any(abs(float(run[name][-1])) >= limit for name, limit in guards.items()):
                return StartUp(run, steady_from, stop, rig)
        longest = stop + max(PATIENCE * self.config.turn, _SETTLES)
        run = join([*pieces, simulation.run(stop, self.step, progress, guards=guards)])
        while stop - 0.5 * self.step <= simulation.time < longest:
            lack, steady_from = self._missing(run, steady_from)
            if lack is None:
                break
            # at most at the requested speed; the next round finds the turns that are still missing then
            stop = min(longest, stop + max(lack * self.config.turn, self.step))
            run = join([run, simulation.run(stop, self.step, progress, guards=guards)])
        return StartUp(run, steady_from, stop, rig)

    def _missing(self, run: xr.Dataset, steady_from: float) -> tuple[float | None, float]:
        """The number of turns that are still missing for the evaluation, as the crank turns too slowly or the motor
        has not settled, or None where none is missing; and the time from which running is steady [s], a turn later
        if the motor has not settled."""
        turns_asked = self.config.run.turns
        since = run.sel(time=slice(steady_from, None))
        turns = self.drive.whole_turns(since, turns_asked)
        if turns is not None and self.drive.turns(turns) > turns_asked - 0.5:
            if is_settled(self.drive, turns):
                return None, steady_from
            # as if one turn more had been waited for
            steady_from = float(whole_turns(self.drive, since, 1)["time"][-1])
            since = run.sel(time=slice(steady_from, None))
        return turns_asked + 0.1 - self.drive.turns(since), steady_from

    def follow(
        self,
        simulation: Simulation,
        event: Event,
        begin: float,
        stop: float,
        progress: Progress | None = None,
        guards: Mapping[str, float] | None = None,
    ) -> Transient:
        """Run an event from the saved state to the time `stop` [s], or until a guard ends it."""
        simulation.restore()
        before: dict[str, float] = {}
        state: dict[str, float] = {}
        pieces = []
        if event.reads:
            before = dict(self._inputs[name] for name in event.inputs(event.side))
            simulation.signals = self.signals(before)
            pieces.append(simulation.run(begin, self.step, progress))
            state = {name: float(pieces[0][f"machine.{name}"][-1]) for name in event.reads}
        signals = self.event_signals(event, begin, state)
        simulation.signals = self.signals(signals)
        pieces.append(simulation.run(stop, self.step, progress, guards=guards))
        jumps = {
            full: Jump(begin, value, after)
            for full, value in before.items()
            if not isinstance(after := signals[full], Profile)
        }
        return Transient(event, begin, join(pieces), signals, jumps, pieces[0] if jumps else None)

    def coast(self, transient: Transient, run: xr.Dataset, stop: float, file: Path) -> xr.Dataset:
        """The run of the machine (FMU `file`) behind the coupling that opened at the end of `run`, with the
        same loads. It ends a second after the time `stop` [s] to which the motor would have been followed."""
        begin = float(run["time"][-1])
        model = self.drive.coasting_model
        start = model.start_from({k: float(x[-1]) for k, x in self.drive.machine_series(run).items()})
        p = model.parameter_layout.from_names(self.drive.coasting_parameters() | start)
        alone = System({"machine": ModelComponent(model, p, file)})
        loads = self.drive.loads(self.config.feed) | transient.signals
        loads = {full: x for full, x in loads.items() if full.startswith("machine.")}
        with self.simulation(alone, {**loads, "machine.tau": 0.0}, begin) as simulation:
            return simulation.run(max(stop, begin) + 1.0, self.step)

    def residuals(self, run: xr.Dataset, lead: xr.Dataset | None = None) -> dict[str, float]:
        """Write the energy residual of each shaft into the run; a shaft that does not drive the machine
        itself is named after the part that it drives. Returns each residual over the energy moved. For `lead`
        see `Transient`."""
        energy = self.drive.simulated_machine.stored_per_unit
        feed = {f"machine.{name}": partial(self._held, per_unit) for name, per_unit in energy.items()}
        shares = {}
        for part, (residual, share) in certify(run, self.graph, feed, lead).items():
            prefix = "" if part == "machine" else f"{part}_"
            run[f"{prefix}residual"] = residual
            shares[prefix + _SHARE] = share
        return shares

    def _held(self, per_unit: Callable[[Mapping[str, Any]], Any], run: xr.Dataset) -> Any:
        return per_unit(self.drive.machine_series(run))

    def compare(
        self, run: xr.Dataset, transient: Transient | None = None, start: Mapping[str, float] | None = None
    ) -> tuple[dict[str, float], dict[str, float]]:
        """Compare a run with the monolithic solution of the same signals, from the states `start` on or from
        rest. Returns the differences of torque and speed, relative to their peaks, and the states at the
        end."""
        profiles = transient.signals if transient else {}
        signals: dict[str, Any] = dict(self.signals(profiles, ramp=start is None))
        if transient:
            signals |= transient.jumps
        time = run["time"].values
        rows = np.unique(np.append(np.arange(0, len(time), 10), len(time) - 1))
        if transient and transient.jumps:
            # at the jump itself the torque has two values
            rows = rows[time[rows] != transient.begin]
        reference = monolithic(self.graph, signals, time[rows], start=start)
        differences = {}
        for of in ("machine.tau", "motor.w"):
            difference = np.abs(run[of].values[rows] - reference[of].values)
            differences[of + DIFFERENCE] = float(np.max(difference) / np.max(np.abs(reference[of].values)))
        return differences, {full: float(reference[full][-1]) for full in map(str, reference.data_vars)}

    def release(self, simulation: Simulation, run: xr.Dataset, time: float) -> tuple[xr.Dataset, float]:
        """A run that ended when the coupling opened, continued for the `time` [s] until no torque passes the
        coupling; and the energy that passes in that time [J]."""
        if time <= 0.0:
            return run, 0.0
        release = simulation.run(simulation.time + time, min(self.step, time))
        torque, speed = (release[name] for name in (self.drive.motor_torque, self.drive.motor_speed))
        energy = float(np.trapezoid(torque * speed, release["time"]))
        return join([run, release]), energy


_SHARE = "energy_residual_share"


def worst_residual(shares: Mapping[str, float]) -> float:
    """The largest of a run's energy residuals over the energy moved; `shares` are its certificates by
    name."""
    return max(share for name, share in shares.items() if name.endswith(_SHARE))


DIFFERENCE = "_difference_to_monolithic"
"""Suffix of the name of a variable for its largest difference to the monolithic solution, over its peak."""


def join(pieces: list[xr.Dataset]) -> xr.Dataset:
    """One run from pieces that follow each other; at an instant that two pieces share, the later piece
    counts."""
    parts = [piece.isel(time=slice(None, -1)) for piece in pieces[:-1]]
    return xr.concat([*parts, pieces[-1]], "time", data_vars="all") if parts else pieces[-1]
