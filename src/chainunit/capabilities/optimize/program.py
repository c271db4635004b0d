"""A nonlinear program over fixed angles: rows, their derivatives, and the bend of their sum.

The variables are the free parameters, each as its place between its bounds (0 to 1), and auxiliary variables, each
as a multiple of its scale.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np

from .extremes import TurnValues, grid, stationary
from .kernel import Kernel
from .requirements import Requirements
from .rows import ExtremeRow, MeanRow, PointRow, RequirementRow, Row

COARSE = 48
"""Number of angles with which the search begins; those at which a limit is exceeded between them are added."""
_APART = 1e-3
"""Distance of two angles that count as one [rad]."""
SLACK_SPEEDS = (0.0, 1.0)
"""Speeds at which the pulls are limited, in parts of the highest speed of the slack-free range: without a processing
force the pull is linear in the square of the speed, so that it is least at one end."""


@dataclass
class Space:
    """What all programs of a search share: the machine's columns and requirements, bounds and scales."""

    kernel: Kernel
    requirements: Requirements
    low: Any
    span: Any
    speed: float
    """crank speed [rad/s]"""
    slack_speed: float

    @property
    def n(self) -> int:
        """Number of free parameters."""
        return len(self.low)

    def x(self, z: Any) -> Any:
        """The free parameters of a point."""
        return self.low + self.span * z[: self.n]


Followed: TypeAlias = tuple[int, bool, float]
"""A column, whether at the speeds of the slack-free range, and its sign."""


@dataclass
class Lanes:
    """The angles and speeds of a program: `coarse` angles, `fine` ones for means, and, by column and sign, maxima
    that are followed as they move with the parameters, from an angle at a speed on."""

    coarse: int = COARSE
    fine: int = 256
    followed: dict[Followed, list[tuple[float, float]]] = field(default_factory=dict)

    def add(self, key: Followed, q: float, w: float) -> bool:
        """Add a maximum; whether it is new."""
        there = self.followed.setdefault(key, [])
        new = all(abs(q - angle) > _APART or w != speed for angle, speed in there)
        if new:
            there.append((q, w))
        return new


