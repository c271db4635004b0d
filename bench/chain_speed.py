# %% [markdown]
# Speed of the chain unit with chains
#
# The compiled FMU, eight rods on each of both sides, assumed damping, the crank at 10 rad/s: times real time at
# communication steps of 1, 5 and 20 ms, from a C loop that only steps, on one core. The limit: right-hand sides and
# projections that were computed, as the runtime counts them, at the cost of one of each alone. Demanded: 200 times
# real time.
#
# Beside it exudyn with the same motion, two turns from the same state, both as accurate: the largest error of the
# force at A2 of the left organ, in parts of its peak, against our own solution with a tolerance of 1e-12, is the
# largest below 1e-4. exudyn has one chain and the rocker prescribed, its time is doubled; its time in the
# Python function of the rocker's motion is subtracted. Ours has the drive and both chains, and is stepped and read
# through fmpy. Demanded: 20 times as fast.
#
# A step of the integrator is seven right-hand sides, however short: the limit falls with the communication step.

# %%
from __future__ import annotations

import math
import shutil
import subprocess
import sys
import tempfile
import time
import zipfile
from pathlib import Path

import numpy as np
from figures import parser, save
from rich.console import Console
from rich.table import Table

from chainunit.fmu.native.export import export
from chainunit.machines.flexible import flexible
from chainunit.system.instance import Fmu, Instance

HERE = Path(__file__).parent
W = 10.0  # rad/s of the crank
STEPS = (0.001, 0.005, 0.020)
DEMANDED, FASTER = 200.0, 20.0
ERROR = 1e-4
WALLS, WEBS = 6, 2

INTEGRATION = "static int slope_at("
"""The first function of the runtime's integration."""
COUNTED = {
    INTEGRATION: f"long evaluations, projections;\n\n{INTEGRATION}",
    "    kernels.derivatives(": "    ++evaluations;\n    kernels.derivatives(",
    "    kernels.closed(": "    ++projections;\n    kernels.closed(",
}


def from_c(file: Path, folder: Path, seconds: float = 10.0):
    """For each communication step: times real time, evaluations and projections per simulated second; then
    their costs [s]."""
    sources = folder / "sources"
    with zipfile.ZipFile(file) as archive:
        for name in archive.namelist():
            if name.startswith("sources/"):
                archive.extract(name, folder)
    runtime = (sources / "runtime.c").read_text()
    at = runtime.index(INTEGRATION)
    head, tail = runtime[:at], runtime[at:]
    for old, new in COUNTED.items():
        assert old in tail, old
        tail = tail.replace(old, new, 1)
    (sources / "runtime.c").write_text(head + tail)
    program = folder / "loop"
    subprocess.run(
        [
            shutil.which("cc"), "-std=gnu99", "-O2", "-fPIC", "-ffp-contract=off", "-o", str(program),
            str(HERE / "chain_loop.c"), *(str(sources / n) for n in ("kernels.c", "model.c", "fmi2.c")),
            "-I", str(sources), "-lm",
        ],
        check=True,
    )  # fmt: skip
    fmu = Fmu(file)
    references = [str(fmu.variables[n].valueReference) for n in ("phi", "w")]
    fmu.close()
    output = subprocess.run(
        [str(program), *references, str(seconds), *map(str, STEPS)],
        check=True,
        capture_output=True,
        text=True,
    ).stdout
    *rows, costs = ([float(x) for x in line.split()] for line in output.splitlines())
    return dict(zip(STEPS, rows, strict=True)), [1e-9 * x for x in costs]


class Ours:
    """The FMU as the machine of the comparison, which has no material, two turns from its state after two."""

    def __init__(self, fmu: Fmu, start: dict[str, float]) -> None:
        self.fmu, self.start = fmu, start | {"w": W, "phi": 0.5 * math.pi}
        self.names = ["left.rocker_joint.fx", "left.rocker_joint.fy"]
        N = WALLS + WEBS
        self.states = [f"left.{x}_{k + 1}" for x in ("theta", "omega") for k in range(N)]
        self.before = 4.0 * math.pi / W

    def run(self, tolerance: float, steps: int, at: int = 1):
        """Forces at every `at`-th of `steps` steps, the states at the beginning, and the time of all steps [s]."""
        unit = Instance(self.fmu, "unit", [])
        # to the begin exactly alike for any tolerance: it is tunable
        unit.initialize(self.start | {"tolerance": 1e-12}, 0.0)
        unit.finish_initialization()
        unit.step(0.0, self.before)
        states, handle, h = unit.get(self.states), unit.handle(self.names), self.before / steps
        unit.set(["tolerance"], [tolerance])
        rows, began = [list(unit.read(handle))], time.perf_counter()
        for k in range(steps):
            unit.step(self.before + k * h, h)
            if (k + 1) % at == 0:
                rows.append(list(unit.read(handle)))
        duration = time.perf_counter() - began
        unit.close()
        return np.array(rows), states, duration


