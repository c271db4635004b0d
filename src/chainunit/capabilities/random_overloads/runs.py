"""Overloads at random sides, crank angles, times and sizes, in batches of runs (see `chainunit.work.runner`).

Each run branches from the same steady state and is determined by the study and its own number alone. The runs
are a NetCDF file, ``monte_carlo_<study>.nc``, where <study> is a digest of everything on which they depend. A
study that was killed goes on from it, and never uses the runs of another study.
"""

from __future__ import annotations

import hashlib
import json
import math
import weakref
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ... import __version__
from ...batch.transients import can_run
from ...core.files import scratch
from ...core.quantities import Value, declaration, quantity, variables
from ...machines.chain_unit import SIDES, SideName
from ...reading.results import Estimate, derived, part, result
from ...study.analysis import Analysis, Findings, Work
from ...study.arrays import Dataset
from ...study.block_runs import BlockRuns, EventRun, EventSimulation, RunPoint
from ...study.event import AnySide, Event
from ...study.event_table import RandomEvent
from ...study.limits import limit_reached
from ...study.measures import MEASURES, read_measure, same_measure
from ...study.operation import OperatingConditions
from ...study.quantiles import CONFIDENCE, quantile, runs_needed, share
from ...study.readings import crank_angle
from ...study.record import StudyRecord
from ...study.remark import fault, note, warning
from ...study.rig import Rig
from ...study.window import Phase, Window
from ...work.job import Job, ResultVariable, made_anew
from ...work.progress import TaskProgress
from ...work.runner import run as run_job
from .table import RandomPlan

OUTCOMES = {"trips": "the torque limiter opens", "stalls": "the {driver} stands at the end"}
"""By switch of a run, the words on a run that ends so badly."""
ENDS = {"stalls": f"{OUTCOMES['stalls']} of the run", "trips": OUTCOMES["trips"]}
"""By switch of a run, its meaning."""


@declaration
class Sample:
    """One run: its event and its results."""

    crank_angle: Value = quantity("rad", "{driver} angle at which the event begins")
    event: Value = quantity("s", "time at which the event begins")
    trip_torque: Value = quantity("N.m", "{driver} torque at which the torque limiter opens in this run")
    crank_torque_peak: Value = same_measure("crank_torque_peak")
    motor_torque_peak: Value = same_measure("motor_torque_peak")
    current_peak: Value = same_measure("current_peak")
    rocker_torque_peak: Value = same_measure("rocker_torque_peak")
    speed_least: Value = same_measure("speed_least")
    stalls: Value = quantity("1", f"1 where {ENDS['stalls']}")
    trips: Value = quantity("1", f"1 where {ENDS['trips']}")


BATCH, COSIMULATED_BATCH = 512, 16
"""Numbers of runs in a batch, on the compiled system and by co-simulation: a second or two of work, which a kill
loses."""
_IN_PROCESS = 8
"""Most batches on the compiled system that are made without other processes, whose start takes longer."""
_LETTERS = 300
_NO_SIDE = "none"
QUANTILES = (0.05, 0.5, 0.95, 0.99)


