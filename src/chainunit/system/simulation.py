"""The common parts of every run of a system of FMUs: set-up, transfer of values, rows, branches.

At each communication point the connected variables are transferred in the order of the FMUs' true dependencies: the
states first, then the outputs that depend on them. So every recorded row belongs to one instant.
"""

from __future__ import annotations

import math
import sys
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from ..core.declared_numbers import number_in
from ..core.errors import InputError, InterruptedRunError, RunError
from ..core.files import atomic_file
from ..work.interrupts import stoppable
from ..work.progress import Progress
from . import rows
from .graph import FmuComponent, System, direct_inputs, order
from .instance import Fmu, Instance, Kind
from .signals import Profile, at_time, signals_by_name

if TYPE_CHECKING:
    import xarray as xr

Guarded = tuple[Instance, Any, list[float]]
"""An instance, the handle of its guarded outputs, and their limits."""


def check_forward(begin: float, stop: float, step: float) -> None:
    """Refuse a run from `begin` to `stop` [s] in steps of `step` [s] that does not go forward.

    Raises
    ------
    InputError
        where it does not.
    """
    if not (0.0 < step < math.inf) or not begin < stop < math.inf:
        raise InputError(f"a run from t = {begin:g} to {stop:g} s in steps of {step:g} s: must go forward")


@dataclass(frozen=True)
class RunOptions:
    """The arguments of `Simulation.run`."""

    stop: float
    step: float
    progress: Progress | None
    guards: Mapping[str, float]
    every: int
    names: Iterable[str] | None
    file: Path | None


_PastRun = tuple[dict[str, Any], RunOptions]
"""The signals and the arguments of a run that can be repeated."""


class Simulation(ABC):
    """A running system, from whose saved state branches can run; use it as a context manager."""

    time: float
    """the present time [s]"""
    signals: dict[str, Any]
    """by full name of an input, a number or a function of time; see `chainunit.system.signals`"""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @abstractmethod
    def close(self) -> None:
        """Free all that the system holds."""

    def run(
        self,
        stop: float | str,
        step: float | str,
        progress: Progress | None = None,
        *,
        guards: Mapping[str, float] | None = None,
        every: int = 1,
        names: Iterable[str] | None = None,
        file: Path | None = None,
    ) -> xr.Dataset:
        """Simulate to the time `stop` [s] with the communication step `step` [s].

        Parameters
        ----------
        stop, step : [s], or texts such as "2 ms"
        progress : is called with the simulated time now and then
        guards : limits by full name of an output: where the absolute value passes the limit at the end of a step, the
            run ends with that row; in Model Exchange it ends with a row at the instant of the passage
        every : keep one of so many rows, besides the first and the last
        names : full names of the outputs and of the inputs with signals to keep; all by default
        file : a NetCDF file to which the rows are written in blocks during the run; the memory then does not grow
            with the number of rows

        Returns
        -------
        every output and every input with a signal, or those in `names`, over the dimension ``time``, with units and
        descriptions. With a `file` the Dataset reads from it lazily; close it at the end. A further call continues
        the run.

        Raises
        ------
        InputError
            for a run that does not go forward, where `every` is no whole number >= 1, and for a name that cannot be
            guarded or kept.
        RunError
            where an FMU fails or the states leave all bounds; the attribute ``partial`` of the error holds the
            Dataset up to the failure.
        WriteError
            where the `file` cannot be written.
        """
        stop = number_in("s", "stop", stop, "time to which the run goes")
        step = number_in("s", "step", step, "communication step")
        check_forward(self.time, stop, step)
        if not every >= 1 or every % 1:
            raise InputError(f"every = {every:g}: must be a whole number >= 1")
        run, failure = self._run(RunOptions(stop, step, progress, guards or {}, every, names, file))
        if failure is not None:
            failure.partial = run
            raise failure
        if progress:
            progress(self.time)
        return run

    @abstractmethod
    def _run(self, options: RunOptions) -> tuple[xr.Dataset, RunError | None]:
        """The rows of a run, and the error that ended it early."""

    @abstractmethod
    def save(self) -> float:
        """Save the present state in place of the last saved one; returns the time."""

    @abstractmethod
    def restore(self) -> None:
        """Return to the saved state, from which another branch can run."""

    @property
    def without_states(self) -> list[str]:
        """The components whose state cannot be saved: to `restore` then runs the system from its start again."""
        return []


