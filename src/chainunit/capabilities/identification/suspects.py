"""Known numbers of a drive that the recordings contradict: those of its machine, its motor and its converter.

Each known number is freed alone, around the best fit: the derivatives of the columns by it say how far it would move,
and with which standard deviation (a score test). A wrong dimension or gain, which the sought numbers make up for
almost wholly, shows here before it shows in the sum of all orders of the residuals. A wrong number makes others
suspicious, too: if the model does not describe the recordings, numbers are freed alone and in pairs, and the
recordings fitted again with the best of them, to tell the ones that would explain the recordings.

A speed by which a law is smooth is no number of a machine, and no suspect. That the law of friction is another one is
tested by itself. As the torque is far from straight in its speed, the secant up to another law stands for its
derivative.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...core.errors import InputError, RunError
from ...core.messages import unit_behind
from ...core.quantities import quantity
from ...reading.results import OWN, part, result
from ...recordings.fit import Fit, NormalEquations, assemble, fit
from ...recordings.plant import AnyPlant
from ...recordings.problem import OUTLIER, Comparison, Problem
from ...recordings.residuals import ResidualTest, describes, residual_tests
from ...recordings.unknown import Unknown
from ...work.progress import TaskProgress, quiet
from .posterior import Posterior

LAW, OTHER_LAWS = "machine.pin.w_smooth", (10.0, 2.0, 1.1)
"""The number by which the law of friction is another one, and factors on it for friction that grows with speed."""
NEAR = 0.3
"""Change of the crank angle by the other law up to which its columns are compared [rad]."""
REJECTION = 4.0
"""Change of a number, in standard deviations, from which the recordings reject its value."""
ROUNDING = 1e-9
"""Information on a number with all others free, in parts of that with all others known, that is rounding alone."""
NO_SUSPECTS = ("machine.g", "machine.ratio", "machine.rod_inertia", "motor.phi_start", "motor.w_start")
"""Parameters that are no known numbers of a machine: constants, counted ones, switches and starts."""
WRONG, ASSUMED = 0.2, 1.0
"""Standard deviation of a known number that may be wrong, in parts of it, and of one that is assumed."""
RANGE = 4.0
"""Factor by which a known number may be wrong."""
FEW, SEARCHES = 3, 3
"""Number of sets of suspects with which the recordings are fitted again around a fit, and most fits around which the
known numbers are freed to find such sets."""
MOST_ROUNDS, USUAL_ROUNDS = 15, 5
"""Most and usual rounds of a fit with suspects: it begins near its end if they are the right ones."""
MARGIN = 25.0
"""Sum of squares, in parts of that of noise, by which a set of suspects may be worse than the best one."""
NEARLY, OTHERS = 40.0, 6
"""Factor on this margin within which the quadratic form is no judge, and number of sets that are fitted there."""
MOST_STEPS = (SEARCHES + 1) * FEW + OTHERS + SEARCHES + 2
"""Most steps of a search: fits with suspects, and fits around which known numbers are freed."""
MOST_SETS = 12
"""Most sets of suspects that are named."""


@dataclass(frozen=True)
class ScoreTest:
    """A number that counts as known: its `known` value, the `change` that the recordings would prefer, and the
    standard deviation of that change, with all sought numbers free: infinite where no column depends on it."""

    name: str
    unit: str
    known: float
    change: float
    deviation: float

    @property
    def is_rejected(self) -> bool:
        """Whether the recordings contradict the number."""
        return abs(self.change) > REJECTION * self.deviation


@result
class Suspect:
    """A known number, and the value with which the model would come nearest to the recordings. A number that is not
    `stated` has the value of a new drive, and not of the study."""

    name: str = part("the number")
    unit: str
    kind: str
    known: float = part("its known value", unit=OWN)
    preferred: float = part("the value with which the model would come nearest to the recordings", unit=OWN)
    stated: bool = part("whether the study states the number")

    def __str__(self) -> str:
        unit = unit_behind(self.unit)
        more = "" if self.stated else ", which the study does not state"
        return f"{self.name} = {self.preferred:.4g}{unit} in place of {self.known:.4g}{unit}{more}"


@result
class SuspectSet:
    """Suspects that together explain the recordings about as well as known numbers can."""

    suspects: tuple[Suspect, ...] = part("the suspects of the set")
    excess: float = quantity(
        "1", "sum of squares of the residuals beyond that of the best set, in parts of that of noise"
    )
    describes: bool | None = part(
        "whether a fit in which they were sought described the recordings; null if none was made"
    )

    def __str__(self) -> str:
        return " and ".join(map(str, self.suspects))


@dataclass(frozen=True)
class KnownNumbers:
    """The tests of the known numbers and of the law of friction (None if no run can tell it), and the sets of
    suspects, the best first: none for a model that describes the recordings."""

    tests: tuple[ScoreTest, ...]
    law: ScoreTest | None = None
    sets: tuple[SuspectSet, ...] = ()

    @property
    def are_rejected(self) -> bool:
        """Whether the recordings contradict a known number, or the law of friction."""
        return any(test.is_rejected for test in self.tests) or self.is_law_rejected

    @property
    def is_law_rejected(self) -> bool:
        """Whether the recordings contradict the law of friction."""
        return self.law is not None and self.law.is_rejected


def is_described(
    problem: Problem, best: Fit, tests: Sequence[ResidualTest], around: Posterior, numbers: KnownNumbers
) -> bool:
    """Whether the model of an identification describes the recordings: the fit does so, no bound is active, and the
    recordings contradict no known number."""
    return describes(problem, best, tests) and not around.active_bounds and not numbers.are_rejected


def known_numbers(plant: AnyPlant, sought: Collection[str], assumed: Collection[str] = ()) -> list[Unknown]:
    """The known numbers of a plant that may be wrong, all except the `sought` ones. The study does not state those
    that are `assumed`."""
    numbers = []
    for v, x in plant.parameters():
        is_number = v.type == "Real" and not v.name.endswith("_smooth") and v.name not in NO_SUSPECTS
        if is_number and v.name not in sought and x and math.isfinite(x):
            low, high = sorted((x / RANGE, x * RANGE))
            low, high = max(low, v.quantity.low), min(high, v.quantity.high)
            share = ASSUMED if v.name in assumed else WRONG
            numbers.append(Unknown(v.name, v.unit, x, low, high, share * abs(x)))
    return numbers


def known_number_tests(problem: Problem, best: NormalEquations, workers: int = 2) -> KnownNumbers:
    """The tests of all known numbers at the best fit."""
    more = known_numbers(problem.plant, {u.name for u in problem.sought})
    freed = _Freed.around(problem, best, more, workers)
    return KnownNumbers(tuple(freed.tests()), _law_test(problem, best, workers))


def suspect_sets(
    problem: Problem,
    best: NormalEquations,
    workers: int = 2,
    assumed: Collection[str] = (),
    progress: TaskProgress = quiet,
) -> tuple[SuspectSet, ...]:
    """The sets of one or two known numbers that, if they are wrong, explain the recordings best.

    The known numbers are freed around the best fit, and the recordings fitted again with the best sets; then around
    the best of these fits, until no other set promises to be better.
    """
    return tuple(_Search(problem, best, workers, assumed, progress).sets())


class _Search:
    """The search for the numbers that explain the recordings of a problem, around its best fit."""

    def __init__(
        self,
        problem: Problem,
        best: NormalEquations,
        workers: int,
        assumed: Collection[str],
        progress: TaskProgress,
    ) -> None:
        self._problem, self._best, self._workers, self._progress = problem, best, workers, progress
        self._assumed = assumed
        self._more = known_numbers(problem.plant, {u.name for u in problem.sought}, assumed)
        self._fits = dict[frozenset[str], tuple[Problem, Fit]]()
        self._failed = set[frozenset[str]]()
        self._steps = 0

    def sets(self) -> Iterator[SuspectSet]:
        """The sets that explain the recordings about as well as the best one, the best first. If none explains them,
        the form is that of a point which is far from the right one, and the best sets are named without a margin."""
        freed = self._best_freed()
        ranked = freed.ranked()
        costs = {names: cost - ranked[0][1] for names, cost in ranked}
        best_sets = list(costs)
        if any(self._describes(names) for names in self._fits):
            # the form is that of small changes: sets that it holds for about as good are fitted
            enough = [names for names, cost in costs.items() if cost < MARGIN]
            near = [names for names, cost in _sorted(costs) if cost < NEARLY * MARGIN]
            candidates = [names for names in near if not any(other < names for other in enough)]
            for names in candidates[:OTHERS]:
                self._fit_with(names, freed)
            fit_costs = self._costs()
            costs = {names: fit_costs.get(names, max(0.0, cost)) for names, cost in costs.items()}
            good = [names for names, cost in _sorted(costs) if cost < MARGIN]
            best_sets = [names for names in good if not any(other < names for other in good)]
        for names in best_sets[:MOST_SETS]:
            yield self._set(names, freed, costs[names])

    def _costs(self) -> dict[frozenset[str], float]:
        """The sums of squares of the fits beyond the least one, in parts of that of its noise."""
        weights = self._fits[self._winner()][1].weights
        scales = {key: 1.0 / weight for key, weight in weights.items()}
        costs = {
            names: assemble(problem, best.z, best.comparisons, scales).cost
            for names, (problem, best) in self._fits.items()
        }
        return {names: cost - min(costs.values()) for names, cost in costs.items()}

    def _best_freed(self) -> _Freed:
        """The known numbers, freed around the best fit in which one or two of them are sought, too. The best sets are
        fitted, and a new form around the best of these fits names the next ones; at most `SEARCHES` times."""
        freed = self._freed_around(self._problem, self._best)
        for k in range(SEARCHES):
            ranked = [names for names, _ in freed.ranked()]
            if self._try(ranked, freed) or not self._fits:
                break
            if k == 0:
                # far from straight, the form shows a second number only after the first one is right
                self._try([names for names in ranked if len(names) == 1], freed)
            freed = self._freed_around(*self._fits[self._winner()])
        return self._freed_around(*self._fits[self._winner()]) if self._fits else freed

    def _freed_around(self, problem: Problem, best: NormalEquations) -> _Freed:
        self._step("derivatives")
        return _Freed.around(problem, best, self._more, self._workers)

    def _step(self, title: str) -> Callable[[int, float], None]:
        """Begin a step; the function reports the rounds of a fit."""
        complete, self._steps = self._steps, self._steps + 1

        def report(rounds: int, _: float) -> None:
            share = complete + rounds / (rounds + USUAL_ROUNDS)
            self._progress(f"suspects, at most {MOST_STEPS} steps ({title})", share, MOST_STEPS)

        report(0, 0.0)
        return report

    def _winner(self) -> frozenset[str]:
        """The set whose fit has the least sum of squares with the stated noise of all sensors."""
        costs = {
            names: assemble(wider, fit.z, fit.comparisons).cost for names, (wider, fit) in self._fits.items()
        }
        return min(costs, key=costs.__getitem__)

    def _try(self, ranked: Sequence[frozenset[str]], freed: _Freed) -> bool:
        """Fit the recordings with the first of these sets that were not tried; whether the search has its end, as one
        of them describes the recordings, or none is left."""
        promising = [names for names in ranked[: 2 * FEW] if names not in self._fits][:FEW]
        for names in promising:
            self._fit_with(names, freed)
            if self._describes(names):
                return True
        return not promising

    def _fit_with(self, names: frozenset[str], freed: _Freed) -> None:
        """Fit the recordings with these numbers sought, too, from the values that the quadratic form promises."""
        if names in self._fits or names in self._failed:
            return
        wider, z = _wider(self._problem, self._best.z, [u for u in self._more if u.name in names])
        for name, x in freed.point(names).items():
            if name in wider.place:
                z[wider.place[name]] = x
        z = np.clip(z, *wider.bounds)
        progress = self._step(" and ".join(sorted(names)))
        try:
            self._fits[names] = wider, fit(wider, z, self._workers, progress, most=MOST_ROUNDS)
        except (RunError, InputError):
            self._failed.add(names)

    def _describes(self, names: frozenset[str]) -> bool | None:
        """Whether the model with these numbers sought describes the recordings; None if no fit was made."""
        if names not in self._fits:
            return None
        problem, best = self._fits[names]
        return describes(problem, best, residual_tests(best), names)

    def _set(self, names: frozenset[str], freed: _Freed, excess: float) -> SuspectSet:
        """The set of these suspects; the ones that changed most come first."""
        values = freed.values(names)
        if names in self._fits:
            wider, best = self._fits[names]
            values = {name: float(best.z[wider.place[name]]) for name in names}
        kinds = {v.name: v.kind for v, _ in self._problem.plant.parameters()}
        suspects = []
        for u in (u for u in self._more if u.name in names):
            is_stated = u.name not in self._assumed
            suspects.append(Suspect(u.name, u.unit, kinds[u.name], u.start, values[u.name], is_stated))
        suspects.sort(key=lambda suspect: -abs(suspect.preferred / suspect.known - 1.0))
        return SuspectSet(tuple(suspects), excess, self._describes(names))


def _sorted(costs: Mapping[frozenset[str], float]) -> list[tuple[frozenset[str], float]]:
    return sorted(costs.items(), key=lambda item: item[1])


def _wider(problem: Problem, z: Any, more: Sequence[Unknown]) -> tuple[Problem, Any]:
    """The problem in which further numbers are sought, and its values, those of `z` beside the start values."""
    names = {u.name for u in more}
    sought = (*(u for u in problem.sought if u.name not in names), *more)
    wider = Problem(problem.plant.with_names([u.name for u in sought]), problem.runs, sought, problem.sensors)
    values = wider.start_values
    for name, place in problem.place.items():
        values[wider.place[name]] = z[place]
    return wider, values


class _Freed:
    """The sum of squares around a fit as a quadratic form in the changes of further numbers from their known values,
    with all sought numbers free."""

    def __init__(self, problem: Problem, best: NormalEquations, more: Sequence[Unknown]) -> None:
        self._more, self._names = more, [u.name for u in more]
        places = [problem.place[name] for name in self._names]
        free = [k for k in range(len(best.z)) if k not in set(places)]
        self._now = best.z[places] - np.array([u.start for u in more])
        self._prior = np.array([u.prior_deviation for u in more]) ** -2.0
        self._free = {u.name: float(best.z[k]) for k, u in enumerate(problem.unknowns) if k in set(free)}
        scale = 1.0 / np.sqrt(np.diag(best.matrix)[free])
        inner = best.matrix[np.ix_(free, free)] * np.outer(scale, scale)
        cross = scale[:, None] * best.fisher[np.ix_(free, places)]
        solution: Any = np.linalg.solve(inner, np.column_stack([cross, scale * best.gradient[free]]))
        # the steps of all others, and how they follow these numbers
        self._others = scale * solution[:, -1], scale[:, None] * solution[:, :-1]
        self._alone = np.diag(best.fisher)[places]
        self._form = best.fisher[np.ix_(places, places)] - cross.T @ solution[:, :-1]
        # of the recordings alone: the weights of these numbers are counted by themselves
        gradient = best.gradient[places] + self._prior * self._now
        self._pull = gradient - cross.T @ solution[:, -1]

    @classmethod
    def around(cls, problem: Problem, best: NormalEquations, more: Sequence[Unknown], workers: int) -> _Freed:
        """Around the fit `best` of a problem, in which some of the further numbers may be sought."""
        wider, z = _wider(problem, best.z, more)
        scales = {key: 1.0 / weight for key, weight in best.weights.items()}
        return cls(wider, assemble(wider, z, tuple(wider.comparisons(z, workers)), scales), more)

    def tests(self) -> Iterator[ScoreTest]:
        """For each further number the change that a fit with it alone would make, and its standard deviation: all
        other further numbers keep their known values, the sought ones are free."""
        for k, u in enumerate(self._more):
            information = float(self._form[k, k])
            change, deviation = 0.0, math.inf
            # else the sought numbers can do all that this one does
            if information > ROUNDING * self._alone[k]:
                change, deviation = float(self._pull[k]) / information, 1.0 / math.sqrt(information)
            yield ScoreTest(u.name, u.unit, u.start, change, deviation)

    def values(self, names: Collection[str]) -> dict[str, float]:
        """The best values of these numbers if all others are as known."""
        places = [k for k, name in enumerate(self._names) if name in names]
        changes = self._solution(places)[0]
        return {self._names[k]: self._more[k].start + float(x) for k, x in zip(places, changes, strict=True)}

    def point(self, names: Collection[str]) -> dict[str, float]:
        """The best values of these numbers, as of `values`, and of all other unknowns, which follow them."""
        values = self.values(names)
        pairs = zip(self._more, self._now, strict=True)
        steps = [values.get(u.name, u.start) - u.start - now for u, now in pairs]
        steps_alone, following = self._others
        changes = steps_alone - following @ np.array(steps)
        others = zip(self._free.items(), changes, strict=True)
        return {name: x + float(change) for (name, x), change in others} | values

    def ranked(self) -> list[tuple[frozenset[str], float]]:
        """The sets of one and of two numbers with their sums of squares, the best first."""
        determined = [k for k in range(len(self._more)) if self._form[k, k] > ROUNDING * self._alone[k]]
        sets = [(k,) for k in determined] + list(itertools.combinations(determined, 2))
        costs = [(frozenset(self._names[k] for k in places), self._solution(places)[1]) for places in sets]
        return sorted(costs, key=lambda item: item[1])

    def _solution(self, places: Sequence[int]) -> tuple[Any, float]:
        """The changes of some numbers from their known values with the least sum of squares, within their bounds, and
        that sum, in parts of that at the fit."""
        chosen, form = list(places), self._form
        # from the fit all others step back to their known values
        step = -self._now
        step[chosen] = 0.0
        pull = self._pull[chosen] - form[chosen] @ step - self._prior[chosen] * self._now[chosen]
        matrix = form[np.ix_(chosen, chosen)] + np.diag(self._prior[chosen])
        changes = self._now[chosen] + np.linalg.solve(matrix, pull)
        lowest = np.array([self._more[k].low - self._more[k].start for k in chosen])
        highest = np.array([self._more[k].high - self._more[k].start for k in chosen])
        changes = np.clip(changes, lowest, highest)
        step[chosen] = changes - self._now[chosen]
        cost = step @ form @ step - 2.0 * self._pull @ step
        return changes, float(cost + np.sum(self._prior[chosen] * changes**2))


def _law_test(problem: Problem, best: NormalEquations, workers: int) -> ScoreTest | None:
    """The score test of the law of friction, with its slopes by secants to another law, and the sought numbers free.
    None for a machine without the law, where it is sought, and where no other law runs and keeps its phase."""
    by_name = {v.name: (v, x) for v, x in problem.plant.parameters()}
    if LAW in problem.place or LAW not in by_name or not by_name[LAW][1]:
        return None
    v, x = by_name[LAW]
    secants = next(filter(None, (_secants(problem, best, f * x, workers) for f in OTHER_LAWS)), None)
    if secants is None:
        return None
    other_x, other_comparisons = secants
    # the row of the law in the normal equations: with the sought numbers, with itself, and its gradient
    cross, alone, pull = np.zeros(len(best.z)), 0.0, 0.0
    for best_fit, other_law in zip(best.comparisons, other_comparisons, strict=True):
        weight = best.weights[best_fit.run, best_fit.column] ** 2
        # outliers count less, as in the fit
        deviations = np.abs(best_fit.residuals) * math.sqrt(weight)
        root = np.sqrt(OUTLIER / np.maximum(deviations, OUTLIER))
        slope = (best_fit.residuals - other_law.residuals) / (other_x - x) * root
        cross[list(best_fit.places)] += weight * ((best_fit.slopes * root[:, None]).T @ slope)
        alone += weight * float(slope @ slope)
        pull += weight * float(slope @ (root * best_fit.residuals))
    # information on the law that the free sought numbers leave
    scale = 1.0 / np.sqrt(np.diag(best.matrix))
    solution: Any = np.linalg.solve(best.matrix * np.outer(scale, scale), scale * cross)
    information = alone - float(scale * cross @ solution)
    if information <= ROUNDING * alone:
        # the sought numbers can do all that the law does: its deviation has no limit
        return ScoreTest(LAW, v.unit, x, 0.0, math.inf)
    change = (pull - float(solution @ (scale * best.gradient))) / information
    return ScoreTest(LAW, v.unit, x, change, 1.0 / math.sqrt(information))


def _secants(
    problem: Problem, best: NormalEquations, x: float, workers: int
) -> tuple[float, tuple[Comparison, ...]] | None:
    """The value `x` of another law of friction, and the comparisons with it at the values of the best fit; None where
    the machine does not run with it, or its angle departs by more than `NEAR` [rad]."""
    runs = [replace(run, values={**run.values, LAW: x}) for run in problem.runs]
    other = Problem(problem.plant, runs, problem.sought, problem.sensors)
    try:
        comparisons = tuple(other.comparisons(best.z, workers))
    except RunError:
        return None
    pairs = zip(best.comparisons, comparisons, strict=True)
    change = max(float(np.max(np.abs(other_law.angle - fitted.angle))) for fitted, other_law in pairs)
    return (x, comparisons) if change <= NEAR else None