@dataclass(frozen=True)
class RandomTask:
    """The data that a worker needs: the plan of the runs, the drive with its FMUs, the time of the steady state [s].

    The runs are made on the compiled system; without a loop for it (`chainunit.batch.transients.can_run`), or if they
    are to be `cosimulated`, by the co-simulation of the FMUs.
    """

    plan: RandomPlan
    rig: Rig
    steady: float
    cosimulated: bool = False

    @property
    def is_compiled(self) -> bool:
        """Whether the runs are made on the compiled system."""
        return not self.cosimulated and can_run()

    @property
    def files(self) -> Mapping[str, Path]:
        """The FMUs by component."""
        return self.rig.files or {}

    @property
    def method(self) -> str:
        """How the runs are made: "compiled", on the compiled system, or by the FMUs as the key `simulation` says."""
        return "compiled" if self.is_compiled else self.rig.operation.simulation

    def digest(self, block: BlockRuns | None = None) -> str:
        """A digest of everything on which the results depend: every parameter, and the code of the compiled system or
        the content of the FMUs. The compiled system is built unless its `block` is given."""
        plan, operation, graph = self.plan, self.rig.operation, self.rig.graph
        relevant = {
            "chainunit": __version__,
            "simulation": operation.simulation,
            "connections": graph.connections,
            "start": graph.values,
            "feed": asdict(operation.feed),
            "run": asdict(operation.run),
            "event": plan.event.identity(),
            "monte_carlo": {"duration": plan.duration, "seed": plan.seed},
            "coupling": asdict(operation.coupling) if operation.coupling else None,
            "steady": self.steady,
            "fed_from": self.rig.fed_from,
        }
        content = hashlib.sha256(json.dumps(relevant, sort_keys=True).encode())
        if self.is_compiled:
            content.update((block or self.block()).loop.digest.encode())
        else:
            for name in sorted(self.files):
                content.update(Path(self.files[name]).read_bytes())
        return content.hexdigest()[:12]

    def block(self, states: Any = None) -> BlockRuns:
        """The compiled system in its steady state, with these `states` if they are known."""
        return BlockRuns(self.rig, self.plan.event.hardest(), start=self.steady, states=states)


def result_variables(event: RandomEvent) -> list[ResultVariable]:
    """The results of a run: its side, the drawn quantities of its event, the sample, and the reason why the run
    failed. The numbers of the sample are NaN where the run failed, where the machine has no such quantity, and,
    of the trip torque, without a coupling."""
    units = {v.name: v for v in variables(event.of.Parameters)}
    return [
        ResultVariable("side", "1", "side of the event", "int8", flags=(_NO_SIDE, *SIDES)),
        *(
            ResultVariable(f"drawn_{name}", units[name].unit, f"drawn: {units[name].description}")
            for name in event.ranges
        ),
        *(ResultVariable(v.name, v.unit, v.description) for v in variables(Sample)),
        ResultVariable("failed", "1", "reason why the run failed; empty where it did not", letters=_LETTERS),
    ]


@dataclass(frozen=True)
class Parcel:
    """A task as it goes to a worker, which may be on another machine: with the steady states of the compiled system,
    or with the content of its FMUs by their names."""

    task: RandomTask
    digest: str
    content: Mapping[str, bytes]
    states: Any = None

    @classmethod
    def of(cls, task: RandomTask) -> Parcel:
        """The parcel of a task whose FMUs are files."""
        if task.is_compiled:
            block = task.block()
            return cls(replace(task, rig=replace(task.rig, files={})), task.digest(block), {}, block.states)
        return cls(task, task.digest(), {name: Path(file).read_bytes() for name, file in task.files.items()})

    @cached_property
    def system(self) -> BlockRuns | EventSimulation:
        """The system of the task in its steady state, which is closed when the parcel goes; a worker keeps the parcel
        of its last job."""
        if self.states is not None:
            return self.task.block(self.states)
        with scratch() as folder:
            files = {name: folder / f"{name}.fmu" for name in self.content}
            for name, file in files.items():
                file.write_bytes(self.content[name])
            # it unpacks the FMUs
            simulation = EventSimulation(replace(self.task.rig, files=files), self.task.steady)
        weakref.finalize(self, simulation.close)
        return simulation


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


def draw(plan: RandomPlan, operation: OperatingConditions, number: int) -> Draw:
    """The event of the run with that number. It is the same in every process, and in whatever order the runs
    are made."""
    event, coupling = plan.event, operation.coupling
    random = np.random.default_rng([plan.seed, number])
    offset = random.uniform(0.0, operation.turn)
    values = event.draw(random)
    spread = random.standard_normal()
    trip = coupling.trip_torque * max(0.1, 1.0 + coupling.scatter * spread) if coupling else math.inf
    side: AnySide = event.side
    if event.of.has_side and not side:
        side = SIDES[random.integers(len(SIDES))]
    return Draw(event.event(side, values), values, offset, trip)


def point(rig: Rig, chance: Draw, duration: float) -> RunPoint:
    """The run of a rig with these random quantities, for the `duration` [s] from the event on."""
    return RunPoint(rig, chance.event, duration, chance.offset, rig.drive.at_port(chance.trip_torque))


