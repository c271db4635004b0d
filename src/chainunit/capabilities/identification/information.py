"""The information of runs: standard deviations to expect, sums of numbers that alone are determined, further runs.

The matrix of Fisher's information follows from the exact sensitivities of the simulated runs; of the measured values
only the sizes of the noise enter. Nuisances, such as the angle of the crank, are not known. A number is
*determined* by the runs if their standard deviation of it is less than half of that of its prior.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...core.quantities import quantity
from ...reading.results import part, result
from ...recordings.fit import NormalEquations, inverse, normal_equations
from ...recordings.plant import CRANK
from ...recordings.problem import Problem, RecordedRun
from ...recordings.recording import Recording
from ...system import Profile

DETERMINED = 0.5
"""Standard deviation by the runs alone, in parts of that of the prior, below which they determine a number."""
SHARP = 0.1
"""The same of a combination that is worth naming."""
MOST_TERMS = 4
ROUNDING = 1.05
"""Factor by which the standard deviation of a sum may grow as its factors are rounded."""
WEAK = 1e3
"""Standard deviation that stands for no prior, in parts of that of the prior: it makes a singular matrix regular."""
NO_INFORMATION, LEAST_PART = 1e-4, 0.05
"""Information on a direction, in parts of that of the prior, below which it counts as one of the null space, and
the least part of a number in it that is named."""
FURTHER = "further run"
"""Name of a run that is proposed; no run of a file has a space in its name."""
REFERENCE = "motor.w_ref"
OTHER_SPEEDS, SHAKEN = (0.5, 1.5), (0.7, 1.3)
"""Speeds of runs that are proposed, in parts of that of the first run: steady ones, and those of a shaken run."""
SHAKING, MOST_CHANGES = 4.0, 30
"""Time between the changes of a shaken speed [s], and their largest number."""
SPARSE, SPARSE_ROWS = 5e-3, 200.0
"""Time between the rows of a run that is proposed [s], and their least number in a turn of the crank."""
ADDED = 15.0
"""Mass to add to a part in a run that is proposed [kg]."""


@dataclass(frozen=True)
class Determination:
    """A sought number: its standard deviation by the prior (`prior_deviation`), by the runs alone, and by both."""

    name: str
    unit: str
    prior_deviation: float
    by_runs: float
    by_both: float

    @property
    def is_determined(self) -> bool:
        """Whether the runs determine the number."""
        return self.by_runs < DETERMINED * self.prior_deviation


@dataclass(frozen=True)
class Combination:
    """A sum of sought numbers: `terms` are names with coefficients, the first of which is 1, and `deviation` is its
    standard deviation by runs and priors, in the unit of the first term."""

    terms: tuple[tuple[str, float], ...]
    unit: str
    deviation: float

    def __str__(self) -> str:
        """The sum as a formula: ``pin.friction - 0.5 crank.m``."""
        (first, _), *others = self.terms
        text = short_name(first)
        for name, coefficient in others:
            size = abs(coefficient)
            text += f" {'+' if coefficient > 0.0 else '-'} {f'{size:.7g} ' if size != 1.0 else ''}{short_name(name)}"
        return text


@result
class Proposal:
    """A further run."""

    words: str = part("the run in words", name="text")
    factor: float = quantity(
        "1", "mean factor by which the standard deviations of the sought numbers would fall"
    )
    determined: int = part("count of numbers that would be determined", unit="1", name="told")


@dataclass(frozen=True)
class Information:
    """The information of the runs: on each number, on sums whose first number they do not determine; further runs.

    `null_space` has changes of the sought numbers together, in the proportions of the coefficients, which leave no
    trace in any column.
    """

    determinations: tuple[Determination, ...]
    combinations: tuple[Combination, ...]
    null_space: tuple[Combination, ...]
    proposals: tuple[Proposal, ...]


def information(
    problem: Problem,
    z: Any = None,
    workers: int = 2,
    propose: bool = True,
    equations: NormalEquations | None = None,
) -> Information:
    """The information of the runs of a problem at the values `z` of the unknowns, by default the start values.

    Of the recordings the columns, the times of the rows and the sizes of the noise count. With `propose` further runs
    are ranked, each of which is simulated. `equations` are the normal equations there, where they are known, with the
    measured sizes of the noise.
    """
    z = problem.initial_point(workers) if z is None else z
    fisher = (equations or normal_equations(problem, z, workers)).fisher
    determinations, sums = _determinations(problem, fisher), _combinations(problem, fisher)
    proposals = _proposals(problem, z, fisher, determinations, workers) if propose else ()
    return Information(determinations, sums, _null_space(problem, fisher), tuple(proposals))


def _covariance(problem: Problem, fisher: Any, wider: float) -> Any:
    """The covariance of the sought numbers with priors that are `wider` by this factor."""
    count = len(problem.sought)
    spread = problem.prior_deviations.copy()
    spread[:count] *= wider
    return inverse(fisher + np.diag(1.0 / spread**2))[:count, :count]


def _determinations(problem: Problem, fisher: Any) -> tuple[Determination, ...]:
    """The standard deviations of each sought number: by its prior, by the runs alone, and by both."""
    by_runs, by_both = (np.sqrt(np.diag(_covariance(problem, fisher, wider))) for wider in (WEAK, 1.0))
    return tuple(
        Determination(u.name, u.unit, u.prior_deviation, float(by_runs[k]), float(by_both[k]))
        for k, u in enumerate(problem.sought)
    )


def _combinations(problem: Problem, fisher: Any) -> tuple[Combination, ...]:
    """For each number that the runs alone (priors wider by `WEAK`) do not determine, the sum with the fewest others
    that they do: others are added one at a time, each time the one that leaves the least variance."""
    by_runs, by_both = (_covariance(problem, fisher, wider) for wider in (WEAK, 1.0))
    sought, sums = problem.sought, dict[frozenset[str], Combination]()
    for first, unknown in enumerate(sought):
        if math.sqrt(by_runs[first, first]) < DETERMINED * unknown.prior_deviation:
            continue
        others: list[int] = []
        while len(others) < MOST_TERMS - 1 and (left := set(range(len(sought))) - {first, *others}):
            others.append(min(left, key=lambda k: _rest(by_runs, first, [*others, k])))
            if math.sqrt(_rest(by_runs, first, others)) < SHARP * unknown.prior_deviation:
                factors, deviation = _factors(by_runs, by_both, first, others)
                names = [sought[k].name for k in others]
                terms = ((unknown.name, 1.0), *zip(names, factors, strict=True))
                combination = Combination(terms, unknown.unit, deviation)
                sums.setdefault(frozenset((unknown.name, *names)), combination)
                break
    return tuple(sums.values())


def _factors(alone: Any, both: Any, first: int, others: Sequence[int]) -> tuple[list[float], float]:
    """The factors of the other numbers with which their sum with the first one has the least standard deviation by
    the runs `alone`, and its deviation by `both` runs and priors, each a covariance. They have so few digits that the
    sum as it is written is as good as that with all digits."""
    best = -np.linalg.solve(alone[np.ix_(others, others)], alone[others, first])
    covariance = both[np.ix_([first, *others], [first, *others])]

    def deviation(factors: Sequence[float]) -> float:
        weights = np.array([1.0, *factors])
        return math.sqrt(float(weights @ covariance @ weights))

    for digits in range(2, 8):
        factors = [float(f"{x:.{digits}g}") for x in best]
        if deviation(factors) < ROUNDING * deviation(list(best)):
            break
    return factors, deviation(factors)


def _null_space(problem: Problem, fisher: Any) -> tuple[Combination, ...]:
    """The directions without information, each with as few numbers as possible."""
    count, spread = len(problem.sought), problem.prior_deviations
    matrix = fisher + np.diag(np.where(np.arange(len(spread)) < count, 0.0, 1.0 / spread**2))
    nuisances = matrix[count:, count:]
    reduced = matrix[:count, :count] - matrix[:count, count:] @ np.linalg.solve(
        nuisances, matrix[count:, :count]
    )
    sizes, directions = np.linalg.eigh(reduced * np.outer(spread[:count], spread[:count]))
    basis = directions[:, sizes < NO_INFORMATION].T
    rows = []
    for k in range(len(basis)):
        # the largest entry is eliminated from all others
        place = int(np.argmax(np.max(np.abs(basis[k:]), axis=0)))
        row = k + int(np.argmax(np.abs(basis[k:, place])))
        basis[[k, row]] = basis[[row, k]]
        basis[k] /= basis[k, place]
        for other in range(len(basis)):
            if other != k:
                basis[other] -= basis[other, place] * basis[k]
        rows.append(place)
    directions_named = []
    for place, row in zip(rows, basis, strict=True):
        first = problem.sought[place]
        others = [k for k in np.argsort(-np.abs(row)) if k != place and abs(row[k]) > LEAST_PART]
        terms = [(problem.sought[k].name, float(row[k] * spread[k] / spread[place])) for k in others]
        directions_named.append(Combination(((first.name, 1.0), *terms), first.unit, math.inf))
    return tuple(directions_named)


def _rest(covariance: Any, first: int, others: Sequence[int]) -> float:
    """The variance of a number that remains if the others were known."""
    cross = covariance[np.ix_(others, [first])][:, 0]
    variance = covariance[first, first] - cross @ np.linalg.solve(covariance[np.ix_(others, others)], cross)
    return max(float(variance), 0.0)


def _proposals(
    problem: Problem, z: Any, fisher: Any, now: Sequence[Determination], workers: int
) -> Iterator[Proposal]:
    """Further runs, the best first: for each the information of all runs with it (`then`), beside the present one
    (`now`). A run is simulated with thinned rows."""
    ranked = []
    for title, run in _candidates(problem):
        more = Problem(problem.plant, (*problem.runs, run), problem.sought, problem.sensors)
        point = more.start_values
        for name, place in problem.place.items():
            point[more.place[name]] = z[place]
        sparse, scales = _sparse(problem, run)
        simulated = _simulated(more, sparse, point, workers)
        single = Problem(problem.plant, (simulated,), problem.sought, problem.sensors)
        single_point = np.array([point[more.place[name]] for name in single.place])
        single_fisher = normal_equations(single, single_point, workers, scales).fisher
        total = np.zeros((len(point), len(point)))
        for of_runs, matrix in ((problem, fisher), (single, single_fisher)):
            places = [more.place[name] for name in of_runs.place]
            total[np.ix_(places, places)] += matrix
        then = _determinations(more, total)
        factor = np.exp(np.mean([math.log(a.by_both / b.by_both) for a, b in zip(now, then, strict=True)]))
        ranked.append(Proposal(title, float(factor), sum(x.is_determined for x in then)))
    yield from sorted(ranked, key=lambda proposal: -proposal.factor)


def _sparse(problem: Problem, run: RecordedRun) -> tuple[RecordedRun, dict[tuple[str, str], float]]:
    """The run with fewer rows, and the factors on the standard deviations by which each of them counts for
    several."""
    step = min(SPARSE, 2.0 * math.pi / (SPARSE_ROWS * run.crank_speed))
    (sparse,) = Problem(problem.plant, (run,), problem.sought, problem.sensors).thinned(step).runs
    thinning = sparse.recording.step / run.recording.step
    # the instant of a mark is known up to the time between two rows
    return sparse, {
        (run.name, name): 1.0 / thinning if name == "mark" else 1.0 / math.sqrt(thinning)
        for name in run.recording.columns
    }


def _candidates(problem: Problem) -> Iterator[tuple[str, RecordedRun]]:
    """Runs that an engineer can make, in words: like the first one with feed."""
    feed = [u.name for u in problem.sought if u.name.endswith(("material_mass", "processing_force"))]
    first = next((run for run in problem.runs if not set(feed) & set(run.values)), problem.runs[0])
    steady = {name: getattr(x, "start", x) for name, x in first.values.items()}
    further = replace(first, name=FURTHER, added={}, values=steady, off=None)
    if feed and not any(set(feed) <= set(run.values) for run in problem.runs):
        yield "empty", replace(further, values={**steady, **dict.fromkeys(feed, 0.0)})
    if REFERENCE in steady:
        yield from _other_speeds(problem, further)
    begin, end = float(first.recording.time[0]), float(first.recording.time[-1])
    if not any(run.off is not None for run in problem.runs):
        yield (
            "with the motor switched off after a quarter",
            replace(further, off=begin + 0.25 * (end - begin)),
        )
    for u in problem.sought:
        if u.name.endswith(("web_mass", "wall_mass")) and not any(
            u.name in run.added for run in problem.runs
        ):
            yield f"with {ADDED:g} kg added to {short_name(u.name)}", replace(further, added={u.name: ADDED})


def _other_speeds(problem: Problem, further: RecordedRun) -> Iterator[tuple[str, RecordedRun]]:
    """The run at other speeds, and at a speed that changes; without speeds, to 5 %, and changes that the runs
    have."""
    w, references = float(further.values[REFERENCE]), [run.values.get(REFERENCE, 0.0) for run in problem.runs]
    first_speeds = [x.start if isinstance(x, Profile) else x for x in references]
    for share in OTHER_SPEEDS:
        if not any(abs(speed - share * w) < 0.05 * w for speed in first_speeds):
            values = {**further.values, REFERENCE: share * w}
            run = replace(further, values=values, crank_speed=share * further.crank_speed)
            yield f"at {share:g} times the speed", run
    if not any(isinstance(x, Profile) for x in references):
        time = further.recording.time
        begins = np.arange(float(time[0]), float(time[-1]), SHAKING)[:MOST_CHANGES]
        changes = tuple((float(t), 0.5 * SHAKING, w * SHAKEN[k % 2]) for k, t in enumerate(begins))
        title = (
            f"at a speed that changes every {SHAKING:g} s between {SHAKEN[0]:g} and {SHAKEN[1]:g} times it"
        )
        yield title, replace(further, values={**further.values, REFERENCE: Profile(w, changes)})


def _simulated(problem: Problem, run: RecordedRun, z: Any, workers: int) -> RecordedRun:
    """The run with a recording as the plant would give it, without noise."""
    response = problem.simulate(run, z, workers)
    time = run.recording.time
    columns = {}
    for name in run.recording.columns:
        if name == "mark":
            crank = np.interp(time, response.time, response.values[CRANK])
            columns[name] = np.append(0.0, np.diff(np.floor(crank / (2.0 * math.pi))))
        else:
            columns[name] = np.interp(time, response.time, response.values[name])
    return replace(run, recording=Recording("simulated", time, columns, run.recording.heads))


def short_name(name: str) -> str:
    """A name of the system without that of the machine."""
    return name.removeprefix("machine.")
