"""The monolithic reference: the one model of a system (`chainunit.system.compiled`) under an error-controlled solver.

There is no communication step and no linearised load: each evaluation gives the driver the load of the machine at
exactly the present angle and speed. A co-simulation converges to this solution. casadi traces the equations once,
which is several times as fast as the equations in Python.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.declared_numbers import in_declared_unit
from ..core.engines import MATH, casadi_
from ..core.errors import InputError, RunError, shown
from ..core.quantities import Quantity, Variable
from .compiled import compiled
from .graph import System
from .signals import at_time, corners, signals_by_name

if TYPE_CHECKING:
    import xarray as xr

_TIMES = Variable("times", "times", Quantity("s", "times of the rows"))


def monolithic(
    system: System,
    signals: Mapping[str, Any],
    times: Any,
    *,
    rtol: float = 1e-10,
    start: Mapping[str, float] | None = None,
) -> xr.Dataset:
    """Solve a system of models.

    Parameters
    ----------
    system : a system whose components are all models; the slopes of load ports have no effect, since each load is
        evaluated at its own point
    signals : by full name of an input, a number or a function of time; the solver stops at their `corners`
    times : times of the rows [s], shape (n,)
    rtol : relative tolerance of the solver (DOP853); the absolute tolerance of a state is a thousandth of it times
        the state's nominal size, and at least 1e-12. Rows inside a step are interpolated, without control of the
        error: where a limit of the control bends the course, a row may be wrong by 1e-6 of the peak at the usual
        tolerance, by less than 1e-9 at 1e-12
    start : every state by full name at the first of the times, to continue another solution; by default the
        models' own start

    Returns
    -------
    every state and output except slopes, over ``time``, with the names of a co-simulation of the same system.

    Raises
    ------
    InputError
        where a component is an FMU, whose equations are not known, and for an algebraic loop.
    RunError
        where the solver gives up.
    """
    from scipy.integrate import DOP853

    signals = system.in_units(signals_by_name(signals), "input")
    equations = _Equations(system, signals)
    times = in_declared_unit(_TIMES, times)
    if np.ndim(times) != 1:
        raise InputError(f"times = {shown(times)}: must be a list of times", "times")
    x = equations.start(float(times[0])) if start is None else [start[full] for full in equations.states]
    inner = [c for c in corners(signals.values()) if times[0] < c < times[-1]]
    states = np.empty((len(x), len(times)))
    for low, high in pairwise([times[0], *inner, times[-1]]):
        # at a corner a signal that jumps still has its value of the piece before
        first_time = float(np.nextafter(low, high))

        def rates(t: float, x: Any, first_time: float = first_time) -> Any:
            return equations.rates(max(t, first_time), x)

        solver = DOP853(rates, low, x, high, rtol=rtol, atol=equations.tolerances(rtol))
        states[:, times == low] = np.reshape(x, (-1, 1))
        while solver.status == "running":
            if message := solver.step():
                raise RunError(f"monolithic reference: {message}")
            # only where a row lies in the step: the interpolation costs three evaluations
            first, end = np.searchsorted(times, (solver.t_old, solver.t), side="right")
            if first < end:
                states[:, first:end] = solver.dense_output()(times[first:end])
        x = solver.y
    return equations.dataset(times, states)


class _Equations:
    """The system as one ODE in the states of all models, at its parameters."""

    def __init__(self, system: System, signals: Mapping[str, Any]) -> None:
        component = compiled(system)
        model = self._model = component.model
        values = system.values
        self._signals = [
            signals.get(v.name, values.get(v.name, v.quantity.start)) for v in model.input_layout.variables
        ]
        self._states = model.state_layout.variables if model.state_layout else ()
        self._outputs = model.parts[0].layout.variables
        self.states = [v.name for v in self._states]
        self._p = model.with_derived(MATH, component.parameters)
        rates, self._output_function = self._traced()

        # the function reads and writes these arrays: its call with arrays of the caller costs four times as much
        self._u = np.array([0.0 if callable(signal) else signal for signal in self._signals], float)
        self._x, self._dxdt = np.zeros(len(self.states)), np.zeros(len(self.states))
        self._changing = [(n, signal) for n, signal in enumerate(self._signals) if callable(signal)]
        self._buffer: Any  # its methods take memoryviews, and are declared otherwise
        self._buffer, self._evaluate = rates.buffer()
        self._buffer.set_arg(0, self._u.data)
        self._buffer.set_arg(1, self._x.data)
        self._buffer.set_res(0, self._dxdt.data)

    def _traced(self) -> list[Any]:
        """The functions of casadi (inputs, states) that give the derivatives of the states, and the outputs."""
        import casadi

        model = self._model
        symbols = [casadi.SX.sym("u", len(self._signals)), casadi.SX.sym("x", len(self.states))]
        u = model.input_layout.instance(casadi.vertsplit(symbols[0]))
        x = model.state_layout.instance(casadi.vertsplit(symbols[1])) if model.state_layout else None
        rates = model.derivatives(casadi_(), self._p, u, x) if model.state_layout else []
        outputs = model.parts[0].layout.values(model.evaluate(casadi_(), self._p, u, x)[0])
        return [
            casadi.Function(
                name, symbols, [casadi.densify(casadi.cse(casadi.vertcat(*map(casadi.SX, rows))))]
            )
            for name, rows in (("rates", rates), ("outputs", outputs))
        ]

    def _inputs(self, t: Any) -> list[Any]:
        return [at_time(signal, t) for signal in self._signals]

    def rates(self, t: float, x: Any) -> Any:
        """Derivatives of all states."""
        for n, signal in self._changing:
            self._u[n] = signal(t)
        self._x[:] = x
        self._evaluate()
        return self._dxdt.copy()

    def tolerances(self, rtol: float) -> list[float]:
        """The absolute tolerance of each state."""
        return [max(1e-12, rtol * 1e-3 * (v.quantity.nominal or 1.0)) for v in self._states]

    def start(self, t: float) -> list[float]:
        """States at the start."""
        layout = self._model.state_layout
        u = self._model.input_layout.instance(self._inputs(t))
        return layout.values(self._model.start(MATH, self._p, u)) if layout else []

    def dataset(self, times: Any, states: Any) -> xr.Dataset:
        """All states and outputs; `states` have the shape (states, times)."""
        import xarray as xr

        inputs = [np.broadcast_to(u, times.shape) for u in self._inputs(times)]
        outputs = np.asarray(self._output_function(np.array(inputs).reshape(-1, len(times)), states))
        rows = zip((*self._states, *self._outputs), (*states, *outputs), strict=True)
        variables = {
            v.name: ("time", row, {"units": v.unit, "long_name": v.description.partition(": ")[2]})
            for v, row in rows
        }
        return xr.Dataset(variables, {"time": ("time", times, {"units": "s", "long_name": "time"})})
