"""The identification of a machine: its recordings, the numbers that they can determine, the fit, and its tests."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from ...core.brief import briefly_shown
from ...core.errors import Faults, InputError, InterruptedRunError
from ...drives.induction_motor import InductionMotor
from ...drives.motor import Motor
from ...recordings.fit import MOST_ROUNDS, Fit, fit
from ...recordings.inspection import inspect_runs
from ...recordings.measurands import MEASURANDS, OF_TERMINALS, SIGNALS, usual_offset
from ...recordings.problem import Comparison, Problem, RecordedRun, Sensor
from ...recordings.recorded_drive import check_motor_is_known, is_of_shaft, plant_for
from ...recordings.recording import Recording
from ...recordings.residuals import (
    PriorConflict,
    ResidualTest,
    prior_conflicts,
    residual_tests,
    sensor_conflicts,
)
from ...recordings.unknown import Unknown
from ...study.arrays import rms
from ...study.choice import drive_of
from ...study.config import Config
from ...study.drive import Drive
from ...study.motor_sources import OwnMotor
from ...system import Profile
from ...work.progress import TaskProgress, quiet
from .information import Combination, Information, information
from .posterior import Posterior, posterior
from .reading import IdentificationPlan, PlannedRun
from .suspects import KnownNumbers, is_described, known_number_tests, suspect_sets

CONTROL = ("speed_control.kp", "speed_control.ki", "current_control.kp", "current_control.ki")
"""Gains of the control of a motor, of which the course of its current depends."""
AT_BOUND = 0.02
"""Distance from a bound, in parts of the standard deviation of an even distribution, within which a value lies at
it."""


@dataclass(frozen=True)
class FittedNumber:
    """A sought number: its value in the best fit, `fitted`, which has a meaning together with those of all others;
    its mean `value` in the distribution that the recordings leave, its standard deviation, the ends of its interval
    of 95 %, and whether the recordings determine it. If the model does not describe the recordings, they tell nothing
    about the number: deviation and interval are the ones before the recordings."""

    unknown: Unknown
    fitted: float
    value: float
    deviation: float
    low: float
    high: float
    is_determined: bool

    @property
    def at_bound(self) -> str:
        """The bound at which the fit ended, "lower" or "upper"; such a number is not determined."""
        return _bound_of(self.unknown, self.fitted)


class ComparedColumn(NamedTuple):
    """The times of the rows that are compared [s], the measured column, and the simulated one as its sensor would
    show it, each of shape (n,)."""

    time: Any
    measured: Any
    simulated: Any


@briefly_shown
@dataclass(frozen=True)
class IdentifiedMachine:
    """An identified machine.

    `information_at_start` is the information of the runs at the start values, with further runs in order;
    `information_at_fit` the same at the fitted values. `best` are the normal equations there, `posterior` is the
    distribution of the sought numbers around them, and `known` has the tests of known numbers with the suspects.
    There is a `failure` if the search for suspects was interrupted.
    """

    config: Config
    plan: IdentificationPlan
    problem: Problem
    information_at_start: Information
    best: Fit
    posterior: Posterior
    information_at_fit: Information
    residual_tests: tuple[ResidualTest, ...]
    known: KnownNumbers
    failure: InterruptedRunError | None = None

    @property
    def estimates(self) -> dict[str, FittedNumber]:
        """The sought numbers by the full names of the study file."""
        marginals = zip(self.plan.sought, self.best.z, self.posterior.marginals, strict=False)
        if not self.is_described:
            return {
                u.name: FittedNumber(u, float(x), u.start, u.prior_deviation, *u.interval, False)
                for u, x, _ in marginals
            }
        determined = {d.name: d.is_determined for d in self.information_at_fit.determinations}
        estimates = {}
        for u, x, m in marginals:
            is_determined = determined[m.name] and not _bound_of(u, float(x))
            estimates[u.name] = FittedNumber(
                u, float(x), m.value, m.deviation, m.low, m.high, is_determined=is_determined
            )
        return estimates

    @property
    def covariance(self) -> Any:
        """The covariance of the sought numbers, shape (sought, sought): if the model does not describe the
        recordings, that of the knowledge before."""
        if not self.is_described:
            return np.diag([u.prior_deviation**2 for u in self.plan.sought])
        return self.posterior.covariance

    @property
    def is_described(self) -> bool:
        """Whether the model describes the recordings, see `suspects.is_described`."""
        return is_described(self.problem, self.best, self.residual_tests, self.posterior, self.known)

    @property
    def prior_conflicts(self) -> list[PriorConflict]:
        """The numbers of clocks and sensors, and sought ones with a stated deviation, that are not as they are
        known."""
        return [*sensor_conflicts(self.problem, self.best), *prior_conflicts(self.plan.sought, self.best)]

    def columns_over_time(self, comparison: Comparison) -> ComparedColumn:
        """The measured and the simulated column of a comparison."""
        recording = self._run(comparison.run).recording
        measured = recording.columns[comparison.column][comparison.rows]
        simulated = measured - comparison.residuals * comparison.size
        return ComparedColumn(recording.time[comparison.rows], measured, simulated)

    def is_steady(self, name: str) -> bool:
        """Whether the turns of a run are alike."""
        run = self._run(name)
        return run.off is None and not any(hasattr(x, "changes") for x in run.values.values())

    def _run(self, name: str) -> RecordedRun:
        return next(run for run in self.problem.runs if run.name == name)

    def value_of_sum(self, combination: Combination) -> tuple[float, float]:
        """The value of a sum of sought numbers, and its standard deviation."""
        places = [self.problem.place[name] for name, _ in combination.terms]
        sums = self.posterior.samples[:, places] @ [factor for _, factor in combination.terms]
        return float(np.mean(sums)), float(np.std(sums))


def _bound_of(unknown: Unknown, x: float) -> str:
    """The bound at which a fitted value lies, "lower" or "upper"; empty between them."""
    near = AT_BOUND * unknown.prior_deviation
    return "lower" if x <= unknown.low + near else "upper" if x >= unknown.high - near else ""


def system_name(name: str) -> str:
    """The name that a number of the study file has in the simulated system: a feed is an input of the machine."""
    return name.replace("feed.", "machine.", 1) if name.startswith("feed.") else name


def identify(
    config: Config,
    progress: TaskProgress = quiet,
    before_fit: Callable[[IdentificationPlan, Information], None] = lambda *_: None,
    after_reading: Callable[[str], None] = lambda _: None,
) -> IdentifiedMachine:
    """Identify the machine of a study from the recordings of its table [identify].

    Parameters
    ----------
    before_fit : gets the plan and the information of the recordings, before anything is fitted
    after_reading : gets a sentence on each recording, how its file was read

    Raises
    ------
    InputError
        for a study without that table, and with a line for each fault of the recordings.
    RunError
        if the machine does not run with the start values.
    """
    plan = plan_of(config.plans)
    workers = min(2, os.cpu_count() or 1)
    progress("reading recordings", 0.0, 1.0)
    recordings = read_runs(plan.runs, config.motor.kind if config.motor else None)
    for recording in recordings.values():
        after_reading(recording.sentence)
    check_motor_is_known(recordings, is_known=config.knows_motor)
    drive = drive_of(config)
    progress("simulating", 0.1, 1.0)
    problem = _problem(config.feed, plan, drive, recordings)
    inspect_runs(problem, workers)
    progress("what the recordings can tell", 0.15, 1.0)
    start = problem.initial_point(workers)
    before = information(problem, start, workers)
    before_fit(plan, before)
    best = fit(
        problem,
        start,
        workers,
        progress=lambda rounds, cost: progress(
            f"round {rounds}", 0.3 + 0.6 * min(1.0, rounds / MOST_ROUNDS), 1.0
        ),
        starts=plan.starts,
        seed=plan.seed,
    )
    progress("checks", 0.95, 1.0)
    after = information(problem, best.z, workers, propose=False, equations=best)
    around = posterior(problem, best, workers, plan.seed)
    numbers, residuals = known_number_tests(problem, best, workers), tuple(residual_tests(best))
    machine = IdentifiedMachine(config, plan, problem, before, best, around, after, residuals, numbers)
    if machine.is_described:
        return machine
    assumed = tuned_gains(config.motor, config.file.given)
    try:
        sets = suspect_sets(problem, best, workers, assumed, progress)
        return replace(machine, known=replace(numbers, sets=sets))
    except KeyboardInterrupt:
        return replace(machine, failure=InterruptedRunError("the search for suspects was interrupted"))


def tuned_gains(motor: Any, keys: Set[str]) -> list[str]:
    """The gains of the control of a `motor` that are none of the `keys` in the file: a new drive has them."""
    if not isinstance(motor, OwnMotor) or not motor.kind.follows(motor.parameters):
        return []
    gains = (f"motor.{name}" for name in CONTROL)
    return [name for name in gains if name not in keys]


def plan_of(plans: Mapping[str, Any]) -> IdentificationPlan:
    """The plan of a study, among those of all capabilities.

    Raises
    ------
    InputError
        for a study without the table [identify].
    """
    plan: IdentificationPlan | None = plans["identification"]
    if plan is None:
        raise InputError(
            "identify: is missing; add [[identify.run]] with the recordings, and [[identify.parameter]] with the "
            "numbers that are sought",
            key="identify",
        )
    return plan


def read_runs(runs: Sequence[PlannedRun], motor: Motor | None = None) -> dict[str, Recording]:
    """The recordings by the names of the runs of a machine with this kind of `motor`, each with the part that counts.

    Raises
    ------
    InputError
        with a line for each fault of a file.
    """
    faults, recordings = Faults(), dict[str, Recording]()
    for run in runs:
        with faults.collected():
            recording = run.read(motor)
            begin, end = recording.time[0], recording.time[-1]
            if run.off is not None and not begin < run.off < end:
                raise InputError(
                    f"identify.run ({run.name}): switched_off = {run.off:.12g} s: {run.file} goes from "
                    f"{begin:.12g} to {end:.12g} s; must lie within",
                    "identify.run",
                )
            for name, other in recordings.items():
                if _same_rows(recording, other):
                    raise InputError(
                        f"identify.run ({run.name}): {run.file} has rows of the run {name}; each run must have "
                        "its own recording",
                        "identify.run",
                    )
            recordings[run.name] = recording
    faults.refuse()
    return recordings


def _same_rows(first: Recording, second: Recording) -> bool:
    """Whether two recordings have rows of one file in common, or the same values in all signals that both have."""
    ends = [(float(recording.time[0]), float(recording.time[-1])) for recording in (first, second)]
    if first.source == second.source and max(begin for begin, _ in ends) < min(end for _, end in ends):
        return True
    common = [name for name in SIGNALS if name in first.columns and name in second.columns]
    return bool(common) and all(np.array_equal(first.columns[name], second.columns[name]) for name in common)


def _problem(
    loads: Any, plan: IdentificationPlan, drive: Drive, recordings: Mapping[str, Recording]
) -> Problem:
    """The problem of the recordings: the plant with the columns that they measure, their runs, and the sensors."""
    sought = [replace(u, name=system_name(u.name)) for u in plan.sought]
    measured = dict.fromkeys(
        name for recording in recordings.values() for name in recording.columns if name != "mark"
    )
    plant = plant_for(drive, measured, [u.name for u in sought])
    of_shaft = is_of_shaft(measured)
    free = {u.name for u in sought}
    runs = [_run(loads, free, drive, run, recordings[run.name], of_shaft) for run in plan.runs]
    return Problem(plant, runs, sought, _sensors(plan, measured, recordings))


def _run(
    feed: Any, sought: Set[str], drive: Drive, run: PlannedRun, recording: Recording, of_shaft: bool
) -> RecordedRun:
    """A run with the `feed` of the study; the numbers that are `sought` are free."""
    values: dict[str, Any] = {}
    if not of_shaft:
        reference = drive.reference(run.crank_speed)
        values = {name: x for name, x in reference.items() if not name.startswith("model.")}
    if run.speeds:
        if "motor.w_ref" not in values:
            raise InputError(
                f"identify.run ({run.name}): speeds are those of a reference, which this motor does not follow; "
                "leave them out",
                "identify.run",
            )
        changes = ((begin, lasts, drive.reference_speed(w)) for begin, lasts, w in run.speeds)
        values["motor.w_ref"] = Profile(values["motor.w_ref"], tuple(changes))
    stated = drive.loads(feed) if run.has_feed else dict.fromkeys(drive.loads(feed), 0.0)
    # a sought feed of a loaded run is free
    loads = {name: float(x) for name, x in stated.items() if not (run.has_feed and name in sought)}
    added = {system_name(name): x for name, x in run.added.items()}
    return RecordedRun(run.name, recording, run.crank_speed, values | loads, added, run.ambient, run.off)


def _sensors(
    plan: IdentificationPlan, measured: Mapping[str, Any], recordings: Mapping[str, Recording]
) -> dict[str, Sensor]:
    """By analog column, what is known of its sensor; an offset that the file does not give is the usual one of the
    size of the column."""
    sensors = {}
    for name in measured:
        if not MEASURANDS[name].analog:
            continue
        knowledge = plan.sensor(name)
        size = max(
            rms(recording.columns[name]) for recording in recordings.values() if name in recording.columns
        )
        offset = usual_offset(name, size) if knowledge.offset is None else knowledge.offset
        sensors[name] = Sensor(knowledge.noise, knowledge.resolution, knowledge.gain, offset)
    return sensors


def _current_swing(machine: IdentifiedMachine) -> float:
    """The change of the simulated current within the last turn of the first run that has it, over its mean."""
    of_current = next(comparison for comparison in machine.best.comparisons if comparison.column == "motor.i")
    column = machine.columns_over_time(of_current)
    speed = next(run.crank_speed for run in machine.problem.runs if run.name == of_current.run)
    turn = column.simulated[column.time > column.time[-1] - 2.0 * np.pi / speed]
    return float(np.ptp(turn) / np.mean(turn))


def remarks(machine: IdentifiedMachine) -> Iterator[str]:
    """Sentences on data that are missing or assumed."""
    runs, motor = machine.problem.runs, machine.config.motor
    columns = {name for run in runs for name in run.recording.columns}
    is_induction = motor is not None and motor.kind is InductionMotor
    if is_induction and "motor.i" in columns and "motor.power" not in columns:
        yield (
            "The recordings have no active power. The current of this induction motor changes by "
            f"{100.0 * _current_swing(machine):.2g} % within a turn, as most of it magnetises the motor: record the "
            "power, too, which tells far more"
        )
    for run in runs:
        yield run.recording.sentence
        for name in sorted(
            signal for signal in columns - run.recording.columns.keys() if MEASURANDS[signal].analog
        ):
            yield f"{run.recording.source} has no {name}, which another recording has: it tells less without it"
        if "mark" not in run.recording.columns:
            yield (
                f"{run.recording.source} has no mark: the angle of the crank follows from the course of the other "
                "columns, and machines that are alike in both halves of a turn may be taken for each other"
            )
    tuned = tuned_gains(machine.config.motor, machine.config.file.given)
    if tuned and columns & set(OF_TERMINALS):
        names = ", ".join(tuned)
        yield f"{names}: not in the file, and tuned as for a new drive; give the values of the real converter"
