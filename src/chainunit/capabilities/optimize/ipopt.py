"""IPOPT on an `AngleProgram`, with the exact derivatives of the program itself."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...work.interrupts import stoppable
from .program import AngleProgram

_DONE = ("Solve_Succeeded", "Solved_To_Acceptable_Level")
_OPTIONS: dict[str, Any] = {
    "print_time": False,
    "no_nlp_grad": True,
    "show_eval_warnings": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.tol": 1e-10,
    "ipopt.constr_viol_tol": 1e-10,
    "ipopt.compl_inf_tol": 1e-10,
    "ipopt.acceptable_tol": 1e-8,
    "ipopt.acceptable_constr_viol_tol": 1e-9,
    "ipopt.bound_relax_factor": 0.0,
    "ipopt.max_iter": 300,
    "ipopt.mu_strategy": "monotone",
}
_WARM = {
    "ipopt.warm_start_init_point": "yes",
    "ipopt.mu_strategy": "monotone",
    "ipopt.mu_init": 1e-6,
    "ipopt.warm_start_bound_push": 1e-9,
    "ipopt.warm_start_slack_bound_push": 1e-9,
    "ipopt.warm_start_mult_bound_push": 1e-9,
}


@dataclass(frozen=True)
class Solution:
    """A solution: the variables `z`, the multipliers of the constraints and of the bounds of the variables
    (positive at an upper bound, negative at a lower one), and whether IPOPT converged."""

    z: Any
    multipliers: Any
    bounds: Any
    converged: bool
    status: str
    iterations: int


def solve(
    program: AngleProgram, cost: Any, low: Any, high: Any, begin: Any, warm: Solution | None = None
) -> Solution:
    """The least ``cost @ z`` under the constraints of the program, with the variables from `low` to `high`.

    Raises
    ------
    KeyboardInterrupt
        where Ctrl-C or SIGTERM came in the meantime.
    """
    import casadi

    n, m = program.size, program.constraints
    dense = casadi.Sparsity.dense
    x, p, f, g = ("x", dense(n, 1)), ("p", dense(0, 1)), ("f", dense(1, 1)), ("g", dense(m, 1))
    upper = np.triu_indices(n)
    order = np.lexsort(upper)  # by columns

    def values(z: Any, *_: Any) -> list[Any]:
        return [cost @ z, program.constraint_values(z)]

    def gradient(z: Any, *_: Any) -> list[Any]:
        return [cost @ z, cost]

    def slopes(z: Any, *_: Any) -> list[Any]:
        return [program.constraint_values(z), program.constraint_slopes(z).T.ravel()]

    def bend(z: Any, _: Any, factor: Any, multipliers: Any) -> list[Any]:
        return [program.bend(z, multipliers)[upper][order]]

    guard = _Guard()
    callbacks = [
        _callback("values", [x, p], [f, g], values, guard),
        _callback("gradient", [x, p], [f, ("grad_f_x", dense(n, 1))], gradient, guard),
        _callback("slopes", [x, p], [g, ("jac_g_x", dense(m, n))], slopes, guard),
        _callback(
            "bend",
            [x, p, ("lam_f", dense(1, 1)), ("lam_g", dense(m, 1))],
            [("triu_hess_gamma_x_x", casadi.Sparsity.upper(n))],
            bend,
            guard,
        ),
    ]
    given: dict[str, Any] = dict(zip(("grad_f", "jac_g", "hess_lag"), callbacks[1:], strict=True))
    options: Any = {**_OPTIONS, **(_WARM if warm else {}), **given}
    solver = casadi.nlpsol("best", "ipopt", callbacks[0], options)
    start: dict[str, Any] = {"x0": begin}
    if warm is not None and len(warm.multipliers) == m:
        start |= {"lam_g0": warm.multipliers, "lam_x0": warm.bounds}
    # an exception inside a callback would end in IPOPT, as a step that was too long
    with stoppable() as guard.stopped:
        out = solver(lbx=low, ubx=high, lbg=np.where(program.equal, 0.0, -np.inf), ubg=0.0, **start)
        interrupted = guard.stopped()
    if interrupted:
        raise KeyboardInterrupt
    if guard.errors:
        raise guard.errors[0]
    stats = solver.stats()
    status = str(stats["return_status"])
    z, multipliers, bounds = (np.array(out[name]).ravel() for name in ("x", "lam_g", "lam_x"))
    return Solution(z, multipliers, bounds, status in _DONE, status, int(stats["iter_count"]))


@dataclass
class _Guard:
    """Tells the callbacks of a solution to end without computing: after an interrupt, or an error in one of them."""

    stopped: Callable[[], bool] = lambda: False
    errors: list[Exception] = field(default_factory=list)

    @property
    def ends(self) -> bool:
        return bool(self.errors) or self.stopped()


def _callback(name: str, inputs: Any, outputs: Any, compute: Callable[..., list[Any]], guard: _Guard) -> Any:
    """A function of CasADi that calls `compute` with arrays; its results may have no values (NaN), which IPOPT
    takes for a step that was too long."""
    import casadi

    class Callback(casadi.Callback):
        def __init__(self) -> None:
            casadi.Callback.__init__(self)
            self.construct(name, {})

        def get_n_in(self) -> int:
            return len(inputs)

        def get_n_out(self) -> int:
            return len(outputs)

        def get_name_in(self, k: int) -> Any:
            return inputs[k][0]

        def get_name_out(self, k: int) -> Any:
            return outputs[k][0]

        def get_sparsity_in(self, k: int) -> Any:
            return inputs[k][1]

        def get_sparsity_out(self, k: int) -> Any:
            return outputs[k][1]

        def has_eval_buffer(self) -> bool:
            return True

        def eval_buffer(self, arguments: Any, results: Any) -> int:
            if guard.ends:
                return 1
            given = [
                np.frombuffer(x, dtype=float).copy() if x is not None else np.zeros(0) for x in arguments
            ]
            try:
                values = compute(*given)
            except Exception as error:
                guard.errors.append(error)
                return 1
            for result, value in zip(results, values, strict=True):
                if result is not None:
                    np.frombuffer(result, dtype=float)[:] = value
            return 0

    return Callback()
