"""The search for the best machine: starts within the bounds, and programs whose angles grow until no limit is
exceeded between them."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...core.errors import InputError, RunError
from ...reading.results import part, result
from ...study.cycle_quantities import CycleQuantity
from .extremes import MOST_ANGLES, TurnValues, grid, peaks_of, stationary
from .ipopt import Solution, solve
from .kernel import Kernel
from .program import COARSE, AngleProgram, Lanes, Space, key_of
from .requirements import Requirements
from .rows import AuxRow, Columns, ExtremeRow, MeanRow, PointRow, RequirementRow, Row, RowMaker
from .wishes import SLACK, TURNS, TurnLimit, Wishes

FINE = 720
"""Number of angles at which the answer of a program is looked over."""
_EXCEEDED = 1e-9
"""Share of its scale by which a limit may be exceeded between the angles."""
_MET = 1e-7
"""Share of its scale by which a limit counts as met."""
_NEAR = 0.05
"""Share of its scale by which a limit must be near at an angle of the grid, to be looked at between the angles."""
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
    point: Solution
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
    """The programs of some wishes."""

    def __init__(self, wishes: Wishes) -> None:
        self.wishes = wishes
        machine, low_high = wishes.machine, np.array(list(wishes.free.values()), float)
        self.columns = Columns(machine)
        self.today = wishes.today
        quantities = (*wishes.objectives, *(limit.quantity for limit in wishes.limits))
        # all columns are known before the kernel is made
        maker = self._maker([])
        for q in sorted(quantities, key=lambda q: q.name):
            maker.at_most(q, "", 1.0)
            if q.name != "installed_power":
                maker.at_least(q, "", 1.0, 0.0)
            for each in q.integrands:
                self.columns.whole(each.column)
        if wishes.slack_free_speed:
            maker.slack_free(self.webs, SLACK, 1.0)
        kernel = Kernel(machine, wishes.feed, self.columns.expressions, wishes.names)
        requirements = Requirements(machine, wishes.names)
        low, high = low_high.T
        self.space = Space(kernel, requirements, low, high - low, wishes.crank_speed, wishes.slack_free_speed)
        self.turn = TurnValues(kernel, wishes.crank_speed)
        self.base = self._base()
        self.scales = {q.name: abs(self.value(q, self.base)) or 1.0 for q in quantities}
        self.effort = Effort()

    @property
    def webs(self) -> list[str]:
        """The outputs with the least pulls at the ends of the webs of the loaded sides."""
        machine = self.wishes.machine
        return [f"{side}.web_pull" for side in machine.loaded_sides(self.wishes.feed)]

    @property
    def mean_pulls(self) -> list[int]:
        """The places of the mean pulls along these webs."""
        return [self.columns.mean(column) for column in self.webs]

    def _maker(self, aux: list[float]) -> RowMaker:
        def new_aux(scale: float) -> int:
            aux.append(scale)
            return len(aux) - 1

        return RowMaker(self.columns, self.wishes.basis, new_aux)

    def _base(self) -> Any:
        """A machine within the bounds that can be assembled: today's, as far as the bounds admit it, or the first
        one of a sequence that fills the bounds evenly.

        Raises
        ------
        RunError
            where there is none.
        """
        inside = np.clip(self.today, self.space.low, self.space.low + self.space.span)
        if self.turns(inside):
            return inside
        for y in _sobol(self.space.n, 4096, self.wishes.seed):
            x = self.space.low + self.space.span * y
            if self.turns(x):
                return x
        raise RunError(f"No machine within the bounds of optimize.free turns. {self._obstacle(inside)}")

    def _obstacle(self, x: Any) -> str:
        """Why a machine does not turn."""
        try:
            self.wishes.machine.replace(dict(zip(self.wishes.names, map(float, x), strict=True)))
        except InputError as error:
            return f"The one nearest to today's: {error}"
        return "The one nearest to today's cannot be assembled at each angle."

    def turns(self, x: Any) -> bool:
        """Whether a machine meets the requirements of its model, and can be assembled at each angle."""
        met = self.space.requirements.values(x)
        if not np.all(met > 0.0):
            return False
        q = grid(COARSE)
        return bool(np.all(np.isfinite(self.space.kernel.values(x, q, np.full(len(q), self.space.speed)))))

    # quantities

    def value(self, q: CycleQuantity, x: Any, points: int = FINE) -> float:
        """A quantity of the continuous turn."""
        parts = []
        for each in q.integrands:
            k = self.columns.whole(each.column)
            if each.reduction in ("mean", "rms"):
                mean = self.turn.mean(x, k, 2 if each.reduction == "rms" else 1)
                parts.append(math.sqrt(mean) if each.reduction == "rms" else mean)
            else:
                at = self.turn.extreme(x, [k], each.reduction, points)  # type: ignore[arg-type]
                parts.append(abs(at.value) if each.reduction == "peak" else at.value)
        ratio = self.ratio(x)
        return float(q.combine(parts, self.wishes.crank_speed * ratio, self.wishes.basis))

    def extreme_angles(self, q: CycleQuantity, x: Any) -> list[float]:
        """The crank angles of the extremes behind a quantity [rad]."""
        extremes = [each for each in q.integrands if each.reduction in ("max", "min", "peak")]
        return [
            self.turn.extreme(x, [self.columns.whole(each.column)], each.reduction, FINE).angle  # type: ignore[arg-type]
            for each in extremes
        ]

    def least_pull(self, x: Any) -> float:
        """The least mean pull along a web up to the highest speed of the slack-free range [N]."""
        from scipy.optimize import minimize_scalar

        places = self.mean_pulls
        q, highest = grid(FINE), self.wishes.slack_free_speed

        def pull(part: float) -> float:
            return float(np.min(self.space.kernel.values(x, q, np.full(FINE, part * highest))[places]))

        pulls = [pull(part) for part in CHECKED]
        k = int(np.argmin(pulls))
        ends = CHECKED[max(k - 1, 0)], CHECKED[min(k + 1, len(CHECKED) - 1)]
        between = minimize_scalar(
            pull, bounds=ends, method="bounded", options={"xatol": 1e-3 * (ends[1] - ends[0])}
        )
        return min(pulls[k], float(between.fun))

    def ratio(self, x: Any) -> float:
        """Motor turns per crank turn."""
        names = self.wishes.machine.model.parameter_layout.names
        return float(self.space.kernel.parameters(x)[names.index("ratio")])

    # programs

    def rows(
        self, objective: CycleQuantity | None, limits: Sequence[TurnLimit], without: frozenset[str]
    ) -> tuple[list[Row], list[float], dict[str, int]]:
        """Rows, scales of the auxiliary variables, and, without an objective, the slacks by their limits."""
        aux: list[float] = []
        maker = self._maker(aux)
        if objective is not None:
            scale = self.scales[objective.name]
            maker.at_most(objective, "", scale, objective=maker.new_aux(scale))
        for limit in limits:
            if limit.name in without:
                continue
            q, low, high = limit.quantity, limit.low, limit.high
            scale = max(abs(low or 0.0), abs(high or 0.0)) or self.scales[q.name]
            if low is not None and low == high:
                maker.exactly(q, limit.name, scale, low)
                continue
            if low is not None:
                maker.at_least(q, limit.name, scale, low)
            if high is not None:
                maker.at_most(q, limit.name, scale, high)
        if self.wishes.slack_free_speed and SLACK not in without:
            maker.slack_free(self.webs, SLACK, self._pull_scale)
        maker.rows += self._clearances("", 0.0)
        if TURNS not in without:
            maker.rows += self._clearances(TURNS, self.wishes.clearance)
        slacks = self._loosen(maker) if objective is None else {}
        return maker.rows, aux, slacks

    @property
    def _pull_scale(self) -> float:
        places = self.mean_pulls
        q = grid(COARSE)
        return float(np.max(np.abs(self.space.kernel.values(self.base, q, np.zeros(len(q)))[places]))) or 1.0

    def _clearances(self, owner: str, clearance: float) -> list[Row]:
        """Rows by which the machine keeps its distance from the requirements of its model."""
        machine, requirements = self.wishes.machine, self.space.requirements
        sizes = requirements.values(self.base)
        return [
            RequirementRow(
                owner, machine.model.required[subject].subject, -clearance * size, size, times=size, place=k
            )
            for k, (subject, size) in enumerate(zip(requirements.subjects, sizes, strict=True))
        ]

    @staticmethod
    def _loosen(maker: RowMaker) -> dict[str, int]:
        """Give each limit a slack, by which all its rows may be exceeded; returns the numbers of the slacks."""
        slacks: dict[str, int] = {}
        rows: list[Row] = []
        for row in maker.rows:
            if row.owner and not (_is_helper(row, maker.rows)):
                k = slacks.setdefault(row.owner, -1)
                if k < 0:
                    k = slacks[row.owner] = maker.new_aux(1.0)
                if row.equal:
                    # from both sides
                    row = dataclasses.replace(row, equal=False)
                    rows.append(dataclasses.replace(_reversed(row), aux={k: -row.scale}))
                row = dataclasses.replace(row, aux={**row.aux, k: -row.scale})
            rows.append(row)
        maker.rows = rows
        return slacks

    # solutions

    def starts(self, number: int, seed: int = 0) -> tuple[list[Any], int]:
        """Points that fill the bounds evenly, each moved towards `base` until the machine can be assembled; and the
        number of points that were moved."""
        points, moved = [], 0
        for y in _sobol(self.space.n, number, self.wishes.seed + seed):
            x = self.space.low + self.space.span * y
            part = 1.0
            while not self.turns(self.base + part * (x - self.base)):
                part *= 0.5
            moved += part < 1.0
            points.append(self.base + part * (x - self.base))
        return points, moved

    def solve(
        self,
        x: Any,
        objective: CycleQuantity | None,
        limits: Sequence[TurnLimit] | None = None,
        without: frozenset[str] = frozenset(),
    ) -> Answer:
        """The machine near `x` with the least objective under the limits, which are by default the limits of the
        wishes; or, without an objective, the one that misses the limits by the least sum of shares."""
        rows, aux, slacks = self.rows(objective, self.wishes.limits if limits is None else limits, without)
        n, space, lanes = self.space.n, self.space, Lanes()
        cost = np.zeros(n + len(aux))
        cost[[n + k for k in slacks.values()] if objective is None else n] = 1.0
        low, high = np.full(len(cost), -np.inf), np.full(len(cost), np.inf)
        low[:n], high[:n] = 0.0, 1.0
        low[[n + k for k in slacks.values()]] = 0.0
        z = np.zeros(len(cost))
        z[:n] = np.clip((x - space.low) / space.span, 1e-3, 1.0 - 1e-3)
        warm: Solution | None = None
        last: AngleProgram | None = None
        first = [*slacks.values()] if objective is None else [0]
        for _ in range(_ROUNDS):
            program = AngleProgram(space, rows, aux, lanes)
            if warm is not None and last is not None:
                warm = dataclasses.replace(warm, multipliers=program.from_other(last, warm.multipliers))
            point = solve(program, cost, low, high, program.lifted(z, first), warm)
            self.effort.programs += 1
            self.effort.iterations += point.iterations
            self.effort.evaluations += program.evaluations
            if not point.converged:
                break
            if not self._add_lanes(program, point.z, lanes):
                break
            z, warm, last = point.z, point, program
        return self._answer(objective, slacks, program, point)

    def _add_lanes(self, program: AngleProgram, z: Any, lanes: Lanes) -> bool:
        """Add the angles at which a limit is exceeded between the angles of the program; whether there are any."""
        space, more = self.space, False
        x = space.x(z)
        for row in program.rows:
            if isinstance(row, MeanRow):
                exact = self.turn.mean(x, row.column, 2 if row.rms else 1)
                rough = program.mean_of(z, row)
                if abs(exact - rough) > _EXCEEDED * abs(exact) and lanes.fine < MOST_ANGLES:
                    lanes.fine, more = 2 * lanes.fine, True
                    break
        q, step = grid(FINE), 2.0 * math.pi / FINE
        values: dict[float, Any] = {}
        for row in program.rows:
            if not isinstance(row, PointRow):
                continue
            for w in [share * space.slack_speed for share in CHECKED] if row.slack else [space.speed]:
                if w not in values:
                    values[w] = space.kernel.values(x, q, np.full(FINE, w))[:, 0]
                offset = program.offset(z, row)
                rest = row.factor * values[w][row.column] / row.scale + offset
                places = peaks_of(rest, 1.0, -_NEAR)
                if not len(places):
                    continue
                sign, number = float(np.sign(row.factor)), len(places)
                at = stationary(
                    space.kernel,
                    x,
                    np.full(number, row.column),
                    q[places],
                    np.full(number, w),
                    sign,
                    2.0 * step,
                )
                for angle, value in zip(at.q, row.factor * at.values / row.scale + offset, strict=True):
                    if value > _EXCEEDED:
                        more |= lanes.add(key_of(row), float(angle), w)
        return more

    def _answer(
        self, objective: CycleQuantity | None, slacks: dict[str, int], program: AngleProgram, point: Solution
    ) -> Answer:
        n, y = self.space.n, point.z[: self.space.n]
        # the inner points of IPOPT end a little off the bounds
        y = np.where(y < _AT_BOUND, 0.0, np.where(y > 1.0 - _AT_BOUND, 1.0, y))
        x = self.space.low + self.space.span * y
        misses = {owner: float(point.z[n + k]) for owner, k in slacks.items()}
        scale = self.scales[objective.name] if objective is not None else 1.0
        at_bounds = {}
        for name, factor, span in zip(self.wishes.names, point.bounds, self.space.span, strict=False):
            at_bounds[name, "max" if factor > 0.0 else "min"] = -float(factor) * scale / float(span)
        if objective is None:
            return Answer(x, sum(misses.values()), point.converged, point, at_bounds=at_bounds, misses=misses)
        feasible = point.converged and float(np.max(program.violation(point.z), initial=0.0)) < _MET
        value = self.value(objective, x) if np.all(np.isfinite(x)) and self.turns(x) else math.nan
        sensitivities: dict[tuple[str, str], float] = {}
        for factor, k in zip(point.multipliers, program.row_of, strict=True):
            row = program.rows[k]
            if row.owner and not _is_helper(row, program.rows):
                sign = -1.0 if row.side == "max" else 1.0
                key = row.owner, row.side
                sensitivities[key] = sensitivities.get(key, 0.0) + sign * float(factor) * row.per_unit * scale
        return Answer(x, value, bool(feasible), point, sensitivities, at_bounds)


def _is_helper(row: Row, rows: Sequence[Row]) -> bool:
    """Whether a row only holds an auxiliary variable of a range, whose limit is a row of its own."""
    return (
        isinstance(row, PointRow)
        and bool(row.aux)
        and any(isinstance(r, AuxRow) and r.owner == row.owner for r in rows)
    )


def _reversed(row: Row) -> Row:
    """The row from the other side."""
    if isinstance(row, ExtremeRow):
        terms = tuple((columns, sense, -factor) for columns, sense, factor in row.terms)
        return dataclasses.replace(row, upper=-row.upper, terms=terms)
    assert isinstance(row, MeanRow)
    return dataclasses.replace(row, upper=-row.upper, factor=-row.factor)


def _sobol(size: int, number: int, seed: int) -> Any:
    """Points of a scrambled Sobol sequence in the unit cube, shape (number, size)."""
    from scipy.stats import qmc

    power = max(0, math.ceil(math.log2(number)))
    return qmc.Sobol(size, rng=seed).random_base2(power)[:number]
