"""A sweep in small batches, in a process of its own that a test may kill: ``python sweeps.py FILE FOLDER``."""

from __future__ import annotations

import sys
from pathlib import Path

from chainunit.capabilities.sweep import points as sweep
from chainunit.study.config import load

BATCH = 32


def small_batches(plan):
    """In place of `chainunit.capabilities.sweep.points.batch_of`."""
    return BATCH


if __name__ == "__main__":
    sweep.batch_of = small_batches
    sweep.run_sweep(load(Path(sys.argv[1])), Path(sys.argv[2]), lambda *said: None, workers=1)
