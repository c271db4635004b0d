"""Transients of a model in blocks: many runs side by side, in one native loop without Python between the steps;
without a C compiler in Python.

Runs differ in parameters, states at the start, signals, and end. Each is integrated by the method of the model's FMU,
with equal steps or with error control of its own (`chainunit.core.integrators`), and its signals are evaluated at
every stage. Without constraints a step need not end at a row: the rows are interpolated (`integrators.DENSE`).

A run may carry a direction in the space of parameters, inputs and states at the start. Then the exact derivative of
the run in this direction is integrated beside it, under the same control of the error: as many runs with the same
values and different directions give the sensitivities to as many parameters.
"""

from __future__ import annotations

import ctypes
import hashlib
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from ..core import integrators
from ..core.engines import MATH, casadi_
from ..core.errors import InputError, RunError
from ..core.model import Model
from ..core.native.compilers import COMPILERS, Compiler, compiler
from ..core.printing.c_forms import STEP, c_file, constant
from ..core.printing.kernels import STEP_NUMBERS
from ..core.printing.operations import Operations
from ..core.printing.vector_code import VectorCode, header
from ..core.symbolic_trace import outputs_of, trace
from .equations import arguments_of, find, names_of
from .native import load, threads
from .python_loop import PythonLoop

_LANES = 8
"""The number of runs is filled up to a multiple of it, a multiple of the lanes of every vector."""


def profile_rows(signal: Any, changes: int) -> list[float]:
    """A number or a `chainunit.system.signals.Profile` as `Transients.run` takes it: the value before, and so many
    changes with begin [s], duration [s] and value after it.

    Raises
    ------
    ValueError
        for a profile with more changes.
    """
    changes_of_signal = getattr(signal, "changes", ())
    if len(changes_of_signal) > changes:
        raise ValueError(f"a profile with {len(changes_of_signal)} changes: at most {changes} are allowed")
    rows = [
        float(getattr(signal, "start", signal)),
        *(float(x) for change in changes_of_signal for x in change),
    ]
    while len(rows) < 1 + 3 * changes:
        rows += [math.inf, 1.0, rows[-1]]
    return rows


def signal_table(
    driven: Sequence[str], signals: Sequence[Mapping[str, Any]], otherwise: Mapping[str, float], changes: int
) -> Any:
    """The signals of runs by the names of the `driven` inputs, with the values `otherwise` of signals that a run does
    not change, as `Transients.run` takes them: shape (inputs, 1 + 3*changes, runs)."""
    rows = [
        [profile_rows(run_signals.get(name, otherwise.get(name, 0.0)), changes) for run_signals in signals]
        for name in driven
    ]
    return np.moveaxis(np.reshape(rows, (len(driven), len(signals), 1 + 3 * changes)), 1, -1)


@dataclass(frozen=True)
class Runs:
    """The results of a block of runs.

    `rows` has the shape (outputs, runs, rows); a run has `count` rows, shape (runs,), after which the values have no
    meaning. If `failed`, shape (runs,), the last of them is not finite. `states` are those at the end, shape
    (states, runs), and `times` the times of the rows [s], shape (runs, rows). With directions, `slopes` are the
    derivatives of the rows, of the same shape, and the derivatives of the states follow the states.
    """

    rows: Any
    slopes: Any
    count: Any
    failed: Any
    states: Any
    times: Any

    def end(self, run: int) -> float:
        """The time of the last row of a run [s]."""
        return float(self.times[run, self.count[run] - 1])

    def failure(self, run: int) -> RunError | None:
        """The error of a run that failed."""
        return (
            RunError(f"at t = {self.end(run):g} s: the states left all bounds") if self.failed[run] else None
        )


def can_run() -> bool:
    """Whether there is a C compiler, and so the fast loop for many runs."""
    return compiler() is not None


