"""The master: fixed communication step, all signals consistent at every communication point.

At each point the connected variables are transferred in the order that the FMUs' true dependencies allow
(states first, then what follows from them), so that every recorded row belongs to one instant; then every
FMU makes its step. With a load port the driver sees the linearised load inside its step, and the coupling
is of second order. An external signal that varies within a step acts with its value at the step's middle,
second order as well.
"""

from __future__ import annotations

import math
import signal
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
import xarray as xr

from ..errors import InputError, InterruptedRunError, RunError
from ..files import netcdf, whole
from .graph import System
from .instance import Fmu, Instance
from .signals import Profile

Progress = Callable[[float], None]
"""Called with the simulated time [s] now and then."""


@contextmanager
def stoppable() -> Iterator[Callable[[], bool]]:
    """Whether Ctrl-C was pressed, asked between steps: a KeyboardInterrupt inside an FMU would be a fatal error. So
    it is with SIGTERM, where somebody handles it by a KeyboardInterrupt. The KeyboardInterrupt of which nobody was
    told, since nobody asked any more, comes at the end."""
    caught: list[KeyboardInterrupt] = []
    told: list[bool] = []
    if threading.current_thread() is not threading.main_thread():
        yield lambda: False
        return

    def later(number: int, frame: Any) -> None:
        try:
            previous[number](number, frame)
        except KeyboardInterrupt as error:
            caught.append(error)

    def stopped() -> bool:
        told.extend([True] * len(caught))
        return bool(told)

    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    previous: dict[int, Any] = {number: handler for number, handler in handlers.items() if callable(handler)}
    for number in previous:
        signal.signal(number, later)
    try:
        yield stopped
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)
        if caught and not told:
            raise caught[0]


_Recorder = tuple[Instance, Any, list[str]]
"""An instance, the handle of what is kept of it, and the full names of that."""
_BLOCK = 4096
"""Rows that are written to a file at a time, and steps whose signals are computed at a time."""


class _Rows:
    """The rows of a run: in memory, or in a NetCDF file that takes a block of them at a time."""

    def __init__(self, recorders: Sequence[_Recorder], room: int, file: Path | None) -> None:
        self._recorders = recorders
        self._names = [name for _, _, names in recorders for name in names]
        self._values = np.empty((1 + len(self._names), room))
        self._filled = self._written = 0
        self._file = None if file is None else self._create(file)

    def __enter__(self) -> _Rows:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._file is not None:
            try:
                if kind is None:
                    self._flush()
            finally:
                with netcdf():
                    self._file.close()

    def add(self, time: float) -> None:
        """Keep the present values as the row of the instant `time`."""
        if self._filled == self._values.shape[1]:
            self._flush()
        row = self._values[:, self._filled]
        row[0] = time
        at = 1
        for instance, handle, names in self._recorders:
            row[at : at + len(names)] = instance.read(handle)
            at += len(names)
        self._filled += 1

    def _attributes(self) -> dict[str, dict[str, str]]:
        """Units and descriptions, of the time first."""
        found = {"time": {"units": "s", "long_name": "time"}}
        for instance, _, names in self._recorders:
            for full in names:
                declared = instance.fmu.variables[full.partition(".")[2]]
                found[full] = {"units": declared.unit or "1", "long_name": declared.description or full}
        return found

    def _create(self, file: Path) -> Any:
        import netCDF4

        with netcdf():
            out = netCDF4.Dataset(file, "w")
            out.createDimension("time", None)
            for name, attributes in self._attributes().items():
                variable = out.createVariable(name, "f8", ("time",), chunksizes=(_BLOCK,))
                variable.setncatts(attributes)
                # by itself the library keeps megabytes of each variable
                variable.set_var_chunk_cache(size=8 * _BLOCK, nelems=3, preemption=1.0)
        return out

    def _flush(self) -> None:
        assert self._file is not None
        end = self._written + self._filled
        with netcdf():
            for values, variable in zip(self._values, self._file.variables.values(), strict=True):
                variable[self._written : end] = values[: self._filled]
            self._file.sync()
        self._written, self._filled = end, 0

    def dataset(self) -> xr.Dataset:
        """What is in memory. Its variables share it."""
        rows = {
            name: ("time", values[: self._filled], attributes)
            for values, (name, attributes) in zip(self._values, self._attributes().items(), strict=True)
        }
        time = rows.pop("time")
        return xr.Dataset(rows, {"time": time})