def against_exudyn(console: Console, file: Path) -> float | None:
    """Times that ours is faster than exudyn; None where there is no comparison."""
    sys.path.insert(0, str(HERE.parent / "tests"))
    try:
        import exudyn
        import test_exudyn_chain as other
    # pytest's own "skip" where exudyn is missing is no Exception
    except BaseException as reason:
        console.print(f"exudyn is missing, no comparison ({reason})")
        return None
    from test_chain import M, organ

    from chainunit.groups.chain import Rods

    exudyn.config.printToConsole = False
    start = {
        "left.material_mass": 0.0,
        "right.material_mass": 0.0,
        "z": M["z"],
        "c": M["c_frame"],
        "hy": M["hy"],
    }
    fmu = Fmu(file)
    ours = Ours(fmu, start)
    instants = 252  # of two turns, 5 ms apart
    exact, states, _ = ours.run(1e-12, instants)
    peak = np.max(np.hypot(*exact.T))

    def wrong(found) -> float:
        return float(np.max(np.hypot(*(found - exact)[1:].T)) / peak)

    lengths, masses = organ(WALLS + WEBS)
    damping = [1.0, *0.24 / (0.5 * (lengths[:-1] + lengths[1:])), 1.0]

    class Case:
        number, begin, end = WALLS + WEBS, 0.0, ours.before
        rods = Rods(lengths, masses, damping)
        theta, omega = np.array(states[: WALLS + WEBS]), np.array(states[WALLS + WEBS :])
        spent = 0.0

        def rocker(self, t):
            began = time.perf_counter()
            psi, first, second = other.rocker(0.5 * math.pi + W * (ours.before + t), 1.0)
            found = psi, first * W, second * W * W
            self.spent += time.perf_counter() - began
            return found

    table = Table(title="Two turns, equal accuracy", title_justify="left")
    for column in ("what", "error", "time [ms]", "times real time"):
        table.add_column(column, justify="right")

    def row(what: str, error: float, spent: float) -> None:
        table.add_row(what, f"{error:.1e}", f"{1e3 * spent:.3g}", f"{ours.before / spent:.0f}")

    best = None
    for tolerance in (1e-3, 1e-4, 1e-5, 1e-6, 1e-7):
        for steps in (63, 252):  # of 20 and 5 ms
            at = max(1, steps // instants)
            every = instants // steps if steps < instants else 1
            found = [ours.run(tolerance, steps, at) for _ in range(5)]
            error = float(np.max(np.hypot(*(found[0][0] - exact[::every])[1:].T)) / peak)
            spent = min(each[2] for each in found)
            row(f"ours, tolerance {tolerance:g}, steps of {1e3 * ours.before / steps:.3g} ms", error, spent)
            if error < ERROR and (best is None or spent < best):
                best = spent
    fmu.close()
    theirs = None
    for steps in (504, 1008, 2016, 4032):
        for newton in ((1e-8, 1e-10), (1e-12, 1e-14)):
            spent = math.inf
            for _ in range(3):
                case, began = Case(), time.perf_counter()
                found = other.by_exudyn(case, steps, newton)
                spent = min(spent, 2.0 * (time.perf_counter() - began - case.spent))
            force = np.stack([found[f"pin.{case.number}.{x}"][:: steps // instants] for x in "xy"], axis=-1)
            error = wrong(force)
            row(f"exudyn, {steps} steps, Newton to {newton[0]:g}, one side doubled", error, spent)
            if error < ERROR and (theirs is None or spent < theirs):
                theirs = spent
    console.print(table)
    if best is None or theirs is None:
        console.print(f"One of both never is as accurate as {ERROR:g}.")
        return None
    console.print(
        f"The fastest with an error below {ERROR:g}: {theirs / best:.0f} times faster (demanded: {FASTER:g})."
    )
    return theirs / best


def main() -> None:
    options, rows = parser().parse_args(), []
    console = Console(width=110)
    with tempfile.TemporaryDirectory() as folder:
        file = export(flexible(WALLS, WEBS), Path(folder) / "machine.fmu")
        result, (one, other) = from_c(file, Path(folder))
        table = Table(
            title=f"{WALLS + WEBS} rods a side, {W:g} rad/s; demanded: {DEMANDED:g} times real time",
            title_justify="left",
        )
        for column in (
            "step",
            "times real time",
            "limit",
            "share",
            "right-hand sides a second",
            "projections",
        ):
            table.add_column(column, justify="right")
        for step, (fast, evaluations, projections) in result.items():
            limit = 1.0 / (evaluations * one + projections * other)
            rows.append({"step": step, "rate": fast, "limit": limit})
            table.add_row(
                f"{1e3 * step:g} ms", f"{fast:.0f}", f"{limit:.0f}", f"{fast / limit:.2f}", f"{evaluations:.0f}",
                f"{projections:.0f}",
            )  # fmt: skip
        console.print(table)
        console.print(f"One right-hand side takes {1e6 * one:.2f} us, one projection {1e6 * other:.2f} us.")
        faster = against_exudyn(console, file)
    save(options.json, {
        "rods": WALLS + WEBS, "speed": W, "rows": rows, "exudyn": faster, "demanded": DEMANDED,
        "demanded_exudyn": FASTER, "error": ERROR,
    })  # fmt: skip


if __name__ == "__main__":
    main()
