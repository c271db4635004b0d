"""The requirements of a model with their derivatives: by how much each is met."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np

from ...core.engines import casadi_
from ...core.symbolic_trace import trace
from ...machines.machine import Machine


class Requirements:
    """The distances of all requirements of a machine's model from their limits, as functions of the free parameters.

    `subjects` are the places of the requirements in ``model.required``, one for each distance.
    """

    def __init__(self, machine: Machine, free: Sequence[str]) -> None:
        import casadi

        model = machine.model
        t = trace(model)
        p, _, _, k = t.symbols
        distances, self.subjects = [], []
        for place, (value, low, high) in enumerate(model.requirements(casadi_(), t.p)):
            for limit, distance in ((low, value - low), (high, high - value)):
                limit = casadi.SX(limit)
                if not (limit.is_constant() and math.isinf(float(limit))):
                    distances.append(casadi.SX(distance))
                    self.subjects.append(place)
        rows = casadi.densify(casadi.vertcat(*distances, casadi.SX(0, 1)))
        if model.derived_count:
            own = model.derive(casadi_(), model.parameter_layout.instance(casadi.vertsplit(p)))
            rows = casadi.substitute(rows, k, casadi.vertcat(*own))
        names = model.parameter_layout.names
        self._places = [names.index(name) for name in free]
        self._p = np.array(model.parameter_layout.values(machine.p), float)
        self._rows, self._symbols = rows, p

    def __len__(self) -> int:
        return len(self.subjects)

    @cached_property
    def _free(self) -> Any:
        import casadi

        return casadi.vertcat(*(self._symbols[i] for i in self._places))

    @cached_property
    def _value(self) -> Any:
        import casadi

        return casadi.Function("h", [self._symbols], [self._rows])

    @cached_property
    def _slope(self) -> Any:
        import casadi

        return casadi.Function(
            "dh", [self._symbols], [casadi.densify(casadi.jacobian(self._rows, self._free))]
        )

    @cached_property
    def _bend(self) -> Any:
        import casadi

        weights = casadi.SX.sym("weights", len(self))
        matrix, _ = casadi.hessian(casadi.dot(weights, self._rows), self._free)
        return casadi.Function("ddh", [self._symbols, weights], [casadi.densify(matrix)])

    def _at(self, x: Any) -> Any:
        p = self._p.copy()
        p[self._places] = x
        return p

    def values(self, x: Any) -> Any:
        """The distances, shape (requirements,)."""
        return np.array(self._value(self._at(x))).ravel()

    def slopes(self, x: Any) -> Any:
        """Their derivatives by the free parameters, shape (requirements, free)."""
        return np.array(self._slope(self._at(x)))

    def bend(self, x: Any, weights: Any) -> Any:
        """The second derivatives of their sum with `weights`, shape (free, free)."""
        return np.array(self._bend(self._at(x), weights))
