"""A nonlinear program from rows: IPOPT solves it with CasADi's derivatives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...work.interrupts import stoppable
from .columns import Columns
from .rows import OVER_TURN, Row, grid

COARSE = 32
"""Number of angles at which each limit over the turn stands at first; the pulls stand at half of them."""
SLACK_SPEEDS = (0.0, 1.0)
"""Speeds at which the pulls are limited at first, in parts of the highest speed of the slack-free range: without a
processing force the pull is linear in the square of the speed, so that it is least at one end."""
_DONE = ("Solve_Succeeded", "Solved_To_Acceptable_Level")
_OPTIONS: dict[str, Any] = {
    "print_time": False,
    "show_eval_warnings": False,
    "no_nlp_grad": True,
    "calc_lam_p": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.bound_relax_factor": 0.0,
    "ipopt.max_iter": 300,
    "ipopt.mu_strategy": "monotone",
    "ipopt.acceptable_tol": 1e-8,
    "ipopt.acceptable_constr_viol_tol": 1e-9,
}
_ROUGH = {f"ipopt.{name}": 1e-7 for name in ("tol", "constr_viol_tol", "compl_inf_tol")}
_EXACT = {f"ipopt.{name}": 1e-10 for name in ("tol", "constr_viol_tol", "compl_inf_tol")}
_WARM = {
    **_EXACT,
    "ipopt.warm_start_init_point": "yes",
    "ipopt.mu_init": 1e-6,
    "ipopt.warm_start_bound_push": 1e-9,
    "ipopt.warm_start_slack_bound_push": 1e-9,
    "ipopt.warm_start_mult_bound_push": 1e-9,
}


@dataclass(frozen=True)
class Lanes:
    """Angles of a program: `peaks`, shape (rows over the turn, peaks, 3), has the angle, the speed and 1 / b of each
    peak, or 0 for a column without such a curvature; `nodes`, shape (2, nodes), the angles for means and their
    weights."""

    peaks: Any
    nodes: Any

    @property
    def sizes(self) -> tuple[int, int]:
        """The numbers of peaks and of nodes."""
        return self.peaks.shape[1], self.nodes.shape[1]


@dataclass(frozen=True)
class Solution:
    """A solution: the variables `z`, the multipliers of each row at its angles, and the multipliers of the bounds
    of the variables (positive at an upper bound, negative at a lower one)."""

    z: Any
    lanes: list[Any]
    """angles and speeds of each row over the turn, shape (2, angles)"""
    multipliers: list[Any]
    bounds: Any
    exceeded: list[Any]
    """by how much each row is exceeded at its angles, in parts of its scale"""
    converged: bool
    iterations: int
    evaluations: int


class TurnProgram:
    """The program of some rows. The variables are the free parameters, each as its place between its bounds (0 to 1),
    and the auxiliary variables.

    The first program from a start is rough: each row over the turn stands at angles of a grid. A further one begins
    from a solution and has peaks of each row instead. There the column f, which has an extreme near this angle,
    counts as f - f'^2 / (2 b), with the curvature b of that solution: to the third order in the way of the extreme
    this is its value, so that the extreme may move with the parameters.

    The sum of the auxiliary variables `costs` is to be least; `sizes` are those of its lanes.
    """

    def __init__(
        self,
        columns: Columns,
        speeds: tuple[float, float],
        rows: Sequence[Row],
        costs: Sequence[int],
        auxiliary: int,
        sizes: tuple[int, int],
    ) -> None:
        import casadi

        # symbols: variables, upper limits of the rows, peaks of the rows over the turn, nodes of the means
        n = columns.size
        z = casadi.MX.sym("z", n + auxiliary)
        over_turn = [k for k, row in enumerate(rows) if row.kind in OVER_TURN]
        upper = casadi.MX.sym("upper", len(rows))
        peaks, fine = sizes
        extremes, nodes = casadi.MX.sym("peaks", 3, peaks * len(over_turn)), casadi.MX.sym("nodes", fine, 2)
        x = casadi.DM(columns.low) + casadi.DM(columns.span) * z[:n]
        derived = columns.derived(x)

        def table(kinds: Sequence[str], lanes: Any) -> dict[int, Any]:
            """The values of the columns of these rows, one row each."""
            places = sorted({row.terms[0][1] for row in rows if row.kind in kinds})
            values = columns.function(places)(x, derived, lanes)
            return {k: values[i, :].T for i, k in enumerate(places)}

        speed, slack_speed = speeds
        half = grid(COARSE // 2)
        self._grid = {
            "turn": np.stack([grid(COARSE), np.full(COARSE, speed)]),
            "slack": np.stack(
                [np.tile(half, 2), np.repeat([share * slack_speed for share in SLACK_SPEEDS], len(half))]
            ),
        }
        tables = (
            {} if peaks else {kind: table([kind], casadi.DM(lanes)) for kind, lanes in self._grid.items()}
        )
        at_nodes = casadi.horzcat(nodes[:, 0], casadi.repmat(casadi.MX(speed), fine)).T
        mean, distances = table(["mean", "rms"], at_nodes), columns.distance(x)

        def terms(k: int, row: Row) -> Any:
            """The sum of the terms of a row, at each of its angles."""
            if row.kind in ("reached", "slope", "auxiliary"):
                order, total = int(row.kind == "slope"), casadi.MX(0.0)
                for angle, column, factor in row.terms:
                    lane = casadi.vertcat(z[n + angle], speed)
                    total += factor * columns.function([column], order)(x, derived, lane)[-1]
                return total
            ((_, column, factor),) = row.terms
            if row.kind == "distance":
                return factor * distances[column]
            if row.kind in ("mean", "rms"):
                power = 2 if row.kind == "rms" else 1
                size = casadi.dot(nodes[:, 1], mean[column] ** power)
                return factor * (casadi.sqrt(size) if power == 2 else size)
            if not peaks:
                return factor * tables[row.kind][column]
            place = peaks * over_turn.index(k)
            lanes = extremes[:, place : place + peaks]
            value, slope = casadi.vertsplit(columns.function([column], 1)(x, derived, lanes[:2, :]))
            return factor * (value - 0.5 * slope**2 * lanes[2, :]).T

        constraints = []
        for k, row in enumerate(rows):
            shift = sum((factor * z[n + place] for place, factor in row.aux), -upper[k])
            constraints.append((casadi.vertcat(terms(k, row)) + shift) / row.scale)
        # of each constraint: its row, whether it is an equality, and whether a cost lifts it
        self._row = np.repeat(np.arange(len(rows)), [part.numel() for part in constraints])
        self._equal = np.array([row.equal for row in rows])[self._row]
        self._lifts = {
            n + place: np.array([any(k == place for k, _ in row.aux) for row in rows])[self._row]
            for place in costs
        }
        p, g = casadi.vertcat(upper, casadi.vec(extremes), casadi.vec(nodes)), casadi.vertcat(*constraints)
        cost = sum((z[n + place] for place in costs), casadi.MX(0.0))
        self._constraints = casadi.Function("constraints", [z, p], [g])
        self._watch = _watch(z.numel(), g.numel(), p.numel())
        options = {**_OPTIONS, **(_WARM if peaks else _ROUGH), "iteration_callback": self._watch}
        self._solver = casadi.nlpsol("best", "ipopt", {"x": z, "p": p, "f": cost, "g": g}, options)
        self._free, self._over_turn = n, over_turn
        self._kinds = [rows[k].kind for k in over_turn]

    def solve(self, z: Any, low: Any, upper: Any, lanes: Lanes, last: Solution | None) -> Solution:
        """The solution near `z`, or near the `last` one, with the lower bounds `low` of the auxiliary variables and
        the numbers `upper` of the rows.

        Raises
        ------
        KeyboardInterrupt
            if Ctrl-C or SIGTERM came in the meantime.
        """
        z, p = z.copy(), np.concatenate([upper, np.ravel(lanes.peaks), np.ravel(lanes.nodes)])
        start: dict[str, Any] = {}
        if last is not None:
            # each peak begins with the multipliers of the angles and speeds that were nearest to it
            first_multipliers: list[Any] = list(last.multipliers)
            for k, before, now in zip(self._over_turn, last.lanes, lanes.peaks, strict=True):
                first_multipliers[k] = np.zeros(len(now))
                angle_gap = np.abs(np.sin(0.5 * (before[0][:, None] - now[:, 0])))
                gap = angle_gap + np.abs(before[1][:, None] - now[:, 1])
                np.add.at(first_multipliers[k], np.argmin(gap, axis=1), last.multipliers[k])
            start = {"lam_g0": np.concatenate(first_multipliers), "lam_x0": last.bounds}
        else:
            # a cost that lifts a constraint begins so large that none is exceeded
            exceeded = np.array(self._constraints(z, p)).ravel()
            for place, is_lifted in self._lifts.items():
                excess = np.max(exceeded[is_lifted & np.isfinite(exceeded)], initial=0.0)
                z[place] = excess + 1e-3 * (1.0 + excess)
        lowest = np.concatenate([np.zeros(self._free), low])
        highest = np.where(np.arange(len(z)) < self._free, 1.0, np.inf)
        # Python drops an interrupt that it raises inside the solver
        with stoppable() as self._watch.stopped:
            out = self._solver(
                x0=z, p=p, lbx=lowest, ubx=highest, lbg=np.where(self._equal, 0.0, -np.inf), ubg=0.0, **start
            )
            if self._watch.stopped():
                raise KeyboardInterrupt
        stats = self._solver.stats()
        z, g, multipliers, bounds = (np.array(out[name]).ravel() for name in ("x", "g", "lam_g", "lam_x"))
        ends = np.flatnonzero(np.diff(self._row)) + 1
        return Solution(
            z=z,
            lanes=[
                now[:, :2].T if len(now) else self._grid[kind]
                for now, kind in zip(lanes.peaks, self._kinds, strict=True)
            ],
            multipliers=np.split(multipliers, ends),
            bounds=bounds,
            exceeded=np.split(np.where(self._equal, np.abs(g), g), ends),
            converged=stats["return_status"] in _DONE,
            iterations=int(stats["iter_count"]),
            evaluations=int(stats["n_call_nlp_jac_g"] + stats["n_call_nlp_hess_l"]),
        )


def _watch(variables: int, constraints: int, parameters: int) -> Any:
    """A function that IPOPT calls after each iteration, and that ends it if `stopped` says so."""
    import casadi

    sizes = {"f": 1, "x": variables, "lam_x": variables, "lam_p": parameters}

    class Watch(casadi.Callback):
        stopped: Callable[[], bool]

        def __init__(self) -> None:
            casadi.Callback.__init__(self)
            self.construct("watch", {})

        def get_n_in(self) -> int:
            return int(casadi.nlpsol_n_out())

        def get_sparsity_in(self, k: int) -> Any:
            return casadi.Sparsity.dense(sizes.get(casadi.nlpsol_out(k), constraints), 1)

        def eval(self, arguments: Any) -> list[int]:
            return [int(self.stopped())]

    return Watch()
