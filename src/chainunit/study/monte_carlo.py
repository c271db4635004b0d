"""Overloads at random sides, crank angles, times and sizes, in batches of runs (see `chainunit.runner`).

Each run branches from the same steady state and is determined by the study and its own number alone. The runs
are a Zarr store, ``monte_carlo_<study>.zarr``, where <study> is a digest of everything on which they depend. A
study that was killed goes on from it, and never uses the runs of another study.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import __version__
from ..ending import remove_folder, temporary_folder
from ..errors import InputError, InterruptedRunError, RunError, printable
from ..job import Job, ResultVariable, texts
from ..machines.chain_unit import SIDES, SideName
from ..progress import Report
from ..quantities import Layout, Value, declaration, quantity, variables
from ..runner import check_scheduler
from ..runner import run as run_job
from ..system import Simulation
from ..text import entry
from .config import Config
from .drive import Drive
from .event import AnySide, Event
from .event_table import RandomEvent
from .measures import MEASURES, read_measure, same_measure
from .quantiles import CONFIDENCE, Estimate, quantile, runs_needed, share
from .rig import Rig
from .window import Phase, Window

if TYPE_CHECKING:
    import xarray as xr


@declaration
class Sample:
    """One run: its event and its results."""

    crank_angle: Value = quantity("rad", "crank angle at which the event begins")
    event: Value = quantity("s", "time at which the event begins")
    trip_torque: Value = quantity("N.m", "crank torque at which the safety coupling opens in this run")
    crank_torque_peak: Value = same_measure("crank_torque_peak")
    motor_torque_peak: Value = same_measure("motor_torque_peak")
    current_peak: Value = same_measure("current_peak")
    rocker_torque_peak: Value = same_measure("rocker_torque_peak")
    speed_least: Value = same_measure("speed_least")
    stalls: Value = quantity("1", "1 where the crank stands at the end of the run")
    trips: Value = quantity("1", "1 where the safety coupling opens")


BATCH = 16
"""Number of runs in a batch: a second or two of work, which a kill loses."""
_LETTERS = 300
_NO_SIDE = "none"
QUANTILES = (0.05, 0.5, 0.95, 0.99)


@dataclass(frozen=True)
class Task:
    """The data that a worker needs: the study, its drive, the FMUs, the time of the steady state [s]."""

    config: Config
    drive: Drive
    files: Mapping[str, Path]
    steady: float
    fed_from: float | None = None
    """time at which a machine that starts empty was fed [s]"""

    @property
    def rig(self) -> Rig:
        """The drive on its co-simulation."""
        return Rig(self.config, self.drive, self.files, fed_from=self.fed_from)

    def digest(self) -> str:
        """A digest of everything on which the results depend: every parameter, and the content of the
        FMUs."""
        config, drive = self.config, self.drive
        relevant = {
            "chainunit": __version__,
            "simulation": config.simulation,
            "connections": drive.graph.connections,
            "start": drive.graph.values,
            "feed": asdict(config.feed),
            "run": asdict(config.run),
            "event": config.random.as_dict(),
            "monte_carlo": {k: v for k, v in asdict(config.monte_carlo).items() if k != "runs"},
            "coupling": asdict(config.coupling) if config.coupling else None,
            "steady": self.steady,
            "fed_from": self.fed_from,
        }
        content = hashlib.sha256(json.dumps(relevant, sort_keys=True).encode())
        for name in sorted(self.files):
            content.update(Path(self.files[name]).read_bytes())
        return content.hexdigest()[:12]


def result_variables(event: RandomEvent) -> list[ResultVariable]:
    """The results of a run: its side, the drawn quantities of its event, the sample, and the reason why it
    failed. The numbers of the sample are NaN where the run failed, where the machine has no such quantity, and,
    of the trip torque, without a coupling."""
    units = {v.name: v for v in variables(event.of.Parameters)}
    return [
        ResultVariable("side", "1", "side of the event", "int8", flags=(_NO_SIDE, *SIDES)),
        *(
            ResultVariable(f"drawn_{name}", units[name].unit, f"drawn: {units[name].description}")
            for name in event.ranges
        ),
        *(ResultVariable(v.name, v.unit, v.description) for v in Layout(Sample).variables),
        ResultVariable("failed", "1", "reason why an FMU failed; empty where none did", letters=_LETTERS),
    ]


@dataclass(frozen=True)
class Parcel:
    """A task with the content of its FMUs by their names: a worker on another machine does not have their
    files."""

    task: Task
    digest: str
    content: Mapping[str, bytes]

    @classmethod
    def of(cls, task: Task) -> Parcel:
        """The parcel of a task whose FMUs are files."""
        return cls(task, task.digest(), {name: Path(file).read_bytes() for name, file in task.files.items()})

    def start(self) -> Simulation:
        """The co-simulation of the task after the start-up, with its steady state saved."""
        folder = temporary_folder("chainunit_runs")
        try:
            files = {name: Path(folder, f"{name}.fmu") for name in self.content}
            for name, file in files.items():
                file.write_bytes(self.content[name])
            # it unpacks the FMUs
            simulation = replace(self.task, files=files).rig.from_rest()
        finally:
            remove_folder(folder)
        simulation.run(self.task.steady, self.task.rig.step)
        simulation.save()
        return simulation


_simulations: dict[str, Simulation] = {}
"""The co-simulation of this process, by the digest of its task."""


def _saved_simulation(parcel: Parcel) -> Simulation:
    if parcel.digest not in _simulations:
        close_simulation()
        _simulations[parcel.digest] = parcel.start()
    return _simulations[parcel.digest]


def close_simulation() -> None:
    """Close the co-simulation that `make_runs` keeps in this process."""
    while _simulations:
        _simulations.popitem()[1].close()


@dataclass(frozen=True)
class Draw:
    """The random quantities of one run."""

    event: Event
    values: dict[str, float]
    """values of the drawn quantities of the event, by name"""
    offset: float
    """time from the saved state to the event [s]"""
    trip_torque: float
    """trip torque at the crank [N m]; infinite without a coupling"""


def draw(config: Config, number: int) -> Draw:
    """The event of the run with that number. It is the same in every process, and in whatever order the runs
    are made."""
    random = np.random.default_rng([int(config.monte_carlo.seed), number])
    offset = random.uniform(0.0, config.turn)
    values = config.random.draw(random)
    spread = random.standard_normal()
    trip = (
        config.coupling.trip_torque * max(0.1, 1.0 + config.coupling.scatter * spread)
        if config.coupling
        else math.inf
    )
    side: AnySide = config.random.side
    if config.random.of.has_side and not side:
        side = SIDES[random.integers(len(SIDES))]
    return Draw(config.random.event(side, values), values, offset, trip)


def one(task: Task, number: int, simulation: Simulation) -> Sample:
    """Run the overload with that number from the saved steady state of the `simulation`."""
    config, drive, chance = task.config, task.drive, draw(task.config, number)
    run, trip = config.run, chance.trip_torque
    event = task.steady + chance.offset
    stop = event + config.monte_carlo.duration
    guards = {"motor.tau": trip / drive.ratio} if config.coupling else None
    series = task.rig.follow(simulation, chance.event, event, stop, guards=guards).run
    angle = float(np.interp(event, series["time"].values, drive.crank_motion(series)[0]))
    has_tripped = simulation.time < stop - 0.5 * run.step
    # from the saved state on, as the event may begin inside a step
    window = Window(Phase.EVENT, series, drive, (), run.crank_speed)
    stalls = not has_tripped and read_measure("stall_time", window) is not None
    return Sample(
        crank_angle=angle % (2.0 * math.pi),
        event=event,
        trip_torque=trip if config.coupling else None,
        **{each.name: read_measure(each.name, window) for each in fields(Sample) if each.name in MEASURES},
        stalls=float(stalls),
        trips=float(has_tripped),
    )


def make_runs(parcel: Parcel, begin: int, end: int) -> dict[str, Any]:
    """The results of the runs from number `begin` to `end` - 1, by the names of `result_variables`."""
    simulation = _saved_simulation(parcel)
    runs = [_result_of(parcel.task, number, simulation) for number in range(begin, end)]
    return {name: [run[name] for run in runs] for name in runs[0]}


def _result_of(task: Task, number: int, simulation: Simulation) -> dict[str, Any]:
    """The results of the run with that number."""
    chance, failed = draw(task.config, number), ""
    sample = dict.fromkeys(Layout(Sample).names)
    try:
        sample = Layout(Sample).by_name(one(task, number, simulation))
    except InterruptedRunError:
        raise
    except RunError as error:
        # a run that fails is a result, too; the next run starts from the saved state again
        failed = str(error) or type(error).__name__
    return {
        "side": np.int8((_NO_SIDE, *SIDES).index(chance.event.side or _NO_SIDE)),
        **{f"drawn_{name}": value for name, value in chance.values.items()},
        **{name: math.nan if value is None else float(value) for name, value in sample.items()},
        "failed": failed,
    }


@dataclass(frozen=True)
class MonteCarloResult:
    """The results of the runs, by the names of `result_variables`, over the dimension ``run``; and their store."""

    dataset: xr.Dataset
    file: Path
    earlier_runs: int = 0
    """number of runs that the store had before"""
    damaged_batches: int = 0
    """number of batches that were damaged in the store; their runs were computed anew"""

    @property
    def runs(self) -> int:
        """Number of runs."""
        return int(self.dataset.sizes["run"])

    def values(self, name: str) -> Sequence[float]:
        """The values of a result in the runs that have it."""
        values = self.dataset[name].values
        return [float(x) for x in values[~np.isnan(values)]]

    def quantiles(self) -> dict[str, dict[str, Estimate]]:
        """Quantiles of every answer, and shares of the runs that stall or trip, each with its interval. A
        quantile is left out where there are too few runs for its interval."""
        estimates_of: dict[str, dict[str, Estimate]] = {}
        for v in Layout(Sample).variables:
            values = self.values(v.name)
            if not values or v.name in ("event", "crank_angle"):
                continue
            if v.name in ("stalls", "trips"):
                estimates_of[v.name] = {"share": share(sum(x > 0.5 for x in values), len(values))}
                continue
            estimates = {f"q{100 * q:.0f}": quantile(values, q) for q in QUANTILES}
            estimates_of[v.name] = {name: each for name, each in estimates.items() if each is not None}
        return estimates_of

    @property
    def remark(self) -> str:
        """Words on the quantiles for which there are too few runs; empty where there are enough."""
        count = self.runs - self.failures
        omissions = [q for q in QUANTILES if count < runs_needed(q)]
        if not omissions:
            return ""
        each = ", ".join(f"the {100 * q:.0f} % quantile takes {runs_needed(q)}" for q in omissions)
        return f"{count} runs are too few for some quantiles: {each} (monte_carlo.runs)."

    @property
    def sides(self) -> dict[SideName, int]:
        """Number of runs by the side of the event; empty for an event without a side."""
        sides = self.dataset["side"].values
        return {side: int(np.sum(sides == k)) for k, side in enumerate(SIDES, 1) if np.any(sides)}

    @cached_property
    def reasons(self) -> dict[int, str]:
        """Why an FMU failed, by the number of the run."""
        return {k: words for k, words in enumerate(texts(self.dataset["failed"])) if words}

    @property
    def failures(self) -> int:
        """Number of runs in which an FMU failed."""
        return len(self.reasons)

    def as_dict(self) -> dict[str, Any]:
        """Ready for JSON, each number with its unit."""
        units, kinds = {v.name: v.unit for v in Layout(Sample).variables}, {"share": ("1", "percent")}
        return {
            "runs": entry(self.runs, "1"),
            "sides": {side: entry(runs, "1") for side, runs in self.sides.items()},
            "failed": entry(self.failures, "1"),
            "damaged_batches": entry(self.damaged_batches, "1"),
            "file": self.file.name,
            "quantiles": {
                name: {k: each.as_dict(*kinds.get(k, (units[name],))) for k, each in sizes.items()}
                for name, sizes in self.quantiles().items()
            },
            "confidence": entry(CONFIDENCE, "1", "percent"),
        }


def check_workers(config: Config, scheduler: str) -> None:
    """Refuse a scheduler that is not needed, or does not answer, before the runs that come first.

    Raises
    ------
    InputError
        see `chainunit.runner.check_scheduler`.
    """
    if not config.monte_carlo.runs:
        raise InputError(
            f"scheduler {printable(scheduler)}: is for random overloads, and this study has none (monte_carlo.runs); "
            "leave it out"
        )
    check_scheduler(scheduler)


def job_of(task: Task) -> Job:
    """The random overloads of a task, as work in batches."""
    parcel = Parcel.of(task)
    return Job(
        name="monte_carlo",
        title="overloads at random",
        points=int(task.config.monte_carlo.runs),
        batch=BATCH,
        variables=result_variables(task.config.random),
        work=make_runs,
        task=parcel,
        digest=parcel.digest,
        dimension="run",
        close=close_simulation,
    )


def run(
    task: Task, folder: Path, report: Report, workers: int | None = None, scheduler: str | None = None
) -> MonteCarloResult:
    """Make the missing runs of the task and write them to the store in `folder`; the other arguments and the errors
    are those of `chainunit.runner.run`."""
    outcome = run_job(job_of(task), folder, report, workers, scheduler)
    return MonteCarloResult(outcome.dataset, outcome.file, outcome.earlier_points, outcome.damaged_batches)
