"""Overloads at random crank angles, times and sizes, in local processes.

Each run branches from the same steady state and is determined by the study and its own number alone. Results are
appended as they come to ``monte_carlo_<study>.jsonl``, where <study> is a digest of all that they depend on: a run
that is killed goes on from there, and another study never mixes with them.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict, dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..config import Config
from ..cosim import CoSimulation, Profile
from ..errors import InterruptedRunError, RunError
from ..quantities import Layout, Value, declaration, quantity
from . import protection
from .drive import Drive


@declaration
class Sample:
    """One run: what happened, and what came of it."""

    crank_angle: Value = quantity("rad", "crank angle at which the lump comes")
    event: Value = quantity("s", "time at which the lump comes")
    force: Value = quantity("N", "processing force of the lump")
    trip_torque: Value = quantity("N.m", "crank torque at which the safety coupling opens in this run")
    crank_torque_peak: Value = quantity("N.m", "crank torque, peak")
    motor_torque_peak: Value = quantity("N.m", "motor torque, peak")
    current_peak: Value = quantity("A", "motor current, peak")
    rocker_torque_peak: Value = quantity("N.m", "rocker torque, peak")
    speed_least: Value = quantity("rad/s", "crank speed, least")
    stalls: Value = quantity("1", "1 where the crank stands at the end of the run")
    trips: Value = quantity("1", "1 where the safety coupling opens")


QUANTILES = (0.05, 0.5, 0.95, 0.99)
_BATCH = 25  # runs between two appendings to the file


@dataclass(frozen=True)
class Task:
    """All that a worker needs: the study, its drive, the FMUs, the time of the steady state [s]."""

    config: Config
    drive: Drive
    files: Mapping[str, Path]
    steady: float

    def digest(self) -> str:
        """Name of what the results depend on: every parameter, and the content of the FMUs."""
        config, drive = self.config, self.drive
        relevant = {
            "chainunit": __version__,
            "connections": drive.connections(),
            "start": drive.start(),
            "feed": asdict(config.feed),
            "run": asdict(config.run),
            "overload": asdict(config.overload),
            "monte_carlo": {k: v for k, v in asdict(config.monte_carlo).items() if k != "runs"},
            "coupling": asdict(config.coupling) if config.coupling else None,
            "steady": self.steady,
        }
        content = hashlib.sha256(json.dumps(relevant, sort_keys=True).encode())
        for name in sorted(self.files):
            content.update(Path(self.files[name]).read_bytes())
        return content.hexdigest()[:12]


_worker: dict[str, CoSimulation] = {}


def _prepared(task: Task, digest: str) -> CoSimulation:
    """The co-simulation of this process, started up and saved in its steady state."""
    if digest not in _worker:
        for other in _worker.values():
            other.close()
        _worker.clear()
        run = task.config.run
        signals = {**task.drive.loads(task.config.feed), **task.drive.reference(run.crank_speed, run.ramp)}
        simulation = CoSimulation(task.drive.system(task.files), signals)
        simulation.run(task.steady, run.step)
        simulation.save()
        _worker[digest] = simulation
    return _worker[digest]


def one(task: Task, number: int, simulation: CoSimulation) -> Sample:
    """Run the overload of that number from the steady state that `simulation` has saved."""
    config, drive = task.config, task.drive
    mc, o, run = config.monte_carlo, config.overload, config.run
    random = np.random.default_rng([int(mc.seed), number])
    offset = random.uniform(0.0, 2.0 * math.pi / run.crank_speed)
    force = random.uniform(mc.force_low, mc.force_high)
    spread = random.standard_normal()
    trip = (
        config.coupling.trip_torque * max(0.1, 1.0 + config.coupling.scatter * spread)
        if config.coupling
        else math.inf
    )

    simulation.restore()
    event, normal = task.steady + offset, config.feed.left.processing_force
    rise, hold = o.jam_rise, o.jam_duration
    lump = Profile(normal, ((event, rise, normal + force), (event + rise + hold, rise, normal)))
    simulation.signals = {
        **drive.loads(config.feed),
        **drive.reference(run.crank_speed),
        "machine.left.processing_force": lump,
    }
    stop = event + mc.duration
    guards = {"motor.tau": trip / drive.ratio} if config.coupling else None
    done = simulation.run(stop, run.step, guards=guards)
    time = done["time"].values
    turned, speed = drive.crank_motion(done)

    def peak(name: str) -> float:
        return float(np.max(np.abs(done[name].values)))

    angle = float(np.interp(event, time, turned))
    tripped = simulation.time < stop - 0.5 * run.step
    return Sample(
        crank_angle=angle % (2.0 * math.pi),
        event=event,
        force=force,
        trip_torque=trip if config.coupling else None,
        crank_torque_peak=float(np.max(np.abs(drive.crank_torque(done)))),
        motor_torque_peak=peak("motor.air_gap_tau"),
        current_peak=peak(f"motor.{drive.motor.current}"),
        rocker_torque_peak=peak("machine.rocker.tau"),
        speed_least=float(np.min(speed)),
        stalls=float(not tripped and protection.stall(time, speed, run.crank_speed) is not None),
        trips=float(tripped),
    )


def batch(task: Task, digest: str, numbers: list[int]) -> list[dict[str, Any]]:
    """Results of several runs, as rows of the file."""
    simulation = _prepared(task, digest)
    layout = Layout(Sample)
    rows: list[dict[str, Any]] = []
    for k in numbers:
        try:
            rows.append({"run": k, "failed": None, **layout.named(one(task, k, simulation))})
        except InterruptedRunError:
            raise
        except RunError as error:
            # one run that fails is an answer, too; the next starts from the saved state again
            rows.append({"run": k, "failed": str(error), **dict.fromkeys(layout.names)})
    return rows


def read(file: Path) -> dict[int, dict[str, Any]]:
    """Rows of a results file by their number; a last line that a kill cut off is left out."""
    rows: dict[int, dict[str, Any]] = {}
    if file.exists():
        for line in file.read_text("utf-8").splitlines():
            try:
                row = json.loads(line)
            except ValueError:
                continue
            rows[row["run"]] = row
    return rows


@dataclass(frozen=True)
class MonteCarloResult:
    """What the runs found: rows as in the file, and the file."""

    rows: list[dict[str, Any]]
    file: Path
    resumed: int
    """runs that were there before"""

    def quantiles(self) -> dict[str, dict[str, float]]:
        """Quantiles of every answer, and shares of runs that stall or trip."""
        found: dict[str, dict[str, float]] = {}
        for v in Layout(Sample).variables:
            values = [row[v.name] for row in self.rows if row[v.name] is not None]
            if not values or v.name in ("event", "force", "crank_angle"):
                continue
            if v.name in ("stalls", "trips"):
                found[v.name] = {"share": float(np.mean(values))}
                continue
            sizes = np.quantile(values, QUANTILES)
            found[v.name] = {f"q{100 * q:.0f}": float(x) for q, x in zip(QUANTILES, sizes, strict=True)}
        return found

    @property
    def failed(self) -> int:
        """Number of runs in which an FMU failed."""
        return sum(row["failed"] is not None for row in self.rows)

    def as_dict(self) -> dict[str, Any]:
        """Ready for JSON, each number with its unit."""
        units = {v.name: v.unit for v in Layout(Sample).variables}
        return {
            "runs": {"value": len(self.rows), "unit": "1"},
            "failed": {"value": self.failed, "unit": "1"},
            "file": self.file.name,
            "quantiles": {
                name: {
                    k: {"value": x, "unit": "1" if k == "share" else units[name]} for k, x in sizes.items()
                }
                for name, sizes in self.quantiles().items()
            },
        }


def run(
    task: Task, folder: Path, report: Callable[[str, float, float], None], workers: int | None = None
) -> MonteCarloResult:
    """Run what is missing of the task's runs, on all processors, and append each batch to the file in `folder`.

    Raises
    ------
    RunError
        where an FMU fails; what was computed is in the file.
    InterruptedRunError
        after Ctrl-C; likewise.
    """
    from dask.base import compute
    from dask.delayed import delayed

    digest = task.digest()
    file = folder / f"monte_carlo_{digest}.jsonl"
    rows = read(file)
    resumed = len(rows)
    wanted = int(task.config.monte_carlo.runs)
    missing = [k for k in range(wanted) if k not in rows]
    workers = workers or os.cpu_count() or 1
    batches = [missing[k : k + _BATCH] for k in range(0, len(missing), _BATCH)]
    if file.exists() and not file.read_bytes().endswith(b"\n"):
        # what a kill cut off must not run into the next line
        file.write_text("".join(json.dumps(row) + "\n" for row in rows.values()), "utf-8")
    what = "overloads at random"
    report(what, len(rows), wanted)
    with (
        ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool,
        file.open("a", encoding="utf-8") as out,
    ):
        try:
            for first in range(0, len(batches), workers):
                tasks = [
                    delayed(batch)(task, digest, numbers) for numbers in batches[first : first + workers]
                ]
                for found in compute(*tasks, scheduler="processes", pool=pool):
                    for row in found:
                        rows[row["run"]] = row
                        out.write(json.dumps(row) + "\n")
                    out.flush()
                report(what, len(rows), wanted)
        except BrokenProcessPool as error:
            raise RunError(
                f"a process of the random overloads was ended from outside after {len(rows)} of {wanted} runs; "
                "run the study again to go on"
            ) from error
        except KeyboardInterrupt as error:
            pool.shutdown(wait=False, cancel_futures=True)
            raise InterruptedRunError(
                f"interrupted after {len(rows)} of {wanted} random overloads"
            ) from error
    return MonteCarloResult([rows[k] for k in sorted(rows) if k < wanted], file, resumed)