class _NativeLoop:
    """The compiled loop, with the `digest` of its source; `names` are its uniform arguments, and the number of runs
    is filled up to a multiple of `lanes`."""

    lanes = _LANES

    def __init__(self, digest: str, library: ctypes.CDLL, names: Sequence[str]) -> None:
        self.digest, self.names, self._library = digest, names, library

    def __call__(
        self,
        runs: tuple[int, int],
        numbers: Sequence[float],
        arrays: Sequence[Any],
        x: Any,
        out: Any,
        count: Any,
    ) -> None:
        """See `PythonLoop`."""
        self._library.transients(
            *map(ctypes.c_long, (*runs, *out.shape[1:])),
            *map(ctypes.c_double, numbers),
            *(ctypes.c_void_p(array.ctypes.data) for array in (*arrays, x, out, count)),
        )


class Transients:
    """The compiled loop of a model; `digest` is that of its source.

    Parameters
    ----------
    model : a model with states, such as a compiled system
    outputs : names of the outputs and states to keep
    varying : names of the parameters that differ between runs
    driven : names of the inputs with signals or with values that differ between runs
    guarded : the outputs that may end a run by a limit of their size
    by : names of the parameters and inputs of which a direction consists

    Raises
    ------
    InputError
        for an unknown name, a model without states, and for directions without a C compiler.
    """

    def __init__(
        self,
        model: Model,
        outputs: Sequence[str],
        *,
        varying: Sequence[str] = (),
        driven: Sequence[str] = (),
        guarded: Sequence[str] = (),
        by: Sequence[str] = (),
        changes: int = 0,
    ) -> None:
        if model.state_layout is None:
            raise InputError(f"{model.name}: has no states, and so no transients")
        self.model, self.outputs = model, tuple(outputs)
        self._varying, self._driven, self._guarded = tuple(varying), tuple(driven), tuple(guarded)
        self._changes, self._by = changes, tuple(by)
        chosen = self.outputs, self._varying, self._driven, self._guarded
        self._loop: _NativeLoop | PythonLoop
        if local_compiler := compiler():
            self._loop = _compiled(model, *chosen, self._by, changes, local_compiler)
        elif by:
            raise InputError(f"no C compiler ({COMPILERS}) found")
        else:
            self._loop = PythonLoop(model, *chosen, *_equations(model, self.outputs, ()))
        self.digest = self._loop.digest

    def run(
        self,
        parameters: Any,
        inputs: Mapping[str, float],
        states: Any,
        *,
        begin: Any,
        step: float,
        stop: Any,
        varying: Any = None,
        signals: Any = None,
        limits: Any = None,
        directions: Any = None,
        longest: float | None = None,
        workers: int = 1,
    ) -> Runs:
        """Simulate a block of runs.

        Parameters
        ----------
        parameters : an instance of the model's declaration, for all that do not vary
        inputs : values of the inputs by name; all others have their start values
        states : at the begin, shape (states,) or (states, runs); with directions, their derivatives follow them
        begin, stop : begin and end of each run [s], shape (runs,), or one begin of all
        step : time between rows [s]; the last step of a run may be shorter
        varying : values of the parameters that differ, shape (parameters, runs)
        signals : of the driven inputs, shape (inputs, 1 + 3*changes, runs): the value before, and for each change its
            begin [s], its duration [s] and the value after it; see `chainunit.system.signals.Profile`
        limits : of the guarded outputs, shape (guarded, runs): a run ends with the row beyond its limit
        directions : of each run, the change of each quantity in `by`, shape (by, runs). The error of the derivative
            is held to the tolerance of the states themselves: a change of the size that matters is a good one.
        longest : longest step of the integrator [s]; by default the one of the model
        workers : number of threads
        """
        stop = np.atleast_1d(np.asarray(stop, float))
        runs = len(stop)
        begin = np.broadcast_to(np.asarray(begin, float), runs)
        rows = 1 + max(0, math.ceil(float(np.max(stop - begin)) / step - 1e-9))
        x = np.asarray(states, float)
        x = self._filled(x if x.ndim == 2 else x[:, None], runs, len(x))
        room = x.shape[-1]
        arrays = [
            self._uniform(parameters, inputs),
            self._run_values(varying, directions, runs),
            self._filled(signals if self._driven else 0.0, runs, len(self._driven), 1 + 3 * self._changes),
            self._filled(begin, runs),
            self._filled(stop, runs),
            self._filled(np.inf if limits is None or not self._guarded else limits, runs, len(self._guarded)),
        ]
        out = np.empty((len(self.outputs) * (2 if self._by else 1), room, rows))
        count = np.zeros(room, np.int64)
        p, model = self.model.with_derived(MATH, parameters), self.model
        numbers = [
            step,
            longest or float(model.internal_step(MATH, p)),
            float(model.tolerance(MATH, p)) if model.controlled else 0.0,
            model.parameter_layout.by_name(parameters)[integrators.MAX_STEPS],
        ]

        def piece(ends_of: tuple[int, int]) -> None:
            self._loop(ends_of, numbers, arrays, x, out, count)

        lanes = self._loop.lanes
        pieces = [(r, r + lanes) for r in range(0, room, lanes)]
        if workers == 1:
            piece((0, runs))
        else:
            list(threads(min(workers, os.cpu_count() or 1)).map(piece, pieces))
        times = np.minimum(begin[:, None] + step * np.arange(rows), stop[:, None])
        count = count[:runs]
        table, slopes = out[: len(self.outputs), :runs], out[len(self.outputs) :, :runs]
        return Runs(table, slopes if self._by else None, np.abs(count), count < 0, x[:, :runs], times)

    def _filled(self, x: Any, runs: int, *shape: int) -> Any:
        """The values of all runs, filled up to whole vectors by the values of the last run; a new array of the shape
        (*shape, lanes)."""
        full = np.broadcast_to(np.asarray(x, float), (*shape, runs))
        padding = np.repeat(full[..., -1:], -runs % self._loop.lanes, -1)
        return np.ascontiguousarray(np.concatenate([full, padding], -1))

    def _run_values(self, varying: Any, directions: Any, runs: int) -> Any:
        """The constant values that differ between runs: varying parameters, then directions."""
        parts = [(varying, len(self._varying)), (directions, len(self._by))]
        return np.concatenate([self._filled(x if n else 0.0, runs, n) for x, n in parts])

    def _uniform(self, parameters: Any, inputs: Mapping[str, float]) -> Any:
        """The uniform arguments in the order of the code."""
        model = self.model
        values = {v.name: v.quantity.start for v in arguments_of(model)}
        values |= model.parameter_layout.by_name(parameters) | dict(inputs)
        return np.array([values[name] for name in self._loop.names] or [0.0], float)


