"""The drive of a study in its co-simulation: its signals, its simulations, and their energy balance."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any

from ..core.errors import refusal_prefix
from ..system import (
    CompiledSimulation,
    CoSimulation,
    ModelExchange,
    Profile,
    Simulation,
    System,
    certify,
    without,
)
from .arrays import Dataset
from .cycle import no_feed
from .drive import Drive
from .drive_fmus import with_files
from .event import Event, OverTime, Signals, Values
from .operation import OperatingConditions
from .readings import machine_series

FEED_RISE = 0.1
"""Share of a turn in which the feed comes to a machine that starts empty."""


@dataclass(frozen=True)
class Rig:
    """A drive as the FMUs of `files` in its `operation`; or, with a `twin`, the drive
    whose system that function has changed, so that a part is left out."""

    operation: OperatingConditions
    drive: Drive
    files: Mapping[str, Path] | None
    """by component; None for the compiled system, which needs no FMUs"""
    twin: Callable[[System], System] | None = None
    fed_from: float | None = None
    """time at which the feed came to a machine that starts empty [s], once it is known"""

    @property
    def step(self) -> float:
        """Communication step [s]."""
        return float(self.operation.run.step)

    def _twin(self, system: System) -> System:
        return system if self.twin is None else self.twin(system)

    @property
    def system(self) -> System:
        """The FMUs and their connections."""
        return self.graph if self.files is None else self._twin(with_files(self.drive, self.files))

    @cached_property
    def graph(self) -> System:
        """The models and their connections."""
        return self._twin(self.drive.graph)

    @property
    def plain(self) -> Rig:
        """The same rig without feed-forward, and without an observer."""
        beside = [name for name in ("model", "observer") if name in self.graph.components]
        return replace(self, twin=partial(without, names=beside))

    @property
    def guards(self) -> dict[str, float]:
        """The variable on the motor's shaft at which a torque limiter opens, with its limit."""
        coupling = self.operation.coupling
        return {self.drive.motor_torque: self.drive.at_port(coupling.trip_torque)} if coupling else {}

    @cached_property
    def inputs(self) -> dict[str, tuple[str, float]]:
        """By input that an event may act on, its full name and its value in normal running."""
        inputs = {
            c.name: (f"{name}.{c.name}", c.start)
            for name in ("motor", "machine")
            for c in self.graph.components[name].connectors.values()
            if c.causality == "input"
        }
        for full, value in self.drive.loads(self.operation.feed).items():
            instance, _, name = full.partition(".")
            if instance == "machine":
                inputs[name] = full, value
        return inputs

    def takes(self, event: Event) -> bool:
        """Whether the drive has the inputs that the event acts on, and the supply that it needs."""
        if event.on_line and self.drive.follows:
            return False
        machine = self.graph.components["machine"].connectors
        return set(event.inputs) <= set(self.inputs) and set(event.reads) <= set(machine)

    def gives(self, full: str) -> bool:
        """Whether the drive has an output of that full name."""
        name, _, variable = full.partition(".")
        connector = self.graph.components[name].connectors.get(variable)
        return connector is not None and connector.causality == "output"

    def event_signals(self, event: Event, begin: float, state: Values) -> Signals:
        """The signals of the event, by full name, if it begins at `begin` [s] with the outputs `state`."""
        normal = {name: value for name, (_, value) in self.inputs.items()}
        signals = event.signals(normal, begin, state)
        return {self.inputs[name][0]: signal for name, signal in signals.items()}

    def signals(self, changes: Mapping[str, OverTime] | None = None, *, ramp: bool = False) -> Signals:
        """Loads of normal running, or the `changes` in their place, and the speed reference, with `ramp` from
        rest, where a starter switches the motor."""
        run = self.operation.run
        loads = self.drive.loads(self.operation.feed)
        if ramp and self.operation.empty_start:
            empty = self.drive.loads(no_feed(self.operation.feed))
            loads = {full: self._coming(empty[full], value) for full, value in loads.items()}
        signals = {
            **loads,
            **(self.drive.star.signals() if ramp else {}),
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
        return Profile(empty, ((self.fed_from, FEED_RISE * self.operation.turn, value),))

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
        if self.operation.simulation == "cs":
            return CoSimulation(system, signals, begin)
        with refusal_prefix('simulation = "me": '):
            return ModelExchange(system, signals, begin)

    def residuals(self, run: Dataset, lead: Dataset | None = None) -> dict[str, float]:
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

    def _held(self, per_unit: Callable[[Mapping[str, Any]], Any], run: Dataset) -> Any:
        return per_unit(machine_series(run))


_SHARE = "energy_residual_share"


def worst_residual(shares: Mapping[str, float]) -> float:
    """The largest of a run's energy residuals over the energy moved; `shares` are its certificates by
    name."""
    return max(share for name, share in shares.items() if name.endswith(_SHARE))


def join(pieces: list[Dataset]) -> Dataset:
    """One run from pieces that follow each other; at an instant that two pieces share, the later piece
    counts."""
    import xarray as xr

    parts = [piece.isel(time=slice(None, -1)) for piece in pieces[:-1]]
    return xr.concat([*parts, pieces[-1]], "time", data_vars="all") if parts else pieces[-1]
