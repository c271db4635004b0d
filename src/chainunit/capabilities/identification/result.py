"""The result of an identification as data: the content of result.json, and of the study file with its values."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ...core.messages import unit_behind
from ...reading.results import as_data
from ...reading.text import array_entry, difference_entry, entry, shown_in
from ...recordings.fit import fitted_entries
from ...recordings.measurands import MEASURANDS
from ...recordings.residuals import EXCESS_NOISE, ResidualTest
from ...study.capability import Estimates
from ...study.heading import Heading
from ...study.registry import registered
from ...study.study_file import changed_tables
from .identification import FittedNumber, IdentifiedMachine, remarks, system_name
from .information import Combination, Information, short_name
from .reading import IdentificationPlan

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


def as_dict(machine: IdentifiedMachine) -> dict[str, Any]:
    """All results, ready for JSON, each number with its unit."""
    with shown_in(machine.config.units):
        return _as_dict(machine)


def _as_dict(machine: IdentifiedMachine) -> dict[str, Any]:
    config, best = machine.config, machine.best
    estimates, start = machine.estimates, machine.information_at_start
    determined = sum(each.is_determined for each in estimates.values())
    return {
        **as_data(Heading.of(config.title, config.file)),
        "is_described": machine.is_described,
        "status": "complete" if machine.is_described else "the model does not describe the recordings",
        "sought": entry(float(len(estimates)), "1"),
        "told": entry(float(determined), "1"),
        "runs": {run.name: _run(machine, k) for k, run in enumerate(machine.plan.runs)},
        "numbers": {name: _number(machine, each) for name, each in estimates.items()},
        "covariance": {
            "names": list(estimates),
            "units": [each.unknown.unit for each in estimates.values()],
            "matrix": machine.covariance.tolist(),
        },
        "correlations": list(_correlations(machine)),
        "combinations": [_combination(machine, each) for each in machine.information_at_fit.combinations],
        "blind": [_unseen_change(machine, each) for each in machine.information_at_fit.null_space],
        "told_at_start": entry(float(sum(each.is_determined for each in start.determinations)), "1"),
        "proposals": [
            {
                "text": each.words,
                "factor": entry(each.factor, "1"),
                "told": entry(float(each.determined), "1"),
            }
            for each in start.proposals
        ],
        "residuals": [_check(each) for each in machine.residual_tests],
        "sensors": {
            unknown.name: each
            for unknown, each in fitted_entries(machine.problem, best)
            if unknown.is_nuisance
        },
        "fit": {
            "rounds": entry(float(best.rounds), "1"),
            "starts": entry(float(best.starts), "1"),
            "agreeing": entry(float(best.agreeing), "1"),
        },
        "remarks": list(remarks(machine)),
        "courses": {run.name: _courses(machine, run.name) for run in machine.plan.runs},
    }


def _run(machine: IdentifiedMachine, k: int) -> dict[str, Any]:
    run, recording = machine.plan.runs[k], machine.problem.runs[k].recording
    return {
        "file": str(run.file),
        "columns": list(recording.columns),
        "rows": entry(float(len(recording.time)), "1"),
        "duration": entry(float(recording.time[-1] - recording.time[0]), "s"),
        "rate": entry(1.0 / recording.step, "1"),
        "crank_speed": entry(run.crank_speed, "rad/s", "speed"),
        "ambient": entry(run.ambient, "K", "temperature"),
        "feed": "that of all loaded runs" if run.has_feed else "none",
        "added": {name: entry(x, machine.plan.variables[name].unit) for name, x in run.added.items()},
    }


def _number(machine: IdentifiedMachine, each: FittedNumber) -> dict[str, Any]:
    """A sought number: with its value only where the recordings determine it."""
    variable = machine.plan.variables[each.unknown.name]
    name, start = system_name(each.unknown.name), machine.information_at_start
    before = next(one for one in start.determinations if one.name == name)
    own, unit, kind = each.unknown, variable.unit, variable.kind
    return {
        "title": variable.description,
        "told": each.is_determined,
        "value": entry(each.value if each.is_determined else None, unit, kind),
        "fitted": entry(each.fitted if each.is_determined else None, unit, kind),
        "deviation": difference_entry(each.deviation, unit),
        "from": entry(each.low, unit, kind),
        "to": entry(each.high, unit, kind),
        "given": entry(own.start, unit, kind),
        "given_deviation": difference_entry(own.prior_deviation, unit),
        "least": entry(own.low, unit, kind),
        "most": entry(own.high, unit, kind),
        "expected": difference_entry(before.by_both, unit),
        "by_runs": difference_entry(before.by_runs, unit),
    }


def _correlations(machine: IdentifiedMachine) -> Iterator[dict[str, Any]]:
    """The pairs of numbers with the largest correlations."""
    names = [each.name for each in machine.plan.sought]
    scale = 1.0 / np.sqrt(np.diag(machine.covariance))
    matrix = machine.covariance * np.outer(scale, scale)
    pairs = sorted(((i, k) for i in range(len(names)) for k in range(i)), key=lambda pair: -abs(matrix[pair]))
    for i, k in pairs[:MOST_PAIRS]:
        if abs(matrix[i, k]) >= CORRELATED:
            yield {"first": names[k], "second": names[i], "correlation": entry(float(matrix[i, k]), "1")}


def _combination(machine: IdentifiedMachine, each: Combination) -> dict[str, Any]:
    value, deviation = machine.value_of_sum(each)
    return {
        "text": str(each),
        "terms": dict(each.terms),
        # of temperatures, a sum is no temperature
        "value": difference_entry(value, each.unit),
        "deviation": difference_entry(deviation, each.unit),
    }


def _unseen_change(machine: IdentifiedMachine, each: Combination) -> dict[str, Any]:
    """A change of numbers together that leaves no trace."""
    units = {system_name(u.name): u.unit for u in machine.plan.sought}
    changes = [
        f"{short_name(name)} {'up' if factor > 0.0 else 'down'} by {abs(factor):.3g}{unit_behind(units[name])}"
        for name, factor in each.terms
    ]
    words = " with ".join(changes)
    if len(changes) > MOST_CHANGES:
        names = ", ".join(short_name(name) for name, _ in each.terms)
        words = f"a change of {len(changes)} numbers together ({names})"
    return {"text": words, "terms": dict(each.terms)}


def _check(each: ResidualTest) -> dict[str, Any]:
    unit = MEASURANDS[each.column].unit
    return {
        "run": each.run,
        "column": each.column,
        "is_noise": each.is_noise,
        "reason": each.reason,
        "statistic": entry(each.statistic, "1"),
        "limit": entry(each.limit, "1"),
        "noise": entry(each.noise, "1"),
        "slow": entry(each.slow, "1"),
        "slow_limit": entry(each.slow_limit if math.isfinite(each.slow_limit) else None, "1"),
        "changes": entry(each.changes, unit),
        "orders": [
            {"order": entry(float(order), "1"), "amplitude": entry(size, unit)} for order, size in each.orders
        ],
    }


def _courses(machine: IdentifiedMachine, run: str) -> dict[str, Any]:
    """By analog column, the mean measured and simulated values in classes: of the crank angle over all turns of a
    steady run, of the time of another one."""
    courses: dict[str, Any] = {}
    steady = machine.is_steady(run)
    for each in machine.best.comparisons:
        if each.run != run or not MEASURANDS[each.column].analog:
            continue
        time, measured, simulated = machine.columns_over_time(each)
        x = np.mod(each.angle, 2.0 * math.pi) if steady else time
        ends = (0.0, 2.0 * math.pi) if steady else (time[0], time[-1])
        edges = np.linspace(ends[0], ends[1], (CLASSES if steady else CLASSES_OF_TIME) + 1)
        place, size = np.digitize(x, edges[1:-1]), len(edges) - 1
        count = np.bincount(place, minlength=size)
        some = count > 0
        means = [np.bincount(place, y, size)[some] / count[some] for y in (measured, simulated)]
        unit = MEASURANDS[each.column].unit
        middle = 0.5 * (edges[1:] + edges[:-1])[some]
        courses[each.column] = {
            "angle" if steady else "time": array_entry(middle, "rad" if steady else "s"),
            "measured": array_entry(means[0], unit),
            "simulated": array_entry(means[1], unit),
        }
    return courses


def sentence_before_fit(plan: IdentificationPlan, before: Information) -> str:
    """The numbers that the recordings can determine, in words: with the standard deviations to expect."""
    names = {system_name(u.name): u.name for u in plan.sought}
    determined = [each for each in before.determinations if each.is_determined]
    total = len(before.determinations)
    words = f"Before the fit: these recordings can determine {len(determined)} of {total} numbers"
    if determined:
        listed = (f"{names[each.name]} to {each.by_both:.2g}{unit_behind(each.unit)}" for each in determined)
        words += f" ({', '.join(listed)})"
    if before.proposals and len(determined) < total:
        best = before.proposals[0]
        words += f". Of further runs, this one would tell most: {best.words} (then {best.determined} numbers)"
    return f"{words}."


def sentences(machine: IdentifiedMachine) -> list[str]:
    """Sentences that judge an identification."""
    active_bounds = machine.posterior.active_bounds
    words = [
        f"{each}: the model does not describe the recordings; check the gear ratio, the units of the columns and the "
        "data of the sensors"
        for each in machine.prior_conflicts
    ]
    words += [
        f"{name} = {each.fitted:.4g}{unit_behind(each.unknown.unit)} lies at its {each.at_bound} bound"
        + (", and the recordings contradict this bound" if system_name(name) in active_bounds else "")
        + ": widen it, or check what else is held for known"
        for name, each in machine.estimates.items()
        if each.at_bound
    ]
    words += [str(each) for each in machine.score_tests if each.is_rejected]
    for check in machine.residual_tests:
        unit = MEASURANDS[check.column].unit
        place = f"{check.column} of the run {check.run}"
        if check.reason == "orders":
            order, size = check.orders[0]
            words.append(
                f"{place}: the model does not describe it. Order {order} of the crank remains, with {size:.2g} "
                f"{unit}; check the dimensions, the gear ratio, and the control"
            )
        elif check.reason == "slow":
            words.append(
                f"{place}: the model does not describe it. Slow changes remain, with a standard deviation of "
                f"{check.changes:.2g} {unit}: the speed, the feed or the supply was not steady; state the changes of "
                "the speed (speeds), or name a steady part (begin, end)"
            )
        elif check.noise > EXCESS_NOISE:
            words.append(
                f"{place}: its noise is {check.noise:.2g} times the stated one; state "
                "its own (identify.sensor.noise), as all deviations grow with it"
            )
    return words


def identified_tables(machine: IdentifiedMachine, folder: Path) -> dict[str, Any]:
    """The tables of the study with the fitted values, as a file in `folder` has them, beside the result of the
    identification. A number that the recordings do not determine has its fitted value, too: only all of them together
    give the measured courses. Other capabilities take the errors of the values into their tables."""
    values = {name: float(f"{each.fitted:.6g}") for name, each in machine.estimates.items()}
    tables = changed_tables(machine.config, values, "identified", folder)
    tables.pop("identify", None)
    estimates = Estimates(values, machine.covariance, RESULT)
    for part in registered():
        part.take_estimates(machine.config, estimates, tables)
    return tables


def identified_notes(machine: IdentifiedMachine) -> dict[str, str]:
    """By full name, a sentence on each number of the study file that the recordings do not determine."""
    notes = {}
    for name, each in machine.estimates.items():
        if not each.is_determined:
            unit = unit_behind(each.unknown.unit)
            ends = f"95 % from {each.low:.4g} to {each.high:.4g}{unit}"
            notes[name] = f"not determined, {ends}; it holds only together with the other fitted values"
    return notes