def sample(task: RandomTask, chance: Draw, run: EventRun) -> Sample:
    """The results of a run that did not fail."""
    assert run.series is not None
    operation, drive, begin = task.rig.operation, task.rig.drive, task.steady + chance.offset
    angle = float(np.interp(begin, run.series["time"].values, crank_angle(drive, run.series)))
    # from the saved state on, as the event may begin inside a step
    window = Window(Phase.EVENT, run.series, drive, (), operation.crank_speed)
    stalls = not run.ended and read_measure("stall_time", window) is not None
    return Sample(
        crank_angle=angle % (2.0 * math.pi),
        event=begin,
        trip_torque=chance.trip_torque if operation.coupling else None,
        **{
            answer.name: read_measure(answer.name, window)
            for answer in fields(Sample)
            if answer.name in MEASURES
        },
        stalls=float(stalls),
        trips=float(run.ended),
    )


def make_runs(parcel: Parcel, begin: int, end: int) -> dict[str, Any]:
    """The results of the runs from number `begin` to `end` - 1, by the names of `result_variables`."""
    task = parcel.task
    chances = [draw(task.plan, task.rig.operation, number) for number in range(begin, end)]
    points = [point(parcel.system.rig, chance, task.plan.duration) for chance in chances]
    # a run that fails is a result, too
    faults, samples = [], []
    for chance, run in zip(chances, parcel.system.runs(points), strict=True):
        faults.append("" if run.fault is None else str(run.fault))
        samples.append(None if run.fault else sample(task, chance, run))
    return {
        "side": np.array(
            [(_NO_SIDE, *SIDES).index(chance.event.side or _NO_SIDE) for chance in chances], np.int8
        ),
        **{f"drawn_{name}": [chance.values[name] for chance in chances] for name in task.plan.event.ranges},
        **{v.name: np.array([getattr(x, v.name, None) for x in samples], float) for v in variables(Sample)},
        "failed": faults,
    }


_SHARE = {("1", "percent"): "share"}
_OUTCOMES = {
    "trips": warning(
        "random-overload-trips",
        f"Overloads at random: in {{share}} of them {OUTCOMES['trips']}.",
        sizes=_SHARE,
    ),
    "stalls": fault(
        "random-overload-stalls",
        f"Overloads at random: in {{share}} of them {OUTCOMES['stalls']}.",
        sizes=_SHARE,
    ),
}
_TOO_FEW = note("too-few-runs", "Overloads at random: {text}")
_AT_LIMIT = note(
    "random-overloads-at-current-limit",
    "Overloads at random: the largest currents are at their limit of {limit}. A harder overload does not raise "
    "them.",
    sizes={"A": "limit"},
)
_MADE_ANEW = note("runs-made-anew", "Overloads at random: {text}.")