@lru_cache(maxsize=32)
def _compiled(
    model: Model,
    outputs: tuple[str, ...],
    varying: tuple[str, ...],
    driven: tuple[str, ...],
    guarded: tuple[str, ...],
    by: tuple[str, ...],
    changes: int,
    compiler: Compiler,
) -> _NativeLoop:
    """The compiled loop of a model, see `Transients`."""
    operations = _operations(model, outputs, by)
    assert model.state_layout is not None
    sides = 2 if by else 1
    states = model.state_layout.variables * sides
    constants = len(varying) + len(by)
    entries = [
        *((0, k) for k in find(varying, model.parameter_layout.names, "parameter")),
        *((3, k) for k in range(len(by))),
        *((1, k) for k in find(driven, model.input_layout.names, "input")),
        *((2, k) for k in range(len(states))),
    ]
    find(guarded, outputs, "output that is kept")
    code = VectorCode(operations, entries)
    places = {entry: k for k, entry in enumerate(entries)}

    def argument(entry: tuple[int, int]) -> str:
        """The vector of an argument that differs between runs: a constant of each run, a signal, or a state."""
        k = places[entry]
        if k < constants:
            return f"b->given[{k}]"
        if k < constants + len(driven):
            return f"signal_at(b->signal + {(k - constants) * (1 + 3 * changes)} * b->runs, b->runs, t)"
        return f"x[{entry[1]}]"

    guards = [
        f"if (fabs(y[{outputs.index(name)}][l]) > limit[{k} * runs + r + l]) ends = 1;"
        for k, name in enumerate(guarded)
    ]
    defines = {
        "STATES": len(states),
        "ROWS": len(outputs) * sides,
        "PARAMS": constants,
        "COLUMNS": len(code.columns),
        "ROOM": code.room,
        "CHANGES": changes,
        "SIGNALS": len(driven),
        "METHOD": _method(model),
        "PUT": " ".join(f"a[{k}] = {argument(entry)};" for k, entry in enumerate(code.columns)),
        "GUARDED": " ".join(guards),
    }
    numbers = STEP_NUMBERS | {"NOMINAL": tuple(v.quantity.nominal or 1.0 for v in states)}
    source = "\n".join(
        [
            header(),
            *(f"#define {name} {value}" for name, value in defines.items()),
            *(constant(name, value) for name, value in numbers.items()),
            code.uniform(),
            code.body("rates", (0,)),
            code.body("results", (1,)),
            code.body("closed", (2,)) if model.controlled else "",
            c_file("transients.h", __package__),
        ]
    )
    layouts = model.parameter_layout, model.input_layout
    uniform = [layouts[kind].names[k] for kind, k in code.inputs]
    files = {STEP: c_file(STEP)}
    digest = hashlib.sha256((source + files[STEP]).encode()).hexdigest()
    return _NativeLoop(digest, load(source, compiler, files), uniform)


