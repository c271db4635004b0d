"""The load observer over a recording: the learning of angle and zero, the run of the observer, and its alarms."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ...core.brief import briefly_shown
from ...core.errors import Faults, InputError
from ...core.files import scratch
from ...core.inputs import JSON, file_bytes, json_of
from ...core.quantities import Layout
from ...drives.motor import Motor
from ...drives.terminal_signals import terminal_signals
from ...fmu.backends import export
from ...machines.load_observer import LoadObserver
from ...reading.tables import instance
from ...recordings.fit import Fit, fit
from ...recordings.inspection import FEWEST_TURNS, constant_parts, inspect_runs
from ...recordings.measurands import MEASURANDS, usual_offset
from ...recordings.problem import MARK_ANGLE, Problem, RecordedRun, Sensor, speed_column
from ...recordings.recorded_drive import check_motor_is_known, is_of_shaft, plant_for
from ...recordings.recording import Recording
from ...recordings.residuals import (
    PriorConflict,
    ResidualTest,
    describes,
    prior_conflicts,
    residual_tests,
    sensor_conflicts,
)
from ...recordings.unknown import Unknown
from ...study.arrays import rms, stretches
from ...study.choice import drive_of
from ...study.config import Config
from ...study.drive import Drive
from ...system.instance import Fmu, Instance
from ...work.progress import TaskProgress, quiet
from .crank_motion import crank_motion
from .observation import false_imbalance, of_shaft, tuning, weights
from .observer_table import ObserverTable
from .reading import WatchPlan

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
THRESHOLDS = ("imbalance.feed_threshold", "imbalance.force_threshold")
GAP = 0.05
"""Time without rows, in parts of a turn, behind which the observer starts anew."""
LULL = 2.0
"""Alarms of one side that are nearer than this many turns are one."""
_LIGHT = 1e-3


@dataclass(frozen=True)
class Alarm:
    """An alarm: its side, from when to when [s], on what it rests ("feed" or "force"), whether it `lasts` up to the
    end of the recording, and the outputs of the observer at the time `at` of its largest statistic."""

    side: str
    begin: float
    end: float
    ground: str
    lasts: bool
    at: float
    values: Mapping[str, float]


@dataclass(frozen=True)
class MachineErrors:
    """Names and covariance of identified parameters of the machine, and whether the identification failed: its model
    did not describe its recordings."""

    names: list[str]
    covariance: Any
    failed: bool


@briefly_shown
@dataclass(frozen=True)
class WatchedRecording:
    """A recording with the outputs of the observer at its rows.

    `learned` is the fit over its begin with the tests of its residuals, `parameters` has the parameters of the
    observer by name, and `uncertainty` is the false imbalance by errors of the machine's parameters: of the feed [kg]
    and of the forces [N]. With these errors the thresholds are wider by the factors `widening`. `failed` says whether
    the model of the identification did not describe its own recordings.
    """

    config: Config
    plan: WatchPlan
    recording: Recording
    drive: Drive
    problem: Problem
    learned: Fit
    residual_tests: tuple[ResidualTest, ...]
    parameters: Mapping[str, float]
    uncertainty: tuple[float, float]
    widening: tuple[float, float]
    failed: bool
    outputs: Mapping[str, Any]
    alarms: tuple[Alarm, ...]

    @property
    def is_described(self) -> bool:
        """Whether the machine of the study describes the begin of the recording."""
        return describes(self.problem, self.learned, self.residual_tests)

    @property
    def prior_conflicts(self) -> list[PriorConflict]:
        """The numbers of clock and sensors that are not as they are known, and feeds that are not as stated."""
        loads = prior_conflicts(self.problem.sought, self.learned)
        named = (replace(conflict, name=file_name(conflict.name)) for conflict in loads)
        return [*sensor_conflicts(self.problem, self.learned), *named]

    @property
    def only_feed_differs(self) -> bool:
        """Whether nothing but a feed that is not as stated speaks against the machine of the study."""
        loads = {load.name for load in self.problem.sought}
        return not self.is_described and describes(self.problem, self.learned, self.residual_tests, loads)

    @property
    def noises(self) -> tuple[float, float]:
        """The noise of the signal and of the measured speed, over the stated noise [1], see `noises`."""
        return noises(self.residual_tests, self.problem.runs[0].recording)

    @property
    def constant_parts(self) -> list[str]:
        """Words on columns of the observer that keep a value over a part."""
        speed = speed_column(self.recording)
        names = [*_signals(self.recording).values(), *([speed] if speed else [])]
        return list(constant_parts(self.recording, names))


def file_name(name: str) -> str:
    """The name in the study file of a load that is learned."""
    return name.replace("machine.", "feed.", 1)


def watch_plan_of(plan: WatchPlan | None) -> WatchPlan:
    """The plan of a study that asks for a watch.

    Raises
    ------
    InputError
        for a study without the table [watch].
    """
    if plan is None:
        raise InputError("watch: is missing; add [watch] with the recording (file)", key="watch")
    return plan


def watch(config: Config, progress: TaskProgress = quiet) -> WatchedRecording:
    """Run the load observer over the recording of the table [watch].

    Raises
    ------
    InputError
        for a study without that table, another machine than the chain unit, and with a line for each fault of the
        recording.
    """
    plan, observer = watch_plan_of(config.plans["watch"].watch), config.plans["watch"].observer
    workers = min(2, os.cpu_count() or 1)
    progress("reading the recording", 0.0, 1.0)
    recording, errors = _read_files(plan, config.motor.kind if config.motor else None)
    duration = float(recording.time[-1] - recording.time[0])
    least = FEWEST_TURNS * plan.turn
    if not least <= plan.learning < duration:
        raise InputError(
            f"watch.learning = {plan.learning:g} s: must be >= {least:.4g} s, {FEWEST_TURNS:g} turns of the crank, "
            f"and < {duration:.4g} s, the duration of {plan.file}",
            "watch.learning",
        )
    check_motor_is_known({RUN: recording}, is_known=config.knows_motor)
    drive = drive_of(config)
    problem = _problem(config.feed, plan, drive, recording)
    inspect_runs(problem, workers)
    progress("learning angle, zero and forces", 0.1, 1.0)
    learned = fit(problem, None, workers)
    learned_values = {u.name: float(x) for u, x in zip(problem.unknowns, learned.z, strict=True)}
    shaft = is_of_shaft(recording.columns)
    ratio = 1.0 if shaft else drive.ratio
    angle = next(comparison.angle[0] for comparison in learned.comparisons if comparison.rows is not None)
    angle = float(angle) if "motor.count" in recording.columns else learned_values.get(MARK_ANGLE, 0.0)
    phi, w = crank_motion(recording, angle, drive.ratio)
    checks = tuple(residual_tests(learned))
    first = problem.runs[0].recording
    values = _parameters(observer, plan, drive, first, learned_values, ratio, noises(checks, first))
    uncertainty = _uncertainty(plan, values, errors)
    values |= dict(zip(UNCERTAINTIES, uncertainty, strict=True))
    gain = {name: learned_values.get(f"gain({name})", 1.0) for name in recording.columns}
    of_speed = gain.get(speed_column(recording), 1.0)
    signals = {"phi": phi * ratio, "w": w * ratio / of_speed} | {
        name: recording.columns[column] / gain[column] for name, column in _signals(recording).items()
    }
    progress("watching", 0.5, 1.0)
    # the thresholds of a machine that is known show by how much errors widen them
    tunings = [values, *([values | dict.fromkeys(UNCERTAINTIES, 0.0)] if any(uncertainty) else [])]
    courses = observe(recording, signals, tunings, GAP * plan.turn)
    outputs, right = courses[0], courses[-1]
    widening = [float(np.median(outputs[name] / right[name])) for name in THRESHOLDS]
    alarms = tuple(_alarms(recording.time, outputs, plan.turn))
    return WatchedRecording(
        config,
        plan,
        recording,
        drive,
        problem,
        learned,
        checks,
        values,
        uncertainty,
        (widening[0], widening[1]),
        errors is not None and errors.failed,
        outputs,
        alarms,
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
    return recordings[0], errors


def _problem(loads: Any, plan: WatchPlan, drive: Drive, recording: Recording) -> Problem:
    """The begin of the recording, in which feed and forces are constant, about as the `loads` of the study."""
    feed = Layout(type(loads)).by_name(loads)
    sought = []
    for name, value in feed.items():
        full = f"machine.{name}"
        if name.endswith("material_mass"):
            spread = max(plan.feed_deviation * value, 1e-3)
            sought.append(Unknown(full, "kg", value, 0.0, value + 20.0 * spread, spread))
        else:
            sought.append(Unknown(full, "N", value, 0.0, MOST_FORCE, FORCE_SPREAD))
    sensors = {
        name: Sensor(plan.noise, gain=plan.gain, offset=usual_offset(name, rms(x)))
        for name, x in recording.columns.items()
        if MEASURANDS[name].analog
    }
    values = {} if is_of_shaft(recording.columns) else drive.reference(plan.crank_speed)
    first = recording.part(end=float(recording.time[0]) + plan.learning)
    run = RecordedRun(RUN, first, plan.crank_speed, values, ambient=plan.ambient)
    return Problem(plant_for(drive, recording.columns, [u.name for u in sought]), [run], sought, sensors)


def _signals(recording: Recording) -> dict[str, str]:
    """By input of the observer, the column that feeds it."""
    if is_of_shaft(recording.columns):
        return {"torque": "crank.tau"}
    return {name: column for name, column in COLUMN_OF.items() if column in recording.columns}


def _parameters(
    observer: ObserverTable | None,
    plan: WatchPlan,
    drive: Drive,
    recording: Recording,
    learned_values: Mapping[str, float],
    ratio: float,
    louder: tuple[float, float],
) -> dict[str, float]:
    """The parameters of the observer by name, by the recording of the begin; `louder` are the factors on the stated
    noise of signal and speed."""
    columns = recording.columns
    values = drive.machine.by_name | {"ratio": ratio}
    if is_of_shaft(columns):
        # the observer wants a rotor: at the crank its inertia and that of the crank are one
        values |= {
            "rotor.J": (1.0 - _LIGHT) * values["crank.I"],
            "crank.I": _LIGHT * values["crank.I"],
            "rotor.d": 0.0,
        }
        values |= {
            "signal.torque": 1.0,
            "signal.current": 0.0,
            "signal.zero": _zero(learned_values, "crank.tau"),
        }
        torque = rms(columns["crank.tau"])
    else:
        p, w = drive.fmu_parameters, plan.crank_speed * drive.ratio
        mean = float(np.mean(columns["motor.power"])) / w if "motor.power" in columns else 0.0
        signals = terminal_signals(drive.motor, p, w, mean, learned_values[f"{RUN}.temperature"])
        missing = [COLUMN_OF[name] for name in signals.outputs if COLUMN_OF[name] not in columns]
        if missing:
            raise InputError(
                f"{recording.source}: the load of this motor is watched by {' and '.join(missing)}, too; record it"
            )
        values |= of_shaft(p) | weights(signals)
        values |= {"signal.zero": signals.per_current * _zero(learned_values, "motor.i")}
        torque = signals.per_current * rms(columns["motor.i"])
        torque += signals.per_power * rms(columns["motor.power"]) if signals.per_power else 0.0
    layout = drive.machine.model.feed_layout
    feed = layout.from_names({name: learned_values[f"machine.{name}"] for name in layout.names})
    table = replace(
        observer or instance(ObserverTable, {}),
        signal_noise=plan.noise * louder[0],
        speed_noise=plan.noise * louder[1],
        rate=1.0 / recording.step,
    )
    return values | tuning(table, feed, plan.crank_speed * ratio, torque)


def _zero(learned_values: Mapping[str, float], column: str) -> float:
    """The value of a column where its sensor shows 0, as the true quantity."""
    return learned_values[f"{RUN}.offset({column})"] / learned_values.get(f"gain({column})", 1.0)


def noises(checks: Sequence[ResidualTest], recording: Recording) -> tuple[float, float]:
    """The noise of the signal of the observer and that of the speed at the begin of the recording, in parts of the
    stated one, where they are larger."""
    by_column = {check.column: check.noise for check in checks}
    signal = max([1.0, *(by_column.get(name, 1.0) for name in _signals(recording).values())])
    return signal, max(1.0, by_column.get(speed_column(recording), 1.0))


def _uncertainty(
    plan: WatchPlan, values: Mapping[str, float], errors: MachineErrors | None
) -> tuple[float, float]:
    """The false imbalance by errors of the machine: of an identified one, or as the table [observer] has it."""
    if errors is None:
        feed, force = (values[name] for name in UNCERTAINTIES)
        return feed, force
    feed, force = false_imbalance(values, errors.names, errors.covariance, plan.crank_speed).values()
    return feed, force


def _read_errors(file: Path) -> MachineErrors:
    """The errors of the machine by the result of an identification."""
    try:
        result = json_of(file_bytes(file, JSON), str(file), "result.json of chainunit identify")
        table, failed = result["covariance"], not result["is_described"]
        names, matrix = list(table["names"]), np.array(table["matrix"], float)
    except InputError as error:
        raise InputError(f"watch.identification = {error}", "watch.identification") from error
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(
            f"watch.identification = {file}: is no result.json of chainunit identify", "watch.identification"
        ) from error
    rows = [k for k, name in enumerate(names) if name.startswith("machine.")]
    names = [names[k].removeprefix("machine.") for k in rows]
    return MachineErrors(names, matrix[np.ix_(rows, rows)], failed)


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
    results = [np.zeros((len(OUTPUTS), len(time))) for _ in tunings]
    pieces = np.split(np.arange(len(time)), np.flatnonzero(np.diff(time) > gap) + 1)
    with scratch() as folder:
        file = folder / f"{LoadObserver.name}.fmu"
        export(LoadObserver, file, dict(tunings[0]))
        with contextlib.closing(Fmu(file)) as fmu:
            for result, values in zip(results, tunings, strict=True):
                for rows in pieces:
                    first = dict(zip(signals, map(float, table[:, rows[0]]), strict=True))
                    with contextlib.closing(Instance(fmu, "observer")) as unit:
                        unit.initialize({**values, **first}, float(time[rows[0]]))
                        unit.finish_initialization()
                        result[:, rows] = _outputs(
                            unit, list(signals), table[:, rows], time[rows], recording.step
                        )
    return [dict(zip(OUTPUTS, result, strict=True)) for result in results]


def _outputs(unit: Instance, signals: list[str], table: Any, time: Any, usual: float) -> Any:
    """The outputs of an instance along the inputs `table`, shape (signals, rows), in steps near the `usual` one."""
    result = np.zeros((len(OUTPUTS), len(time)))
    inputs, outputs = unit.handle(signals), unit.handle(list(OUTPUTS))
    for k, (t, row) in enumerate(zip(time.tolist(), table.T, strict=True)):
        unit.write(inputs, row.tolist())
        result[:, k] = unit.read(outputs)
        if k + 1 == len(time):
            break
        step = float(time[k + 1]) - t
        parts = max(1, round(step / usual))
        for part in range(parts):
            if part:
                unit.write(inputs, (row + (table[:, k + 1] - row) * part / parts).tolist())
            unit.step(t + step * part / parts, step / parts)
    return result


def _alarms(time: Any, outputs: Mapping[str, Any], turn: float) -> list[Alarm]:
    """The alarms in order; those of one side with a short lull between them are one."""
    alarms: list[Alarm] = []
    for side, sign in (("left", 1.0), ("right", -1.0)):
        joined: list[tuple[int, int]] = []
        for first, last in stretches(outputs["alarm"] == sign):
            if joined and time[first] - time[joined[-1][1] - 1] < LULL * turn:
                joined[-1] = joined[-1][0], last
            else:
                joined.append((first, last))
        for first, last in joined:
            rows = slice(first, last)
            shares = {name: sign * outputs[f"grounds.{name}"][rows] for name in ("feed", "force")}
            ground = max(shares, key=lambda name: float(np.max(shares[name])))
            place = first + int(np.argmax(shares[ground]))
            values = {name: float(x[place]) for name, x in outputs.items()}
            begin, end = float(time[first]), float(time[last - 1])
            # an alarm begins on the ground that is beyond its threshold first
            first_ground = max(shares, key=lambda name: float(shares[name][0]))
            lasts = last == len(time)
            alarms.append(Alarm(side, begin, end, first_ground, lasts, float(time[place]), values))
    return sorted(alarms, key=lambda alarm: alarm.begin)
