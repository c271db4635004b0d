# %% [markdown]
# A sweep
#
# Six swept parameters, five quantities of a turn at 720 angles, on all cores: points and states a second of a whole
# sweep, after a first one that compiles the loop, and the limit: the native loop alone within it. Then the largest
# memory of the process.

# %%
from __future__ import annotations

import os
import resource
import tempfile
import time
from pathlib import Path

from figures import parser, save

from chainunit.batch.native import NativeKernel
from chainunit.capabilities.sweep import points as sweep
from chainunit.study.config import parse

POINTS, ANGLES = 131_072, 720
QUANTITIES = ("peak(crank_torque)", "rms(tau)", "min(margin)", "max(force(pivot))", "installed_power")
RANGES = {
    "machine.r": (0.13, 0.17), "machine.l": (1.45, 1.55), "machine.h": (0.95, 1.05), "machine.e": (0.8, 0.82),
    "machine.l1": (1.34, 1.36), "feed.left.material_mass": (0.0, 40.0),
}  # fmt: skip


def study(points: int) -> str:
    """The file of the study."""
    names = ", ".join(f'"{name}"' for name in QUANTITIES)
    swept = [f'[[sweep.parameter]]\nname = "{k}"\nfrom = {a}\nto = {b}\n' for k, (a, b) in RANGES.items()]
    return f"[sweep]\npoints = {points}\nangles = {ANGLES}\nquantities = [{names}]\n" + "".join(swept)


def timed(points: int) -> tuple[float, float]:
    """Seconds of a sweep, and of the native loop in it."""
    spent, real = [0.0], NativeKernel.__call__

    def call(self, *given):
        began = time.perf_counter()
        real(self, *given)
        spent[0] += time.perf_counter() - began

    NativeKernel.__call__ = call
    with tempfile.TemporaryDirectory() as folder:
        began = time.perf_counter()
        sweep.run_sweep(parse(study(points)), Path(folder), lambda *said: None)
        whole = time.perf_counter() - began
    NativeKernel.__call__ = real
    return whole, spent[0]


def main() -> None:
    options = parser().parse_args()
    timed(1024)
    whole, loop = min(timed(POINTS) for _ in range(3))
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    print(
        f"{POINTS} points, {POINTS * ANGLES:.1e} states: {whole:.1f} s, of these {loop:.1f} s in the native loop; "
        f"largest memory {memory:.0f} MB"
    )
    save(options.json, {
        "points": POINTS, "angles": ANGLES, "parameters": len(RANGES), "quantities": len(QUANTITIES), "whole": whole,
        "loop": loop, "memory": memory, "cores": os.cpu_count(),
    })  # fmt: skip


if __name__ == "__main__":
    main()
