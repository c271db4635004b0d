"""Overloads at random sides, crank angles, times and sizes, in local processes.

Each run branches from the same steady state and is determined by the study and its own number alone. When a
run ends, its row is appended to ``monte_carlo_<study>.jsonl``, where <study> is a digest of everything on
which the rows depend. A study that was killed goes on from these rows, and never uses the rows of another
study. Lines that are no rows are left out.
"""

from __future__ import annotations

import atexit
import hashlib
import json
import math
import os
from collections.abc import Mapping
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict, dataclass, fields
from itertools import islice
from multiprocessing import get_context
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, create_model

from .. import __version__
from ..ending import end_at_signals
from ..errors import InterruptedRunError, RunError
from ..files import whole, writing
from ..machines.chain_unit import SIDES, SideName
from ..progress import Report
from ..quantities import Layout, Value, declaration, quantity
from ..system import Simulation
from ..text import entry
from .config import Config
from .drive import Drive
from .event import AnySide, Event
from .measures import MEASURES, read_measure, same_measure
from .quantiles import CONFIDENCE, Estimate, quantile, runs_needed, share
from .rig import Rig
from .window import Phase, Window


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


def _row_form() -> type[BaseModel]:
    """The form of a row, from the declaration of a sample. The missing numbers of a failed run are null, and
    so is the trip torque without a coupling."""
    number = float | None
    fields: dict[str, Any] = {v.name: (number, Field(allow_inf_nan=False)) for v in Layout(Sample).variables}
    return create_model(
        "Row",
        __config__=ConfigDict(extra="forbid", strict=True),
        run=(int, Field(ge=0)),
        side=(SideName | None, Field()),
        drawn=(dict[str, Annotated[float, Field(allow_inf_nan=False)]], Field()),
        failed=(str | None, Field()),
        **fields,
    )


_Row = _row_form()
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
    absent: frozenset[str] = frozenset()
    """names of the measures that this motor or machine does not have"""

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
            "row": list(_Row.model_fields),
        }
        content = hashlib.sha256(json.dumps(relevant, sort_keys=True).encode())
        for name in sorted(self.files):
            content.update(Path(self.files[name]).read_bytes())
        return content.hexdigest()[:12]


_worker: dict[str, Simulation] = {}


def _close() -> None:
    for simulation in _worker.values():
        simulation.close()
    _worker.clear()


def _begin() -> None:
    """Prepare a worker process."""
    end_at_signals()
    atexit.register(_close)


def _saved_simulation(task: Task, digest: str) -> Simulation:
    """The co-simulation of this process, after the start-up, with its steady state saved."""
    if digest not in _worker:
        _close()
        simulation = task.rig.from_rest()
        simulation.run(task.steady, task.rig.step)
        simulation.save()
        _worker[digest] = simulation
    return _worker[digest]


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


def row_of(task: Task, digest: str, number: int) -> dict[str, Any]:
    """The result of the run with that number, as a row of the file."""
    simulation = _saved_simulation(task, digest)
    layout = Layout(Sample)
    chance = draw(task.config, number)
    head = {"run": number, "side": chance.event.side or None, "drawn": chance.values}
    try:
        return {**head, "failed": None, **layout.by_name(one(task, number, simulation))}
    except InterruptedRunError:
        raise
    except RunError as error:
        # a run that fails is a result, too; the next run starts from the saved state again
        return {**head, "failed": str(error), **dict.fromkeys(layout.names)}


def read_rows(file: Path, absent: frozenset[str] = frozenset()) -> tuple[dict[int, dict[str, Any]], int]:
    """The rows of a results file by their number, and the number of lines that were left out.

    A line counts as a row if it has the complete form: every number is present and finite, except those of
    the `absent` measures; or the run failed and no number is present. Rows of the same number that differ do
    not count. A last line that was cut off when the study was killed is ignored.
    """
    rows: dict[int, dict[str, Any]] = {}
    twice: set[int] = set()
    left_out = 0
    if not file.exists():
        return rows, left_out
    with file.open("rb") as lines:
        for line in lines:
            row = _row_in(line, absent)
            if row is None:
                left_out += line.endswith(b"\n")
            elif rows.setdefault(row["run"], row) is not row:
                left_out += 1
                if rows[row["run"]] != row:
                    twice.add(row["run"])
    return {number: row for number, row in rows.items() if number not in twice}, left_out + len(twice)


def _row_in(line: bytes, absent: frozenset[str]) -> dict[str, Any] | None:
    """The row in a line; None where the line is no row."""
    try:
        row = _Row.model_validate_json(line).model_dump()
    except ValidationError:
        return None
    gaps = {name for name in Layout(Sample).names if row[name] is None}
    whole_row = (
        gaps <= {"trip_torque", *absent} if row["failed"] is None else len(gaps) == len(Layout(Sample).names)
    )
    return row if whole_row else None


