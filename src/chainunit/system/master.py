"""The master of a co-simulation: fixed communication step, all signals consistent at every communication point.

With a load port the driver sees the linearised load inside its step, and the coupling is of second order (through a
driveline near rest of first order, see `chainunit.drives.driveline`). An external signal that varies within a step
acts with its value at the middle of the step, which is of second order, too. Inputs that a model lets run on inside a
step, `Model.input_rates`, act from their values at its begin on.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from .graph import ModelComponent
from .instance import Instance
from .simulation import FmuSimulation, Guarded

_Table = list[tuple[Instance, Any, Any]]
"""For each instance a handle and the values of its signals, shape (n, signals)."""


class CoSimulation(FmuSimulation):
    """A running co-simulation; see `FmuSimulation`."""

    kind = "Co-Simulation"
    instances = Instance

    def _begin(self, stop: float) -> None:
        _apply(self._signal_values(np.array([self.time])), 0)
        self._transfer()

    def _meet(self, guarded: Sequence[Guarded]) -> None:
        """Do nothing: a co-simulation cannot go back into a step."""

    def _steps(self, times: Any) -> Iterator[None]:
        """The steps from time to time [s]: all FMUs go one step with the inputs that move inside it, then the outputs
        are transferred."""
        points = self._signal_values(times)
        middles = self._signal_values(0.5 * (times[:-1] + times[1:]))
        moves_inside, moves_over = _moves(points, middles, len(times) - 1)
        for (instance, handle, nodes), (_, _, between) in zip(points, middles, strict=True):
            run_on = [name in self._run_on(instance.name) for name in handle.names]
            between[:, run_on] = nodes[:-1, run_on]
            if any(run_on):
                moves_over = [True] * len(moves_over)
        for k, after in enumerate(times[1:].tolist()):
            if moves_inside[k]:
                _apply(middles, k)
                self._transfer()
            t = float(times[k])
            for instance in self._instances.values():
                instance.step(t, after - t)
            self.time = after
            if moves_over[k]:
                _apply(points, k + 1)
            self._transfer()
            yield

    def _run_on(self, name: str) -> Mapping[str, str]:
        """The inputs of a component that run on inside a step; none of an FMU whose model is not known."""
        component = self.system.components[name]
        return component.model.input_rates if isinstance(component, ModelComponent) else {}


def _apply(signals: _Table, row: int) -> None:
    for instance, handle, values in signals:
        instance.write(handle, values[row].tolist())


def _moves(points: _Table, middles: _Table, n: int) -> tuple[list[bool], list[bool]]:
    """For each of the `n` steps: whether a signal changes within it, so that its value at the middle acts, and
    whether the values have to be set at its end."""
    inside, over = np.zeros(n, dtype=bool), np.zeros(n, dtype=bool)
    for (_, _, nodes), (_, _, between) in zip(points, middles, strict=True):
        inside |= ((between != nodes[:-1]) | (between != nodes[1:])).any(axis=1)
        over |= (nodes[1:] != nodes[:-1]).any(axis=1)
    return inside.tolist(), (inside | over).tolist()
