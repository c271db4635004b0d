"""The monolithic reference: the models' own equations as one ODE under an error-controlled solver.

There is no communication step and no linearised load: each evaluation gives the driver the load of the machine at
exactly the present angle and speed. A co-simulation converges to this solution. casadi traces the equations once,
which is several times as fast as the equations in Python.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
import xarray as xr
from scipy.integrate import solve_ivp

from ..engines import MATH, casadi_
from ..errors import InputError, RunError
from ..model import Model
from .graph import ModelComponent, System, hold_loads, order
from .signals import at_time, corners


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
        the state's nominal size, and at least 1e-12
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
    equations = _Equations(system, signals)
    times = np.asarray(times, float)
    x = equations.start(float(times[0])) if start is None else [start[full] for full in equations.states]
    inner = [c for c in corners(signals.values()) if times[0] < c < times[-1]]
    states = np.empty((len(x), len(times)))
    for low, high in pairwise([times[0], *inner, times[-1]]):
        behind = float(np.nextafter(low, high))

        def rates(t: float, x: Any, behind: float = behind) -> Any:
            return equations.rates(max(t, behind), x)

        solution = solve_ivp(
            rates, (low, high), x, method="DOP853", rtol=rtol, atol=equations.tolerances(rtol), dense_output=True
        )  # fmt: skip
        if not solution.success:
            raise RunError(f"monolithic reference: {solution.message}")
        here = (times >= low) & (times <= high)
        if here.any():
            states[:, here] = solution.sol(times[here])
        x = solution.y[:, -1]
    return equations.dataset(times, states)


@dataclass(frozen=True)
class _Unit:
    """A model in casadi: `function` maps its inputs and states to its outputs and the derivatives of its states."""

    model: type[Model]
    p: Any
    function: Any

    @cached_property
    def state_names(self) -> tuple[str, ...]:
        return self.model.state_layout.names if self.model.state_layout else ()

    @cached_property
    def output_names(self) -> tuple[str, ...]:
        return self.model.parts[0].layout.names

    @cached_property
    def direct(self) -> dict[str, set[str]]:
        """By state and output, the inputs on which it depends directly."""
        inputs: dict[str, set[str]] = {name: set() for name in (*self.state_names, *self.output_names)}
        names = self.model.input_layout.names
        for row, column in zip(*self.function.jac_sparsity(0, 0).get_triplet(), strict=True):
            inputs[self.output_names[row]].add(names[column])
        return inputs


def _trace(name: str, component: Any) -> _Unit:
    import casadi

    if not isinstance(component, ModelComponent):
        raise InputError(
            f"{name} ({component.title}): is an FMU, whose equations are not known; there is no monolithic reference"
        )
    model = component.model
    engine, p = casadi_(), model.prepared(MATH, component.parameters)
    layouts = (model.input_layout, model.state_layout)
    symbols = [casadi.SX.sym(s, len(of.names) if of else 0) for s, of in zip("ux", layouts, strict=True)]
    u, x = (
        of.instance(casadi.vertsplit(symbol)) if of else None
        for of, symbol in zip(layouts, symbols, strict=True)
    )
    part = model.parts[0]
    outputs = part.layout.values(part.equations(engine, p, u, x, model.shared(engine, p, u, x)))
    rates = model.derivatives(engine, p, u, x) if model.state_layout else []
    sides = [casadi.vertcat(*side) if side else casadi.SX(0, 1) for side in (outputs, rates)]
    return _Unit(model, p, casadi.Function(name, symbols, sides))


class _Equations:
    """The system as one ODE in the states of all models."""

    def __init__(self, system: System, signals: Mapping[str, Any]) -> None:
        self._units = {name: _trace(name, c) for name, c in system.components.items()}
        self._connections = hold_loads(system).connections
        self._sources = {target: source for source, target in self._connections}
        self.states = [f"{name}.{x}" for name, unit in self._units.items() for x in unit.state_names]
        values = system.values
        self._outside = {
            f"{name}.{v.name}": signals.get(
                f"{name}.{v.name}", values.get(f"{name}.{v.name}", v.quantity.start)
            )
            for name, unit in self._units.items()
            for v in unit.model.input_layout.variables
            if f"{name}.{v.name}" not in self._sources
        }
        self._compose()

    def _compose(self) -> None:
        """Compose the functions of the external inputs and of all states: the derivatives, and all outputs."""
        import casadi

        symbols = [casadi.SX.sym(s, len(of)) for s, of in (("u", self._outside), ("x", self.states))]
        values = dict(zip(self._outside, casadi.vertsplit(symbols[0]), strict=True))
        values |= zip(self.states, casadi.vertsplit(symbols[1]), strict=True)
        direct = {name: unit.direct for name, unit in self._units.items()}
        for name, outputs in order(self._connections, direct):
            missing = [output for output in outputs if f"{name}.{output}" not in values]
            if missing:
                own, _ = self._call(name, values)
                values |= {f"{name}.{output}": own[output] for output in missing}
        rates: list[Any] = []
        all_outputs: dict[str, Any] = {}
        for name in self._units:
            own, dx = self._call(name, values)
            all_outputs |= {f"{name}.{output}": y for output, y in own.items()}
            rates.append(dx)
        self._outputs = list(all_outputs)
        self._rates = casadi.Function("rates", symbols, [casadi.cse(casadi.vertcat(*rates))])
        self._all = casadi.Function("outputs", symbols, [casadi.cse(casadi.vertcat(*all_outputs.values()))])

    def _call(self, name: str, values: Mapping[str, Any]) -> tuple[dict[str, Any], Any]:
        """Outputs by name and derivatives of a model; inputs without a value yet are NaN."""
        import casadi

        unit = self._units[name]
        fulls = [f"{name}.{v}" for v in unit.model.input_layout.names]
        u = [values.get(self._sources.get(full, full), casadi.SX.nan()) for full in fulls]
        x = [values[f"{name}.{v}"] for v in unit.state_names]
        y, dx = unit.function(casadi.vertcat(*u), casadi.vertcat(*x) if x else casadi.SX(0, 1))
        return dict(zip(unit.output_names, casadi.vertsplit(y), strict=True)), dx

    def _inputs(self, t: Any) -> list[Any]:
        return [at_time(signal, t) for signal in self._outside.values()]

    def rates(self, t: float, x: Any) -> Any:
        """Derivatives of all states."""
        return self._rates(self._inputs(t), x).full().ravel()

    def tolerances(self, rtol: float) -> list[float]:
        """The absolute tolerance of each state."""
        layouts = [unit.model.state_layout for unit in self._units.values() if unit.model.state_layout]
        sizes = [v.quantity.nominal or 1.0 for layout in layouts for v in layout.variables]
        return [max(1e-12, rtol * 1e-3 * size) for size in sizes]

    def start(self, t: float) -> list[float]:
        """States at the start. A state may depend on an input that is a state of another model, and so on: each pass
        resolves one such dependency."""
        values = dict(zip(self._outside, self._inputs(t), strict=True))
        x: list[float] = []
        for _ in range(len(self._units) + 1):
            before, x = x, []
            for name, unit in self._units.items():
                if unit.model.state_layout:
                    inputs = {
                        v: values[self._sources.get(f"{name}.{v}", f"{name}.{v}")]
                        for v in unit.model.input_layout.names
                        if self._sources.get(f"{name}.{v}", f"{name}.{v}") in values
                    }
                    u = unit.model.input_layout.from_names(inputs)
                    x += unit.model.state_layout.values(unit.model.start(MATH, unit.p, u))
            values |= zip(self.states, x, strict=True)
            outputs = self._all(self._inputs(t), x).full().ravel()
            values |= zip(self._outputs, map(float, outputs), strict=True)
            if x == before:
                break
        return x

    def dataset(self, times: Any, states: Any) -> xr.Dataset:
        """All states and outputs; `states` have the shape (states, times)."""
        outside = [np.broadcast_to(u, times.shape) for u in self._inputs(times)]
        outputs = np.asarray(self._all(np.array(outside).reshape(-1, len(times)), states))
        declarations = {
            f"{name}.{v.name}": v
            for name, unit in self._units.items()
            for layout in (unit.model.state_layout, unit.model.parts[0].layout)
            if layout
            for v in layout.variables
        }
        rows = [*zip(self.states, states, strict=True), *zip(self._outputs, outputs, strict=True)]
        variables = {
            full: (
                "time",
                row,
                {"units": declarations[full].unit, "long_name": declarations[full].description},
            )
            for full, row in rows
        }
        return xr.Dataset(variables, {"time": ("time", times, {"units": "s", "long_name": "time"})})
