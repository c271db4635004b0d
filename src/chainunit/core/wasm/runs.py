"""Runs of a model inside its module: the integrators of `chainunit.core.integrators`, signals, and rows of results.

``run(begin, step, longest, rows, signals, chosen, into, groups)`` goes from the states in memory at the time `begin`
[s] on, and gives the number of rows that are written, one for each of `rows` times `step` [s] apart, the first at
the begin. It writes fewer where the states leave all bounds or a step takes more than ``solver.max_steps`` substeps.
A model with error control has that (`controlled`); its next substep [s] is in memory at the address ``pace``, which
``start()`` sets to 0, as none is known. All others have equal substeps (`rk4`). Substeps are at most `longest` [s],
or, where that is 0, as long as the model allows. At the end, the memory has the states of the last row.

``dense(...)``, of the same arguments, is for models with error control and without constraints on their states. Its
substeps end where a change of a profile begins or ends, and not at every row; the states of a row are interpolated,
see `chainunit.core.wasm.interpolation`.

``signals`` is the address of a table, or 0: the number of signals, and from the next 8 bytes on 24 bytes for each:
the address of an input, the kind of the signal, its number of points or changes, the address of its numbers, and a
place for the point where it was read last, 0 at the begin; all whole numbers of 4 bytes, and 4 bytes free.

- Kind 0, lines between points, each with its time [s] and value. Before the first and behind the last the value
  stays. Of two points with the same time the second holds from there on.
- Kind 1, a `chainunit.system.signals.Profile`: the value at first, and for each change begin [s], duration [s], and
  value after it.

``chosen`` is the address of the number of results of a row, and from the next 8 bytes on their addresses, 4 bytes
each. The rows are written to the address `into`, one after the other. Before each row the outputs of the `groups`
are computed.
"""

from __future__ import annotations

from collections.abc import Mapping

from .. import integrators
from ..symbolic_trace import Trace
from .encoding import Function, Module
from .expressions import OwnFunctions
from .integration import Controlled, RunParts, StateLoop, even
from .interpolation import Reaching
from .memory import BYTES, Places
from .signals import add, signals

RUN_PLACES = ("internal_step", "pace")
"""Places in memory of a run that its host may read or write."""


def write_run(
    t: Trace, memory: Places, module: Module, own: OwnFunctions, written: Mapping[str, Function]
) -> None:
    """Write the functions of runs of a traced model."""
    model = t.model
    assert model.state_layout is not None
    n = len(model.state_layout.names)
    memory.room("table of signals", 1)
    memory.room("now", n)
    parts = RunParts(memory, n, module, own, written, signals(memory, module))
    most = memory["parameters"] + BYTES * model.parameter_layout.names.index(integrators.MAX_STEPS)
    if model.controlled:
        nominal = memory.room("nominal", n)
        module.fill(nominal, [v.quantity.nominal or 1.0 for v in model.state_layout.variables])
        memory.room("stages", n * len(integrators.NODES))
    memory.room("row", n)
    _run(parts, Controlled(parts).write(most) if model.controlled else even(parts, most))
    if model.controlled and t.is_free:
        path = Reaching(parts)
        _run(parts, path.write(most), path)


def _keep_row(f: Function, chosen: int, into: int, source: int, left: int) -> None:
    """Write the `chosen` values `into` the rows, and go on behind them; `source` and `left` are locals for it."""
    f.get(chosen)
    f.set(source)
    f.get(source)
    f.load("i32")
    f.set(left)
    add(f, source, 8)
    with f.block(), f.loop():
        f.get(left)
        f.do("i32.eqz")
        f.leave_if(1)
        f.get(into, source)
        f.load("i32")
        f.load()
        f.store()
        add(f, source, 4)
        add(f, into, BYTES)
        add(f, left, -1)
        f.leave(0)


def _run(parts: RunParts, advance: Function, path: Reaching | None = None) -> None:
    """The function of runs; `advance` ends at each row, or goes on along a path."""
    memory, written = parts.memory, parts.written
    name = "run" if path is None else "dense"
    f = parts.module.function(["f64", "f64", "f64", "i32", "i32", "i32", "i32", "i32"], ["i32"], name)
    begin, step, longest, rows, table, chosen, into, groups = range(8)
    row, time, left, source, end = f.local("i32"), f.local(), f.local("i32"), f.local("i32"), f.local()
    x, kept, states = memory["states"], memory["row"], StateLoop(f, parts)

    def time_of_row() -> None:
        f.get(begin, row)
        f.do("f64.convert_i32_u")
        f.get(step)
        f.do("f64.mul", "f64.add")

    with f.into(memory["table of signals"], "i32"):
        f.get(table)
    f.get(longest)
    f.f64(0.0)
    f.do("f64.eq")
    with f.when():
        f.call(written["internal_step"])
        f.at(memory["internal_step"])
        f.set(longest)
    sum_ = f.local()
    if path is not None:
        path.begin_at(f, begin)
        f.get(begin, rows)
        f.i32(1)
        f.do("i32.sub", "f64.convert_i32_u")
        f.get(step)
        f.do("f64.mul", "f64.add")
        f.set(end)
    with f.block(), f.loop():
        f.get(row, rows)
        f.do("i32.ge_s")
        f.leave_if(1)
        time_of_row()
        f.set(time)
        f.get(time)
        f.call(parts.signals)
        f.get(groups)
        f.call(written["values"])
        _keep_row(f, chosen, into, source, left)
        add(f, row, 1)
        f.get(row, rows)
        f.do("i32.ge_s")
        f.leave_if(1)
        f.copy(kept, x, parts.room)
        if path is None:
            f.get(time, step, longest)
            f.call(advance)
        else:
            time_of_row()
            f.set(time)
            f.get(time, end, longest)
            f.call(advance)
            path.states_at(f, states, time)
        f.f64(0.0)
        f.set(sum_)
        with states.each():
            f.get(sum_)
            states.push(x)
            f.f64(0.0)
            f.do("f64.mul", "f64.add")
            f.set(sum_)
        f.get(sum_)
        f.f64(0.0)
        f.do("f64.eq", "i32.and")
        f.leave_if(0)
        f.copy(x, kept, parts.room)
    f.get(row)
