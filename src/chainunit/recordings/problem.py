"""What is sought, what is known, and the residuals of recorded runs with their exact derivatives."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..study.arrays import rms
from .measurands import COUNTS, MEASURANDS
from .plant import ANGLE, CRANK, AnyPlant, Nuisance, Overview, Response, Scenario
from .recording import Recording
from .unknown import Unknown

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

JITTER = 2e-5
"""Scatter of the instants at which rows are sampled [s]."""
OUTLIER = 6.0
"""Size of a residual, in standard deviations, from which it counts less."""
STEP = 2e-3
"""Time between the rows of a simulation [s], between which it is interpolated."""
ANGLES, TURNS = 24, 3.0
"""Number of crank angles at which a run without marks is tried, and the turns that are tried."""
ADVANCE_ORDERS, ADVANCE = (1, 2, 3), 1e4
"""Orders of a polynomial over the run by which the machine may be ahead of the simulated one, and its size in counts
of the encoder. The mean speed depends on the frequency of the supply and on the warming of the motor, to which the
count is far more sensitive than any other column; within a turn it shows the motion."""
AHEAD = 0.04
"""Part of a run with an encoder by which the simulation is longer: with the start values its speed is another."""
STANDING, SMOOTHED = 0.1, 0.1
"""Share of the crank speed of a run below which the machine stands, and the time over which its speed is averaged for
that [s]."""
SPEEDS = ("crank.w", "motor.w")
"""Columns that tell the speed, the first one best."""
MARK_ANGLE = "mark.angle"
"""Name of the crank angle at the mark among the unknowns."""
_CHANGE = 0.2
"""Change of an unknown for which the derivatives are integrated, in parts of its spread."""


@dataclass(frozen=True)
class Sensor:
    """An analog sensor: noise in parts of the RMS of its column, step of its converter in the unit of the column, and
    the standard deviations of its gain and of its offset, 0 where they are known."""

    noise: float = 0.01
    resolution: float = 0.0
    gain: float = 0.0
    offset: float = 0.0


@dataclass(frozen=True)
class RecordedRun:
    """A recording, and what is known of it.

    `values` are the known values of inputs and parameters of the system by full name, such as those of an empty
    machine; those of inputs may be `chainunit.system.Profile`, such as a reference that is shaken. `added` is what
    was added to a parameter. `crank_speed` is that with which the simulation begins [rad/s], and `off` the time of
    the recording at which the motor is switched off [s].
    """

    name: str
    recording: Recording
    crank_speed: float
    values: Mapping[str, Any] = field(default_factory=dict)
    added: Mapping[str, float] = field(default_factory=dict)
    ambient: float = 293.15
    off: float | None = None


@dataclass(frozen=True)
class Comparison:
    """Residuals of a column of a run, in standard deviations, shape (n,), and the derivatives of the simulated column
    by the unknowns at the `places`, shape (n, places). `angle` is the simulated crank angle at the rows [rad], shape
    (n,), `size` the standard deviation in the unit of the column, and `rows` tells, of each row of the recording,
    whether it is compared; None for marks."""

    run: str
    column: str
    residuals: Any
    slopes: Any
    places: Sequence[int]
    angle: Any
    size: float
    rows: Any = None


class Interpolated(NamedTuple):
    """A simulated quantity, shape (n,), with its derivatives by the unknowns, shape (n, names), and by time."""

    values: Any
    slopes: Any
    rate: Any


class ShownColumn(NamedTuple):
    """A simulated column as its sensor shows it, shape (n,), with its slopes, shape (n, names); by name, its
    derivatives by clock and sensor, and the standard deviation `size` of the measured column."""

    values: Any
    slopes: Any
    further: dict[str, Any]
    size: float


class SimulatedRun:
    """A simulated `run`, with derivatives by the unknowns `names`, each integrated for a change of its size."""

    def __init__(self, run: RecordedRun, response: Response, names: Sequence[str], sizes: Any) -> None:
        self.run, self.response, self.names, self._sizes = run, response, tuple(names), sizes
        self._courses: dict[tuple[str, int], CubicSpline] = {}

    def interpolate(self, name: str, instants: Any, with_slopes: bool = True) -> Interpolated:
        """A simulated quantity at the times `instants` [s], shape (n,). Before the first and behind the last
        simulated time it stands."""
        from scipy.interpolate import CubicSpline

        response = self.response
        instants = np.clip(instants, response.time[0], response.time[-1])
        x, rate = np.empty(len(instants)), np.empty(len(instants))
        slopes = np.empty((len(instants), len(self.names) if with_slopes else 0))
        for rows in response.pieces:
            time = response.time[rows]
            here = instants >= time[0]
            if (name, rows.start) not in self._courses:
                self._courses[name, rows.start] = CubicSpline(time, response.values[name][rows])
            course, inside = self._courses[name, rows.start], instants[here]
            x[here], rate[here] = course(inside), course(inside, 1)
            for k in range(slopes.shape[1]):
                slopes[here, k] = np.interp(inside, time, response.slopes[name][k, rows]) / self._sizes[k]
        return Interpolated(x, slopes, rate)


class Problem:
    """Runs of one machine, and the numbers that are sought.

    Parameters
    ----------
    plant : what was recorded; its `by` are the names of `sought`
    runs : the recordings; those after whose switch the machine comes to rest are taken until then
    sought : the unknown parameters and inputs of the system, by full name
    sensors : by measured quantity; all others have the usual noise
    """

    def __init__(
        self,
        plant: AnyPlant,
        runs: Sequence[RecordedRun],
        sought: Sequence[Unknown],
        sensors: Mapping[str, Sensor],
    ) -> None:
        self.plant, self.sought = plant, tuple(sought)
        self.runs = tuple(until_rest(run, plant.ratio) for run in runs)
        self.sensors = {name: sensors.get(name, Sensor()) for run in runs for name in run.recording.columns}
        self.unknowns = (
            *self.sought,
            *self._sensor_unknowns(),
            *(u for run in self.runs for u in self._run_unknowns(run)),
        )
        self.place = {unknown.name: k for k, unknown in enumerate(self.unknowns)}

    @property
    def start_values(self) -> Any:
        """The start values, shape (unknowns,)."""
        return np.array([u.start for u in self.unknowns])

    @property
    def speed_gain(self) -> float:
        """The largest standard deviation of the gain of a sensor of speed [1]."""
        return max((self.sensors[name].gain for name in SPEEDS if name in self.sensors), default=0.0)

    @property
    def prior_deviations(self) -> Any:
        """The standard deviations of the priors, shape (unknowns,)."""
        return np.array([u.prior_deviation for u in self.unknowns])

    @cached_property
    def bounds(self) -> tuple[Any, Any]:
        """Lower and upper bounds, each of shape (unknowns,)."""
        return np.array([u.low for u in self.unknowns]), np.array([u.high for u in self.unknowns])

    def _sensor_unknowns(self) -> Iterator[Unknown]:
        """What the runs have in common: the gains of sensors, and the angle of the mark."""
        for name, sensor in self.sensors.items():
            if sensor.gain:
                yield _nuisance(f"gain({name})", "1", 1.0, sensor.gain)
        if "mark" in self.sensors:
            # the mark is near the crank angle 0, at most a twentieth of a turn beside it
            yield _nuisance(MARK_ANGLE, "rad", 0.0, 0.2)

    def _run_unknowns(self, run: RecordedRun) -> Iterator[Unknown]:
        """The unknowns of one run: what the plant needs, drift and start of its count, and the offsets of its
        sensors."""
        columns = run.recording.columns
        for nuisance in self._nuisances(run):
            yield Unknown(
                f"{run.name}.{nuisance.name}",
                nuisance.unit,
                nuisance.start,
                nuisance.low,
                math.inf,
                nuisance.prior_deviation,
                is_nuisance=True,
            )
        if "mark" in columns or "motor.count" in columns:
            yield _nuisance(f"{run.name}.drift", "1", 0.0, 5e-5)
        if "motor.count" in columns:
            yield _nuisance(f"{run.name}.count", "1", 0.0, 3.0)
            if self.plant.may_advance:
                yield from (_nuisance(f"{run.name}.count.{k}", "1", 0.0, ADVANCE) for k in ADVANCE_ORDERS)
        for name in columns:
            if MEASURANDS[name].analog and self.sensors[name].offset:
                yield _nuisance(
                    f"{run.name}.offset({name})", MEASURANDS[name].unit, 0.0, self.sensors[name].offset
                )

    def _nuisances(self, run: RecordedRun) -> Iterator[Nuisance]:
        """What the plant needs of a run."""
        time, speed, passed = run.recording.time, mean_speed(run, self.plant.ratio), mark_times(run.recording)
        angle = -speed * float(passed[0] - time[0]) if len(passed) else 0.0
        overview = Overview(angle, speed, run.ambient, float(time[0]), float(time[-1]), run.off)
        return self.plant.nuisances(overview)

    def initial_point(self, workers: int = 2) -> Any:
        """The start values, shape (unknowns,), with the crank angle of each run without marks at which the course of
        its analog columns is most like the simulated one."""
        z = self.start_values
        for run in self.runs:
            if not len(mark_times(run.recording)):
                turns = TURNS * 2.0 * math.pi / run.crank_speed
                end = float(run.recording.time[0]) + turns
                first, value = replace(run, recording=run.recording.part(end=end)), self._values(z)
                angles = np.arange(ANGLES) * (2.0 * math.pi / ANGLES)
                name = f"{run.name}.{ANGLE}"
                z[self.place[name]] = max(
                    angles,
                    key=lambda angle: self._likeness(first, value | {name: angle}, workers),
                )
        return z

    def _likeness(self, run: RecordedRun, value: Mapping[str, float], workers: int) -> float:
        """The sum of the correlations of measured and simulated columns."""
        response = self.plant.respond(self._scenario(run, value), {}, workers)
        return sum(likeness(run.recording, name, response) for name in run.recording.columns)

    def thinned(self, step: float) -> Problem:
        """The problem with rows at this distance in time [s], or at its own if that is longer. A mark stands in the
        first row behind it."""
        runs = []
        for run in self.runs:
            recording, every = run.recording, max(1, round(step / run.recording.step))
            begins = np.arange(0, len(recording.time), every)
            columns = {
                name: np.maximum.reduceat(x, begins) if name == "mark" else x[begins]
                for name, x in recording.columns.items()
            }
            runs.append(
                replace(
                    run,
                    recording=Recording(recording.source, recording.time[begins], columns, recording.heads),
                )
            )
        return Problem(self.plant, runs, self.sought, self.sensors)

    @cached_property
    def needs_simulation(self) -> Any:
        """Whether a change of the unknown needs another simulation, shape (unknowns,). The others are those of clocks
        and sensors."""
        nuisances = {f"{run.name}.{nuisance.name}" for run in self.runs for nuisance in self._nuisances(run)}
        return np.array([not u.is_nuisance or u.name in nuisances for u in self.unknowns])

    def comparisons(self, z: Any, workers: int = 2) -> Iterator[Comparison]:
        """The comparisons of all runs with the values `z` of the unknowns, shape (unknowns,)."""
        yield from self.compare(self.simulate_all(z, workers), z)

    def simulate_all(self, z: Any, workers: int = 2) -> list[SimulatedRun]:
        """All runs, simulated with the values `z` of the unknowns, shape (unknowns,)."""
        return [self._simulate(run, self._values(z), workers) for run in self.runs]

    def compare(
        self, simulations: Iterable[SimulatedRun], z: Any, with_slopes: bool = True
    ) -> Iterator[Comparison]:
        """The comparisons of simulated runs with the values `z` of clocks and sensors; without slopes, with the
        derivatives by clocks and sensors alone."""
        value = self._values(z)
        for simulation in simulations:
            yield from self._compare_columns(simulation, value, with_slopes)

    def _values(self, z: Any) -> dict[str, float]:
        return {u.name: float(x) for u, x in zip(self.unknowns, z, strict=True)}

    def _scenario(self, run: RecordedRun, value: Mapping[str, float]) -> Scenario:
        """How the run goes with these values of the unknowns."""
        recording = run.recording
        begin, end = float(recording.time[0]), float(recording.time[-1])
        # the clock of the logger may be wrong by a ten-thousandth
        ahead = self._simulation_times(run, np.array([end]), value)[0][0] - end
        part = AHEAD if "motor.count" in recording.columns else 1e-3
        margin = 2.0 * recording.step + part * (end - begin) + max(0.0, float(ahead))
        return Scenario(
            {u.name: value[u.name] + run.added.get(u.name, 0.0) for u in self.sought} | dict(run.values),
            {nuisance.name: value[f"{run.name}.{nuisance.name}"] for nuisance in self._nuisances(run)},
            run.crank_speed,
            begin,
            end + margin,
            STEP,
            self._simulation_times(run, np.union1d(recording.time, mark_times(recording)), value)[0],
            run.off,
        )

    def _simulate(self, run: RecordedRun, value: Mapping[str, float], workers: int) -> SimulatedRun:
        """The run with the unknowns at these values by name, and its changes with each unknown that the run does not
        fix, and with each nuisance of the run."""
        free = [u for u in self.sought if u.name not in run.values]
        directions = {u.name: (u.name, _CHANGE * u.prior_deviation) for u in free}
        directions |= {
            f"{run.name}.{nuisance.name}": (nuisance.name, nuisance.change)
            for nuisance in self._nuisances(run)
        }
        response = self.plant.respond(self._scenario(run, value), directions, workers)
        return SimulatedRun(run, response, list(directions), [size for _, size in directions.values()])

    def simulate(self, run: RecordedRun, z: Any, workers: int = 2) -> Response:
        """The course of a run with these values of the unknowns, shape (unknowns,), without derivatives."""
        return self.plant.respond(self._scenario(run, self._values(z)), {}, workers)

    def _simulation_times(
        self, run: RecordedRun, instants: Any, value: Mapping[str, float]
    ) -> tuple[Any, dict[str, Any]]:
        """The times of the simulation that belong to times of the logger, and their derivatives by unknowns."""
        begin, end = float(run.recording.time[0]), float(run.recording.time[-1])
        since = instants - begin
        rates = {f"{run.name}.drift": since}
        part, counts = since / (end - begin), run.crank_speed * self.plant.ratio * COUNTS / (2.0 * math.pi)
        rates |= {f"{run.name}.count.{k}": part**k / counts for k in ADVANCE_ORDERS}
        rates = {name: rate for name, rate in rates.items() if name in self.place}
        return instants + sum(value[name] * rate for name, rate in rates.items()), rates

    def _compare_columns(
        self, simulation: SimulatedRun, value: Mapping[str, float], with_slopes: bool
    ) -> Iterator[Comparison]:
        """The comparisons of measured and simulated values, column by column, at the rows that the plant describes:
        the residuals in parts of the size of the column, and, `with_slopes`, their derivatives by the unknowns."""
        run, response = simulation.run, simulation.response
        recording, names = run.recording, simulation.names if with_slopes else ()
        time, rates = self._simulation_times(run, recording.time, value)
        angle = np.interp(time, response.time, response.values[CRANK])
        for name, y in recording.columns.items():
            if name == "mark":
                yield from self._compare_marks(simulation, value, with_slopes)
                continue
            x, slopes, rate = simulation.interpolate(name, time, with_slopes)
            by_clock = {key: rate * slope for key, slope in rates.items()}
            shown = self._count if name == "motor.count" else self._sensor
            x, slopes, further, size = shown(run, name, x, slopes, by_clock, value)
            rows = response.describes(name, recording.time)
            if rows.any():
                further = {key: slope[rows] for key, slope in further.items()}
                residuals = (y - x)[rows] / size
                yield self._comparison(
                    run, name, residuals, slopes[rows] / size, names, further, angle[rows], size, rows
                )

    def _compare_marks(
        self, simulation: SimulatedRun, value: Mapping[str, float], with_slopes: bool
    ) -> Iterator[Comparison]:
        """The crank angles at which the mark is passed, where it is passed twice or more."""
        run, recording = simulation.run, simulation.run.recording
        passed = mark_times(recording)
        passed = passed[simulation.response.describes("mark", passed)]
        if len(passed) < 2:
            return
        instants, rates = self._simulation_times(run, passed, value)
        x, slopes, rate = simulation.interpolate(CRANK, instants, with_slopes)
        size = mean_speed(run, self.plant.ratio) * recording.step / math.sqrt(12.0)
        off = (x - value[MARK_ANGLE] + math.pi) % (2.0 * math.pi) - math.pi
        further = {key: rate * slope for key, slope in rates.items()} | {MARK_ANGLE: -np.ones(len(x))}
        names = simulation.names if with_slopes else ()
        yield self._comparison(run, "mark", -off / size, slopes / size, names, further, x, size)

    def _count(
        self,
        run: RecordedRun,
        name: str,
        x: Any,
        slopes: Any,
        further: dict[str, Any],
        value: Mapping[str, float],
    ) -> ShownColumn:
        """The simulated column `x` with its slopes as an encoder counts it from the first row on, rounded down."""
        y, time = run.recording.columns[name], run.recording.time
        size = math.hypot(math.sqrt(1.0 / 12.0), JITTER * float(np.sum(np.abs(np.diff(y)))) / np.ptp(time))
        start = f"{run.name}.count"
        return ShownColumn(
            x - x[0] + value[start] - 0.5, slopes - slopes[0], further | {start: np.ones(len(x))}, size
        )

    def _sensor(
        self,
        run: RecordedRun,
        name: str,
        x: Any,
        slopes: Any,
        further: dict[str, Any],
        value: Mapping[str, float],
    ) -> ShownColumn:
        """The same as an analog sensor shows it, with its gain and its offset."""
        sensor, gain, offset = self.sensors[name], f"gain({name})", f"{run.name}.offset({name})"
        size = math.hypot(
            sensor.noise * rms(run.recording.columns[name]), sensor.resolution / math.sqrt(12.0)
        )
        if gain in self.place:
            further = {key: slope * value[gain] for key, slope in further.items()} | {gain: x}
            x, slopes = x * value[gain], slopes * value[gain]
        if offset in self.place:
            further = further | {offset: np.ones(len(x))}
            x = x + value[offset]
        return ShownColumn(x, slopes, further, size)

    def _comparison(
        self, run: RecordedRun, column: str, residuals: Any, slopes: Any, names: Sequence[str],
        further: Mapping[str, Any], angle: Any, size: float, rows: Any = None,
    ) -> Comparison:  # fmt: skip
        """The residuals with the derivatives by all unknowns."""
        columns = [slopes, *(np.reshape(x, (-1, 1)) / size for x in further.values())]
        places = [self.place[name] for name in (*names, *further)]
        return Comparison(run.name, column, residuals, np.hstack(columns), places, angle, size, rows)


def likeness(recording: Recording, name: str, response: Response) -> float:
    """The correlation of a measured analog column with the simulated one, where that is described; 0 where one of
    them is constant, and for a column that is counted."""
    if not MEASURANDS[name].analog:
        return 0.0
    rows = response.describes(name, recording.time)
    y, time = recording.columns[name][rows], recording.time[rows]
    x = np.interp(time, response.time, response.values[name])
    return float(np.corrcoef(y, x)[0, 1]) if len(y) and np.ptp(y) and np.ptp(x) else 0.0


def _nuisance(name: str, unit: str, start: float, spread: float) -> Unknown:
    return Unknown(name, unit, start, -math.inf, math.inf, spread, is_nuisance=True)


def mark_times(recording: Recording) -> Any:
    """The times at which the crank passed the mark: half a row before the rows that say so."""
    if "mark" not in recording.columns:
        return np.zeros(0)
    return recording.time[recording.columns["mark"] > 0.5] - 0.5 * recording.step


def speed_column(recording: Recording) -> str:
    """The column that tells the speed; empty without one."""
    return next((name for name in SPEEDS if name in recording.columns), "")


def measured_speed(recording: Recording, ratio: float) -> Any:
    """The speed of the crank at the rows [rad/s], shape (n,), by a column of it or of the motor's speed; None without
    one."""
    name = speed_column(recording)
    if not name:
        return None
    return recording.columns[name] / (ratio if name == "motor.w" else 1.0)


def until_rest(run: RecordedRun, ratio: float) -> RecordedRun:
    """A run whose motor is switched off, until the machine has come to rest: friction that is smoothed lets it creep,
    where a real one sticks. A run without a column of the speed or an encoder stays as it is."""
    from scipy.ndimage import uniform_filter1d

    recording, columns = run.recording, run.recording.columns
    if run.off is None or not {"crank.w", "motor.w", "motor.count"} & columns.keys():
        return run
    speed = measured_speed(recording, ratio)
    if speed is None:
        speed = np.gradient(columns["motor.count"], recording.time) * (2.0 * math.pi / COUNTS / ratio)
    smooth = uniform_filter1d(speed, max(1, round(SMOOTHED / recording.step)))
    swings = recording.time[np.abs(smooth) > STANDING * run.crank_speed]
    rest = float(swings[-1]) if len(swings) else -math.inf
    return replace(run, recording=recording.part(end=max(rest, run.off)))


def mean_speed(run: RecordedRun, ratio: float) -> float:
    """Mean speed of the crank before the motor is switched off [rad/s]: by the marks where there are two, by the
    count of an encoder, or by the measured speed. `ratio` are the turns of the motor in a turn of the crank."""
    recording = run.recording.part(end=math.inf if run.off is None else run.off)
    passed, columns = mark_times(recording), recording.columns
    if len(passed) > 1:
        turn = np.median(np.diff(passed))
        turns = np.round((passed[-1] - passed[0]) / turn)
        return float(2.0 * math.pi * turns / (passed[-1] - passed[0]))
    if "motor.count" in columns:
        turns = np.ptp(columns["motor.count"]) / (COUNTS * ratio)
        return float(2.0 * math.pi * turns / np.ptp(recording.time))
    speed = measured_speed(recording, ratio)
    return run.crank_speed if speed is None else float(np.mean(speed))