class AngleProgram:
    """The rows over some lanes."""

    def __init__(self, space: Space, rows: Sequence[Row], aux: Sequence[float], lanes: Lanes) -> None:
        self.space, self.rows, self.scales = space, tuple(rows), np.array(aux, float)
        self.size = space.n + len(aux)
        points = [(float(q), space.speed) for q in grid(lanes.coarse)]
        self._coarse = np.arange(lanes.coarse)
        self._fine = np.arange(0)
        if any(isinstance(row, MeanRow) for row in rows):
            self._fine = len(points) + np.arange(lanes.fine)
            points += [(float(q), space.speed) for q in grid(lanes.fine)]
        slack = np.arange(0)
        if any(isinstance(row, PointRow) and row.slack for row in rows):
            speeds = [part * space.slack_speed for part in SLACK_SPEEDS]
            slack = len(points) + np.arange(lanes.coarse * len(speeds))
            points += [(float(q), w) for w in speeds for q in grid(lanes.coarse)]
        more: dict[Followed, list[int]] = {}
        first, columns, signs = len(points), [], []
        for key, extra in lanes.followed.items():
            more[key] = list(range(len(points), len(points) + len(extra)))
            columns += [key[0]] * len(extra)
            signs += [key[2]] * len(extra)
            points += extra
        self.begin, self.w = np.array(points).T
        self.q = self.begin.copy()
        self._followed = np.arange(first, len(points))
        self._followed_columns, self._signs = np.array(columns, int), np.array(signs)
        self._reach = 2.0 * np.pi / lanes.coarse
        self._turn = TurnValues(space.kernel, space.speed)
        self._arrange(slack, more)
        self._key = b""
        self.evaluations = 0

    def _arrange(self, slack: Any, more: dict[Followed, list[int]]) -> None:
        """Number the rows: point rows one for each angle, then the others one each."""
        column, lane, owner, self._others = [], [], [], []
        for k, row in enumerate(self.rows):
            if not isinstance(row, PointRow):
                self._others.append(k)
                continue
            at = [*(slack if row.slack else self._coarse), *more.get(key_of(row), [])]
            lane += at
            column += [row.column] * len(at)
            owner += [k] * len(at)
        self._column, self._lane = np.array(column, int), np.array(lane, int)
        self.row_of = np.array(owner + self._others, int)
        """the row of each constraint"""
        points = len(owner)
        self._points = points
        factors = [row.factor for row in self.rows if isinstance(row, PointRow)]
        scaled = dict(
            zip((k for k, row in enumerate(self.rows) if isinstance(row, PointRow)), factors, strict=True)
        )
        self._factor = np.array([scaled[k] / self.rows[k].scale for k in owner])
        self._constant = np.array([-self.rows[k].upper / self.rows[k].scale for k in self.row_of], float)
        self._aux = np.zeros((len(self.row_of), len(self.scales)))
        for i, k in enumerate(self.row_of):
            for a, factor in self.rows[k].aux.items():
                self._aux[i, a] = factor * self.scales[a] / self.rows[k].scale
        self.equal = np.array([self.rows[k].equal for k in self.row_of], bool)

    @property
    def constraints(self) -> int:
        """Number of constraints."""
        return len(self.row_of)

    def _compute(self, z: Any) -> None:
        """Values and slopes of all constraints at a point; the values at the last point are kept."""
        if z.tobytes() == self._key:
            return
        space, n = self.space, self.space.n
        self.evaluations += 1
        x = space.x(z)
        self._x = x
        if len(self._followed):
            at = self._followed
            those = self._followed_columns, self.begin[at], self.w[at], self._signs
            self._maxima = stationary(space.kernel, x, *those, self._reach)
            self.q[at] = self._maxima.q
        columns, slopes = space.kernel.slopes(x, self.q, self.w)
        self._columns, self._slopes = columns, slopes
        g = self._constant + self._aux @ z[n:]
        J = np.zeros((self.constraints, self.size))
        J[:, n:] = self._aux
        if self._points:
            g[: self._points] += self._factor * columns[self._column, self._lane]
            J[: self._points, :n] = self._factor[:, None] * slopes[self._column, :n, self._lane]
        self._extremes: dict[int, list[Any]] = {}
        self._met = (
            (space.requirements.values(x), space.requirements.slopes(x)) if self._needs_requirements else None
        )
        for i, k in enumerate(self._others, self._points):
            value, gradient = self._other(k, x)
            g[i] += value / self.rows[k].scale
            J[i, :n] = gradient / self.rows[k].scale
        J[:, :n] *= space.span
        self._g, self._J, self._key = g, J, z.tobytes()

    @property
    def _needs_requirements(self) -> bool:
        return any(isinstance(self.rows[k], RequirementRow) for k in self._others)

    def _other(self, k: int, x: Any) -> tuple[float, Any]:
        """Value and gradient of a row that is no point row."""
        row, n = self.rows[k], self.space.n
        if isinstance(row, RequirementRow):
            assert self._met is not None
            return -self._met[0][row.place], -self._met[1][row.place]
        if isinstance(row, MeanRow):
            c, dc = self._columns[row.column, self._fine], self._slopes[row.column, :n][:, self._fine]
            if not row.rms:
                return row.factor * float(np.mean(c)), row.factor * np.mean(dc, axis=1)
            rms = float(np.sqrt(np.mean(c * c)))
            return row.factor * rms, row.factor * np.mean(dc * c, axis=1) / rms
        if isinstance(row, ExtremeRow):
            value, gradient = 0.0, np.zeros(n)
            found = []
            for columns, sense, factor in row.terms:
                at = self._turn.extreme(x, columns, sense, len(self._coarse), self._columns[:, self._coarse])
                factor *= at.sign if sense == "peak" else 1.0
                value += factor * at.value
                if np.isfinite(at.value):
                    lane = np.array([at.angle]), np.array([self.space.speed])
                    gradient += factor * self.space.kernel.slopes(x, *lane)[1][at.column, :n, 0]
                found.append((at, factor))
            self._extremes[k] = found
            return value, gradient
        return 0.0, np.zeros(n)

    def constraint_values(self, z: Any) -> Any:
        """The constraints, each to be at most 0 or exactly 0, shape (constraints,)."""
        self._compute(z)
        return self._g

    def constraint_slopes(self, z: Any) -> Any:
        """Their derivatives, shape (constraints, size)."""
        self._compute(z)
        return self._J

    def violation(self, z: Any) -> Any:
        """By how much each constraint is exceeded, in parts of its scale."""
        g = self.constraint_values(z)
        return np.where(self.equal, np.abs(g), g)

    def lifted(self, z: Any, last: Sequence[int]) -> Any:
        """The point with auxiliary variables that meet the constraints, as far as they can: first all others, then
        the `last` ones, which may depend on them."""
        z, n = z.copy(), self.space.n
        for those in ([k for k in range(len(self.scales)) if k not in last], last):
            z[[n + k for k in those]] = 0.0
            g = self.constraint_values(z)
            for k in those:
                factors = self._aux[:, k]
                above, below = (factors < 0.0) & np.isfinite(g), (factors > 0.0) & np.isfinite(g)
                alone = np.sum(self._aux != 0.0, axis=1) == 1
                if k in last:
                    least = np.max(g[above] / -factors[above], initial=0.0)
                    z[n + k] = least + 1e-3 * (1.0 + abs(least))
                elif np.any(above & alone):
                    z[n + k] = np.max((g / -np.where(factors == 0.0, 1.0, factors))[above & alone]) + 1e-3
                elif np.any(below & alone):
                    z[n + k] = np.min((-g / np.where(factors == 0.0, 1.0, factors))[below & alone]) - 1e-3
        return z

    def from_other(self, other: AngleProgram, multipliers: Any) -> Any:
        """The multipliers of the same rows over other angles; 0 for new angles."""
        known = dict(zip(other.keys, multipliers, strict=True))
        return np.array([known.get(key, 0.0) for key in self.keys])

    @property
    def keys(self) -> list[tuple[int, float, float]]:
        """Row, angle and speed of each constraint."""
        at = [(float(self.begin[i]), float(self.w[i])) for i in self._lane]
        at += [(0.0, 0.0)] * len(self._others)
        return [(int(k), *pair) for k, pair in zip(self.row_of, at, strict=True)]

    def offset(self, z: Any, row: Row) -> float:
        """The part of a row that does not depend on the machine, over its scale."""
        own = sum(factor * self.scales[a] * z[self.space.n + a] for a, factor in row.aux.items())
        return float((own - row.upper) / row.scale)

    def mean_of(self, z: Any, row: MeanRow) -> float:
        """The mean, or the mean square, of a column over the angles for means."""
        self._compute(z)
        return float(np.mean(self._columns[row.column, self._fine] ** (2 if row.rms else 1)))

    def bend(self, z: Any, multipliers: Any) -> Any:
        """The second derivatives of their sum with `multipliers`, shape (size, size)."""
        self._compute(z)
        self.evaluations += 1
        space, n, x = self.space, self.space.n, self._x
        weights = np.zeros((space.kernel.rows, len(self.q)))
        own = multipliers[: self._points] * self._factor if self._points else np.zeros(0)
        np.add.at(weights, (self._column, self._lane), own)
        matrix, of_requirements = np.zeros((n, n)), np.zeros(len(space.requirements))
        for i, k in enumerate(self._others, self._points):
            row, factor = self.rows[k], multipliers[i] / self.rows[k].scale
            if factor == 0.0:
                continue
            if isinstance(row, RequirementRow):
                of_requirements[row.place] -= factor
            elif isinstance(row, MeanRow):
                matrix += self._mean_bend(row, factor, weights)
            elif isinstance(row, ExtremeRow):
                matrix += self._extreme_bend(k, x, factor)
        matrix += space.kernel.bend(x, self.q, self.w, weights)[:n, :n]
        if len(self._followed):
            # the angle of a maximum moves with the parameters
            maxima = self._maxima
            own = np.where(maxima.good, weights[self._followed_columns, self._followed], 0.0)
            own = own / np.where(maxima.good, maxima.curvature, 1.0)
            mixed = np.where(maxima.good, maxima.mixed, 0.0)
            matrix -= (mixed * own) @ mixed.T
        if np.any(of_requirements):
            matrix += space.requirements.bend(x, of_requirements)
        whole = np.zeros((self.size, self.size))
        whole[:n, :n] = matrix * np.outer(space.span, space.span)
        return whole

    def _mean_bend(self, row: MeanRow, factor: float, weights: Any) -> Any:
        """The part of a mean's bend that the slopes give; the rest is added to the `weights`."""
        n, factor = self.space.n, factor * row.factor / len(self._fine)
        if not row.rms:
            weights[row.column, self._fine] += factor
            return np.zeros((n, n))
        c, dc = self._columns[row.column, self._fine], self._slopes[row.column, :n][:, self._fine]
        rms = np.sqrt(np.mean(c * c))
        weights[row.column, self._fine] += factor * c / rms
        gradient = dc @ c
        return factor * (dc @ dc.T / rms - np.outer(gradient, gradient) / (rms**3 * len(self._fine)))

    def _extreme_bend(self, k: int, x: Any, factor: float) -> Any:
        """The bend of extremes, whose angle moves with the parameters."""
        n, kernel = self.space.n, self.space.kernel
        matrix = np.zeros((n, n))
        for at, own in self._extremes[k]:
            weights = np.zeros((kernel.rows, 1))
            weights[at.column] = 1.0
            H = kernel.bend(x, np.array([at.angle]), np.array([self.space.speed]), weights)
            matrix += own * factor * H[:n, :n]
            if H[n, n] * at.sign < 0.0:  # else the extreme is at a kink
                matrix -= own * factor * np.outer(H[:n, n], H[n, :n]) / H[n, n]
        return matrix


def key_of(row: PointRow) -> Followed:
    """The maxima that the row follows."""
    return row.column, row.slack, float(np.sign(row.factor))
