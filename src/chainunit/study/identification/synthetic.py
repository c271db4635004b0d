"""Synthetic recordings: a drive with known values is simulated, and its course passes through a model of the sensors.

They are for examples, tests and benches, and no measurements of a real machine.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from ...batch.transients import Transients, signal_table
from ...errors import InputError
from ...system.compiled_simulation import LONGEST, CompiledSystem
from ...system.reference import monolithic
from ..arrays import rms
from ..drive import Drive
from .measurands import COUNTS, MEASURANDS
from .plant import source_of
from .problem import JITTER
from .recording import Recording

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
    time from the first to the last row, and the time that is simulated `before` [s].
    """

    crank_speed: float
    duration: float
    values: Mapping[str, Any] = field(default_factory=dict)
    angle: float = 0.0
    temperature: float | None = None
    before: float = 10.0


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
    profiles = {name: x for name, x in run.values.items() if hasattr(x, "changes")}
    graph = drive.graph.with_values(
        {name: float(x) for name, x in run.values.items() if name not in profiles}
    )
    system = CompiledSystem(graph)
    sources = {name: source_of(drive, name, system.outputs) for name in measured}
    outputs = list(dict.fromkeys(["motor.phi", *(output for output, _ in sources.values())]))
    speed = run.crank_speed * drive.ratio
    layout = system.model.state_layout
    assert layout is not None
    begin = -run.before
    first = system.inputs | {name: float(x(begin)) for name, x in profiles.items()}
    start = {"motor.phi_start": run.angle * drive.ratio - speed * run.before, "motor.w_start": speed}
    states = dict(zip(layout.names, system.start(first, start), strict=True))
    if run.temperature is not None:
        states[f"motor.{drive.motor.temperature}"] = run.temperature
    if integrator == "monolithic":
        # rows that jitter before one another are solved in order
        times, places = np.unique(at, return_inverse=True)
        solved = monolithic(graph, profiles, [begin, *times], rtol=1e-9, start=states)
        rows = {output: solved[output].values[1:][places] for output in outputs}
    else:
        changes = max((len(x.changes) for x in profiles.values()), default=0)
        loop = Transients(system.model, outputs, driven=list(profiles), changes=changes)
        result = loop.run(
            system.p,
            system.inputs,
            list(states.values()),
            begin=begin,
            step=_STEP,
            stop=[float(np.max(at)) + 2.0 * _STEP],
            signals=signal_table(list(profiles), [profiles], {}, changes),
            longest=LONGEST * _STEP,
        )
        failure = result.failure(0)
        if failure is not None:
            raise failure
        rows = {
            output: CubicSpline(result.times[0], result.rows[k, 0])(at) for k, output in enumerate(outputs)
        }
    return {"motor.phi": rows["motor.phi"]} | {name: f * rows[o] for name, (o, f) in sources.items()}