@dataclass(frozen=True)
class MonteCarloResult:
    """The results of the runs: the rows of the file, and the file."""

    rows: list[dict[str, Any]]
    file: Path
    earlier_runs: int
    """number of runs that the file had before"""
    left_out: int = 0
    """number of lines that were no rows, or were differing rows of the same run; these runs were computed
    anew"""

    def quantiles(self) -> dict[str, dict[str, Estimate]]:
        """Quantiles of every answer, and shares of the runs that stall or trip, each with its interval. A
        quantile is left out where there are too few runs for its interval."""
        estimates_of: dict[str, dict[str, Estimate]] = {}
        for v in Layout(Sample).variables:
            values = [row[v.name] for row in self.rows if row[v.name] is not None]
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
        count = len(self.rows) - self.failures
        omissions = [q for q in QUANTILES if count < runs_needed(q)]
        if not omissions:
            return ""
        each = ", ".join(f"the {100 * q:.0f} % quantile takes {runs_needed(q)}" for q in omissions)
        return f"{count} runs are too few for some quantiles: {each} (monte_carlo.runs)."

    @property
    def sides(self) -> dict[SideName, int]:
        """Number of runs by the side of the event; empty for an event without a side."""
        sides = {row["side"] for row in self.rows}
        return {side: sum(row["side"] == side for row in self.rows) for side in SIDES if sides != {None}}

    @property
    def failures(self) -> int:
        """Number of runs in which an FMU failed."""
        return sum(row["failed"] is not None for row in self.rows)

    def as_dict(self) -> dict[str, Any]:
        """Ready for JSON, each number with its unit."""
        units, kinds = {v.name: v.unit for v in Layout(Sample).variables}, {"share": ("1", "percent")}
        return {
            "runs": entry(len(self.rows), "1"),
            "sides": {side: entry(runs, "1") for side, runs in self.sides.items()},
            "failed": entry(self.failures, "1"),
            "left_out": entry(self.left_out, "1"),
            "file": self.file.name,
            "quantiles": {
                name: {k: each.as_dict(*kinds.get(k, (units[name],))) for k, each in sizes.items()}
                for name, sizes in self.quantiles().items()
            },
            "confidence": entry(CONFIDENCE, "1", "percent"),
        }


def run(task: Task, folder: Path, report: Report, workers: int | None = None) -> MonteCarloResult:
    """Make the missing runs of the task on all processors, and append each row to the file in `folder` when
    its run ends.

    Raises
    ------
    RunError
        where an FMU fails, or the file cannot be written; earlier results are in the file.
    InterruptedRunError
        after Ctrl-C; likewise.
    """
    digest = task.digest()
    file = folder / f"monte_carlo_{digest}.jsonl"
    rows, left_out = read_rows(file, task.absent)
    earlier_runs = len(rows)
    count = int(task.config.monte_carlo.runs)
    open_runs = [k for k in range(count) if k not in rows]
    workers = workers or os.cpu_count() or 1
    what = "overloads at random"
    complete = count - len(open_runs)
    report(what, complete, count)
    if left_out or (file.exists() and not file.read_bytes().endswith(b"\n")):
        # the next row must not be appended to a last line that was cut off
        with whole(file) as part:
            part.write_text("".join(_line(row) for row in rows.values()), "utf-8")
    with writing(file):
        out = file.open("a", encoding="utf-8")
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=_begin) as pool, out:
        waiting: set[Future[dict[str, Any]]] = set()
        numbers = iter(open_runs)
        try:
            while True:
                # a few runs at a time, as a study may have a million
                for k in islice(numbers, 2 * workers - len(waiting)):
                    waiting.add(pool.submit(row_of, task, digest, k))
                if not waiting:
                    break
                finished_runs, waiting = wait(waiting, return_when=FIRST_COMPLETED)
                new = sorted((future.result() for future in finished_runs), key=lambda row: row["run"])
                rows |= {row["run"]: row for row in new}
                with writing(file):
                    out.writelines(_line(row) for row in new)
                    out.flush()
                complete += len(finished_runs)
                report(what, complete, count)
        except BrokenProcessPool as error:
            raise RunError(
                f"a process of the random overloads was ended from outside after {len(rows)} of {count} runs; "
                "run the study again to go on"
            ) from error
        except OSError as error:
            raise RunError(
                f"a process of the random overloads failed after {len(rows)} of {count} runs "
                f"({error.strerror or error}); run the study again to go on"
            ) from error
        except KeyboardInterrupt as error:
            pool.shutdown(wait=False, cancel_futures=True)
            raise InterruptedRunError(f"interrupted after {len(rows)} of {count} random overloads") from error
    return MonteCarloResult([rows[k] for k in sorted(rows) if k < count], file, earlier_runs, left_out)


def _line(row: Mapping[str, Any]) -> str:
    return json.dumps(row, allow_nan=False) + "\n"