def _method(model: Model) -> str:
    """How the model is integrated, see transients.h."""
    if not model.controlled:
        return "EVEN"
    return "INTERPOLATED" if trace(model).is_free else "TO_ROWS"


@lru_cache(maxsize=4)
def _operations(model: Model, outputs: tuple[str, ...], by: tuple[str, ...]) -> Operations:
    """The operations of `_equations`."""
    return Operations(*_equations(model, outputs, by))


def _equations(model: Model, outputs: tuple[str, ...], by: tuple[str, ...]) -> tuple[list[Any], list[Any]]:
    """The arguments, and three groups: the derivatives of the states, these outputs and states, and the states that
    meet the constraints of a model with error control. The derivatives of each group in a direction follow it; the
    direction consists of derivatives of the states, which follow the states, and of the changes of the quantities in
    `by`, a fourth argument."""
    import casadi

    t = trace(model)
    assert model.state_layout is not None
    declared = names_of((*model.state_layout.variables, *outputs_of(model)))
    values = [*casadi.vertsplit(t.symbols[2]), *t.outputs]
    rows = casadi.vertcat(*(casadi.SX(values[k]) for k in find(outputs, declared, "output")), casadi.SX(0, 1))
    rates = casadi.vertcat(*(casadi.SX(rate) for rate in t.derivatives))
    closed = model.constrained_states(casadi_(), t.p, t.u, t.x) if model.controlled else []
    met = casadi.vertcat(*(casadi.SX(x) for x in closed), casadi.SX(0, 1))
    p, u, x = t.symbols[:3]
    groups = t.explicit([rates, rows, met])
    if not by:
        return [p, u, x], groups
    names = [*model.parameter_layout.names, *model.input_layout.names]
    direction, changes = casadi.SX.zeros(len(names)), casadi.SX.sym("d", len(by))
    for k, place in enumerate(find(by, names, "parameter or input")):
        direction[place] = changes[k]
    slopes = casadi.SX.sym("dx", x.numel())
    point, direction = casadi.vertcat(p, u, x), casadi.vertcat(direction, slopes)
    groups = [casadi.vertcat(group, casadi.jtimes(group, point, direction)) for group in groups]
    return [p, u, casadi.vertcat(x, slopes), changes], groups
