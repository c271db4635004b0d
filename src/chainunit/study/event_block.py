"""Runs with events in blocks, on the compiled system: one native loop in place of the co-simulation of FMUs.

The co-simulation of separate FMUs remains the reference; both agree to the error of the coupling.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from operator import itemgetter
from typing import Any

import numpy as np
import xarray as xr

from ..batch.transients import Runs, Transients, signal_table
from ..system import monolithic
from ..system.compiled_simulation import LONGEST, CompiledSimulation, CompiledSystem, is_evaluated
from ..system.signals import at_time
from .event_runs import EventRun, Request
from .event_table import RandomEvent
from .rig import Rig

BLOCK = 64
"""Number of runs that are side by side in memory."""


def kept_outputs(rig: Rig, system: CompiledSystem, reads: Sequence[str]) -> list[str]:
    """The outputs and states of the compiled `system` of a rig that the measures of a run with an event need, and the
    outputs of the machine that the event itself `reads`."""
    names = {"motor.air_gap_tau", f"motor.{rig.drive.motor.current}", "machine.rocker.tau"}
    names |= {f"machine.{name}" for name in reads}
    for bond in rig.graph.bonds:
        for name, terminal in zip((bond.driver, bond.machine), bond.flanges, strict=True):
            names |= {f"{name}.{terminal.members[x]}" for x in ("phi", "w", "tau") if x in terminal.members}
    return sorted(names & set(system.outputs))


class EventBlock:
    """The compiled system of a rig, and runs that branch from its steady state.

    Parameters
    ----------
    rig : of models only; its FMUs are not needed
    random : the events that are to come
    steady : time of the steady state [s]
    states : the states at that time, in the order of the model; by default those of a run from rest

    Raises
    ------
    InputError
        where a component of the system is an FMU, and where there is no C compiler.
    """

    def __init__(
        self,
        rig: Rig,
        random: RandomEvent,
        steady: float,
        states: Any = None,
    ) -> None:
        self._rig, self._random, self._steady = rig, random, steady
        self._system = CompiledSystem(rig.graph)
        normal = {full: float(at_time(signal, steady)) for full, signal in rig.signals().items()}
        self._inputs = self._system.inputs | normal
        self._given_states = states

    @cached_property
    def states(self) -> Any:
        """The states at the steady time, in the order of the model.

        Raises
        ------
        RunError
            where they leave all bounds before that time.
        """
        if self._given_states is not None:
            return self._given_states
        graph, signals = self._rig.graph, self._rig.signals(ramp=True)
        if all(map(is_evaluated, signals.values())):
            with CompiledSimulation(graph, signals) as simulation:
                simulation.run(self._steady, self._rig.step, names=())
                return simulation.states
        # the rate of the reference, which a feed-forward takes, is no profile
        layout = self._system.model.state_layout
        assert layout is not None
        run = monolithic(graph, signals, [0.0, self._steady])
        return np.array([float(run[name][-1]) for name in layout.names])

    @cached_property
    def outputs(self) -> list[str]:
        """The outputs and states that the measures of a run with an event read, and the events themselves."""
        return kept_outputs(self._rig, self._system, self._random_reads)

    @property
    def _random_reads(self) -> tuple[str, ...]:
        return self._random.of.reads

    @cached_property
    def _driven(self) -> dict[str, int]:
        """By full name of an input that an event may change, the number of its changes."""
        unknown: Mapping[str, float] = defaultdict(float)
        driven: dict[str, int] = {}
        for event in self._random.hardest():
            for full, signal in self._rig.event_signals(event, 0.0, unknown).items():
                driven[full] = max(driven.get(full, 0), len(getattr(signal, "changes", ())))
        return driven

    @property
    def _changes(self) -> int:
        return max(self._driven.values(), default=0)

    @cached_property
    def loop(self) -> Transients:
        """The compiled loop."""
        return Transients(
            self._system.model,
            self.outputs,
            driven=list(self._driven),
            guarded=[self._rig.drive.motor_torque],
            changes=self._changes,
        )

    def close(self) -> None:
        """See `EventSimulation`; nothing is left to close."""

    def runs(self, requests: Sequence[Request], workers: int = 1) -> Iterator[EventRun]:
        """The requested runs in order. A run depends on its request alone, whatever the others are."""
        for first in range(0, len(requests), BLOCK):
            block = requests[first : first + BLOCK]
            # runs that end at nearly the same time share a vector
            order = sorted(range(len(block)), key=lambda k: block[k].stop)
            results = self._block([block[k] for k in order], workers)
            yield from (run for _, run in sorted(zip(order, results, strict=True), key=itemgetter(0)))

    def _block(self, requests: Sequence[Request], workers: int) -> Iterator[EventRun]:
        begins = np.array([each.begin for each in requests])
        limits = np.array([[each.limit for each in requests]])
        states, begin, lead = self.states, np.full(len(requests), self._steady), None
        read: list[dict[str, float]] = [{} for _ in requests]
        if self._random_reads:
            lead = self._run(
                [{} for _ in requests], states, begin, begins, np.full_like(limits, np.inf), workers
            )
            states, begin = lead.states, begins
            for name in self._random_reads:
                row = lead.rows[self.outputs.index(f"machine.{name}")]
                for k, value in enumerate(row[np.arange(len(requests)), lead.count - 1]):
                    read[k][name] = float(value)
        signals = [
            dict(self._rig.event_signals(each.event, each.begin, state))
            for each, state in zip(requests, read, strict=True)
        ]
        stops = np.array([each.stop for each in requests])
        result = self._run(signals, states, begin, stops, limits, workers)
        for k, each in enumerate(requests):
            yield self._event_run(k, each, result, lead)

    def _run(
        self,
        signals: Sequence[Mapping[str, Any]],
        states: Any,
        begin: Any,
        stop: Any,
        limits: Any,
        workers: int,
    ) -> Runs:
        table = signal_table(list(self._driven), signals, self._inputs, self._changes)
        return self.loop.run(
            self._system.p,
            self._inputs,
            states,
            begin=begin,
            step=self._rig.step,
            stop=stop,
            signals=table,
            limits=limits,
            longest=LONGEST * self._rig.step,
            workers=workers,
        )

    def _event_run(self, k: int, request: Request, result: Runs, lead: Runs | None) -> EventRun:
        pieces = [self._rows(k, lead)[:, :-1]] if lead is not None else []
        table = np.concatenate([*pieces, self._rows(k, result)], axis=1)
        # without an index, which would take as long as a tenth of the run
        time = xr.Coordinates({"time": ("time", table[0])}, indexes={})
        series = xr.Dataset(
            {name: ("time", row) for name, row in zip(self.outputs, table[1:], strict=True)}, time
        )
        ended = result.end(k) < request.stop - 0.5 * self._rig.step
        return EventRun(series, ended, result.failure(k))

    def _rows(self, k: int, runs: Runs) -> Any:
        """Time and outputs of a run, shape (1 + outputs, rows)."""
        n = int(runs.count[k])
        return np.concatenate([runs.times[k : k + 1, :n], runs.rows[:, k, :n]])
