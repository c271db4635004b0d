# %% [markdown]
# Random overloads
#
# Runs of 2 s with a row every millisecond, on two processes: on the compiled system, and by the co-simulation of
# native FMUs, in one run of this script. The same runs are compared. Rates count from the first finished batch on, as
# the start of the processes takes some seconds. The limit of the co-simulation is the importer's own time: as many
# steps in which fmpy only calls the FMUs (set, step, get). The limit of the compiled system is its native loop alone.
# `python bench/monte_carlo.py 1000000` makes so many runs on the compiled system, and prints memory and size of the
# store.

# %%
from __future__ import annotations

import dataclasses
import os
import resource
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from figures import parser, save

from chainunit.capabilities.random_overloads import runs as monte_carlo
from chainunit.drives.dc_motor import DcMotor
from chainunit.study.config import parse
from chainunit.study.drive import Drive
from chainunit.study.drive_fmus import export_drive
from chainunit.study.rig import Rig
from chainunit.system.instance import Fmu, Instance

STUDY = "[monte_carlo]\nruns = {runs}\nduration = 2\n[coupling]\ntrip_torque = 1000\n"
COSIMULATED, COMPILED, WORKERS = 320, 16384, 2
MEASURES = ("crank_torque_peak", "motor_torque_peak", "current_peak", "rocker_torque_peak", "speed_least")


def task_of(runs: int, folder: Path) -> monte_carlo.RandomTask:
    """The packaged study; its FMUs are written into the folder."""
    config = parse(STUDY.format(runs=runs))
    drive = Drive(DcMotor, config.motor.parameters, config.machine)
    files, _ = export_drive(drive, folder)
    return monte_carlo.RandomTask(config.plans["random_overloads"], Rig(config.operation, drive, files), 6.7)


def timed(task: monte_carlo.RandomTask, folder: Path) -> tuple[monte_carlo.MonteCarloResult, float]:
    """The runs of a task, and their rate [runs/s] after the first finished batch."""
    times: list[tuple[float, float]] = []

    def report(what: str, done: float, todo: float) -> None:
        if done:
            times.append((time.perf_counter(), done))

    result = monte_carlo.run(task, folder, report, workers=WORKERS)
    (first, begin), (last, end) = times[0], times[-1]
    return result, (end - begin) / (last - first)


def loop_alone(task: monte_carlo.RandomTask, runs: int = 256) -> float:
    """Seconds a run of the native loop, without what Python does before and after it."""
    block = task.block()
    plan, operation = task.plan, task.rig.operation
    drawn = [monte_carlo.draw(plan, operation, k) for k in range(runs)]
    points = [monte_carlo.point(block.rig, each, plan.duration) for each in drawn]
    spent = 0.0
    real = block.loop.run

    def run(*args, **more):
        nonlocal spent
        began = time.thread_time()
        result = real(*args, **more)
        spent += time.thread_time() - began
        return result

    block.loop.run = run
    for _ in block.runs(points):
        pass
    return spent / runs


def importer(files) -> float:
    """Seconds for 2,000 steps of both FMUs through fmpy, without a master."""
    units = []
    for file in files.values():
        fmu = Fmu(file)
        unit = Instance(fmu, "unit")
        unit.initialize({}, 0.0)
        unit.finish_initialization()
        inputs = [n for n, v in fmu.variables.items() if v.causality == "input"]
        units.append((unit, unit.handle(inputs), [0.0] * len(inputs), unit.handle(fmu.outputs())))
    began = time.perf_counter()
    for k in range(2000):
        for unit, into, values, out in units:
            unit.write(into, values)
            unit.step(1e-3 * k, 1e-3)
            unit.read(out)
    duration = time.perf_counter() - began
    for unit, *_ in units:
        unit.close()
    return duration


def compare(folder: Path) -> dict[str, Any]:
    task = task_of(COMPILED, folder)
    few = dataclasses.replace(task_of(COSIMULATED, folder), cosimulated=True)
    (reference, slow), (result, fast) = timed(few, folder), timed(task, folder)
    fmpy, loop = WORKERS / importer(task.files), WORKERS / loop_alone(task)
    print(f"{WORKERS} processes, runs of 2 s:")
    print(f"co-simulation    {slow:7.1f} runs/s ({COSIMULATED} runs), limit: fmpy alone, {fmpy:.0f} runs/s")
    print(f"compiled system  {fast:7.1f} runs/s ({COMPILED} runs), limit: its loop alone, {loop:.0f} runs/s")
    print(f"ratio            {fast / slow:7.1f}")
    same = result.dataset.isel(run=slice(0, COSIMULATED))
    differences = {}
    for name in MEASURES:
        a, b = (np.asarray(each[name]) for each in (same, reference.dataset))
        differences[name] = float(np.nanmax(np.abs(a - b) / np.abs(b)))
        print(f"{name:20} largest difference {differences[name]:.1e} of the value")
    return {
        "workers": WORKERS, "runs": {"cosimulation": COSIMULATED, "compiled": COMPILED},
        "cosimulation": slow, "compiled": fast, "limit_cosimulation": fmpy, "limit_compiled": loop,
        "differences": differences,
    }  # fmt: skip


def many(runs: int, folder: Path) -> None:
    began = time.perf_counter()
    result, _ = timed(task_of(runs, folder), folder)
    spent = time.perf_counter() - began
    size = sum(file.stat().st_size for file in result.file.rglob("*") if file.is_file())
    count = sum(1 for file in result.file.rglob("*") if file.is_file())
    own, workers = (
        resource.getrusage(who).ru_maxrss / 1024 for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    )
    print(f"{result.runs} runs in {spent:.0f} s, {result.runs / spent:.0f} runs/s")
    print(
        f"largest memory: {own:.0f} MB, of a worker {workers:.0f} MB; store: {size / 1e6:.0f} MB in {count} files"
    )
    print({name: f"{each['q99'].value:.4g}" for name, each in result.quantiles.items() if "q99" in each})


def main() -> None:
    options = parser()
    options.add_argument("runs", type=int, nargs="?", help="make so many runs on the compiled system")
    values = options.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        if values.runs:
            many(values.runs, Path(os.environ.get("STORE", folder)))
        else:
            save(values.json, compare(Path(folder)))


if __name__ == "__main__":
    main()
