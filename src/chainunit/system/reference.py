"""The monolithic reference: the models' own equations as one ODE under an error-controlled solver.

No communication step and no linearised load: each evaluation gives the driver the machine's load at exactly the
present angle and speed. It is what a co-simulation converges to.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import xarray as xr
from scipy.integrate import solve_ivp

from ..engines import MATH, casadi_, numpy_
from ..errors import RunError
from ..model import Model


def monolithic(
    models: Mapping[str, tuple[type[Model], Any]],
    connections: Sequence[tuple[str, str]],
    signals: Mapping[str, Any],
    times: Any,
    *,
    rtol: float = 1e-10,
    corners: Sequence[float] = (),
    start: Mapping[str, float] | None = None,
) -> xr.Dataset:
    """Solve a system of models.

    Parameters
    ----------
    models : model class and parameters by name, in an order in which each model's load is known before it
        is driven (the machine before its motor)
    connections : as in `System`; leave out slopes (``port_connections(..., slopes=False)``), which
        vanish from the equations at the port's own point
    signals : by full name of an input, a number or a function of time
    times : where the solution is wanted [s], shape (n,)
    rtol : relative tolerance of the solver (DOP853); the absolute one is its thousandth of each
        state's nominal size, and at least 1e-12
    corners : times at which a signal starts or ends to change; the solver stops there
    start : every state by full name at the first of the times, to go on from another solution; by default the
        models' own start

    Returns
    -------
    every state and output but slopes, over ``time``, named as in a co-simulation of the same system.

    Raises
    ------
    RunError
        where the solver gives up.
    """
    import casadi

    models = {name: (model, model.prepared(MATH, p)) for name, (model, p) in models.items()}
    offsets, n = {}, 0
    begin: list[float] = []
    tolerances: list[float] = []
    for name, (model, p) in models.items():
        if model.state_layout:
            offsets[name] = n
            begin += model.state_layout.values(model.start(MATH, p, model.input_layout.from_names({})))
            sizes = [v.quantity.nominal or 1.0 for v in model.state_layout.variables]
            tolerances += [max(1e-12, rtol * 1e-3 * size) for size in sizes]
            n = len(begin)

    def pass_through(engine: Any, given: Mapping[str, Any], x: Any, rounds: int) -> dict[str, Any]:
        """Every value by full name: states, then outputs in the models' order; `rounds` passes carry a
        value through as many models. `given` are the inputs from outside."""
        values: dict[str, Any] = {}
        for name, (model, _) in models.items():
            if model.state_layout:
                at = offsets[name]
                for i, variable in enumerate(model.state_layout.names):
                    values[f"{name}.{variable}"] = x[at + i]
        for _ in range(rounds):
            for name, (model, p) in models.items():
                u, state = inputs(name, model, given, values), states(name, model, x)
                shared = model.shared(engine, p, u, state)
                part = model.parts[0]
                out = part.layout.values(part.equations(engine, p, u, state, shared))
                values.update(zip((f"{name}.{v}" for v in part.layout.names), out, strict=True))
        return values

    sources: dict[str, str] = {target: source for source, target in connections}

    outside = {
        f"{name}.{v.name}": signals.get(f"{name}.{v.name}", v.quantity.start)
        for name, (model, _) in models.items()
        for v in model.input_layout.variables
        if f"{name}.{v.name}" not in sources
    }

    def at(t: Any) -> dict[str, Any]:
        return {full: signal(t) if callable(signal) else signal for full, signal in outside.items()}

    def inputs(name: str, model: type[Model], given: Mapping[str, Any], values: Mapping[str, Any]) -> Any:
        full = [f"{name}.{variable}" for variable in model.input_layout.names]
        return model.input_layout.instance(
            [values.get(sources[f], 0.0) if f in sources else given[f] for f in full]
        )

    def states(name: str, model: type[Model], x: Any) -> Any:
        if model.state_layout is None:
            return None
        at = offsets[name]
        return model.state_layout.instance(x[at : at + len(model.state_layout.names)])

    def traced() -> Any:
        """The derivatives of all states, traced once: several times as fast as the kernels themselves."""
        engine = casadi_()
        symbols = casadi.SX.sym("u", len(outside)), casadi.SX.sym("x", n)
        given, x = dict(zip(outside, casadi.vertsplit(symbols[0]), strict=True)), casadi.vertsplit(symbols[1])
        values = pass_through(engine, given, x, 1)
        dx: list[Any] = []
        for name, (model, p) in models.items():
            if model.state_layout:
                dx += model.derivatives(engine, p, inputs(name, model, given, values), states(name, model, x))
        return casadi.Function("rates", list(symbols), [casadi.cse(casadi.vertcat(*dx))])

    derivatives = traced()

    def rates(t: float, x: Any) -> Any:
        return derivatives(list(at(t).values()), x).full().ravel()

    # where the start depends on an input that is another one's state, a pass for each on the way
    for _ in models:
        values = pass_through(MATH, at(0.0), begin, 1)
        begun: list[float] = []
        for name, (model, p) in models.items():
            if model.state_layout:
                begun += model.state_layout.values(model.start(MATH, p, inputs(name, model, at(0.0), values)))
        if begun == begin:
            break
        begin = begun
    if start is not None:
        begin = [
            start[f"{name}.{state}"]
            for name, (model, _) in models.items()
            if model.state_layout
            for state in model.state_layout.names
        ]
    times = np.asarray(times, float)
    inner = [c for c in sorted(set(corners)) if times[0] < c < times[-1]]
    stops = [times[0], *inner, times[-1]]
    x = np.asarray(begin)
    found = np.empty((n, len(times)))
    for low, high in pairwise(stops):
        chosen = (times >= low) & (times <= high)
        solution = solve_ivp(
            rates,
            (low, high),
            x,
            method="DOP853",
            rtol=rtol,
            atol=tolerances,
            dense_output=True,
        )
        if not solution.success:
            raise RunError(f"monolithic reference: {solution.message}")
        if chosen.any():
            found[:, chosen] = solution.sol(times[chosen])
        x = solution.y[:, -1]
    values = pass_through(numpy_(), at(times), found, len(models) + 1)
    described = {
        f"{name}.{v.name}": v
        for name, (model, _) in models.items()
        for layout in (model.state_layout, model.parts[0].layout)
        if layout
        for v in layout.variables
    }
    variables = {
        full: (
            "time",
            np.broadcast_to(value, times.shape).astype(float),
            {"units": described[full].unit, "long_name": described[full].description},
        )
        for full, value in values.items()
    }
    return xr.Dataset(variables, {"time": ("time", times, {"units": "s", "long_name": "time"})})