def _moves(points: Any, middles: Any, n: int) -> tuple[list[bool], list[bool]]:
    """In which of the `n` steps a signal moves, whose value at the middle then acts; in which it is another one at
    the end."""
    inside, over = np.zeros(n, dtype=bool), np.zeros(n, dtype=bool)
    for (_, _, at), (_, _, between) in zip(points, middles, strict=True):
        inside |= ((between != at[:-1]) | (between != at[1:])).any(axis=1)
        over |= (at[1:] != at[:-1]).any(axis=1)
    return inside.tolist(), (inside | over).tolist()


class CoSimulation:
    """A running co-simulation; use it as a context manager.

    Parameters
    ----------
    system : FMUs, connections, start values
    signals : by full name of an input, a number or a function of time
    start_time : [s]

    Raises
    ------
    InputError
        for a connection or signal that names no variable, and for an algebraic loop, which is named.
    RunError
        where an FMU refuses to start.
    """

    def __init__(
        self, system: System, signals: Mapping[str, Any] | None = None, start_time: float = 0.0
    ) -> None:
        self.time = start_time
        self._fmus: dict[str, Fmu] = {}
        self._instances: dict[str, Instance] = {}
        self._state: dict[str, Any] = {}
        self._journal: list[str] = []
        try:
            files: dict[Any, Fmu] = {}
            for name, file in system.fmus.items():
                if file not in files:
                    files[file] = Fmu(file)
                self._fmus[name] = files[file]
                self._instances[name] = Instance(files[file], name, self._journal)
            self._transfers = self._schedule(system)
            self._starts = self._split_names(system.start)
            self.signals = dict(signals or {})
            self._initialize()
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> CoSimulation:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Free every instance and the unpacked files."""
        for name, instance in self._instances.items():
            if name in self._state:
                instance.forget(self._state[name])
            instance.close()
        for fmu in self._fmus.values():
            fmu.close()
        self._instances, self._fmus, self._state = {}, {}, {}

    # -- set-up

    def _split(self, full: str, causality: str | None = None) -> tuple[str, str]:
        instance, _, variable = full.partition(".")
        known = self._fmus[instance].variables if instance in self._fmus else {}
        if variable not in known or causality not in (None, known[variable].causality):
            raise InputError(f"{full}: no such {causality or 'variable'} in the system")
        return instance, variable

    def _split_names(self, values: Mapping[str, float]) -> dict[str, dict[str, float]]:
        split: dict[str, dict[str, float]] = {name: {} for name in self._fmus}
        for full, value in values.items():
            instance, variable = self._split(full)
            if self._fmus[instance].variables[variable].causality not in ("parameter", "input"):
                raise InputError(f"{full}: is no parameter or input, it cannot be set")
            split[instance][variable] = value
        return split

    def _schedule(self, system: System) -> list[tuple[Instance, Any, list[tuple[Instance, Any, list[int]]]]]:
        """Groups of connected outputs in an order in which each is final when it is read."""
        sources: dict[tuple[str, str], tuple[str, str]] = {}
        for source, target in system.connections:
            into = self._split(target, "input")
            if into in sources:
                raise InputError(f"{target}: is connected to {'.'.join(sources[into])} and to {source}")
            sources[into] = self._split(source, "output")
        self._driven = {".".join(target) for target in sources}
        feedthrough = {name: fmu.feedthrough() for name, fmu in self._fmus.items()}
        level: dict[tuple[str, str], int] = {}

        def rank(output: tuple[str, str], above: tuple[tuple[str, str], ...]) -> int:
            if output in above:
                loop = " -> ".join(".".join(v) for v in (*above[above.index(output) :], output))
                raise InputError(f"algebraic loop: {loop}; break it with a load port or a state")
            if output not in level:
                instance, variable = output
                feeding = [
                    sources[(instance, known)]
                    for known in feedthrough[instance].get(variable, ())
                    if (instance, known) in sources
                ]
                level[output] = 1 + max((rank(s, (*above, output)) for s in feeding), default=-1)
            return level[output]

        for connected in sources.values():
            rank(connected, ())
        transfers = []
        for height in range(max(level.values(), default=-1) + 1):
            for name, instance in self._instances.items():
                names = [v for (i, v), at in level.items() if i == name and at == height]
                if not names:
                    continue
                targets: dict[str, list[tuple[str, int]]] = {}
                for (target, variable), (giver, output) in sources.items():
                    if giver == name and output in names:
                        targets.setdefault(target, []).append((variable, names.index(output)))
                transfers.append(
                    (
                        instance,
                        instance.handle(names),
                        [
                            (
                                self._instances[target],
                                self._instances[target].handle([v for v, _ in pairs]),
                                [at for _, at in pairs],
                            )
                            for target, pairs in targets.items()
                        ],
                    )
                )
        return transfers

    def _initialize(self) -> None:
        for name, instance in self._instances.items():
            instance.initialize(self._starts[name], self.time)
        for instance, handle, values in self._signal_values(np.array([self.time])):
            instance.write(handle, values[0].tolist())
        self._transfer()
        for instance in self._instances.values():
            instance.finish_initialization()

    # -- running

    def _signal_values(self, times: Any) -> list[tuple[Instance, Any, Any]]:
        """The external signals at `times`, shape (n,): of each instance a handle and a table (n, signals)."""
        split: dict[str, tuple[list[str], list[Any]]] = {}
        for full, given in self.signals.items():
            instance, variable = self._split(full, "input")
            if full in self._driven:
                raise InputError(f"{full}: is connected, it cannot have a signal")
            if isinstance(given, Profile):
                values = given(times)
            elif callable(given):
                values = [given(float(t)) for t in times]
            else:
                values = np.full(len(times), given, dtype=float)
            names, columns = split.setdefault(instance, ([], []))
            names.append(variable)
            columns.append(np.asarray(values, dtype=float))
        return [
            (self._instances[name], self._instances[name].handle(names), np.stack(columns, axis=1))
            for name, (names, columns) in split.items()
        ]

    def _transfer(self) -> None:
        for source, outputs, targets in self._transfers:
            values = source.read(outputs)
            for target, inputs, order in targets:
                target.write(inputs, [values[i] for i in order])

    def run(
        self,
        stop: float,
        step: float,
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
        stop, step : [s]
        progress : is called with the simulated time now and then
        guards : limits by full name of an output: where its size passes the limit at the end of a step, the run ends
            with that row
        every : each so many rows one is kept, beside the first and the last
        names : full names of the outputs and driven inputs that are kept; all by default
        file : a NetCDF file that the rows are written to as they come; then of a row no more than its time stays in
            memory

        Returns
        -------
        every output and connected or driven input, or those of `names`, over the dimension ``time``, with units and
        descriptions; of a `file` a Dataset that reads from it when asked (close it at the end). A further call goes
        on from where this one ended.

        Raises
        ------
        InputError
            for a run that does not go forward, and for a name that cannot be watched or kept.
        RunError
            where an FMU fails; its attribute ``partial`` holds the Dataset up to there.
        WriteError
            where the `file` cannot be written.
        """
        start = self.time
        if not (0.0 < step < math.inf) or not start < stop < math.inf:
            raise InputError(
                f"a run from t = {start:g} to {stop:g} s in steps of {step:g} s: must go forward"
            )
        if every < 1 or every != int(every):
            raise InputError(f"every = {every:g}: must be a whole number >= 1")
        n = max(1, math.ceil((stop - start) / step - 1e-9))
        recorders = self._recorders(names)
        watched = self._watched(guards or {})
        room = n // every + 2 if file is None else _BLOCK
        told = max(1, n // 200)
        failure: RunError | None = None
        done = said = before = 0

        def apply(signals: Any, row: int) -> None:
            for instance, handle, values in signals:
                instance.write(handle, values[row].tolist())

        try:
            with (
                stoppable() as stopped,
                nullcontext() if file is None else whole(file) as part,
                _Rows(recorders, room, part) as rows,
            ):
                try:
                    for first in range(0, n, _BLOCK):
                        # the last step is shorter where the end is no multiple of the step
                        times = np.minimum(start + step * np.arange(first, min(first + _BLOCK, n) + 1), stop)
                        points = self._signal_values(times)
                        middles = self._signal_values(0.5 * (times[:-1] + times[1:]))
                        moves_inside, moves_over = _moves(points, middles, len(times) - 1)
                        if first == 0:
                            apply(points, 0)
                            self._transfer()
                            rows.add(start)
                        for k, after in enumerate(times[1:].tolist()):
                            # what leads to a failure may have been said while the values for this step were set
                            said, before = before, len(self._journal)
                            t = float(times[k])
                            if moves_inside[k]:
                                apply(middles, k)
                                self._transfer()
                            for instance in self._instances.values():
                                instance.step(t, after - t)
                            self.time = after
                            if moves_over[k]:
                                apply(points, k + 1)
                            self._transfer()
                            done = first + k + 1
                            passed = any(
                                abs(value) > limit
                                for instance, handle, limits in watched
                                for value, limit in zip(instance.read(handle), limits, strict=True)
                            )
                            interrupted = stopped()
                            ended = passed or interrupted or done == n
                            if ended or done % every == 0:
                                rows.add(after)
                            if progress and done % told == 0:
                                progress(after)
                            if ended:
                                break
                        if ended:
                            break
                    if interrupted:
                        raise self._interrupted()
                except RunError as error:
                    # the call that fails may only pass on what another FMU complained of before
                    hint = f" (before: {self._journal[said]})" if len(self._journal) > said + 1 else ""
                    failure = type(error)(f"{error}{hint}")
                    failure.__cause__ = error
        except KeyboardInterrupt:
            # after the last step: the rows are there
            if done == 0:
                raise
            failure = self._interrupted()
        found = rows.dataset() if file is None else xr.open_dataset(file)
        if failure is not None:
            failure.partial = found
            raise failure
        if progress:
            progress(self.time)
        return found

    def _interrupted(self) -> InterruptedRunError:
        return InterruptedRunError(f"interrupted at t = {self.time:g} s")

    def _recorders(self, names: Iterable[str] | None) -> list[_Recorder]:
        """What is kept of each instance, in declared order."""
        there = {name: self._recorded(name) for name in self._instances}
        if names is not None:
            wanted = set(names)
            for full in sorted(wanted - {f"{name}.{v}" for name, vs in there.items() for v in vs}):
                raise InputError(f"{full}: cannot be kept; must be an output or an input with a signal")
            there = {name: [v for v in vs if f"{name}.{v}" in wanted] for name, vs in there.items()}
        return [
            (self._instances[name], self._instances[name].handle(vs), [f"{name}.{v}" for v in vs])
            for name, vs in there.items()
            if vs
        ]

    def _watched(self, guards: Mapping[str, float]) -> list[tuple[Instance, Any, list[float]]]:
        """Handles and limits of what is watched, by instance."""
        split: dict[str, list[tuple[str, float]]] = {}
        for full, limit in guards.items():
            instance, variable = self._split(full, "output")
            split.setdefault(instance, []).append((variable, limit))
        return [
            (
                self._instances[name],
                self._instances[name].handle([v for v, _ in pairs]),
                [x for _, x in pairs],
            )
            for name, pairs in split.items()
        ]

    def _recorded(self, name: str) -> list[str]:
        fmu = self._fmus[name]
        driven = {full.partition(".")[2] for full in self.signals if full.startswith(name + ".")}
        return [*fmu.outputs(), *sorted(driven)]

    # -- branching

    def save(self) -> float:
        """Keep the present state of every FMU, in place of the one kept before; returns the time."""
        for name, instance in self._instances.items():
            if name in self._state:
                instance.forget(self._state[name])
            self._state[name] = instance.state()
        self._saved_at = self.time
        return self.time

    def restore(self) -> None:
        """Return to the state that `save` kept, from which another branch can run."""
        for name, instance in self._instances.items():
            instance.restore(self._state[name])
        self.time = self._saved_at
