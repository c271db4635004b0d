"""Runs a sweep: its points as batches of the runner (see `chainunit.work.runner`), and its results as a dataset. For
measures each point starts its own drive from rest, and meets the event once it is steady."""

from __future__ import annotations

import hashlib
import json
import math
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from enum import Enum
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ... import __version__
from ...batch.evaluate import ReasonKind, StateReason, check_engine, reasons_of
from ...batch.transients import can_run
from ...core.brief import briefly_shown
from ...core.errors import Faults, InputError
from ...core.native.compilers import COMPILERS
from ...core.quantities import Layout, Variable, plain_variable, variables
from ...machines.machine import Machine
from ...reading.results import InUnit
from ...study.arrays import Dataset
from ...study.block_runs import BlockRuns, Cause, EventRun, RunPoint
from ...study.choice import drive_of
from ...study.config import Config
from ...study.cycle_quantities import CycleQuantity, cycle_quantity, evaluate
from ...study.event import Event
from ...study.measures import Answers, read_measure
from ...study.rig import Rig
from ...study.window import Phase, Trip, Window
from ...work.job import BatchStore, Job, ResultVariable
from ...work.progress import TaskProgress
from ...work.runner import check_scheduler
from ...work.runner import run as run_job
from .plan import SweepPlan
from .table import SPEED

_RATIO = "machine.ratio"
TITLE = "points of the sweep"
_STATES, _STATES_OF_RATIOS, _RUNS = 12e6, 2e6, 64
"""Largest numbers of states of a batch, of states where the ratio of the gear is swept (each then has an angle of its
own), and of transients of a batch."""


class Beside(Enum):
    """Why a point has no result, where no swept quantity is the reason; with its text."""

    BOUNDS = "another value of the point is outside its bounds"


@dataclass(frozen=True)
class SweepTask:
    """The data that a worker needs: the plan, the machine with its feed and crank speed [rad/s], and for measures the
    drive."""

    plan: SweepPlan
    machine: Machine
    feed: Any
    crank_speed: float
    rig: Rig | None = None
    event: Event | None = None
    """the event of the measures"""
    threads: int = 1
    """number of threads of the native loop; the results do not depend on it"""
    engine: str = "native"
    """engine of the quantities of a turn, see `chainunit.batch.evaluate`"""

    @cached_property
    def quantities(self) -> list[CycleQuantity]:
        """The quantities of a turn."""
        return [cycle_quantity(name, self.machine.model) for name in self.plan.quantities]

    @cached_property
    def variables(self) -> dict[str, Variable]:
        """Parameters, quantities and measures by name."""
        declared = {parameter.name: parameter.variable for parameter in self.plan.parameters}
        for q in self.quantities:
            declared[q.name] = plain_variable(q.name, q.unit, q.description, kind=q.kind)
        answers = {v.name: v for v in variables(Answers)}
        return declared | {name: answers[name] for name in self.plan.measures}

    @cached_property
    def block(self) -> BlockRuns:
        """The compiled system, in which the values of the sweep vary."""
        assert self.rig is not None and self.event is not None
        varying = [full for parameter in self.plan.parameters for full in of_system(parameter.name)]
        return BlockRuns(self.rig, [self.event], varying)

    @cached_property
    def reasons(self) -> list[StateReason]:
        """The reasons for which a point has no result, by their codes."""
        bounds = (
            StateReason(ReasonKind.BOUNDS, parameter.name, parameter.variable.quantity.allowed_range)
            for parameter in self.plan.parameters
        )
        runs = (Cause.LEFT_BOUNDS, Cause.UNSETTLED) if self.plan.measures else ()
        return [*reasons_of(self.machine.model), *bounds, *map(StateReason, (Beside.BOUNDS, *runs))]

    @cached_property
    def codes(self) -> dict[tuple[Enum, str], int]:
        """The codes of the reasons by kind and subject."""
        return {(reason.kind, reason.subject): code for code, reason in enumerate(self.reasons)}

    def turns(self, values: Mapping[str, Any]) -> Dataset:
        """The quantities of a turn at points with these values by full name, each of shape (points,)."""
        import xarray as xr

        arrays = {name: xr.DataArray(x, dims="point") for name, x in values.items()}
        varied = {
            name.partition(".")[2]: x for name, x in arrays.items() if name.startswith(("machine.", "feed."))
        }
        if not varied:
            # the shape of the results
            name, value = next(iter(self.machine.by_name.items()))
            varied = {name: xr.DataArray(np.full(len(next(iter(values.values()))), value), dims="point")}
        return evaluate(
            self.machine,
            self.quantities or [cycle_quantity("peak(crank_torque)", self.machine.model)],
            arrays.get(SPEED, self.crank_speed),
            self.feed,
            varied,
            self.plan.basis,
            self.plan.angles,
            workers=self.threads,
            engine=self.engine,
            on_host=True,
        )

    def digest(self) -> str:
        """A digest of everything on which the results depend, in hexadecimal digits. The number of points of Sobol's
        sequence is not of it: such a sweep may grow."""
        plan = self.plan
        relevant: dict[str, Any] = {
            "chainunit": __version__,
            "model": self.machine.model.identity,
            "machine": self.machine.by_name,
            "feed": Layout(type(self.feed)).by_name(self.feed),
            "crank_speed": self.crank_speed,
            "plan": [plan.method, plan.seed, plan.quantities, plan.measures, plan.event, plan.angles],
            "points": None if plan.method == "sobol" else plan.points,
            "basis": asdict(plan.basis),
            "parameters": [
                [p.name, p.centre, p.values, repr(p.ends), p.tolerance, p.distribution]
                for p in plan.parameters
            ],
            # other versions of scipy may have other points
            "first": [list(map(float, x)) for x in plan.values(0, min(8, plan.points)).values()],
            "batch": batch_of(plan),
        }
        if self.rig is not None and self.event is not None:
            operation, graph, event = self.rig.operation, self.rig.graph, self.event
            relevant |= {
                "run": asdict(operation.run),
                "event": [event.kind, event.side, Layout(type(event.p)).by_name(event.p)],
                "connections": graph.connections,
                "start": graph.values,
                "empty_start": operation.empty_start,
                "ramp_end": operation.ramp_end,
            }
            if operation.coupling is not None:
                relevant["coupling"] = asdict(operation.coupling)
        return hashlib.sha256(json.dumps(relevant, sort_keys=True).encode()).hexdigest()


