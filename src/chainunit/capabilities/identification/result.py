"""The result of an identification as data: the content of result.json, and of the study file with its values."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...core.messages import unit_behind
from ...core.quantities import quantity
from ...reading.results import GIVEN, OWN, InUnit, difference, part, result
from ...recordings.fit import FittedValue, fitted_values
from ...recordings.measurands import MEASURANDS
from ...recordings.residuals import EXCESS_NOISE, ResidualTest
from ...study.capability import Estimates, EstimateUser
from ...study.provenance import Heading
from ...study.study_file import changed_tables
from .identification import FittedNumber, IdentifiedMachine, remarks, system_name
from .information import Combination, Information, Proposal, short_name
from .reading import IdentificationPlan
from .suspects import KnownNumbers, SuspectSet

RESULT = "result.json"
"""Name of the file with the result."""
CORRELATED = 0.8
"""Correlation from which a pair of numbers is named."""
MOST_PAIRS = 12
MOST_CHANGES = 4
"""Most numbers whose changes without a trace are named one by one."""
CLASSES = 90
"""Number of crank angles at which measured and simulated courses are shown."""
CLASSES_OF_TIME = 600
"""Number of times at which those of a run that is not steady are shown."""


@result
class IdentifiedRun:
    """A run, and its recording."""

    file: str = part("the recording")
    understood: str = part("how the file of the recording was read")
    columns: list[str] = part("columns of the recording")
    rows: int = quantity("1", "number of rows")
    duration: float = quantity("s", "time from the first to the last row")
    rate: float = quantity("1", "rows in a second")
    crank_speed: float = quantity("rad/s", "speed of the crank", kind="speed")
    ambient: float = quantity("K", "temperature of the surroundings", kind="temperature")
    feed: str = part("the feed of the run")
    added: Mapping[str, InUnit] = part("amounts that were added to sought numbers")


@result
class IdentifiedNumber:
    """A sought number: with its value only where the recordings determine it."""

    unit: str
    kind: str
    title: str = part("description")
    told: bool = part("whether the recordings determine the number")
    value: float | None = part("mean in the distribution that the recordings leave", unit=OWN)
    fitted: float | None = part("value in the best fit, together with all others", unit=OWN)
    deviation: InUnit = part("standard deviation")
    low: float = part("lower end of the interval of 95 %", unit=OWN, name="from")
    high: float = part("upper end of the interval of 95 %", unit=OWN, name="to")
    given: float = part("value before the fit", unit=OWN)
    given_deviation: InUnit = part("standard deviation before the fit")
    least: float = part("lower bound", unit=OWN)
    most: float = part("upper bound", unit=OWN)
    expected: InUnit = part(
        "standard deviation that the recordings and the knowledge before the fit let expect"
    )
    by_runs: InUnit = part("standard deviation that the recordings alone let expect")


@result
class Covariance:
    """The covariance of the sought numbers."""

    names: list[str] = part("the numbers")
    units: list[str] = part("their units")
    matrix: list[list[float]] = part("covariance of each pair", unit=GIVEN)


@result
class Correlation:
    """A pair of numbers with a large correlation."""

    first: str = part("first number")
    second: str = part("second number")
    correlation: float = quantity("1", "their correlation")


@result
class UnseenChange:
    """A change of numbers together that leaves no trace in the recordings."""

    text: str = part("the change in words")
    terms: Mapping[str, float] = part("factor of each number", unit=GIVEN)


@result
class DeterminedSum:
    """A sum of numbers that the recordings determine, whose first number they do not determine."""

    text: str = part("the sum in words")
    terms: Mapping[str, float] = part("factor of each number", unit=GIVEN)
    value: InUnit = part("value")
    deviation: InUnit = part("standard deviation")


@result
class FitCounts:
    """Counts of the fit."""

    rounds: int = quantity("1", "rounds of the best start")
    is_ended: bool = part("whether a further round would not improve the fit")
    starts: int = quantity("1", "number of starts")
    agreeing: int = quantity("1", "number of starts that ended at the best fit")


@result
class IdentificationSummary:
    """All results of an identification: the content of its result.json."""

    heading: Heading = part(inline=True)
    is_described: bool = part("whether the model describes the recordings")
    status: str = part("whether the identification is complete")
    sought: int = quantity("1", "number of sought numbers")
    told: int = quantity("1", "number of numbers that the recordings determine")
    runs: Mapping[str, IdentifiedRun] = part("the runs")
    numbers: Mapping[str, IdentifiedNumber] = part("the sought numbers")
    covariance: Covariance = part("covariance of the sought numbers")
    correlations: list[Correlation] = part("pairs with the largest correlations")
    combinations: list[DeterminedSum] = part("sums that the recordings determine")
    blind: list[UnseenChange] = part("changes of numbers together that leave no trace in the recordings")
    told_at_start: int = quantity("1", "number of numbers that the recordings could determine before the fit")
    proposals: tuple[Proposal, ...] = part("further runs, the best first")
    residuals: tuple[ResidualTest, ...] = part("tests of the residuals")
    suspects: tuple[SuspectSet, ...] = part(
        "sets of known numbers that would explain the recordings if they were wrong, the best first; none if the "
        "model describes the recordings"
    )
    sensors: Mapping[str, FittedValue] = part("numbers of clocks and sensors")
    fit: FitCounts = part("counts of the fit")
    remarks: list[str] = part("sentences on data that are missing or assumed")
    courses: Mapping[str, Mapping[str, Mapping[str, InUnit]]] = part(
        "by run and column, the mean measured and simulated values in classes of the crank angle, or of the time"
    )


def summary_of(machine: IdentifiedMachine) -> IdentificationSummary:
    """All that the report and result.json say of an identification; its texts have the units of `shown_in`."""
    best, estimates, start = machine.best, machine.estimates, machine.information_at_start
    return IdentificationSummary(
        heading=Heading.of(machine.config.title, machine.config.file),
        is_described=machine.is_described,
        status=("complete" if machine.is_described else "the model does not describe the recordings")
        + (f"; {machine.failure}" if machine.failure else ""),
        sought=len(estimates),
        told=sum(estimate.is_determined for estimate in estimates.values()),
        runs={run.name: _run(machine, k) for k, run in enumerate(machine.plan.runs)},
        numbers={name: _number(machine, estimate) for name, estimate in estimates.items()},
        covariance=Covariance(
            list(estimates),
            [estimate.unknown.unit for estimate in estimates.values()],
            machine.covariance.tolist(),
        ),
        correlations=list(_correlations(machine)),
        combinations=[
            _sum(machine, combination)
            for combination in machine.information_at_fit.combinations
            if machine.is_described
        ],
        blind=[_unseen_change(machine, direction) for direction in machine.information_at_fit.null_space],
        told_at_start=sum(determination.is_determined for determination in start.determinations),
        proposals=start.proposals if machine.is_described else (),
        residuals=machine.residual_tests,
        suspects=machine.known.sets,
        sensors={
            unknown.name: fitted
            for unknown, fitted in fitted_values(machine.problem, best)
            if unknown.is_nuisance
        },
        fit=FitCounts(best.rounds, best.is_ended, best.starts, best.agreeing),
        remarks=list(remarks(machine)),
        courses={run.name: _courses(machine, run.name) for run in machine.plan.runs},
    )


def _run(machine: IdentifiedMachine, k: int) -> IdentifiedRun:
    """A run as it was identified: its recording and its conditions."""
    run, recording = machine.plan.runs[k], machine.problem.runs[k].recording
    return IdentifiedRun(
        file=str(run.file),
        understood=recording.understood,
        columns=list(recording.columns),
        rows=len(recording.time),
        duration=float(recording.time[-1] - recording.time[0]),
        rate=1.0 / recording.step,
        crank_speed=run.crank_speed,
        ambient=run.ambient,
        feed="that of all loaded runs" if run.has_feed else "none",
        added={name: InUnit(x, machine.plan.variables[name].unit) for name, x in run.added.items()},
    )


def _number(machine: IdentifiedMachine, estimate: FittedNumber) -> IdentifiedNumber:
    """A sought number: as fitted, as known before, and as sharp as was expected at the start values."""
    unknown, variable = estimate.unknown, machine.plan.variables[estimate.unknown.name]
    name, unit = system_name(unknown.name), variable.unit
    at_start = next(entry for entry in machine.information_at_start.determinations if entry.name == name)
    return IdentifiedNumber(
        unit,
        variable.kind,
        title=variable.description,
        told=estimate.is_determined,
        value=estimate.value if estimate.is_determined else None,
        fitted=estimate.fitted if estimate.is_determined else None,
        deviation=difference(estimate.deviation, unit),
        low=estimate.low,
        high=estimate.high,
        given=unknown.start,
        given_deviation=difference(unknown.prior_deviation, unit),
        least=unknown.low,
        most=unknown.high,
        expected=difference(at_start.by_both, unit),
        by_runs=difference(at_start.by_runs, unit),
    )


def _correlations(machine: IdentifiedMachine) -> Iterator[Correlation]:
    """The pairs of numbers with the largest correlations."""
    names = [unknown.name for unknown in machine.plan.sought]
    scale = 1.0 / np.sqrt(np.diag(machine.covariance))
    matrix = machine.covariance * np.outer(scale, scale)
    pairs = sorted(((i, k) for i in range(len(names)) for k in range(i)), key=lambda pair: -abs(matrix[pair]))
    for i, k in pairs[:MOST_PAIRS]:
        if abs(matrix[i, k]) >= CORRELATED:
            yield Correlation(names[k], names[i], float(matrix[i, k]))


def _sum(machine: IdentifiedMachine, combination: Combination) -> DeterminedSum:
    """A sum of sought numbers with its value."""
    # of temperatures, a sum is no temperature
    value, deviation = (difference(x, combination.unit) for x in machine.value_of_sum(combination))
    return DeterminedSum(str(combination), dict(combination.terms), value, deviation)


def _unseen_change(machine: IdentifiedMachine, direction: Combination) -> UnseenChange:
    """A change of numbers that leaves no trace in any column, in words and by its terms."""
    units = {system_name(u.name): u.unit for u in machine.plan.sought}
    changes = [
        f"{short_name(name)} {'up' if factor > 0.0 else 'down'} by {abs(factor):.3g}{unit_behind(units[name])}"
        for name, factor in direction.terms
    ]
    text = " with ".join(changes)
    if len(changes) > MOST_CHANGES:
        names = ", ".join(short_name(name) for name, _ in direction.terms)
        text = f"a change of {len(changes)} numbers together ({names})"
    return UnseenChange(text, dict(direction.terms))


def _courses(machine: IdentifiedMachine, run: str) -> dict[str, dict[str, InUnit]]:
    """By analog column, the mean measured and simulated values in classes: of the crank angle over all turns of a
    steady run, of the time of another one."""
    courses = dict[str, dict[str, InUnit]]()
    steady = machine.is_steady(run)
    for comparison in machine.best.comparisons:
        if comparison.run != run or not MEASURANDS[comparison.column].analog:
            continue
        time, measured, simulated = machine.columns_over_time(comparison)
        x = np.mod(comparison.angle, 2.0 * math.pi) if steady else time
        ends = (0.0, 2.0 * math.pi) if steady else (time[0], time[-1])
        edges = np.linspace(ends[0], ends[1], (CLASSES if steady else CLASSES_OF_TIME) + 1)
        place, size = np.digitize(x, edges[1:-1]), len(edges) - 1
        count = np.bincount(place, minlength=size)
        filled = count > 0
        means = [np.bincount(place, y, size)[filled] / count[filled] for y in (measured, simulated)]
        unit = MEASURANDS[comparison.column].unit
        middle = 0.5 * (edges[1:] + edges[:-1])[filled]
        courses[comparison.column] = {
            "angle" if steady else "time": InUnit(middle, "rad" if steady else "s"),
            "measured": InUnit(means[0], unit),
            "simulated": InUnit(means[1], unit),
        }
    return courses


def sentence_before_fit(plan: IdentificationPlan, before: Information) -> str:
    """The numbers that the recordings can determine, in words: with the standard deviations to expect."""
    names = {system_name(u.name): u.name for u in plan.sought}
    determined = [determination for determination in before.determinations if determination.is_determined]
    total = len(before.determinations)
    sentence = f"Before the fit: these recordings can determine {len(determined)} of {total} numbers"
    if determined:
        listed = (
            f"{names[determination.name]} to {determination.by_both:.2g}{unit_behind(determination.unit)}"
            for determination in determined
        )
        sentence += f" ({', '.join(listed)})"
    if before.proposals and len(determined) < total:
        best = before.proposals[0]
        sentence += (
            f". Of further runs, this one would tell most: {best.words} (then {best.determined} numbers)"
        )
    return f"{sentence}."


def sentences(machine: IdentifiedMachine) -> list[str]:
    """Sentences that judge an identification."""
    active_bounds = machine.posterior.active_bounds
    lines = list[str]()
    if not machine.best.is_ended:
        worst, size = machine.best.worst
        lines.append(
            f"The fit still improved in its last round, and is farthest from {worst.column} of the run {worst.run}, "
            f"with residuals of {size:.2g} times its noise; check the unit and the sign of this column, crank_speed "
            "and the gear ratio"
        )
    is_explained = any(suspects.describes for suspects in machine.known.sets)
    lines += [
        f"{conflict}: the model does not describe the recordings; check the gear ratio, the units of the columns and "
        "the data of the sensors"
        for conflict in machine.prior_conflicts
        if not is_explained
    ]
    lines += [
        f"{name} = {estimate.fitted:.4g}{unit_behind(estimate.unknown.unit)} lies at its {estimate.at_bound} bound"
        + (", and the recordings contradict this bound" if system_name(name) in active_bounds else "")
        + ": widen it, or check what else is held for known"
        for name, estimate in machine.estimates.items()
        if estimate.at_bound
    ]
    lines += _on_known_numbers(machine.known)
    if machine.failure is not None:
        lines.append(f"{str(machine.failure).capitalize()}, and none are named; identify again to name them")
    for check in machine.residual_tests:
        unit = MEASURANDS[check.column].unit
        place = f"{check.column} of the run {check.run}"
        if is_explained and not check.is_noise:
            continue  # by numbers that are named above
        if check.reason == "orders":
            order, size = check.orders[0]
            lines.append(
                f"{place}: the model does not describe it. Order {order} of the crank remains, with {size:.2g} "
                f"{unit}; check the dimensions, the gear ratio, and the control"
            )
        elif check.reason == "slow":
            lines.append(
                f"{place}: the model does not describe it. Slow changes remain, with a standard deviation of "
                f"{check.changes:.2g} {unit}: the speed, the feed or the supply was not steady; state the changes of "
                "the speed (speeds), or name a steady part (begin, end)"
            )
        elif check.noise > EXCESS_NOISE:
            lines.append(
                f"{place}: its noise is {check.noise:.2g} times the stated one; state "
                "its own (identify.sensor.noise), as all deviations grow with it"
            )
    return lines


def _on_known_numbers(numbers: KnownNumbers) -> Iterator[str]:
    """Sentences on the known numbers and the law of friction that the recordings contradict."""
    explaining = [str(suspects) for suspects in numbers.sets if suspects.describes]
    if explaining:
        yield (
            f"The model describes the recordings with {'; or with '.join(explaining)}: measure these numbers, or "
            "seek them (identify.parameter)"
        )
    if not explaining and numbers.is_law_rejected:
        yield (
            "The recordings contradict the law of friction in the pins: friction that is the same at all speeds does "
            "not describe them"
        )
    if not explaining and numbers.sets:
        yield (
            f"No one or two of the known numbers explain the recordings; nearest comes {numbers.sets[0]}: check "
            "these first"
        )


def identified_tables(machine: IdentifiedMachine, folder: Path) -> dict[str, Any]:
    """The tables of the study with the fitted values, as a file in `folder` has them, beside the result of the
    identification. A number that the recordings do not determine has its fitted value, too: only all of them together
    give the measured courses. Other capabilities take the errors of the values into their tables."""
    values = {name: float(f"{estimate.fitted:.6g}") for name, estimate in machine.estimates.items()}
    tables = changed_tables(machine.config, values, "identified", folder)
    tables.pop("identify", None)
    estimates = Estimates(values, machine.covariance, RESULT)
    for plan in machine.config.plans.values():
        if isinstance(plan, EstimateUser):
            plan.take_estimates(machine.config, estimates, tables)
    return tables


def identified_notes(machine: IdentifiedMachine) -> dict[str, str]:
    """By full name, a sentence on each number of the study file that the recordings do not determine."""
    notes = {}
    for name, estimate in machine.estimates.items():
        if not estimate.is_determined:
            unit = unit_behind(estimate.unknown.unit)
            ends = f"95 % from {estimate.low:.4g} to {estimate.high:.4g}{unit}"
            notes[name] = f"not determined, {ends}; it holds only together with the other fitted values"
    return notes
