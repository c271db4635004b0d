"""Columns of a machine over crank angles and speeds, with exact first and second derivatives, in native code.

The columns are functions of the free parameters x and of the crank angle q. Numbers that the groups of a linkage
derive from its lengths stay arguments of the compiled code: their own derivatives are long, do not depend on the
angle, and come from CasADi. Derivatives are taken in directions, which are the outer dimension of the loop, so that
the code stays short however many parameters are free.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ...batch.arrays import by_numpy
from ...batch.equations import Equations, Result
from ...batch.native import aligned, native_kernel
from ...batch.reductions import ReducedColumn, Reductions, flat_numbers
from ...core.engines import casadi_
from ...core.errors import RunError
from ...core.printing.operations import Operations
from ...core.symbolic_trace import trace
from ...machines.machine import Machine

_P, _U, _K, _LANE, _WEIGHT, _SEED = range(6)
"""The arguments of the compiled code: parameters, inputs, derived numbers, (angle, speed), weights, direction."""


class AngleDerivatives(NamedTuple):
    """A column in each lane: its `value`, its `slope` by the angle, each of shape (lanes,), the derivatives of this
    slope by the free parameters, `mixed`, shape (free, lanes), and by the angle, `curvature`, shape (lanes,)."""

    value: Any
    slope: Any
    mixed: Any
    curvature: Any


class Kernel:
    """Columns of a machine as functions of its free parameters.

    Parameters
    ----------
    machine : gives the model, and all parameters that are not free
    feed : the loads
    columns : the expressions of `symbols_of`, by which the rows of all results count
    free : the names of the free parameters

    The arguments `q` and `w` of the methods are crank angles [rad] and crank speeds [rad/s], shape (lanes,).
    A lane in which the machine cannot be assembled is NaN.
    """

    def __init__(self, machine: Machine, feed: Any, columns: Sequence[Any], free: Sequence[str]) -> None:
        import casadi

        model = machine.model
        self.size, self.rows = len(free), len(columns)
        t = trace(model)
        p, u, _, k = t.symbols
        names = model.parameter_layout.names
        self._places = [names.index(name) for name in free]
        self._model = model
        self._p = np.array(model.parameter_layout.values(machine.p), float)
        inputs = dict.fromkeys(model.input_layout.names, 0.0) | model.feed_layout.by_name(feed)
        self._u = np.array([inputs[name] for name in model.input_layout.names], float)
        lane = casadi.SX.sym("lane", 2)
        weight, seed = (
            casadi.SX.sym("weight", self.rows),
            casadi.SX.sym("seed", self.size + 1 + model.derived_count),
        )
        ratio = p[names.index("ratio")]
        shaft = {"phi": lane[0] * ratio, "w": lane[1] * ratio, "a": casadi.SX(0.0)}
        places = [model.input_layout.names.index(name) for name in shaft]
        rows = casadi.substitute(
            casadi.densify(casadi.vertcat(*map(casadi.SX, columns))),
            casadi.vertcat(*(u[i] for i in places)),
            casadi.vertcat(*shaft.values()),
        )
        self._symbols = [p, u, k, lane, weight, seed]
        point = casadi.vertcat(*(p[i] for i in self._places), lane[0], k)
        along = _along(rows, point, seed)
        gradient = casadi.gradient(casadi.dot(weight, rows), point)
        bend = _along(gradient, point, seed)
        self._values = self._equations([rows])
        self._slopes = self._equations([rows, along])
        self._bends = self._equations([bend, gradient[self.size + 1 :]])
        self._last: tuple[bytes, Any] = (b"", None)

    def _equations(self, groups: Sequence[Any]) -> Equations:
        import casadi

        rows = casadi.vertcat(*groups)
        operations = Operations(self._symbols, [rows, casadi.SX(0.0)])
        results = tuple(Result(str(place), "1", "") for place in range(rows.numel()))
        return Equations(self._model, (), results, operations)

    @cached_property
    def _derived(self) -> Any:
        """The derived numbers as functions of the free parameters: value, slopes, and the bend of their sum with
        weights."""
        import casadi

        p = self._symbols[_P]
        free = casadi.vertcat(*(p[i] for i in self._places))
        values = self._model.derive(casadi_(), self._model.parameter_layout.instance(casadi.vertsplit(p)))
        k = casadi.vertcat(*values)
        weights = casadi.SX.sym("weights", k.numel())
        return (
            casadi.Function("k", [p], [k]),
            casadi.Function("dk", [p], [casadi.densify(casadi.jacobian(k, free))]),
            casadi.Function(
                "ddk", [p, weights], [casadi.densify(casadi.hessian(casadi.dot(weights, k), free)[0])]
            ),
        )

    def parameters(self, x: Any) -> Any:
        """The values of all parameters, in declared order, for free ones of the values `x`."""
        p = self._p.copy()
        p[self._places] = x
        return p

    def _arguments(self, xs: Any) -> tuple[Any, Any]:
        """All parameters and derived numbers of machines, shapes (machines, ..)."""
        p = np.tile(self._p, (len(xs), 1))
        p[:, self._places] = xs
        if not self._model.derived_count:
            return p, np.zeros((len(xs), 0))
        return p, np.array([np.array(self._derived[0](row)).ravel() for row in p])

    def _run(
        self,
        equations: Equations,
        outer: Mapping[int, Any],
        lanes: Mapping[int, Any],
        size: tuple[int, int],
        reductions: Reductions = (),
    ) -> Any:
        """Results, shape (results, outer, inner), or (results, outer) where they are reduced. `outer` are arguments
        that are constant over the lanes, shape (1 or outer, entries); `lanes` the entries that vary, shape (entries,
        inner)."""
        varying = tuple((kind, row) for kind, x in lanes.items() for row in range(len(x)))
        kernel = native_kernel(equations, varying, reductions)
        if kernel is None:
            return self._by_numpy(equations, outer, lanes, size, bool(reductions))
        shape = size[:1] if reductions else size
        out, reason = aligned((len(reductions or equations.results), *shape)), np.zeros(shape, np.int16)
        uniform = np.empty((len(kernel.inputs), size[0]))
        for row, (kind, place) in zip(uniform, kernel.inputs, strict=True):
            row[:] = outer[kind][:, place]
        columns = np.empty((len(kernel.columns), 1, size[1]))
        for part, (kind, place) in zip(columns, kernel.columns, strict=True):
            part[0] = lanes[kind][place]
        kernel(uniform, columns, out, reason, size, flat_numbers(()), 1)
        return out

    def _by_numpy(
        self,
        equations: Equations,
        outer: Mapping[int, Any],
        lanes: Mapping[int, Any],
        size: Any,
        reduced: bool,
    ) -> Any:
        arguments: dict[tuple[int, int], Any] = {}
        for kind, x in outer.items():
            arguments |= {(kind, place): x[:, place, None] for place in range(x.shape[1])}
        for kind, x in lanes.items():
            arguments |= {(kind, place): row[None, :] for place, row in enumerate(x)}
        out, reason = np.empty((len(equations.results), *size)), np.zeros(size, np.int16)
        by_numpy(equations.operations, arguments, out, reason, equations.not_finite)
        return np.mean(out, axis=-1) if reduced else out

    def values(self, xs: Any, q: Any, w: Any) -> Any:
        """The columns of machines `xs`, shape (machines, free): shape (rows, machines, lanes)."""
        xs = np.atleast_2d(xs)
        p, k = self._arguments(xs)
        outer = {_P: p, _U: self._u[None, :], _K: k}
        return self._run(self._values, outer, {_LANE: np.array([q, w])}, (len(xs), len(q)))

    def _directions(self, x: Any) -> tuple[dict[int, Any], Any]:
        """The arguments that are constant over the lanes, and the slopes of the derived numbers; the outer
        dimension is that of the directions: each free parameter, then the angle. The values of the last machine
        are kept."""
        if self._last[0] != x.tobytes():
            p, k = self._arguments(x[None, :])
            seeds = np.eye(self.size + 1, self.size + 1 + k.shape[1])
            slopes = np.zeros((k.shape[1], self.size))
            if k.shape[1]:
                slopes = np.array(self._derived[1](p[0]))
                seeds[: self.size, self.size + 1 :] = slopes.T
            self._last = x.tobytes(), ({_P: p, _U: self._u[None, :], _K: k, _SEED: seeds}, slopes)
        return self._last[1]

    def slopes(self, x: Any, q: Any, w: Any) -> tuple[Any, Any]:
        """The columns at `x`, shape (rows, lanes), and their derivatives by each free parameter and by the angle,
        shape (rows, free + 1, lanes)."""
        outer, _ = self._directions(x)
        out = self._run(self._slopes, outer, {_LANE: np.array([q, w])}, (self.size + 1, len(q)))
        return out[: self.rows, 0], out[self.rows :]

    def bend(self, x: Any, q: Any, w: Any, weights: Any) -> Any:
        """The matrix of second derivatives, by the free parameters and the angle, of the sum of all columns over all
        lanes with `weights`, shape (rows, lanes): shape (free + 1, free + 1)."""
        outer, slopes = self._directions(x)
        used = np.flatnonzero(np.any(weights != 0.0, axis=0))
        n = self.size
        if not len(used):
            return np.zeros((n + 1, n + 1))
        lanes = {_LANE: np.array([q[used], w[used]]), _WEIGHT: weights[:, used]}
        results = len(self._bends.results)
        means = tuple(ReducedColumn(place, "mean") for place in range(results))
        out = len(used) * self._run(self._bends, outer, lanes, (n + 1, len(used)), means)
        matrix = out[: n + 1].copy()
        if len(slopes):
            matrix[:n] += slopes.T @ out[n + 1 : n + 1 + len(slopes)]
            by_derived = out[n + 1 + len(slopes) :, 0]
            matrix[:n, :n] += np.array(self._derived[2](outer[_P][0], by_derived))
        return 0.5 * (matrix + matrix.T)

    def derivatives_by_angle(self, x: Any, q: Any, w: Any, columns: Any) -> AngleDerivatives:
        """The derivatives of one column in each lane, `columns` of shape (lanes,)."""
        outer, slopes = self._directions(x)
        outer, n, lanes = {**outer, _SEED: outer[_SEED][-1:]}, self.size, np.arange(len(q))
        out = self._run(self._slopes, outer, {_LANE: np.array([q, w])}, (1, len(q)))[:, 0]
        weights = np.zeros((self.rows, len(q)))
        weights[columns, lanes] = 1.0
        bend = self._run(self._bends, outer, {_LANE: np.array([q, w]), _WEIGHT: weights}, (1, len(q)))[:, 0]
        mixed = bend[:n]
        if len(slopes):
            mixed = mixed + slopes.T @ bend[n + 1 : n + 1 + len(slopes)]
        return AngleDerivatives(out[columns, lanes], out[self.rows + columns, lanes], mixed, bend[n])


def _along(rows: Any, point: Any, seed: Any) -> Any:
    import casadi

    return casadi.densify(casadi.jtimes(rows, point, seed))


def symbols_of(machine: Machine, names: Sequence[str]) -> list[Any]:
    """The columns of these names in CasADi's symbols.

    Raises
    ------
    RunError
        for a name that the model does not have.
    """
    columns = trace(machine.model).columns
    missing = [name for name in names if name not in columns]
    if missing:
        raise RunError(f"{missing[0]}: no such column of the {machine.model.name}")
    return [columns[name][1] for name in names]


def pieces(expression: Any, kind: str) -> list[Any]:
    """The expressions whose least value (`kind` "FMIN") or largest value ("FMAX") an expression is: itself, where
    it is no such choice. The pieces are smooth where the choice has kinks."""
    import casadi

    expression = casadi.SX(expression)
    if (
        expression.numel() == 1
        and expression.n_dep() == 2
        and expression.op() == getattr(casadi, f"OP_{kind}")
    ):
        return [piece for k in (0, 1) for piece in pieces(expression.dep(k), kind)]
    return [expression]