def plain_name(name: str) -> str:
    """The name of a result or parameter in the store: ``peak(crank_torque)`` -> peak_crank_torque."""
    return re.sub(r"\W+", "_", name).strip("_")


def batch_of(plan: SweepPlan) -> int:
    """The number of points of a batch, a power of 2: some tenths of a second of work, and some 100 MB."""
    has_ratio = any(parameter.name == _RATIO for parameter in plan.parameters)
    states = (_STATES_OF_RATIOS if has_ratio else _STATES) / plan.angles
    return _RUNS if plan.measures else 1 << max(4, int(math.log2(states)))


def result_variables(task: SweepTask) -> list[ResultVariable]:
    """The results of a point: its parameters, its quantities and measures, and the reason why it has none."""
    flags = [re.sub(r"[^\w.+@-]+", "_", str(reason)).strip("_") for reason in task.reasons]
    return [
        *(ResultVariable(plain_name(name), v.unit, v.description) for name, v in task.variables.items()),
        ResultVariable("reason", "1", "reason for which there is no result", "int16", flags=tuple(flags)),
    ]


def make_points(task: SweepTask, begin: int, end: int) -> dict[str, Any]:
    """The results of the points from `begin` to `end` - 1, by the names of `result_variables`."""
    plan = task.plan
    values = plan.values(begin, end)
    table = task.turns(values)
    code, count = table.reason.values, len(reasons_of(task.machine.model))
    reason = np.where(code < count, code, task.codes[Beside.BOUNDS, ""]).astype(np.int16)
    for parameter in plan.parameters:
        admitted = parameter.variable.quantity.admits(values[parameter.name])
        reason[~admitted] = task.codes[ReasonKind.BOUNDS, parameter.name]
    results = {plain_name(name): x for name, x in values.items()}
    for name in plan.quantities:
        results[plain_name(name)] = np.where(
            reason == 0, np.broadcast_to(table[name].values, reason.shape), np.nan
        )
    if plan.measures:
        results |= {name: np.full(end - begin, np.nan) for name in plan.measures}
        sound = np.flatnonzero(reason == 0)
        if len(sound):
            runs = _measures(task, {name: x[sound] for name, x in values.items()})
            for k, measured in zip(sound, runs, strict=True):
                if isinstance(measured, Cause):
                    reason[k] = task.codes[measured, ""]
                else:
                    for name, value in measured.items():
                        results[name][k] = value
    return results | {"reason": reason.astype(np.int16)}