class FmuSimulation(Simulation):
    """A running system of FMUs; use it as a context manager.

    Parameters
    ----------
    system : a system whose components all have an FMU; see `chainunit.system.export`
    signals : by full name of an input, a number or a function of time; see `chainunit.system.signals`
    start_time : time at the start [s]

    Raises
    ------
    InputError
        for a component without FMU, a signal that names no input, and for an algebraic loop, which is named.
    RunError
        where an FMU refuses to start.
    """

    kind: ClassVar[Kind]
    instances: ClassVar[type[Instance]]

    def __init__(
        self, system: System, signals: Mapping[str, Any] | None = None, start_time: float = 0.0
    ) -> None:
        self.system, self.time = system, start_time
        self.signals = signals_by_name(signals)
        self._fmus: dict[str, Fmu] = {}
        self._instances: dict[str, Any] = {}
        self._state: dict[str, Any] = {}
        self._journal: list[str] = []
        self._start = self.time, dict(self.signals)
        self._past: list[_PastRun] = []
        """the runs since the start, where a state cannot be saved"""
        self._saved_past: list[_PastRun] = []
        try:
            self._open()
            self._instantiate()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Free every instance and the unpacked files."""
        self._free_instances()
        for fmu in self._fmus.values():
            fmu.close()
        self._fmus = {}

    def _free_instances(self) -> None:
        _free(self._instances, self._state)
        self._instances, self._state = {}, {}

    # -- set-up

    def _open(self) -> None:
        """Unpack the FMUs, each file once."""
        archives: dict[Any, Fmu] = {}
        for name, component in self.system.components.items():
            if component.file is None:
                raise InputError(f"{name} ({component.title}): has no FMU yet; export the system first")
            names = component.names if isinstance(component, FmuComponent) else {}
            key = (component.file, *sorted(names.items()))
            if key not in archives:
                archives[key] = Fmu(component.file, self.kind, names)
                for variable in archives[key].variables.values():
                    connector = component.connectors.get(variable.name)
                    variable.unit = variable.unit or (connector.unit if connector else None)
            self._fmus[name] = archives[key]

    def _instantiate(self) -> None:
        """Instantiate the components, and bring them to the start."""
        for name, fmu in self._fmus.items():
            self._instances[name] = self.instances(fmu, name, self._journal)
        self._transfers = self._schedule()
        self._initialize()

    def _schedule(self) -> list[tuple[Instance, Any, list[tuple[Instance, Any, list[int]]]]]:
        """Groups of connected outputs in an order in which each output is final when it is read. A group has its
        instance, the handle of the outputs, and the inputs that take their values."""
        direct = {
            name: direct_inputs(component, self._fmus[name].feedthrough())
            for name, component in self.system.components.items()
        }
        transfers = []
        for name, outputs in order(self.system.connections, direct):
            targets: dict[str, list[tuple[str, int]]] = {}
            for source, target in self.system.connections:
                giver, _, output = source.partition(".")
                taker, _, variable = target.partition(".")
                if giver == name and output in outputs:
                    targets.setdefault(taker, []).append((variable, outputs.index(output)))
            inputs = [
                (
                    self._instances[taker],
                    self._instances[taker].handle([v for v, _ in pairs]),
                    [i for _, i in pairs],
                )
                for taker, pairs in targets.items()
            ]
            transfers.append((self._instances[name], self._instances[name].handle(outputs), inputs))
        return transfers

    def _initialize(self) -> None:
        """Initialize the FMUs with the start values of the system and the signals at the start."""
        start: dict[str, dict[str, float]] = {name: {} for name in self._instances}
        for full, value in self.system.values.items():
            name, _, variable = full.partition(".")
            start[name][variable] = value
        for name, instance in self._instances.items():
            instance.initialize(start[name], self.time)
        for instance, handle, values in self._signal_values(np.array([self.time])):
            instance.write(handle, values[0].tolist())
        self._transfer()
        for instance in self._instances.values():
            instance.finish_initialization()

    # -- values

    def _by_instance(self, fulls: Iterable[str]) -> dict[str, list[str]]:
        """Full names by the name of their component."""
        groups: dict[str, list[str]] = {}
        for full in fulls:
            groups.setdefault(full.partition(".")[0], []).append(full)
        return groups

    def _handles(self, fulls: Iterable[str]) -> list[tuple[Instance, Any, list[str]]]:
        """Instances, handles and full names, by component."""
        handles = []
        for name, group in self._by_instance(fulls).items():
            instance = self._instances[name]
            handles.append((instance, instance.handle([full.partition(".")[2] for full in group]), group))
        return handles

    def _signal_inputs(self) -> list[tuple[Instance, Any, list[str]]]:
        """Handles of the inputs with signals."""
        connected = {target for _, target in self.system.connections}
        self.signals = self.system.in_units(self.signals, "input")
        for full in self.signals:
            if full in connected:
                raise InputError(f"{full}: is connected, it cannot have a signal")
        return self._handles(self.signals)

    def _signal_values(self, times: Any) -> list[tuple[Instance, Any, Any]]:
        """The signals at `times`, shape (n,): for each instance a handle and a table (n, signals)."""

        def column(source: Any) -> Any:
            if callable(source) and not isinstance(source, Profile):
                return [source(float(t)) for t in times]
            return np.broadcast_to(at_time(source, times), len(times))

        return [
            (
                instance,
                handle,
                np.stack([np.asarray(column(self.signals[full]), float) for full in names], axis=1),
            )
            for instance, handle, names in self._signal_inputs()
        ]

    def _transfer(self) -> None:
        for source, outputs, targets in self._transfers:
            values = source.read(outputs)
            for target, inputs, places in targets:
                target.write(inputs, [values[i] for i in places])

    # -- running

    @abstractmethod
    def _begin(self, stop: float) -> None:
        """Make all values consistent at the present time, at which a run to the time `stop` begins."""

    @abstractmethod
    def _steps(self, times: Any) -> Iterator[None]:
        """Go from the first of the `times` to each of the others in turn, with all values consistent there."""

    def _run(self, options: RunOptions) -> tuple[xr.Dataset, RunError | None]:
        import xarray as xr

        start, file = self.time, options.file
        if self.without_states:
            kept = replace(options, progress=None, every=sys.maxsize, file=None)
            self._past.append((dict(self.signals), kept))
        n = max(1, math.ceil((options.stop - start) / options.step - 1e-9))
        recorders, guarded = self._recorders(options.names), self._guarded(options.guards)
        room = n // options.every + 2 if file is None else rows.BLOCK
        failure: RunError | None = None
        try:
            with (
                stoppable() as stopped,
                nullcontext() if file is None else atomic_file(file) as part,
                rows.Rows(recorders, room, part) as table,
            ):
                complaints = _Complaints(self._journal)
                try:
                    self._record(table, options, n, guarded, stopped, complaints)
                except RunError as error:
                    failure = complaints.explain(error)
        except KeyboardInterrupt:
            # the interrupt came after the last step: the rows are complete
            if self.time == start:
                raise
            failure = self._interruption()
        return table.dataset() if file is None else xr.open_dataset(file, decode_times=False), failure

    def _record(
        self,
        table: rows.Rows,
        options: RunOptions,
        n: int,
        guarded: Sequence[Guarded],
        stopped: Callable[[], bool],
        complaints: _Complaints,
    ) -> None:
        """Take `n` steps, or fewer where a guard or an interrupt ends the run."""
        start, stop, progress = self.time, options.stop, options.progress
        often, done = max(1, n // 200), 0
        self._begin(stop)
        table.add(start)
        complaints.step()
        for first in range(0, n, rows.BLOCK):
            # the last step is shorter where the end is no multiple of the step
            times = np.minimum(start + options.step * np.arange(first, min(first + rows.BLOCK, n) + 1), stop)
            for _ in self._steps(times):
                done += 1
                is_beyond = beyond(guarded)
                if is_beyond:
                    self._meet(guarded)
                is_interrupted = stopped()
                ends = is_beyond or is_interrupted or done == n
                if ends or done % options.every == 0:
                    table.add(self.time)
                if progress and done % often == 0:
                    progress(self.time)
                if is_interrupted:
                    raise self._interruption()
                if ends:
                    return
                complaints.step()

    @abstractmethod
    def _meet(self, guarded: Sequence[Guarded]) -> None:
        """Go back from a row beyond a guard to the instant of the passage, if the simulation can."""

    def _interruption(self) -> InterruptedRunError:
        return InterruptedRunError(f"interrupted at t = {self.time:g} s")

    def _recorders(self, names: Iterable[str] | None) -> list[rows.Recorder]:
        """The outputs and inputs of each instance to keep, in declared order."""
        there: list[str] = []
        for name, fmu in self._fmus.items():
            inputs = sorted(full for full in self.signals if full.startswith(f"{name}."))
            there += [*(f"{name}.{v}" for v in fmu.outputs()), *inputs]
        return self._handles(rows.selected(names, there))

    def _guarded(self, guards: Mapping[str, float]) -> list[Guarded]:
        """The guarded outputs of each instance with their limits; refuses a guard that is no output."""
        for full in guards:
            self.system.connector(full, "output")
        return [
            (instance, handle, [guards[full] for full in names])
            for instance, handle, names in self._handles(guards)
        ]

    # -- branching

    @property
    def without_states(self) -> list[str]:
        """See `Simulation`."""
        return [name for name, fmu in self._fmus.items() if not fmu.interface.canGetAndSetFMUstate]

    def save(self) -> float:
        """Save the present state of every FMU, in place of the last saved one; returns the time. Where an FMU cannot
        give its state, the runs since the start are remembered in its place."""
        if self.without_states:
            self._saved_past = list(self._past)
        else:
            for name, instance in self._instances.items():
                if name in self._state:
                    instance.forget(self._state[name])
                self._state[name] = instance.state()
        self._saved_at = self.time
        return self.time

    def restore(self) -> None:
        """Return to the saved state, from which another branch can run. Where an FMU cannot give its state, all FMUs
        begin again, and the runs up to the saved time are repeated.

        Raises
        ------
        RunError
            where an FMU fails in one of these runs.
        """
        if self.without_states:
            self._repeat(self._saved_past)
        else:
            for name, instance in self._instances.items():
                instance.restore(self._state[name])
        self.time = self._saved_at

    def _repeat(self, runs: Sequence[_PastRun]) -> None:
        """Make these runs from the start again; the signals stay as they are. After a failure the simulation is as it
        was before: its instances are kept until then, or run again if an FMU allows one instance alone."""
        before = dict(vars(self))
        alone = any(fmu.interface.canBeInstantiatedOnlyOncePerProcess for fmu in self._fmus.values())
        if alone:
            self._free_instances()
        try:
            self._run_again(runs)
        except BaseException:
            self._free_instances()
            vars(self).update(before)
            if alone:
                self._run_again(before["_past"])
            raise
        if not alone:
            _free(before["_instances"], before["_state"])

    def _run_again(self, runs: Sequence[_PastRun]) -> None:
        """Start anew, and go through the same runs, for FMUs whose states cannot be kept."""
        signals, self._instances, self._state, self._past = self.signals, {}, {}, []
        self.time, first = self._start
        self.signals = dict(first)
        self._instantiate()
        for self.signals, options in runs:
            failure = self._run(options)[1]
            if failure is not None:
                raise failure
        self.signals = signals


def _free(instances: Mapping[str, Any], states: Mapping[str, Any]) -> None:
    """Free instances, and the saved states of some of them."""
    for name, instance in instances.items():
        if name in states:
            instance.forget(states[name])
        instance.close()


def beyond(guarded: Sequence[Guarded]) -> bool:
    """Whether the absolute value of a guarded output is above its limit."""
    return any(
        abs(value) > limit
        for instance, handle, limits in guarded
        for value, limit in zip(instance.read(handle), limits, strict=True)
    )


class _Complaints:
    """The messages of the FMUs during a run, to explain a failure: its cause may be an earlier message of another
    FMU, also one from the transfer of values before the step."""

    def __init__(self, journal: Sequence[str]) -> None:
        self._journal = journal
        self._first = self._last = 0

    def step(self) -> None:
        """Mark the begin of a step."""
        self._first, self._last = self._last, len(self._journal)

    def explain(self, error: RunError) -> RunError:
        """The error with the first message since the begin of the previous step."""
        hint = f" (before: {self._journal[self._first]})" if len(self._journal) > self._first + 1 else ""
        failure = type(error)(f"{error}{hint}")
        failure.__cause__ = error
        return failure
