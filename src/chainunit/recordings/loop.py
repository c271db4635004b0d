"""A compiled system whose runs carry exact derivatives, piece by piece."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from ..batch.transients import Transients, signal_table
from ..study.drive import Drive
from ..system.compiled_simulation import LONGEST, CompiledSystem


@dataclass(frozen=True)
class Piece:
    """A simulated piece of a run: its `time` [s], shape (rows,), the `values` of the kept outputs by name, each of
    shape (rows,), their `slopes` in the directions, each of shape (directions, rows), and the states at its end by
    name with their derivatives, each of shape (1 + directions,)."""

    time: Any
    values: Mapping[str, Any]
    slopes: Mapping[str, Any]
    states: Mapping[str, Any]


class DirectedLoop:
    """The system of a drive.

    Parameters
    ----------
    drive : motor and machine
    outputs : names of the states and outputs to keep
    by : full names of parameters and inputs; directions may consist of the ones that the system has
    """

    def __init__(self, drive: Drive, outputs: Sequence[str], by: Sequence[str]) -> None:
        self.system = CompiledSystem(drive.graph)
        layout = self.system.model.parameter_layout
        assert self.system.model.state_layout is not None
        self.states = self.system.model.state_layout.names
        names = {*layout.names, *self.system.inputs}
        self._outputs = tuple(outputs)
        # derivatives by the states alone need a quantity, too
        self._by = tuple(name for name in by if name in names) or (layout.names[0],)
        self._loop = lru_cache(maxsize=8)(self._transients)

    def _transients(self, driven: tuple[str, ...], changes: int) -> Transients:
        return Transients(self.system.model, self._outputs, by=self._by, driven=driven, changes=changes)

    def start(
        self, values: Mapping[str, Any], parameters: Mapping[str, float], time: float
    ) -> dict[str, float]:
        """The states at rest by name, with these values and further start `parameters`."""
        system_values, inputs, profiles = self._parted(values)
        first = inputs | {name: float(x(time)) for name, x in profiles.items()}
        return dict(
            zip(
                self.states,
                map(float, self.system.start(first, system_values | dict(parameters))),
                strict=True,
            )
        )

    def _parted(self, values: Mapping[str, Any]) -> tuple[dict[str, float], dict[str, float], dict[str, Any]]:
        """Values of parameters and inputs, and the profiles of inputs; those of another system are left out."""
        layout = self.system.model.parameter_layout
        system_values = {name: x for name, x in values.items() if name in layout.names}
        inputs = {name: x for name, x in values.items() if name in self.system.inputs}
        profiles = {name: x for name, x in inputs.items() if hasattr(x, "changes")}
        return (
            system_values,
            self.system.inputs | {n: x for n, x in inputs.items() if n not in profiles},
            profiles,
        )

    def run(
        self,
        values: Mapping[str, Any],
        states: Mapping[str, Any],
        directions: Sequence[tuple[str, float]],
        span: tuple[float, float],
        step: float,
        workers: int = 1,
    ) -> Piece:
        """Simulate a piece of a run.

        Parameters
        ----------
        values : of parameters and inputs, by full name; those of inputs also as `Profile`
        states : at the begin by name, each with its derivatives in the directions, shape (1 + directions,)
        directions : of each, a quantity of `by` with its change, or a name that the system does not have
        span : begin and end [s]
        step : time between rows [s]; the last one is at the end

        Raises
        ------
        InputError
            for values that make no machine.
        RunError
            where the states leave all bounds.
        """
        system, count, size = self.system, max(1, len(directions)), len(self.states)
        system_values, inputs, profiles = self._parted(values)
        x = np.zeros((2 * size, count))
        changes = np.zeros((len(self._by), count))
        for k, name in enumerate(self.states):
            x[k] = states[name][0]
            x[size + k, : len(directions)] = states[name][1:]
        for k, (name, change) in enumerate(directions):
            if name in self._by:
                changes[self._by.index(name), k] = change
        bends = max((len(profile.changes) for profile in profiles.values()), default=0)
        begin, end = span
        result = self._loop(tuple(profiles), bends).run(
            system.model.check(system.model.parameter_layout.from_names(system_values, system.p)),
            inputs,
            x,
            begin=begin,
            step=step,
            stop=np.full(count, end),
            signals=signal_table(list(profiles), [profiles] * count, {}, bends),
            directions=changes,
            longest=LONGEST * step,
            workers=workers,
        )
        failure = next(filter(None, map(result.failure, range(count))), None)
        if failure is not None:
            raise failure
        kept = range(len(directions))
        return Piece(
            result.times[0],
            {name: result.rows[k, 0] for k, name in enumerate(self._outputs)},
            {name: result.slopes[k, : len(kept)] for k, name in enumerate(self._outputs)},
            {
                name: np.array([result.states[k, 0], *(result.states[size + k, j] for j in kept)])
                for k, name in enumerate(self.states)
            },
        )
