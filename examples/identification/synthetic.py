"""Synthetic recordings: a drive with known values is simulated, and its course passes through a model of the sensors.

They are for examples, tests and benches, and no measurements of a real machine.
"""

from __future__ import annotations

import gzip
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from chainunit.batch.transients import Transients, signal_table
from chainunit.core.errors import InputError
from chainunit.core.files import atomic_file
from chainunit.recordings.measurands import COUNTS, MEASURANDS
from chainunit.recordings.plant import MOVING, free, source_of
from chainunit.recordings.problem import JITTER
from chainunit.recordings.recording import Recording
from chainunit.study.arrays import rms
from chainunit.study.drive import Drive
from chainunit.system.compiled_simulation import LONGEST, CompiledSystem
from chainunit.system.reference import monolithic
from chainunit.system.signals import at_time

INTEGRATORS = ("compiled", "monolithic")
_STEP = 1e-3
"""Time between the rows of the compiled system [s], between which it is interpolated."""


@dataclass(frozen=True)
class Logger:
    """Sensors and logger.

    `rate` is the number of rows a second, `noise` the standard deviation of each analog column in parts of its own
    RMS, `full` the range of its converter with `bits` (without a range the numbers are not rounded), `offset` and
    `gain` the faults of its sensor, each by the name of the quantity. `angles` are the columns that tell the angle:
    "mark", which the crank passes at `mark_angle` [rad], and "motor.count". Row k is sampled at k (1 + drift)/rate
    with the standard deviation `jitter` [s]; rows within `gaps` (begin, end [s]) are missing.
    """

    rate: float = 1000.0
    noise: float = 0.01
    full: Mapping[str, float] = field(default_factory=dict)
    bits: int = 12
    offset: Mapping[str, float] = field(default_factory=dict)
    gain: Mapping[str, float] = field(default_factory=dict)
    angles: Sequence[str] = ("mark",)
    mark_angle: float = 0.0
    drift: float = 0.0
    jitter: float = JITTER
    gaps: Sequence[tuple[float, float]] = ()

    def column(self, name: str, x: Any, rng: np.random.Generator) -> Any:
        """An analog column of the true course `x`, shape (rows,)."""
        y = x * self.gain.get(name, 1.0) + self.offset.get(name, 0.0)
        y = y + self.noise * rms(x) * rng.standard_normal(len(x))
        if name not in self.full:
            return y
        half = 2 ** (self.bits - 1)
        step = self.full[name] / half
        return np.clip(np.round(y / step), -half, half - 1) * step


@dataclass(frozen=True)
class HiddenRun:
    """How a simulated run goes.

    `values` of parameters and inputs of the system by full name, those of inputs also as `Profile` whose times count
    from the first row; the speed of the crank at the begin [rad/s]; the crank angle at the first row if the motor
    kept its speed [rad]; the `temperature` of the winding at the begin [K], by default that of the surroundings; the
    time from the first to the last row, and the time that is simulated `before` [s]. At the time `off` [s] after the
    first row the motor is switched off; its electric quantities are zero from then on.
    """

    crank_speed: float
    duration: float
    values: Mapping[str, Any] = field(default_factory=dict)
    angle: float = 0.0
    temperature: float | None = None
    before: float = 10.0
    off: float | None = None


def synthetic(
    drive: Drive,
    measured: Sequence[str],
    run: HiddenRun,
    logger: Logger,
    rng: np.random.Generator,
    integrator: str = "compiled",
) -> Recording:
    """A recording of a simulated run.

    Parameters
    ----------
    drive : motor and machine; for `crank.tau` and `crank.w` as the only columns, the motor may be any
    measured : names of the analog columns, see `MEASURANDS`
    rng : of the noise; the same state gives the same recording
    integrator : "compiled", a native loop, which simulates a minute in 0.1 s; or "monolithic", scipy's solver, which
        has nothing but the equations in common with the loop by which a recording is fitted (`monolithic`)

    Raises
    ------
    InputError
        for a quantity that this drive does not have, an unknown name, values that make no machine, and another
        integrator.
    RunError
        where the states leave all bounds.
    """
    if integrator not in INTEGRATORS:
        raise InputError(f"integrator {integrator!r}: must be one of {', '.join(INTEGRATORS)}")
    shown = np.arange(round(logger.rate * run.duration)) / logger.rate
    for begin, end in logger.gaps:
        shown = shown[(shown <= begin) | (shown >= end)]
    at = shown * (1.0 + logger.drift) + logger.jitter * rng.standard_normal(len(shown))
    course = _simulated(drive, measured, run, at, integrator)
    columns = {name: logger.column(name, course[name], rng) for name in measured}
    phi = course["motor.phi"]
    if "mark" in logger.angles:
        passed = np.floor((phi / drive.ratio - logger.mark_angle) / (2.0 * math.pi))
        columns["mark"] = np.append(0.0, np.diff(passed))
    if "motor.count" in logger.angles:
        count = np.floor(phi * COUNTS / (2.0 * math.pi))
        columns["motor.count"] = count - count[0]
    heads = {name: f"{name} [{MEASURANDS[name].unit}]" for name in ("time", *columns)}
    return Recording("synthetic", shown, columns, heads)


