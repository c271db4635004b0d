"""The load observer over a recording: the learning of angle and zero, the run of the observer, and its alarms."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ...core.brief import briefly_shown
from ...core.errors import Faults, InputError
from ...core.files import scratch
from ...core.inputs import JSON, file_bytes, json_of
from ...core.quantities import Layout, Variable, quantity
from ...drives.motor import Motor
from ...drives.terminal_signals import terminal_signals
from ...fmu.backends import export
from ...machines.load_observer import LoadObserver
from ...reading.results import InUnit, derived, part, result
from ...reading.tables import instance
from ...recordings.fit import Fit, fit
from ...recordings.inspection import FEWEST_TURNS, inspect_runs
from ...recordings.measurands import MEASURANDS, usual_offset
from ...recordings.problem import MARK_ANGLE, Problem, RecordedRun, Sensor, speed_column
from ...recordings.recorded_drive import check_motor_is_known, is_of_shaft, plant_for
from ...recordings.recording import Recording
from ...recordings.residuals import ResidualTest, describes, residual_tests
from ...recordings.unknown import Unknown
from ...study.arrays import rms, stretches
from ...study.choice import drive_of
from ...study.config import Config
from ...study.drive import Drive
from ...system.instance import Fmu, Instance
from ...work.progress import TaskProgress, quiet
from .crank_motion import crank_motion
from .observation import false_imbalance, of_shaft, tuning, weights
from .tables import ObserverTable, WatchPlan

RUN = "watch"
COLUMN_OF = {"current": "motor.i", "power": "motor.power"}
"""By signal at the terminals of a motor, its column."""
FORCE_SPREAD, MOST_FORCE = 200.0, 2000.0
"""Standard deviation and bound of a processing force that is learned [N]."""
UNCERTAINTIES = ("imbalance.uncertainty", "imbalance.force_uncertainty")
OUTPUTS = (
    "left.material_mass",
    "right.material_mass",
    "left.material_mass_deviation",
    "right.material_mass_deviation",
    "left.processing_force",
    "right.processing_force",
    "left.processing_force_deviation",
    "right.processing_force_deviation",
    "left.web_pull",
    "right.web_pull",
    "left.overload",
    "right.overload",
    "imbalance.feed",
    "imbalance.feed_deviation",
    "imbalance.feed_threshold",
    "imbalance.force",
    "imbalance.force_deviation",
    "imbalance.force_threshold",
    "rocker.tau",
    "grounds.feed",
    "grounds.force",
    "alarm",
)
"""Outputs of the observer that are kept."""
GROUNDS = {"feed": "imbalance of the feed", "force": "imbalance of the processing forces"}
GAP = 0.05
"""Time without rows, in parts of a turn, behind which the observer starts anew."""
LULL = 2.0
"""Alarms of one side that are nearer than this many turns are one."""
_LIGHT = 1e-3


def declared_outputs() -> dict[str, Variable]:
    """The declarations of the outputs and states of the observer, by name."""
    layouts = [*(block.layout for block in LoadObserver.parts), LoadObserver.state_layout]
    return {v.name: v for layout in layouts if layout is not None for v in layout.variables}


@result
class Alarm:
    """An alarm. Its `ground` is the imbalance on which it rests, "feed" or "force", and `values` are the outputs of
    the observer at the time `at`."""

    side: str = part("side that is overloaded")
    ground: str
    begin: float = quantity("s", "its begin")
    end: float = quantity("s", "its end")
    lasts: bool = part("whether it lasts up to the end of the recording")
    in_learning: bool = part("whether it begins in the time of learning")
    turn: float = quantity("1", "turns of the crank before its begin")
    at: float = quantity("s", "time at which its statistic is largest")
    values: Mapping[str, float]

    @derived(name="ground")
    def imbalance(self) -> str:
        """The imbalance on which it rests."""
        return GROUNDS[self.ground]

    @derived(name="values")
    def outputs(self) -> dict[str, InUnit]:
        """Outputs of the observer at this time."""
        declared = declared_outputs()
        return {name: InUnit(x, declared[name].unit) for name, x in self.values.items()}


@dataclass(frozen=True)
class MachineErrors:
    """Names and covariance of identified parameters of the machine, and whether the identification failed: its model
    did not describe its recordings."""

    names: list[str]
    covariance: Any
    failed: bool


@dataclass(frozen=True)
class Begin:
    """The begin of a recording, in which feed and forces are constant: the `fit` over it, from which the observer
    learns, and the tests of its residuals."""

    problem: Problem
    fit: Fit
    tests: tuple[ResidualTest, ...]

    @classmethod
    def learned(cls, problem: Problem, workers: int) -> Begin:
        """The begin with the numbers that fit it best."""
        best = fit(problem, None, workers)
        return cls(problem, best, tuple(residual_tests(best)))

    @cached_property
    def values(self) -> dict[str, float]:
        """The learned numbers by name."""
        return {u.name: float(x) for u, x in zip(self.problem.unknowns, self.fit.z, strict=True)}

    @property
    def recording(self) -> Recording:
        """The rows of the begin."""
        return self.problem.runs[0].recording

    @property
    def is_described(self) -> bool:
        """Whether the machine of the study describes it."""
        return describes(self.problem, self.fit, self.tests)

    @property
    def noises(self) -> tuple[float, float]:
        """The noise of the signal of the observer and that of the speed, in parts of the stated one, where they are
        larger."""
        by_column = {test.column: test.noise for test in self.tests}
        signal = max([1.0, *(by_column.get(name, 1.0) for name in columns_watched(self.recording).values())])
        return signal, max(1.0, by_column.get(speed_column(self.recording), 1.0))

    @property
    def mark_angle(self) -> float:
        """The angle of the crank at its mark, or at the first row of a recording with an encoder [rad]."""
        if "motor.count" not in self.recording.columns:
            return self.values.get(MARK_ANGLE, 0.0)
        return float(next(entry.angle[0] for entry in self.fit.comparisons if entry.rows is not None))

    def gain(self, column: str | None) -> float:
        """The gain of the sensor of a column."""
        return self.values.get(f"gain({column})", 1.0)

    def zero(self, column: str) -> float:
        """The value of a column where its sensor shows 0, as the true quantity."""
        return self.values[f"{RUN}.offset({column})"] / self.gain(column)


@briefly_shown
@dataclass(frozen=True)
class WatchedRecording:
    """A recording with the outputs of the observer at its rows.

    `parameters` has the parameters of the observer by name, and `uncertainty` is the false imbalance by errors of the
    machine's parameters: of the feed [kg] and of the forces [N]. With these errors the thresholds are wider by the
    factors `widening`. `failed` says whether the model of the identification did not describe its own recordings.
    """

    config: Config
    plan: WatchPlan
    recording: Recording
    begin: Begin
    parameters: Mapping[str, float]
    uncertainty: tuple[float, float]
    widening: tuple[float, float]
    failed: bool
    outputs: Mapping[str, Any]
    alarms: tuple[Alarm, ...]

    @property
    def is_described(self) -> bool:
        """Whether the machine of the study describes the begin of the recording."""
        return self.begin.is_described


def watch(config: Config, progress: TaskProgress = quiet) -> WatchedRecording:
    """Run the load observer over the recording of the table [watch].

    Raises
    ------
    InputError
        for a study without that table, another machine than the chain unit, and with a line for each fault of the
        recording.
    """
    plan: WatchPlan | None = config.plans["watch"].watch
    if plan is None:
        raise InputError("watch: is missing; add [watch] with the recording (file)", key="watch")
    workers = min(2, os.cpu_count() or 1)
    progress("reading the recording", 0.0, 1.0)
    recording, errors = _read_files(plan, config.motor.kind if config.motor else None)
    check_motor_is_known({RUN: recording}, is_known=config.knows_motor)
    drive = drive_of(config)
    problem = _problem(config.feed, plan, drive, recording)
    inspect_runs(problem, workers)
    progress("learning angle, zero and forces", 0.1, 1.0)
    begin = Begin.learned(problem, workers)
    values = _parameters(config.plans["watch"].observer, plan, drive, begin)
    if errors is not None:
        false = false_imbalance(values, errors.names, errors.covariance, plan.crank_speed)
        values |= dict(zip(UNCERTAINTIES, false.values(), strict=True))
    progress("watching", 0.5, 1.0)
    # the thresholds of a machine that is known show by how much errors widen them
    tunings = [values]
    if any(values[name] for name in UNCERTAINTIES):
        tunings.append(values | dict.fromkeys(UNCERTAINTIES, 0.0))
    courses = observe(recording, _signals(recording, begin, drive), tunings, GAP * plan.turn)
    feed_widening, force_widening = (
        float(np.median(courses[0][name] / courses[-1][name]))
        for name in ("imbalance.feed_threshold", "imbalance.force_threshold")
    )
    return WatchedRecording(
        config,
        plan,
        recording,
        begin,
        values,
        (values[UNCERTAINTIES[0]], values[UNCERTAINTIES[1]]),
        (feed_widening, force_widening),
        errors is not None and errors.failed,
        courses[0],
        tuple(_alarms(recording.time, courses[0], plan)),
    )


def _read_files(plan: WatchPlan, motor: Motor | None) -> tuple[Recording, MachineErrors | None]:
    """The recording, and the errors of the machine where the file of an identification has them."""
    faults, errors, recordings = Faults(), None, list[Recording]()
    with faults.collected():
        recordings.append(plan.read(motor))
    if plan.identification is not None:
        with faults.collected():
            errors = _read_errors(plan.identification)
    faults.refuse()
    (recording,) = recordings
    duration, least = float(recording.time[-1] - recording.time[0]), FEWEST_TURNS * plan.turn
    if not least <= plan.table.learning < duration:
        raise InputError(
            f"watch.learning = {plan.table.learning:g} s: must be >= {least:.4g} s, {FEWEST_TURNS:g} turns of the "
            f"crank, and < {duration:.4g} s, the duration of {plan.file}",
            "watch.learning",
        )
    return recording, errors


def _problem(loads: Any, plan: WatchPlan, drive: Drive, recording: Recording) -> Problem:
    """The begin of the recording, in which feed and forces are constant, about as the `loads` of the study."""
    feed, table = Layout(type(loads)).by_name(loads), plan.table
    sought = []
    for name, value in feed.items():
        full = f"machine.{name}"
        if name.endswith("material_mass"):
            spread = max(table.feed_deviation * value, 1e-3)
            sought.append(Unknown(full, "kg", value, 0.0, value + 20.0 * spread, spread))
        else:
            sought.append(Unknown(full, "N", value, 0.0, MOST_FORCE, FORCE_SPREAD))
    sensors = {
        name: Sensor(table.noise, gain=table.gain, offset=usual_offset(name, rms(x)))
        for name, x in recording.columns.items()
        if MEASURANDS[name].analog
    }
    values = {} if is_of_shaft(recording.columns) else drive.reference(plan.crank_speed)
    first = recording.part(end=float(recording.time[0]) + table.learning)
    run = RecordedRun(RUN, first, plan.crank_speed, values, ambient=plan.ambient)
    return Problem(plant_for(drive, recording.columns, [u.name for u in sought]), [run], sought, sensors)


def columns_watched(recording: Recording) -> dict[str, str]:
    """By input of the observer, the column that feeds it."""
    if is_of_shaft(recording.columns):
        return {"torque": "crank.tau"}
    return {name: column for name, column in COLUMN_OF.items() if column in recording.columns}


def _signals(recording: Recording, begin: Begin, drive: Drive) -> dict[str, Any]:
    """The inputs of the observer by name, each of shape (rows,), without the errors of the sensors."""
    phi, w = crank_motion(recording, begin.mark_angle, drive.ratio)
    ratio = 1.0 if is_of_shaft(recording.columns) else drive.ratio
    signals = {"phi": phi * ratio, "w": w * ratio / begin.gain(speed_column(recording))}
    for name, column in columns_watched(recording).items():
        signals[name] = recording.columns[column] / begin.gain(column)
    return signals


def _parameters(
    observer: ObserverTable | None, plan: WatchPlan, drive: Drive, begin: Begin
) -> dict[str, float]:
    """The parameters of the observer by name, by the `begin` of the recording."""
    recording, columns = begin.recording, begin.recording.columns
    values = dict(drive.machine.in_plane)
    if is_of_shaft(columns):
        ratio, torque = 1.0, rms(columns["crank.tau"])
        values |= {
            # the observer wants a rotor: at the crank its inertia and that of the crank are one
            "rotor.J": (1.0 - _LIGHT) * values["crank.I"],
            "crank.I": _LIGHT * values["crank.I"],
            "rotor.d": 0.0,
            "signal.torque": 1.0,
            "signal.current": 0.0,
            "signal.zero": begin.zero("crank.tau"),
        }
    else:
        p, ratio, w = drive.fmu_parameters, drive.ratio, plan.crank_speed * drive.ratio
        mean = float(np.mean(columns["motor.power"])) / w if "motor.power" in columns else 0.0
        signals = terminal_signals(drive.motor, p, w, mean, begin.values[f"{RUN}.temperature"])
        missing = [COLUMN_OF[name] for name in signals.outputs if COLUMN_OF[name] not in columns]
        if missing:
            raise InputError(
                f"{recording.source}: the load of this motor is watched by {' and '.join(missing)}, too; record it"
            )
        zero = signals.per_current * begin.zero("motor.i")
        values |= of_shaft(p) | weights(signals) | {"signal.zero": zero}
        torque = signals.per_current * rms(columns["motor.i"])
        torque += signals.per_power * rms(columns["motor.power"]) if signals.per_power else 0.0
    layout = drive.machine.model.feed_layout
    feed = layout.from_names({name: begin.values[f"machine.{name}"] for name in layout.names})
    louder_signal, louder_speed = begin.noises
    table = replace(
        observer or instance(ObserverTable, {}),
        signal_noise=plan.table.noise * louder_signal,
        speed_noise=plan.table.noise * louder_speed,
        rate=1.0 / recording.step,
    )
    return values | {"ratio": ratio} | tuning(table, feed, plan.crank_speed * ratio, torque)


def _read_errors(file: Path) -> MachineErrors:
    """The errors of the machine by the result of an identification."""
    key = "watch.identification"
    try:
        content = json_of(file_bytes(file, JSON), str(file), "result.json of chainunit identify")
        table, failed = content["covariance"], not content["is_described"]
        rows = [k for k, name in enumerate(table["names"]) if name.startswith("machine.")]
        names = [table["names"][k].removeprefix("machine.") for k in rows]
        return MachineErrors(names, np.array(table["matrix"], float)[np.ix_(rows, rows)], failed)
    except InputError as error:
        raise InputError(f"{key} = {error}", key) from error
    except (ValueError, KeyError, TypeError, AttributeError, IndexError) as error:
        raise InputError(f"{key} = {file}: is no result.json of chainunit identify", key) from error


def observe(
    recording: Recording, signals: Mapping[str, Any], tunings: Sequence[Mapping[str, float]], gap: float
) -> list[dict[str, Any]]:
    """The outputs of the observer's FMU, by name, each of shape (rows,), for each tuning.

    Parameters
    ----------
    signals : inputs of the observer by name, each of shape (rows,)
    tunings : parameters of the observer by name
    gap : time without rows behind which the observer starts anew [s]; over a shorter one the inputs go straight
    """
    table, time = np.stack(list(signals.values())), recording.time
    courses = [np.zeros((len(OUTPUTS), len(time))) for _ in tunings]
    pieces = np.split(np.arange(len(time)), np.flatnonzero(np.diff(time) > gap) + 1)
    with scratch() as folder:
        file = folder / f"{LoadObserver.name}.fmu"
        export(LoadObserver, file, dict(tunings[0]))
        with contextlib.closing(Fmu(file)) as fmu:
            for course, values in zip(courses, tunings, strict=True):
                for rows in pieces:
                    first = dict(zip(signals, map(float, table[:, rows[0]]), strict=True))
                    with contextlib.closing(Instance(fmu, "observer")) as unit:
                        unit.initialize({**values, **first}, float(time[rows[0]]))
                        unit.finish_initialization()
                        inputs = table[:, rows]
                        course[:, rows] = _outputs(unit, list(signals), inputs, time[rows], recording.step)
    return [dict(zip(OUTPUTS, course, strict=True)) for course in courses]


def _outputs(unit: Instance, signals: list[str], table: Any, time: Any, usual: float) -> Any:
    """The outputs of an instance along the inputs `table`, shape (signals, rows), in steps near the `usual` one."""
    rows = np.zeros((len(OUTPUTS), len(time)))
    inputs, outputs = unit.handle(signals), unit.handle(list(OUTPUTS))
    for k, t in enumerate(time.tolist()):
        unit.write(inputs, table[:, k].tolist())
        rows[:, k] = unit.read(outputs)
        if k + 1 == len(time):
            break
        step, change = float(time[k + 1]) - t, table[:, k + 1] - table[:, k]
        parts = max(1, round(step / usual))
        for stage in range(parts):
            if stage:
                unit.write(inputs, (table[:, k] + change * stage / parts).tolist())
            unit.step(t + step * stage / parts, step / parts)
    return rows


def _alarms(time: Any, outputs: Mapping[str, Any], plan: WatchPlan) -> list[Alarm]:
    """The alarms in order; those of one side with a short lull between them are one."""
    alarms: list[Alarm] = []
    for side, sign in (("left", 1.0), ("right", -1.0)):
        joined: list[tuple[int, int]] = []
        for first, last in stretches(outputs["alarm"] == sign):
            if joined and time[first] - time[joined[-1][1] - 1] < LULL * plan.turn:
                joined[-1] = joined[-1][0], last
            else:
                joined.append((first, last))
        shares = {name: sign * outputs[f"grounds.{name}"] for name in GROUNDS}
        for first, last in joined:
            # the ground that is beyond its threshold first, and the place of the largest statistic
            ground = max(shares, key=lambda name: float(shares[name][first]))
            place = first + int(np.argmax(np.maximum(*shares.values())[first:last]))
            values = {name: float(x[place]) for name, x in outputs.items()}
            begin, end, largest = (float(time[k]) for k in (first, last - 1, place))
            after, lasts = begin - float(time[0]), last == len(time)
            in_learning, turn = after < plan.table.learning, after / plan.turn
            alarms.append(Alarm(side, ground, begin, end, lasts, in_learning, turn, largest, values))
    return sorted(alarms, key=lambda alarm: alarm.begin)
