"""The search for the best machine: starts within the bounds, and programs whose peaks move until no limit is exceeded
between the angles."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from ...core.errors import InputError, RunError
from ...mechanism.sampled_quantities import mean_rule, means
from ...reading.results import part, result
from ...study.cycle_quantities import CycleQuantity
from .columns import Columns
from .program import COARSE, Lanes, Solution, TurnProgram
from .rows import OVER_TURN, SIGNS, LimitRows, Row, grid
from .wishes import SLACK, TURNS, TurnLimit, Wishes

FINE = 720
"""Number of angles at which the answer of a program is looked over."""
_PARTS, _ROOM, _MOST_PEAKS = 8, 64, 8
"""Parts of the turn at first for means, the number of nodes of which that of a program is a multiple, and the largest
number of peaks of a column at a speed: a constant column has peaks of rounding."""
_EXCEEDED = 1e-9
"""Share of its scale by which a limit may be exceeded between the angles."""
_MET = 1e-7
"""Share of its scale by which a limit counts as met."""
_LOOKED_AT, _NEAR = 0.05, 0.01
"""Shares of its scale by which a limit must be near at an angle of the grid, to be looked at between the angles, and
at a peak, for which a program then has an angle."""
_WAY, _EXACT = 1e-3, 1e-6
"""Way of a peak [rad] that its program describes to the rounding, and deviation of an angle at which its value is
exact."""
_NARROW = 10.0
"""How many times the way down from a peak over one step of the grid its curvature may predict."""
_SAME = 1e-5
"""Distance of two answers of rough programs, in parts of the bounds, that count as one."""
_SIGNED = ("max", "min", "mean", "energy_per_year")
"""Reductions whose value may be below 0."""
_POWERS = {"mean": 1, "rms": 2}
CHECKED = tuple(k / 16.0 for k in range(17))
"""Parts of the highest speed of the slack-free range at which the pulls are looked over; a processing force lowers
the pull between the ends."""
_ROUNDS = 12
_AT_BOUND = 1e-7
"""Share of the distance between the bounds within which a parameter counts as at its bound."""


@dataclass(frozen=True)
class Answer:
    """The answer from one start: the free parameters `x`, the exact `value` of the objective there, or the sum of the
    `misses` without an objective, and whether all limits are met; `sensitivities` are the derivatives of the value by
    each limit, by name and side, and `at_bounds` those by the bounds of the parameters."""

    x: Any
    value: float
    feasible: bool
    sensitivities: dict[tuple[str, str], float] = field(default_factory=dict)
    at_bounds: dict[tuple[str, str], float] = field(default_factory=dict)
    misses: dict[str, float] = field(default_factory=dict)
    """by the name of a limit, the share of its scale by which it is missed; of an elastic program"""


@result(frozen=False)
class Effort:
    """The work of a search."""

    programs: int = part("number of programs", unit="1", default=0)
    iterations: int = part("number of their iterations", unit="1", default=0)
    evaluations: int = part(
        "number of turns of a machine that were computed with derivatives", unit="1", default=0
    )


class Search:
    """The programs of some wishes; `pulls` are the mean pulls along the webs of the loaded sides, if the wishes limit
    them."""

    def __init__(self, wishes: Wishes) -> None:
        self.wishes, self.today = wishes, wishes.today
        self.columns = Columns(wishes)
        sides = wishes.machine.loaded_sides(wishes.feed) if wishes.table.slack_free_speed else ()
        self.pulls = [self.columns.whole(f"mean_pull({side}.web)") for side in sides]
        quantities = (*wishes.objectives, *(limit.quantity for limit in wishes.limits))
        self._turning = [self.columns.whole(i.column) for q in quantities for i in q.integrands]
        self._turning += self.pulls
        self._programs: dict[Any, TurnProgram] = {}
        self._answers: dict[Any, list[tuple[Any, Answer]]] = {}
        self.effort = Effort()
        self.base = self._base()
        self.scales = {q.name: abs(self.value(q, self.base)) or 1.0 for q in quantities}

    def _base(self) -> Any:
        """A machine within the bounds that can be assembled: today's, as far as the bounds admit it, or the first
        one of a sequence that fills the bounds evenly.

        Raises
        ------
        RunError
            if there is none.
        """
        low, span = self.columns.low, self.columns.span
        clipped = np.clip(self.today, low, low + span)
        for x in (clipped, *(low + span * _sobol(len(low), 4096, int(self.wishes.table.seed)))):
            if self.turns(x):
                return x
        obstacle = " cannot be assembled at each angle."
        try:
            self.wishes.machine.replace(dict(zip(self.wishes.names, map(float, clipped), strict=True)))
        except InputError as error:
            obstacle = f": {error}"
        raise RunError(
            f"No machine within the bounds of optimize.free turns. The one nearest to today's{obstacle}"
        )

    def turns(self, x: Any) -> bool:
        """Whether a machine meets the requirements of its model, and can be assembled at each angle."""
        met = np.all(self.columns.distances(x) > 0.0)
        return bool(met and np.all(np.isfinite(self._turn(x, self._turning))))

    def _turn(self, x: Any, places: Sequence[int]) -> Any:
        """Columns over the turn, shape (places, COARSE)."""
        return self.columns.values(x, grid(COARSE), self.wishes.crank_speed, places)[0]

    # quantities

    def value(self, q: CycleQuantity, x: Any) -> float:
        """A quantity of the continuous turn."""
        parts = []
        for integrand in q.integrands:
            k, reduction = self.columns.whole(integrand.column), integrand.reduction
            if reduction in SIGNS:
                parts.append(self._extreme(x, k, reduction)[1])
            else:
                mean = self._mean(x, k, reduction)
                parts.append(math.sqrt(mean) if reduction == "rms" else mean)
        return float(q.combine(parts, self.wishes.crank_speed * self.columns.ratio(x), self.wishes.table))

    def _mean(self, x: Any, k: int, reduction: str) -> float:
        """The mean of a column over the turn, or, for "rms", that of its square."""

        def values(q: Any) -> Any:
            return self.columns.values(x, q, self.wishes.crank_speed, [k])[0] ** _POWERS[reduction]

        return float(means(values, 0.0, 2.0 * math.pi)[0][0])

    def _extreme(self, x: Any, k: int, reduction: str) -> tuple[float, float]:
        """The crank angle [rad] and the value of an extreme of a column."""
        speeds = [self.wishes.crank_speed]
        peaks = np.concatenate([self._peaks(x, k, sign, speeds, -math.inf) for sign in SIGNS[reduction]])
        top, angle, *_ = peaks[np.argmax(peaks[:, 0])]
        return float(angle), float(-top if reduction == "min" else top)

    def least_pull(self, x: Any) -> float:
        """The least mean pull along a web up to the highest speed of the slack-free range [N]."""
        from scipy.optimize import minimize_scalar

        def pulls(q: Any, shares: Any) -> Any:
            """The least pull of all webs at these angles and shares of the slack-free speed."""
            w = np.repeat(np.atleast_1d(shares) * self.wishes.table.slack_free_speed, len(q))
            values = self.columns.values(x, np.tile(q, np.size(shares)), w, self.pulls)
            return np.min(values, axis=(0, 1)).reshape(np.size(shares), len(q))

        coarse = grid(FINE // 3)
        k, place = divmod(int(np.argmin(pulls(coarse, CHECKED))), len(coarse))
        low, high = CHECKED[max(k - 1, 0)], CHECKED[min(k + 1, len(CHECKED) - 1)]
        q = coarse[place] + coarse[2] * np.linspace(-1.0, 1.0, 49)

        def pull(share: float) -> float:
            return float(np.min(pulls(q, share)))

        between = minimize_scalar(
            pull, bounds=(low, high), method="bounded", options={"xatol": 1e-3 * (high - low)}
        )
        return min(pull(CHECKED[k]), float(between.fun))

    # programs

    def starts(self, number: int, seed: int = 0) -> tuple[list[Any], int]:
        """Points that fill the bounds evenly, each moved towards `base` until the machine can be assembled; and the
        number of points that were moved."""
        points, moved = [], 0
        for y in _sobol(self.columns.size, number, int(self.wishes.table.seed) + seed):
            way, share = self.columns.low + self.columns.span * y - self.base, 1.0
            while not self.turns(self.base + share * way):
                share *= 0.5
            moved += share < 1.0
            points.append(self.base + share * way)
        return points, moved

    def _rows(
        self, x: Any, objective: CycleQuantity | None, limits: Sequence[TurnLimit], without: frozenset[str]
    ) -> tuple[LimitRows, dict[str, int]]:
        """The rows near `x`, and, without an objective, the slacks by their limits."""
        wishes, sizes = self.wishes, self.columns.distances(self.base)
        rows = LimitRows(self.columns, wishes.table, partial(self._turn, x))
        if objective is not None:
            least = -math.inf if objective.reduction in _SIGNED else 0.0
            rows.at_most(objective, "", self.scales[objective.name], objective=rows.auxiliary(0.0, least))
        for limit in limits:
            if limit.name in without:
                continue
            q, low, high = limit.quantity, limit.low, limit.high
            scale = max(abs(low or 0.0), abs(high or 0.0)) or self.scales[q.name]
            if low is not None:
                rows.at_least(q, limit.name, scale, low, equal=low == high)
            if high is not None and low != high:
                rows.at_most(q, limit.name, scale, high)
        if self.pulls and SLACK not in without:
            at_rest = self.columns.values(self.base, grid(COARSE), 0.0, self.pulls)
            rows.over_turn("slack", self.pulls, SLACK, float(np.max(np.abs(at_rest))) or 1.0)
        names = [wishes.machine.model.required[subject].subject for subject in self.columns.subjects]
        rows.distances("", 0.0, sizes, names)
        if TURNS not in without:
            rows.distances(TURNS, wishes.table.clearance, sizes, names)
        return rows, rows.loosen() if objective is None else {}

    def solve(
        self,
        x: Any,
        objective: CycleQuantity | None,
        limits: Sequence[TurnLimit] | None = None,
        without: frozenset[str] = frozenset(),
    ) -> Answer:
        """The machine near `x` with the least objective under the limits, which are by default the limits of the
        wishes; or, without an objective, the one that misses the limits by the least sum of shares."""
        low, span, n = self.columns.low, self.columns.span, self.columns.size
        limits = self.wishes.limits if limits is None else limits
        rows, slacks = self._rows(x, objective, limits, without)
        costs = (0,) if objective is not None else tuple(slacks.values())
        z = np.concatenate([np.clip((x - low) / span, 1e-3, 1.0 - 1e-3), rows.begin])
        number = sum(row.kind in OVER_TURN for row in rows.rows)
        nodes = np.stack([grid(COARSE), np.full(COARSE, 1.0 / COARSE)])
        # a mean at its limit leaves no room for a rough one
        tight = [row for row in rows.rows if row.kind in _POWERS and row.owner and self._is_tight(row, x)]
        nodes, _ = self._nodes(tight, x, nodes)
        lanes, worst = Lanes(np.zeros((number, 0, 3)), nodes), math.inf
        # a rough program with all angles of a grid, and then programs with the peaks of the solution before
        point = self._run(rows, costs, z, lanes, None)
        # a start that ends where another one did has its answer
        earlier = self._answers.setdefault((tuple(rows.rows), costs), [])
        for z, answer in earlier:
            if np.max(np.abs(point.z - z)) < _SAME:
                return answer
        rough = point.z
        for _ in range(_ROUNDS):
            worst = math.inf
            if not point.converged:
                break
            z, x = point.z, self._x(point)
            lanes, more, worst = self._followed(rows.rows, point, lanes)
            if any(row.kind == "slope" for row in rows.rows):
                # another extreme may be the largest one now
                fresh, _ = self._rows(x, objective, limits, without)
                turns = np.abs(np.sin(0.5 * (z[n:] - fresh.begin)))[fresh.angles]
                if fresh.rows != rows.rows or np.any(turns > math.pi / COARSE):
                    rows, more, worst = fresh, True, math.inf
                    z[n + np.array(fresh.angles)] = np.array(fresh.begin)[fresh.angles]
            if not more:
                break
            point = self._run(rows, costs, z, lanes, point)
        earlier.append((rough, self._answer(objective, slacks, rows.rows, point, worst)))
        return earlier[-1][1]

    def _run(
        self, rows: LimitRows, costs: tuple[int, ...], z: Any, lanes: Lanes, last: Solution | None
    ) -> Solution:
        """The solution of a program of these rows, which serves for all numbers that they have as upper limits."""
        key = tuple(replace(row, upper=0.0) for row in rows.rows), costs, lanes.sizes
        if key not in self._programs:
            speeds = self.wishes.crank_speed, self.wishes.table.slack_free_speed
            auxiliary = len(rows.begin)
            self._programs[key] = TurnProgram(self.columns, speeds, rows.rows, costs, auxiliary, lanes.sizes)
        upper = np.array([row.upper for row in rows.rows])
        point = self._programs[key].solve(z, rows.low, upper, lanes, last)
        self.effort.programs += 1
        self.effort.iterations += point.iterations
        self.effort.evaluations += point.evaluations
        return point

    def _x(self, point: Solution) -> Any:
        return self.columns.low + self.columns.span * point.z[: self.columns.size]

    def _followed(self, rows: Sequence[Row], point: Solution, lanes: Lanes) -> tuple[Lanes, bool, float]:
        """The lanes of a further program, with the peaks of its rows at this solution; whether there must be one: a
        limit is exceeded between the angles, a peak has moved too far, or a mean is rough; and the most by which a
        limit is exceeded, over its scale."""
        x, over_turn = self._x(point), [k for k, row in enumerate(rows) if row.kind in OVER_TURN]
        tops, more = [], not lanes.sizes[0]
        for k, peaks_before in zip(over_turn, lanes.peaks, strict=True):
            tops.append(self._tops(rows[k], x, point.z[self.columns.size :]))
            if len(peaks_before):
                angle, speed, inverse_bend = peaks_before.T
                ((_, column, _),) = rows[k].terms
                _, (slopes,) = self.columns.values(x, angle, speed, [column], 1)
                # slope over curvature is the way to the extreme
                has_moved = np.abs(slopes * inverse_bend) > _WAY
                more |= bool(np.any((point.exceeded[k] > -_MET) & has_moved))
        worst = max((float(np.max(top[:, 0])) for top in tops), default=-math.inf)
        # few sizes of programs serve all numbers of peaks
        room = max((2 ** math.ceil(math.log2(len(top))) for top in tops), default=1)
        peaks = np.zeros((len(tops), max(room, lanes.sizes[0], 2), 3))
        for place, top, k in zip(peaks, tops, over_turn, strict=True):
            place[:, 1] = self._speeds(rows[k])[0]
            place[: len(top)] = top[:, 1:]
        near = [row for row, exceeded in zip(rows, point.exceeded, strict=True) if exceeded[0] > -_NEAR]
        nodes, rough = self._nodes(near, x, lanes.nodes)
        return Lanes(peaks, nodes), more or rough or worst > _EXCEEDED, worst

    def _speeds(self, row: Row) -> list[float]:
        """The crank speeds at which a row over the turn stands [rad/s]."""
        highest = self.wishes.table.slack_free_speed
        return [share * highest for share in CHECKED] if row.kind == "slack" else [self.wishes.crank_speed]

    def _tops(self, row: Row, x: Any, aux: Any) -> Any:
        """The peaks of a row over the turn that come near to its limit or exceed it, and always the largest one: as
        of `_peaks`, but with the excess over the limit, in parts of the row's scale, in place of the value. `aux` are
        the auxiliary variables of the program, which shift the row."""
        ((_, column, factor),) = row.terms
        offset = sum(weight * aux[place] for place, weight in row.aux) - row.upper
        peaks = self._peaks(x, column, factor, self._speeds(row), -offset - _LOOKED_AT * row.scale)
        excess = (peaks[:, 0] + offset) / row.scale
        peaks[:, 0] = excess
        return peaks[excess >= min(-_NEAR, np.max(excess))]

    def _is_tight(self, row: Row, x: Any) -> bool:
        """Whether a mean is near its limit at a machine."""
        ((_, k, factor),) = row.terms
        mean = self._mean(x, k, row.kind)
        value = factor * (math.sqrt(mean) if row.kind == "rms" else mean)
        return abs(value - row.upper) < _NEAR * row.scale

    def _nodes(self, rows: Sequence[Row], x: Any, nodes: Any) -> tuple[Any, bool]:
        """Nodes for the means of some rows, and whether the `nodes` of the program were too few."""
        means = [(row.terms[0][1], _POWERS[row.kind]) for row in rows if row.kind in _POWERS]
        if not means:
            return nodes, False

        def values(q: Any) -> Any:
            table = self.columns.values(x, q, self.wishes.crank_speed, [k for k, _ in means])[0]
            return table ** np.array([power for _, power in means])[:, None]

        q, weights = mean_rule(values, 0.0, 2.0 * math.pi, _PARTS)
        exact, rough = values(q) @ weights, values(nodes[0]) @ nodes[1]
        if np.all(np.abs(exact - rough) <= _EXCEEDED * np.abs(exact)):
            return nodes, False
        room = np.zeros((2, max(_ROOM * math.ceil(len(q) / _ROOM), len(nodes[0]))))
        room[:, : len(q)] = q, weights
        return room, True

    def _peaks(self, x: Any, column: int, factor: float, speeds: Sequence[float], least: float) -> Any:
        """The maxima of a column times `factor` at crank speeds that are about `least` or more, and the largest one.

        Each has its value, the angle, the speed, and 1 / curvature of the column, or 0 at a kink, shape (maxima, 4).
        """
        lanes = np.stack([np.tile(grid(FINE), len(speeds)), np.repeat(speeds, FINE)])
        y = factor * self.columns.values(x, lanes[0], lanes[1], [column]).reshape(len(speeds), FINE)
        is_peak = ((y >= least) & (y >= np.roll(y, 1, axis=1)) & (y > np.roll(y, -1, axis=1))).ravel()
        is_peak[np.argmax(y)] = True
        places = np.flatnonzero(is_peak)
        places = places[np.argsort(-y.ravel()[places])][:_MOST_PEAKS]
        (grid_q, w), grid_value = lanes[:, places], y.ravel()[places]
        q, step = grid_q, 2.0 * math.pi / FINE
        # of nine angles around each peak the best is next, within a quarter of the distance
        for k in range(_ROUNDS):
            near = q[:, None] + step * 0.25**k * np.linspace(-1.0, 1.0, 9)
            values = self.columns.values(x, near.ravel(), np.repeat(w, 9), [column]).reshape(near.shape)
            q = near[np.arange(len(q)), np.argmax(factor * values, axis=1)]
        # value, slope and bend at the peaks, and the values a step of the grid beside them
        around = np.concatenate([q, q - step, q + step])
        derivatives = self.columns.values(x, around, np.tile(w, 3), [column], 2).reshape(3, 3, -1)
        (value, *beside), (slope, *_), (bend, *_) = derivatives
        least_drop = np.min(factor * (value - beside), axis=0)
        # a kink, or a peak that is narrower than the grid, counts as the angle of the grid
        smooth = (factor * bend < 0.0) & (np.abs(slope) < _EXACT * np.abs(bend))
        smooth &= 0.5 * np.abs(bend) * step**2 < _NARROW * least_drop
        value, q = np.where(smooth, factor * value, grid_value), np.where(smooth, q, grid_q)
        return np.stack([value, q, w, smooth / np.where(smooth, bend, 1.0)], axis=1)

    def _answer(
        self,
        objective: CycleQuantity | None,
        slacks: dict[str, int],
        rows: Sequence[Row],
        point: Solution,
        worst: float,
    ) -> Answer:
        """The answer at a solution. `slacks` are the misses of an elastic program by their limits, and `worst` is the
        most by which a limit is exceeded between the angles, over its scale. IPOPT's multipliers become derivatives
        by the limits."""
        n, span = self.columns.size, self.columns.span
        # the inner points of IPOPT end a little off the bounds
        y = point.z[:n]
        x = self.columns.low + span * np.where(y < _AT_BOUND, 0.0, np.where(y > 1.0 - _AT_BOUND, 1.0, y))
        scale = self.scales[objective.name] if objective is not None else 1.0
        at_bounds = {
            (name, "max" if factor > 0.0 else "min"): -float(factor) * scale / width
            for name, factor, width in zip(self.wishes.names, point.bounds, span, strict=False)
        }
        if objective is None:
            misses = {owner: float(point.z[n + k]) for owner, k in slacks.items()}
            return Answer(x, sum(misses.values()), point.converged, at_bounds=at_bounds, misses=misses)
        value = self.value(objective, x) if np.all(np.isfinite(x)) and self.turns(x) else math.nan
        sensitivities: dict[tuple[str, str], float] = {}
        for row, factors in zip(rows, point.multipliers, strict=True):
            if row.owner:
                key, sign = (row.owner, row.side), -1.0 if row.side == "max" else 1.0
                slope = sign * float(np.sum(factors)) * row.times / row.scale * scale
                sensitivities[key] = sensitivities.get(key, 0.0) + slope
        feasible = max(worst, *(np.max(part) for part in point.exceeded)) < _MET
        return Answer(x, value, point.converged and feasible, sensitivities, at_bounds)


def _sobol(size: int, number: int, seed: int) -> Any:
    """Points of a scrambled Sobol sequence in the unit cube, shape (number, size)."""
    from scipy.stats import qmc

    power = max(0, math.ceil(math.log2(number)))
    return qmc.Sobol(size, rng=seed).random_base2(power)[:number]
