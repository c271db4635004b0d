"""A compiled system that runs: the same calls as the co-simulation of its FMUs, in one loop, without FMUs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..batch.transients import Transients, signal_table
from ..core.engines import MATH
from ..core.errors import InputError, InterruptedRunError, RunError
from ..core.quantities import Variable
from .compiled import compiled, input_starts
from .graph import System
from .rows import selected
from .signals import at_time, signals_by_name
from .simulation import RunOptions, Simulation, check_forward

if TYPE_CHECKING:
    import xarray as xr

TOLERANCE = 1e-9
"""Relative tolerance of the integrator: a run agrees with the monolithic solution to some 1e-7 of the peaks, where a
co-simulation has an error of some 1e-5."""
LONGEST = 20.0
"""Longest step of the integrator, over the time between rows."""


def is_evaluated(signal: Any) -> bool:
    """Whether a native loop evaluates a signal: a number or a `Profile`, no other function of time."""
    return not callable(signal) or hasattr(signal, "changes")


class CompiledSystem:
    """A system as one model, as native loops run it: the `model`, its parameters `p` with the `TOLERANCE`, and the
    values of its `inputs` in the system.

    Raises
    ------
    InputError
        where a component of the `system` is an FMU, and where the parameters make no machine.
    """

    def __init__(self, system: System) -> None:
        component = compiled(system)
        self.model, layout = component.model, component.model.parameter_layout
        self.p = self.model.check(layout.from_names({"solver.tolerance": TOLERANCE}, component.parameters))
        declared = {v.name: float(v.quantity.start or 0.0) for v in self.model.input_layout.variables}
        self.inputs = declared | input_starts(system, self.model)

    @property
    def outputs(self) -> dict[str, Variable]:
        """The states and outputs by full name."""
        assert self.model.state_layout is not None
        parts = (self.model.state_layout, *(part.layout for part in self.model.parts))
        return {v.name: v for layout in parts for v in layout.variables}

    def start(self, inputs: Mapping[str, float], parameters: Mapping[str, float] | None = None) -> Any:
        """The states at rest with these inputs, and with other values of some parameters; shape (states,)."""
        model = self.model
        assert model.state_layout is not None
        p = self.p
        if parameters:
            p = model.check(model.parameter_layout.from_names(dict(parameters), self.p))
        set_inputs = {full: x for full, x in inputs.items() if full in self.inputs}
        values = model.input_layout.from_names(self.inputs | set_inputs)
        return np.array(model.state_layout.values(model.begin(p, values)), float)


class CompiledSimulation(Simulation):
    """A running compiled system.

    Parameters
    ----------
    system : a system of models
    signals : by full name of an input, a number or a `Profile`
    start_time : time at the start [s]

    Raises
    ------
    InputError
        where a component is an FMU, and for an unknown input.
    """

    def __init__(
        self, system: System, signals: Mapping[str, Any] | None = None, start_time: float = 0.0
    ) -> None:
        self._compiled = CompiledSystem(system)
        self.time, self.signals = start_time, signals_by_name(signals)
        self._system = system
        self._check_signals()
        start = {full: float(at_time(signal, start_time)) for full, signal in self.signals.items()}
        self._states = self._compiled.start(start)
        self._saved = self.time, self._states

    def _check_signals(self) -> None:
        """Refuse a signal that is of no input, or neither a number nor a profile."""
        for full, signal in self.signals.items():
            if full not in self._compiled.inputs:
                raise InputError(f"{full}: no such input of the system")
            if not is_evaluated(signal):
                raise InputError(f"{full}: a compiled system takes numbers and profiles as signals")
        self.signals = self._system.in_units(self.signals, "input")

    @property
    def states(self) -> Any:
        """The present states in the order of the model, shape (states,)."""
        return np.array(self._states)

    def close(self) -> None:
        """See `Simulation`; nothing is left to free."""

    def _run(self, options: RunOptions) -> tuple[xr.Dataset, RunError | None]:
        """All rows are in memory, without a `file`.

        Raises
        ------
        InputError
            as `Simulation.run`, and for a `file`.
        InterruptedRunError
            after Ctrl-C; the time is then that before the run.
        """
        if options.file is not None:
            raise InputError("a compiled system keeps its rows in memory: leave the file out")
        return _advance([self], [options.stop], options)[0]

    def _dataset(self, times: Any, outputs: Mapping[str, Any], kept: Sequence[str], every: int) -> xr.Dataset:
        """The run of the `kept` variables, of every so many rows and the last one; `outputs` have the shape of
        `times`."""
        import xarray as xr

        chosen = np.arange(0, len(times), every)
        if chosen[-1] != len(times) - 1:
            chosen = np.append(chosen, len(times) - 1)
        signals = {full: np.broadcast_to(at_time(x, times), times.shape) for full, x in self.signals.items()}
        rows = {**outputs, **signals}
        declared = {v.name: v for v in self._compiled.model.input_layout.variables} | self._compiled.outputs
        variables = {}
        for full in kept:
            attributes = {"units": declared[full].unit, "long_name": declared[full].description}
            variables[full] = "time", rows[full][chosen], attributes
        return xr.Dataset(variables, {"time": ("time", times[chosen], {"units": "s", "long_name": "time"})})

    def save(self) -> float:
        """Keep the state, and return its time [s]."""
        self._saved = self.time, self._states
        return self.time

    def restore(self) -> None:
        """Go back to the state that was kept."""
        self.time, self._states = self._saved


def run_together(
    simulations: Sequence[Simulation],
    stops: Sequence[float],
    step: float,
    *,
    guards: Mapping[str, float] | None = None,
    names: Iterable[str] | None = None,
) -> list[xr.Dataset]:
    """Continue simulations of one system, each to its own end: compiled ones side by side in one loop, where eight
    cost little more than one, others one after the other. They may differ in parameters, states, signals, and the
    present time.

    Parameters
    ----------
    simulations : compiled ones of systems that are one model, or any others
    stops : end of each [s]
    step, guards, names : see `Simulation.run`

    Returns
    -------
    of each simulation, the rows of `Simulation.run`

    Raises
    ------
    InputError, RunError
        as `Simulation.run`; and InputError for systems that are different models.
    """
    pairs = list(zip(simulations, stops, strict=True))
    together = [simulation for simulation in simulations if isinstance(simulation, CompiledSimulation)]
    if len(together) < len(pairs):
        return [simulation.run(stop, step, guards=guards, names=names) for simulation, stop in pairs]
    for simulation, stop in pairs:
        check_forward(simulation.time, stop, step)
    options = RunOptions(max(stops, default=0.0), step, None, guards or {}, 1, names, None)
    runs = []
    for run, failure in _advance(together, stops, options):
        if failure is not None:
            failure.partial = run
            raise failure
        runs.append(run)
    return runs


def _advance(
    simulations: Sequence[CompiledSimulation], stops: Sequence[float], options: RunOptions
) -> list[tuple[xr.Dataset, RunError | None]]:
    """The rows of each simulation up to its own end, and the error that ended it early."""
    if not simulations:
        return []
    for simulation in simulations:
        simulation._check_signals()
    system, signals = simulations[0]._compiled, [simulation.signals for simulation in simulations]
    if any(
        simulation._compiled.model is not system.model or simulation.signals.keys() != signals[0].keys()
        for simulation in simulations
    ):
        raise InputError("simulations side by side must have one model, and signals of the same inputs")
    kept, guards = selected(options.names, [*system.outputs, *signals[0]]), options.guards
    needed = {*kept, *guards}
    outputs = [name for name in system.outputs if name in needed]
    by_name = [system.model.parameter_layout.by_name(simulation._compiled.p) for simulation in simulations]
    varying = [name for name, value in by_name[0].items() if any(p[name] != value for p in by_name)]
    driven = [
        full
        for full, signal in signals[0].items()
        if any(
            hasattr(run_signals[full], "changes") or run_signals[full] != signal for run_signals in signals
        )
    ]
    profiles = [getattr(run_signals[full], "changes", ()) for run_signals in signals for full in driven]
    changes = max(map(len, profiles), default=0)
    loop = Transients(
        system.model, outputs, varying=varying, driven=driven, guarded=list(guards), changes=changes
    )
    times = [simulation.time for simulation in simulations]
    try:
        result = loop.run(
            system.p,
            system.inputs | {full: float(x) for full, x in signals[0].items() if full not in driven},
            np.stack([simulation._states for simulation in simulations], -1),
            begin=times,
            step=options.step,
            stop=stops,
            varying=np.reshape(
                [[p[name] for p in by_name] for name in varying], (len(varying), len(simulations))
            ),
            signals=signal_table(driven, signals, {}, changes),
            limits=np.repeat(np.reshape(list(guards.values()), (len(guards), 1)), len(simulations), 1),
            longest=max(LONGEST * options.step, float(system.model.internal_step(MATH, system.p))),
        )
    except KeyboardInterrupt:
        raise InterruptedRunError(f"interrupted at t = {min(times):g} s") from None
    done = []
    for r, simulation in enumerate(simulations):
        n = int(result.count[r])
        simulation.time, simulation._states = result.end(r), result.states[:, r]
        rows = dict(zip(outputs, result.rows[:, r, :n], strict=True))
        run, failure = simulation._dataset(result.times[r, :n], rows, kept, options.every), result.failure(r)
        # the last row is that of the failure
        done.append((run if failure is None else run.isel(time=slice(None, -1)), failure))
    return done
