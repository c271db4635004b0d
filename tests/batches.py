"""A job for tests of the runner, in a module that workers import."""

from __future__ import annotations

import os
import signal
import sys
import time
from pathlib import Path

import netCDF4
import numpy as np

from chainunit.work.job import CHECKS, Job, ResultVariable
from chainunit.work.runner import run

VARIABLES = (
    ResultVariable("height", "m", "height of a point"),
    ResultVariable("colour", "1", "colour of a point", "int8", flags=("red", "green", "blue")),
    ResultVariable("torque", "N.m", "torque at a point", "float32"),
    ResultVariable("remark", "1", "remark on a point", letters=12),
)


def results(begin, end):
    """The results of some points, from their numbers alone."""
    n = np.arange(begin, end)
    return {
        "height": np.where(n % 7 == 3, np.nan, np.sin(n)),
        "colour": n % 3,
        "torque": np.cos(n),
        "remark": [f"point {k}" if k % 5 == 0 else "" for k in n],
    }


def work(task, begin, end):
    """Make a batch; `task` says what goes wrong."""
    if "seen" in task:
        Path(task["seen"], f"{begin}_{os.getpid()}").touch()
    if begin in task.get("slow", ()):
        time.sleep(task["seconds"])
    if begin == task.get("waits"):
        while finished(Path(task["marks"])) < 2:
            time.sleep(0.01)
    if begin == task.get("dies"):
        os.kill(os.getpid(), signal.SIGKILL)
    if begin == task.get("fails"):
        raise ValueError("no such point")
    return results(begin, end)


def job(points=100, batch=16, digest="0123456789abcdef", **task):
    return Job(
        name="demo",
        title="points of a demo",
        points=points,
        batch=batch,
        variables=VARIABLES,
        work=work,
        task=task,
        digest=digest,
    )


def finished(file):
    """The number of batches in a store that have a checksum; 0 without a store."""
    if not file.exists():
        return 0
    with netCDF4.Dataset(file) as stored:
        return int(np.count_nonzero(stored[CHECKS][:]))


def damage(file, name, place, value=None):
    """Change a value in a store, to `value` or by a bit."""
    with netCDF4.Dataset(file, "r+") as stored:
        stored.set_auto_maskandscale(False)
        stored.set_auto_chartostring(False)
        part = np.atleast_1d(stored[name][place])
        raw = bytearray(part.tobytes())
        raw[0] ^= 1
        changed = np.frombuffer(bytes(raw), part.dtype).reshape(part.shape)
        stored[name][place] = changed if value is None else value


if __name__ == "__main__":
    import batches

    folder, points, workers = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
    slow = {"slow": range(0, points, 4), "seconds": 0.05} if len(sys.argv) > 4 else {}
    outcome = run(batches.job(points, 4, **slow), folder, lambda *said: None, workers)
    print(outcome.earlier_points, "distributed" in sys.modules)