def check_drive(rig: Rig, plan: SweepPlan, event: Event) -> None:
    """Refuse what the transients of a drive with this `event` cannot have.

    Raises
    ------
    InputError
        for an event that the drive cannot have, for a swept quantity that changes no run or is not one number of the
        drive, and without a C compiler.
    """
    faults = Faults()
    if not rig.takes(event):
        faults.add([InputError(f"sweep.event = {plan.event}: {event.without}", "sweep.event")])
    names = rig.drive.simulated_machine.model.parameter_layout.names
    for name in (parameter.name for parameter in plan.parameters):
        reason = ""
        if name == SPEED and not rig.drive.follows:
            reason = "changes no run, as the motor has the speed of its supply"
        elif name.startswith("machine.") and name.partition(".")[2] not in names:
            reason = "is not of the drive"
        elif name == _RATIO and rig.drive.whole_line:
            reason = "is not one number of the drive"
        if reason:
            line = f"sweep.parameter: {name} {reason}; leave it out, or sweep it without measures"
            faults.add([InputError(line, "sweep.parameter")])
    if not can_run():
        line = f"sweep.measures: need a C compiler ({COMPILERS}); install one, or leave them out"
        faults.add([InputError(line, "sweep.measures")])
    faults.refuse()


def _measures(task: SweepTask, values: Mapping[str, Any]) -> Iterator[Cause | dict[str, float]]:
    """By point, the measures of the plan by name, or the cause for which there are none. The points have these values
    by full name, each of shape (points,)."""
    assert task.rig is not None and task.event is not None
    point_values = zip(*(map(float, x) for x in values.values()), strict=True)
    points = [_point(task.rig, task.event, dict(zip(values, x, strict=True))) for x in point_values]
    for point, run in zip(points, task.block.runs(points), strict=True):
        if run.fault is not None:
            yield run.fault.cause
        else:
            window = _window(point, run)
            measured = {name: read_measure(name, window) for name in task.plan.measures}
            yield {name: math.nan if value is None else value for name, value in measured.items()}


def of_system(name: str) -> list[str]:
    """The parameters of the compiled system that a swept quantity sets, by full name."""
    part, _, short = name.partition(".")
    # the machine of the feed-forward has the same parameters
    return [name, f"model.{short}"] if part == "machine" else []


def _point(rig: Rig, event: Event, values: Mapping[str, float]) -> RunPoint:
    """The run with these values by full name."""
    operation = rig.operation
    feed = {name.removeprefix("feed."): x for name, x in values.items() if name.startswith("feed.")}
    begin = f"event.{event.name}."
    of_event = {name.removeprefix(begin): x for name, x in values.items() if name.startswith(begin)}
    event = replace(event, p=replace(event.p, **of_event))
    if _RATIO in values:
        machine = rig.drive.machine.replace(ratio=values[_RATIO])
        rig = replace(rig, drive=replace(rig.drive, machine=machine))
    if feed or SPEED in values:
        loads = Layout(type(operation.feed)).from_names(feed, operation.feed)
        run = replace(operation.run, crank_speed=values.get(SPEED, operation.crank_speed))
        rig = replace(rig, operation=replace(operation, feed=loads, run=run))
    limit = rig.guards.get(rig.drive.motor_torque, math.inf)
    system_values = {full: x for name, x in values.items() for full in of_system(name)}
    return RunPoint(rig, event, event.time_followed(rig.operation.turn), limit=limit, values=system_values)


def _window(point: RunPoint, run: EventRun) -> Window:
    """The rows of a run from its event on."""
    assert run.series is not None and run.steady is not None
    drive, speed = point.rig.drive, point.rig.operation.crank_speed
    steady = Window(Phase.STEADY, run.steady, drive, (), speed)
    # the energy behind a coupling that opens is not followed
    trip = Trip(float(run.series["time"][-1]), math.nan, None) if run.ended else None
    return Window(Phase.EVENT, run.series, drive, (), speed, 0.0, steady, trip)


