"""The columns of a machine over the turn, and its requirements, as CasADi's functions of the free parameters."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np

from ...core.engines import casadi_
from ...core.errors import RunError
from ...core.symbolic_trace import trace
from .wishes import Wishes


class Columns:
    """Columns of a machine, which get numbers as they are asked for, and its requirements.

    The arguments `x` of the methods are the free parameters, shape (free,), and `q` and `w` crank angles [rad] and
    crank speeds [rad/s], shape (lanes,). A lane in which the machine cannot be assembled is NaN. `subjects` are the
    places of the requirements in ``model.required``, one for each distance of `distances`.
    """

    def __init__(self, wishes: Wishes) -> None:
        import casadi

        model = wishes.machine.model
        self.low, high = np.array(list(wishes.free.values()), float).T
        self.span, self.size = high - self.low, len(self.low)
        self._trace = trace(model)
        names = model.parameter_layout.names
        x, lane = casadi.SX.sym("x", self.size), casadi.SX.sym("lane", 2)
        p = casadi.SX(casadi.DM(model.parameter_layout.values(wishes.machine.p)))
        for name, value in zip(wishes.names, casadi.vertsplit(x), strict=True):
            p[names.index(name)] = value
        self._ratio = casadi.Function("ratio", [x], [p[names.index("ratio")]])
        shaft = {"phi": lane[0] * self._ratio(x), "w": lane[1] * self._ratio(x), "a": 0.0}
        inputs = dict.fromkeys(model.input_layout.names, 0.0) | model.feed_layout.by_name(wishes.feed) | shaft
        u = casadi.vertcat(*(inputs[name] for name in model.input_layout.names))
        self._symbols, self._values = self._trace.symbols[:2], [p, u]
        self._x, self._lane, self._derived = x, lane, self._trace.symbols[3]
        numbers = model.derive(casadi_(), model.parameter_layout.instance(casadi.vertsplit(p)))
        self.derived = casadi.Function("derived", [x], [casadi.vertcat(casadi.SX(0, 1), *numbers)])
        self._expressions: list[Any] = []
        self._places: dict[tuple[str, str], tuple[int, ...]] = {}
        self._functions: dict[tuple[tuple[int, ...], int], Any] = {}
        self.subjects: list[int] = []
        distances = []
        for place, (value, low, high) in enumerate(model.requirements(casadi_(), self._trace.p)):
            for limit, distance in ((low, value - low), (high, high - value)):
                limit = casadi.SX(limit)
                if not (limit.is_constant() and math.isinf(float(limit))):
                    distances.append(casadi.SX(distance))
                    self.subjects.append(place)
        rows = self._inserted(self._trace.explicit([casadi.vertcat(casadi.SX(0, 1), *distances)])[0])
        self.distance = casadi.Function("distance", [x], [casadi.densify(rows)])

    def _inserted(self, expression: Any) -> Any:
        """An expression of the model with the values of its parameters and inputs."""
        import casadi

        return casadi.substitute([casadi.SX(expression)], self._symbols, self._values)[0]

    def whole(self, column: str) -> int:
        """The number of a column."""
        return self.pieces(column, "")[0]

    def pieces(self, column: str, choice: str) -> tuple[int, ...]:
        """The places of the expressions whose least value (`choice` "FMIN") or largest value ("FMAX") a column is:
        these are smooth where the column has kinks. A column that is no such choice is one expression; an expression
        gets its place when it is asked for first.

        Raises
        ------
        RunError
            for a column that the model does not have.
        """
        key = column, choice
        if key not in self._places:
            if column not in self._trace.columns:
                raise RunError(f"{column}: no such column of the {self._trace.model.name}")
            parts = _pieces(self._trace.columns[column][1], choice)
            if choice and len(parts) == 1:
                self._places[key] = self.pieces(column, "")
            else:
                first = len(self._expressions)
                self._expressions += map(self._inserted, parts)
                self._places[key] = tuple(range(first, len(self._expressions)))
        return self._places[key]

    def function(self, places: Sequence[int], order: int = 0) -> Any:
        """The function of the free parameters, the derived numbers, and a lane (angle, speed) that has these columns,
        and then their derivatives by the angle up to that order, one below the other."""
        import casadi

        key = tuple(places), order
        if key not in self._functions:
            rows = [casadi.vertcat(*(self._expressions[k] for k in places))]
            for _ in range(order):
                rows.append(casadi.jtimes(rows[-1], self._lane[0], 1.0))
            result = casadi.densify(casadi.vertcat(*rows))
            arguments = [self._x, self._derived, self._lane]
            self._functions[key] = casadi.Function("columns", arguments, [result], {"cse": True})
        return self._functions[key]

    def values(self, x: Any, q: Any, w: Any, places: Sequence[int], order: int = 0) -> Any:
        """Columns and their derivatives by the angle, shape (1 + order, places, lanes)."""
        result = self.function(places, order)(x, self.derived(x), np.stack(np.broadcast_arrays(q, w)))
        return np.array(result).reshape(1 + order, len(places), -1)

    def slopes(self, x: Any, q: Any, w: Any, places: Sequence[int]) -> Any:
        """The derivatives of columns by the free parameters, shape (places, lanes, free)."""
        import casadi

        free, lane = casadi.MX.sym("x", self.size), casadi.MX.sym("lane", 2)
        rows = self.function(places)(free, self.derived(free), lane)
        slope = casadi.Function("slope", [free, lane], [casadi.densify(casadi.jacobian(rows, free))])
        result = slope(x, np.stack(np.broadcast_arrays(q, w)))
        return np.array(result).reshape(len(places), -1, self.size)

    def ratio(self, x: Any) -> float:
        """Motor turns per crank turn."""
        return float(self._ratio(x))

    def distances(self, x: Any) -> Any:
        """The distances of all requirements of the model from their limits, shape (distances,)."""
        return np.array(self.distance(x)).ravel()

    @cached_property
    def distance_slopes(self) -> Any:
        """The function of the free parameters that has the derivatives of the distances, shape (distances, free)."""
        import casadi

        slopes = casadi.jacobian(self.distance(self._x), self._x)
        return casadi.Function("slopes", [self._x], [casadi.densify(slopes)])


def _pieces(expression: Any, choice: str) -> list[Any]:
    """The expressions of which an expression is the `choice`, FMIN or FMAX, with choices inside it opened; the
    expression itself if it is none."""

    import casadi

    expression = casadi.SX(expression)
    is_choice = choice and expression.numel() == 1 and expression.n_dep() == 2
    if is_choice and expression.op() == getattr(casadi, f"OP_{choice}"):
        return [piece for k in (0, 1) for piece in _pieces(expression.dep(k), choice)]
    return [expression]
