"""Transients of a model without a C compiler: run by run in Python, by the integrators of Python FMUs. CasADi
evaluates the equations. The steps of the integrator end at rows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..core import integrators
from ..core.model import Model
from .equations import find


class PythonLoop:
    """The loop of a model, with the interface of the native one; `names` are the uniform arguments, and `lanes`
    is the number of runs that share a vector.

    Parameters
    ----------
    model, outputs, varying, driven, guarded : see `chainunit.batch.transients.Transients`
    symbols, groups : the vectors of parameters, inputs and states; the derivatives of the states, the kept rows, and
        the states that meet the constraints, none if the integrator has equal steps

    Raises
    ------
    InputError
        for an unknown name.
    """

    lanes = 1
    digest = ""
    """empty: without native code there is nothing to identify"""

    def __init__(
        self,
        model: Model,
        outputs: Sequence[str],
        varying: Sequence[str],
        driven: Sequence[str],
        guarded: Sequence[str],
        symbols: Sequence[Any],
        groups: Sequence[Any],
    ) -> None:
        import casadi

        assert model.state_layout is not None
        self.names = [*model.parameter_layout.names, *model.input_layout.names]
        self._count = len(model.parameter_layout.names)
        self._varying = find(varying, model.parameter_layout.names, "parameter")
        self._driven = find(driven, model.input_layout.names, "input")
        self._guarded = find(guarded, outputs, "output that is kept")
        self._controlled = model.controlled
        self._nominal = [v.quantity.nominal or 1.0 for v in model.state_layout.variables]
        self._functions = self._rates, self._results, self._closed = tuple(
            casadi.Function(name, list(symbols), [casadi.densify(group)])
            for name, group in zip(("rates", "results", "closed"), groups, strict=True)
        )

    def __call__(
        self,
        runs: tuple[int, int],
        numbers: Sequence[float],
        arrays: Sequence[Any],
        x: Any,
        out: Any,
        count: Any,
    ) -> None:
        """Simulate the runs from the first number to before the second.

        Parameters
        ----------
        numbers : time between rows [s], longest step [s], tolerance, and most substeps of a step
        arrays : uniform arguments, shape (arguments,); varying parameters; signals; begins and stops; limits: see
            `chainunit.batch.transients.Transients.run`, the runs last
        x : states at the begin, shape (states, runs); those at the end replace them
        out : rows to be filled, shape (outputs, runs, rows)
        count : numbers of rows to be filled, shape (runs,); negative if the last one is not finite
        """
        uniform, varying, signals, begin, stop, limits = arrays
        for r in range(*runs):
            p, u = uniform[: self._count].copy(), uniform[self._count :].copy()
            p[self._varying] = varying[: len(self._varying), r]
            ends = float(begin[r]), float(stop[r])
            count[r] = self._run((p, u), signals[:, :, r], ends, numbers, limits[:, r], x[:, r], out[:, r])

    def _run(
        self,
        constants: tuple[Any, Any],
        signals: Any,
        ends: tuple[float, float],
        numbers: Sequence[float],
        limits: Any,
        x: Any,
        out: Any,
    ) -> int:
        """Fill the rows of a run, shape (outputs, rows), and replace its states; gives the number of rows, negative
        if the last one is not finite. `constants` are the parameters and the inputs, whose driven ones change."""
        p, u = constants
        step, longest, tolerance, most = numbers
        time, stop = ends
        signals = signals[: len(self._driven)]
        u[self._driven], moving = signals[:, 0], _moving(signals)
        state = np.array(x, float)
        evaluated = {function: _Evaluation(function, (p, u, state)) for function in self._functions}

        def values_at(function: Any, t: float, states: Sequence[float]) -> list[float]:
            for k, row in moving:
                u[self._driven[k]] = _signal_at(row, t)
            state[:] = states
            return evaluated[function]()

        def advanced(size: float) -> tuple[list[float], float]:
            """The states after a step of this size [s] from the present time, and the next substep [s]."""

            def rates(since: float, states: Sequence[float]) -> list[float]:
                return values_at(self._rates, time + since, states)

            def close(since: float, states: Sequence[float]) -> list[float]:
                return values_at(self._closed, time + since, states)

            if not self._controlled:
                return integrators.rk4(rates, now, size, longest, most), 0.0
            return integrators.controlled(
                rates, close, now, size, pace, longest, tolerance, self._nominal, most
            )

        now, pace, rows = [float(start) for start in x], 0.0, out.shape[-1]
        for n in range(rows):
            if n:
                following = min(ends[0] + n * step, stop)
                if not following > time:
                    return n
                try:
                    now, pace = advanced(following - time)
                except ArithmeticError:
                    now = [math.nan] * len(now)
                time = following
            out[:, n] = values_at(self._results, time, now)
            x[:] = now
            if not (np.isfinite(out[:, n]).all() and np.isfinite(x).all()):
                return -(n + 1)
            if (np.abs(out[self._guarded, n]) > limits[: len(self._guarded)]).any():
                return n + 1
        return rows


class _Evaluation:
    """A function of CasADi with arrays as its arguments, whose values are read at each call."""

    def __init__(self, function: Any, arguments: Sequence[Any]) -> None:
        self._buffer, self._evaluate = function.buffer()
        # the buffer does not keep them alive
        self._arguments = arguments
        self._values: Any = np.zeros(function.numel_out(0))
        for k, array in enumerate(arguments):
            self._buffer.set_arg(k, array.data)
        self._buffer.set_res(0, self._values.data)

    def __call__(self) -> list[float]:
        self._evaluate()
        return self._values.tolist()


def _moving(signals: Any) -> list[tuple[int, list[float]]]:
    """The signals that change, of the shape (inputs, 1 + 3*changes), each with its number."""
    return [(k, row.tolist()) for k, row in enumerate(signals) if np.isfinite(row[1::3]).any()]


def _signal_at(row: Sequence[float], t: float) -> float:
    """The value of a signal at a time, see transients.h."""
    value = before = row[0]
    for begin, duration, after in zip(row[1::3], row[2::3], row[3::3], strict=True):
        z = min(max((t - begin) / duration, 0.0), 1.0)
        value += (after - before) * (z * z * z * (10.0 + z * (6.0 * z - 15.0)))
        before = after
    return value