def _simulated(
    drive: Drive, measured: Sequence[str], run: HiddenRun, at: Any, integrator: str
) -> dict[str, Any]:
    """The measured quantities and the angle of the motor at these times [s], each of shape (times,)."""
    system = CompiledSystem(drive.graph.with_values(_numbers(run.values)))
    speed, begin = run.crank_speed * drive.ratio, -run.before
    first = {name: float(at_time(x, begin)) for name, x in run.values.items()}
    start = {"motor.phi_start": run.angle * drive.ratio - speed * run.before, "motor.w_start": speed}
    states = dict(zip(_states(system), system.start(first, start), strict=True))
    if run.temperature is not None:
        states[f"motor.{drive.motor.temperature}"] = run.temperature
    end = float(np.max(at)) + 2.0 * _STEP
    cuts = [begin, end] if run.off is None else [begin, run.off, end]
    course = {name: np.zeros(len(at)) for name in ("motor.phi", *measured)}
    for own, (low, high) in zip((drive, free(drive)), pairwise(cuts), strict=False):
        here = (at >= low) & (at <= high)
        names = measured if own is drive else [name for name in measured if name in MOVING]
        known = CompiledSystem(own.graph).outputs
        sources = {name: source_of(own, name, known) for name in names} | {"motor.phi": ("motor.phi", 1.0)}
        outputs = list(dict.fromkeys(output for output, _ in sources.values()))
        rows, states = _stretch(own, run.values, states, outputs, (low, high), at[here], integrator)
        for name, (output, factor) in sources.items():
            course[name][here] = factor * rows[output]
        for name in set(measured) - set(names):
            course[name][here] = 0.0
    return course


def _numbers(values: Mapping[str, Any]) -> dict[str, float]:
    return {name: float(x) for name, x in values.items() if not hasattr(x, "changes")}


def _states(system: CompiledSystem) -> Sequence[str]:
    assert system.model.state_layout is not None
    return system.model.state_layout.names


def _stretch(
    drive: Drive, values: Mapping[str, Any], states: Mapping[str, float], outputs: Sequence[str],
    span: tuple[float, float], at: Any, integrator: str,
) -> tuple[dict[str, Any], dict[str, float]]:  # fmt: skip
    """The outputs at these times [s] of a stretch without a switch, and the states at its end."""
    known = drive.graph.values.keys() | CompiledSystem(drive.graph).inputs.keys()
    profiles = {name: x for name, x in values.items() if hasattr(x, "changes") and name in known}
    graph = drive.graph.with_values({name: x for name, x in _numbers(values).items() if name in known})
    system = CompiledSystem(graph)
    names, (begin, end) = _states(system), span
    own = {name: states[name] for name in names}
    if integrator == "monolithic":
        # rows that jitter before one another are solved in order
        times, places = np.unique(np.append(at, end), return_inverse=True)
        solved = monolithic(graph, profiles, [begin, *times], rtol=1e-9, start=own)
        rows = {output: solved[output].values[1:][places[:-1]] for output in outputs}
        return rows, {name: float(solved[name][-1]) for name in names}
    changes = max((len(x.changes) for x in profiles.values()), default=0)
    loop = Transients(system.model, outputs, driven=list(profiles), changes=changes)
    result = loop.run(
        system.p,
        system.inputs,
        list(own.values()),
        begin=begin,
        step=_STEP,
        stop=[end],
        signals=signal_table(list(profiles), [profiles], {}, changes),
        longest=LONGEST * _STEP,
    )
    failure = result.failure(0)
    if failure is not None:
        raise failure
    rows = {output: CubicSpline(result.times[0], result.rows[k, 0])(at) for k, output in enumerate(outputs)}
    return rows, dict(zip(names, map(float, result.states[:, 0]), strict=True))


def write_recording(recording: Recording, file: Path) -> None:
    """Write a recording as `chainunit.recordings.recording.read_recording` takes it, with names and units of the
    quantities; packed where the name ends with ``.gz``. Times have 15 digits, analog columns seven, counted ones all.

    Raises
    ------
    WriteError
        where the file cannot be written.
    """
    rows = np.column_stack([recording.time, *recording.columns.values()])
    names = ("time", *recording.columns)
    forms = [".15g" if name == "time" else ".7g" if MEASURANDS[name].analog else ".0f" for name in names]
    lines = [",".join(f"{name} [{MEASURANDS[name].unit}]" for name in names)]
    lines += (",".join(format(x, form) for x, form in zip(row, forms, strict=True)) for row in rows.tolist())
    content = ("\n".join(lines) + "\n").encode()
    with atomic_file(file) as part:
        # without a time in its head, the same recording gives the same file
        part.write_bytes(gzip.compress(content, mtime=0) if file.suffix == ".gz" else content)
