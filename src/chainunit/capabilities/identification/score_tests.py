"""Known numbers of a machine that the recordings contradict.

Each is freed alone, around the best fit: the derivatives of the columns by it say how far it would move, and with
which standard deviation (a score test). A wrong dimension or another law of friction, which the sought numbers make
up for almost wholly, shows here before it shows in the sum of all orders of the residuals. As the torque is far from
straight in the speed of smooth friction, the secant up to another law stands for its derivative.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...core.errors import RunError
from ...core.messages import unit_behind
from ...recordings.fit import NormalEquations, assemble
from ...recordings.problem import Comparison, Problem
from ...recordings.unknown import Unknown

TESTED = ("pin.w_smooth", "processing.v_smooth", "r", "l", "h", "e", "l1", "z", "web_share")
"""Known numbers of a chain unit that are tested: its law of friction, its dimensions, and where the material lies."""
SMOOTH, LAW = "machine.pin.w_smooth", 10.0
"""The number by which the law of friction is another one, and the factor on it for friction that grows with speed."""
NEAR = 0.3
"""Change of the crank angle by the other law up to which its columns are compared [rad]."""
REJECTION = 4.0
"""Change of a number, in standard deviations, from which the recordings reject its value."""
ROUNDING = 1e-9
"""Information on a number with all others free, in parts of that with all others known, that is rounding alone."""
_CHANGE = 0.05
"""Change for which the derivatives are integrated, in parts of the number."""


@dataclass(frozen=True)
class ScoreTest:
    """A number that counts as known: its `known` value, the `change` that the recordings would prefer, and the
    standard deviation of that change, with all sought numbers free: infinite where no column depends on it."""

    name: str
    unit: str
    known: float
    change: float
    deviation: float

    def __str__(self) -> str:
        unit, preferred = unit_behind(self.unit), self.known + self.change
        words = f"{self.name} = {self.known:.4g}{unit}: "
        if self.known * preferred <= 0.0:
            return words + "the recordings contradict it, and no value of its sign would mend that alone"
        return (
            f"{words}the recordings would prefer {preferred:.4g}{unit} (standard deviation {self.deviation:.2g}) if "
            "it alone were wrong"
        )

    @property
    def is_rejected(self) -> bool:
        """Whether the recordings contradict the number."""
        return abs(self.change) > REJECTION * self.deviation


def score_tests(
    problem: Problem, best: NormalEquations, workers: int = 2, names: Sequence[str] = TESTED
) -> list[ScoreTest]:
    """The tests of the numbers `names` of the machine, except the sought ones, at the best fit."""
    machine, taken = problem.plant.machine, {u.name for u in problem.sought}
    layout = machine.model.parameter_layout
    units = {v.name: v.unit for v in layout.variables}
    more = [
        Unknown(f"machine.{name}", units[name], x, -math.inf, math.inf, abs(x) * _CHANGE)
        for name in names
        if name in units and f"machine.{name}" not in taken and (x := machine.by_name[name])
    ]
    if not more:
        return []
    sought = (*problem.sought, *more)
    wider = Problem(problem.plant.with_names([u.name for u in sought]), problem.runs, sought, problem.sensors)
    z = wider.start_values
    for name, place in problem.place.items():
        z[wider.place[name]] = best.z[place]
    comparisons = tuple(wider.comparisons(z, workers))
    if SMOOTH in wider.place and SMOOTH not in taken:
        comparisons = _with_secant(wider, z, comparisons, workers)
    at = assemble(wider, z, comparisons, {key: 1.0 / weight for key, weight in best.weights.items()})
    return [_score_test(each, wider, at, {u.name for u in more}) for each in more]


def _with_secant(
    problem: Problem, z: Any, comparisons: tuple[Comparison, ...], workers: int
) -> tuple[Comparison, ...]:
    """The comparisons with the secant to another law of friction as the derivative by `SMOOTH`, where the machine
    runs with it and keeps its phase."""
    place, other = problem.place[SMOOTH], z.copy()
    other[place] *= LAW
    try:
        others = tuple(problem.comparisons(other, workers))
    except RunError:
        return comparisons
    pairs = list(zip(comparisons, others, strict=True))
    if max(float(np.max(np.abs(there.angle - here.angle))) for here, there in pairs) > NEAR:
        return comparisons
    replaced = []
    for here, there in pairs:
        slopes = here.slopes.copy()
        if place in here.places:
            change = here.residuals - there.residuals
            slopes[:, list(here.places).index(place)] = change / (other[place] - z[place])
        replaced.append(replace(here, slopes=slopes))
    return tuple(replaced)


def _score_test(of: Unknown, problem: Problem, at: NormalEquations, more: set[str]) -> ScoreTest:
    """The step of one number with all others but the further ones free."""
    place = problem.place[of.name]
    free = [k for name, k in problem.place.items() if name not in more]
    scale = 1.0 / np.sqrt(np.diag(at.matrix)[free])
    cross = scale * at.fisher[free, place]
    own: Any = np.linalg.solve(at.matrix[np.ix_(free, free)] * np.outer(scale, scale), cross)
    alone = float(at.fisher[place, place])
    information = alone - float(cross @ own)
    if information <= ROUNDING * alone:
        return ScoreTest(of.name, of.unit, of.start, 0.0, math.inf)
    change = float(at.gradient[place] - own @ (scale * at.gradient[free])) / information
    return ScoreTest(of.name, of.unit, of.start, change, 1.0 / math.sqrt(information))