def task_of(config: Config) -> SweepTask:
    """The task of the sweep of a study.

    Raises
    ------
    InputError
        for a study without a sweep or without swept parameters; of measures see `check_drive`.
    """
    plan: SweepPlan | None = config.plans["sweep"]
    if plan is None or not plan.parameters:
        raise InputError(
            "sweep.parameter: the study has none; add a table [[sweep.parameter]] with name, from and to "
            "(chainunit keys sweep.parameter)",
            "sweep.parameter",
        )
    drive = drive_of(config)
    rig = event = None
    if plan.measures:
        rig, event = Rig(config.operation, drive, {}), config.events[plan.event]
        check_drive(rig, plan, event)
    return SweepTask(plan, drive.machine, config.feed, float(config.run.crank_speed), rig, event)


def job_of(task: SweepTask) -> Job:
    """The points of a sweep, as work in batches."""
    return Job(
        name="sweep",
        title=TITLE,
        points=task.plan.points,
        batch=batch_of(task.plan),
        variables=result_variables(task),
        work=make_points,
        task=task,
        digest=task.digest(),
    )


_PART = 2**18
"""Number of points that are read at a time."""


@briefly_shown
@dataclass(frozen=True)
class SweepFindings:
    """The results of a sweep, in the store of `outcome`."""

    config: Config
    task: SweepTask
    outcome: BatchStore

    @property
    def plan(self) -> SweepPlan:
        """Its plan."""
        return self.task.plan

    @property
    def results(self) -> tuple[str, ...]:
        """The names of all quantities and measures."""
        return (*self.plan.quantities, *self.plan.measures)

    @property
    def variables(self) -> dict[str, Variable]:
        """Parameters and results by name."""
        return self.task.variables

    def in_unit(self, name: str, value: float | None) -> InUnit:
        """A value of a parameter or result, with its unit."""
        return InUnit(value, self.variables[name].unit, self.variables[name].kind)

    @cached_property
    def points(self) -> Dataset:
        """All points over the dimension ``point``, by the names of the study: parameters, results and ``reason``. The
        values are read when they are used."""
        dataset = self.outcome.dataset.rename({plain_name(name): name for name in self.variables})
        dataset["reason"].attrs["reasons"] = [str(reason) for reason in self.task.reasons]
        return dataset.set_coords([parameter.name for parameter in self.plan.parameters])

    def parts(self, names: Sequence[str]) -> Iterator[tuple[int, Dataset]]:
        """The variables `names` of all points in parts, each with the number of its first point."""
        points = self.points[[*names]]
        for begin in range(0, points.sizes["point"], _PART):
            yield begin, points.isel(point=slice(begin, begin + _PART)).load()

    @cached_property
    def dataset(self) -> Dataset:
        """The results by the names of the study: over the parameters of a grid, else over ``point``, with the
        parameters as coordinates."""
        import xarray as xr

        plan, points = self.plan, self.points
        if not plan.is_grid:
            return points
        axes = {p.name: (p.name, list(p.values), points[p.name].attrs) for p in plan.parameters}
        results = {
            name: (plan.dims, x.values.reshape(plan.shape), x.attrs) for name, x in points.data_vars.items()
        }
        return xr.Dataset(results, axes, points.attrs)


def run_sweep(
    config: Config,
    folder: Path,
    progress: TaskProgress,
    workers: int | None = None,
    scheduler: str | None = None,
    engine: str = "native",
) -> SweepFindings:
    """Make the points of the sweep of a study that its store in `folder` does not have; the other arguments and the
    errors are those of `task_of`, of `chainunit.batch.evaluate`, and of `chainunit.work.runner.run`."""
    check_engine(engine)
    task = replace(task_of(config), engine=engine)
    if scheduler is not None:
        # before there is a store, which a refusal would leave behind
        check_scheduler(scheduler)
    if scheduler is None and not task.plan.measures:
        # the native loop leaves so little to Python that threads do; processes take longer to start
        task, workers = replace(task, threads=workers or os.cpu_count() or 1), 1
    return SweepFindings(config, task, run_job(job_of(task), folder, progress, workers, scheduler))