@result
class MonteCarloResult(Findings):
    """The results of the runs, by the names of `result_variables`, over the dimension ``run``; and their store."""

    dataset: Dataset
    file: Path
    method: str = part("how the runs are made: compiled, or by the FMUs as cs or me")
    earlier_runs: int = 0
    """number of runs that the store had before"""
    damaged_batches: int = part(
        "number of batches that were damaged in the store; their runs were computed anew", unit="1", default=0
    )

    @property
    def store(self) -> Path:
        """The store of the runs."""
        return self.file

    @derived(name="file")
    def file_name(self) -> str:
        """Name of the store of the runs."""
        return self.file.name

    @derived("1", "percent")
    def confidence(self) -> float:
        """Confidence of the intervals."""
        return CONFIDENCE

    @derived("1")
    def runs(self) -> int:
        """Number of runs."""
        return int(self.dataset.sizes["run"])

    def values(self, name: str) -> Sequence[float]:
        """The values of a result in the runs that have it."""
        values = self.dataset[name].values
        return [float(x) for x in values[~np.isnan(values)]]

    @derived()
    def quantiles(self) -> dict[str, dict[str, Estimate]]:
        """Quantiles of every answer, and shares of the runs that stall or trip, each with its interval. A
        quantile is left out where there are too few runs for its interval."""
        results: dict[str, dict[str, Estimate]] = {}
        for v in variables(Sample):
            values = self.values(v.name)
            if not values or v.name in ("event", "crank_angle"):
                continue
            if v.name in ENDS:
                of_runs = share(sum(x > 0.5 for x in values), len(values))
                results[v.name] = {"share": replace(of_runs, unit="1", kind="percent")}
            else:
                sizes = ((f"q{100 * q:.0f}", quantile(values, q)) for q in QUANTILES)
                results[v.name] = {name: replace(x, unit=v.unit) for name, x in sizes if x is not None}
        return results

    def remark(self, study: StudyRecord) -> None:
        """Warn of runs that end badly, and note what limits the numbers."""
        shares = self.quantiles
        for name, code in _OUTCOMES.items():
            if name in shares and shares[name]["share"].value > 0.0:
                study.findings.say(code, share=shares[name]["share"].value)
        if self.shortage:
            study.findings.say(_TOO_FEW, text=self.shortage)
        currents = (estimate.value for estimate in shares.get("current_peak", {}).values())
        if (limit := limit_reached(study.setup.drive, currents)) is not None:
            study.findings.say(_AT_LIMIT, limit=limit)
        if self.damaged_batches:
            study.findings.say(_MADE_ANEW, text=made_anew(self.damaged_batches, "runs", self.file_name))

    @property
    def shortage(self) -> str:
        """Words on the quantiles for which there are too few runs; empty where there are enough."""
        count = self.runs - self.failures
        needed = ((q, runs_needed(q)) for q in QUANTILES)
        lacks = ", ".join(f"the {100 * q:.0f} % quantile takes {runs}" for q, runs in needed if count < runs)
        return lacks and f"{count} runs are too few for some quantiles: {lacks} (monte_carlo.runs)."

    @derived("1")
    def sides(self) -> dict[SideName, int]:
        """Number of runs by the side of the event; empty for an event without a side."""
        sides = self.dataset["side"].values
        return {side: int(np.sum(sides == k)) for k, side in enumerate(SIDES, 1)} if np.any(sides) else {}

    @cached_property
    def reasons(self) -> dict[int, str]:
        """Why a run failed, by its number."""
        return {k: reason for k, reason in enumerate(self.dataset["failed"].values.tolist()) if reason}

    @derived("1", name="failed")
    def failures(self) -> int:
        """Number of runs that failed."""
        return len(self.reasons)


def job_of(task: RandomTask) -> Job:
    """The random overloads of a task, as work in batches."""
    parcel = Parcel.of(task)
    return Job(
        name="monte_carlo",
        title="overloads at random",
        points=task.plan.runs,
        batch=BATCH if task.is_compiled else COSIMULATED_BATCH,
        variables=result_variables(task.plan.event),
        work=make_runs,
        task=parcel,
        digest=parcel.digest,
        dimension="run",
    )


def run(
    task: RandomTask,
    folder: Path,
    progress: TaskProgress,
    workers: int | None = None,
    scheduler: str | None = None,
) -> MonteCarloResult:
    """Make the missing runs of the task and write them to the store in `folder`; the other arguments and the errors
    are those of `chainunit.work.runner.run`."""
    job = job_of(task)
    if workers is None and scheduler is None and task.is_compiled and job.points <= _IN_PROCESS * BATCH:
        workers = 1
    store = run_job(job, folder, progress, workers, scheduler)
    return MonteCarloResult(
        store.dataset, store.file, task.method, store.earlier_points, store.damaged_batches
    )


class RandomAnalysis(Analysis):
    """The runs of the table [monte_carlo]."""

    name = "monte_carlo"
    needs_runs = True
    applies = staticmethod(lambda drive, plans: bool(plans["random_overloads"].runs))

    @staticmethod
    def find(study: StudyRecord, work: Work) -> MonteCarloResult:
        """Make the missing runs, and write them to their store in the folder of the study.

        Raises
        ------
        RunError
            where a batch fails; earlier ones are in the store.
        """
        assert work.folder is not None
        rig = replace(work.rig, drive=replace(study.setup.drive, observer=None))
        task = RandomTask(study.setup.config.plans["random_overloads"], rig, work.steady)
        return run(task, work.folder, work.progress, scheduler=work.scheduler)
