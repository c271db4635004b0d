# %% [markdown]
# States per second
#
# `ChamberForces` over arrays of crank angle, speed and acceleration with a steady feed, by each of our engines, and
# the same machine in other engines, in one run. Rates are those of whole calls of `Machine.batch`, checks of the
# arguments and memory of the results included: the least of some rounds, by the clock, and by the processors' time as
# if no other process had taken their time. Beside each rate its limit, see `vector_limit`; beside each engine the
# error at the joints, and the deviation of its torque.

# %%
from __future__ import annotations

import json
import os
import platform
from pathlib import Path
from typing import Any

import numpy as np
import other_engines
import vector_limit
import xarray as xr
from figures import least, parser, save
from other_engines import LOADS, W

from chainunit import ChainUnitMachine, batch
from chainunit.core.native.compilers import compiler
from chainunit.core.symbolic_trace import outputs_of
from chainunit.machines.chain_unit import ChamberForces

ALL = tuple(v.name for v in outputs_of(ChamberForces))
CHOSEN = (
    "tau",
    "rocker.tau",
    "rocker.psi",
    *(f"{pin}.f{axis}" for pin in ChamberForces.joints for axis in "xy"),
)
BY = ("r", "l", "h", "e", "coupler.m")
MOTION = ("phi", "w", "a")
BLOCK, MANY = 2**16, 2**20
ANGLES = 720
CORES = os.cpu_count() or 1
POINTS = Path(__file__).parents[1] / "tests" / "data" / "chamber_forces.json"
STORED, EVERY, FASTER = 40e6, 12e6, 15.0
"""What is demanded on two cores: states a second with chosen outputs, with all, and times the rate of numpy."""


def motion(n: int) -> dict[str, Any]:
    """So many states of the machine in any motion."""
    rng = np.random.default_rng(1)
    of = {"phi": (0.0, 2.0 * np.pi), "w": (-6.0, 6.0), "a": (-9.0, 9.0)}
    return LOADS | {name: xr.DataArray(rng.uniform(*ends, n), dims="state") for name, ends in of.items()}


class Rates:
    """The rows of the table."""

    def __init__(self) -> None:
        self.machine = ChainUnitMachine()
        self.rows: list[dict[str, Any]] = []

    def add(self, key: str, work: str, n: int, threads: Any, call: Any, rounds: int, **more: Any) -> None:
        """Measure a call of so many states."""
        spent = least(call, rounds)
        count = threads if isinstance(threads, int) else 1
        row = {"key": key, "work": work, "states": n, "threads": threads, "rate": n / spent.wall}
        self.rows.append(row | {"cpu": n * count / spent.processor} | more)
        print(f"{work:72} {n:8} states, {threads} threads: {1e-6 * row['rate']:7.2f} million/s", flush=True)

    def native(
        self, key: str, outputs: tuple[str, ...], n: int, by: tuple[str, ...] = (), again: bool = False
    ) -> None:
        """The native engine, on one thread and on all, beside its limits; `again` in the memory of an earlier
        result."""
        values, columns = motion(n), len(outputs) * (1 + len(by))
        limit = vector_limit.arithmetic(vector_limit.operations(ChamberForces, outputs, MOTION, by))
        words = f"tau and its derivatives by {len(by)} parameters" if by else f"{columns} outputs stored"
        words += ", in memory of an earlier call" if again else ""
        pages, out = (
            ("used", self.machine.batch(values, list(outputs), by=list(by))) if again else ("fresh", None)
        )
        for threads in sorted({1, CORES}):
            written = vector_limit.bandwidth(columns, n, threads)[pages]
            self.add(
                key, f"native, {words}", n, threads,
                lambda k=threads: self.machine.batch(values, list(outputs), by=list(by), workers=k, out=out), 12,
                arithmetic=limit * threads, memory=written / (8 * columns + 2), pages=pages, bytes=8 * columns + 2,
            )  # fmt: skip

    def cycle(self, key: str, outputs: tuple[str, ...], cranks: int = 2000) -> None:
        """Peak and root mean square over a turn, for many cranks."""
        phi = np.linspace(0.0, 2.0 * np.pi, ANGLES, endpoint=False)
        values = LOADS | {"phi": phi, "r": np.linspace(0.1, 0.2, cranks), "w": W, "a": 0.0}
        limit = vector_limit.arithmetic(vector_limit.operations(ChamberForces, outputs, ("phi",)))
        reduce = {name: ["peak", "rms"] for name in outputs}
        of = "tau" if len(outputs) == 1 else f"{len(outputs)} outputs"
        for threads in sorted({1, CORES}):
            self.add(
                key, f"native, peak and rms of {of} over {ANGLES} angles of {cranks} cranks", ANGLES * cranks,
                threads,
                lambda k=threads: self.machine.batch(values, over="phi", reduce=reduce, workers=k), 7,
                arithmetic=limit * threads,
            )  # fmt: skip

    def arrays(self) -> None:
        """The engines of arrays."""
        values = motion(2 * BLOCK)
        plain = {name: x.values if isinstance(x, xr.DataArray) else x for name, x in values.items()}
        for key, names in (("chosen", CHOSEN), ("all", ALL)):
            self.add(
                f"numpy {key}", f"numpy engine, {len(names)} outputs stored", 2 * BLOCK, 1,
                lambda names=names: self.machine.batch(values, list(names), engine="numpy"), 4,
            )  # fmt: skip
        self.add(
            "evaluate", f"Machine.evaluate, {len(ALL)} outputs", 2 * BLOCK, 1,
            lambda: self.machine.evaluate(plain), 4,
        )  # fmt: skip


def reference_points() -> dict[str, Any]:
    """The worst deviation of the native engine from the reference points, relative, or absolute below 1."""
    points = json.loads(POINTS.read_text("utf-8"))["points"]
    start = ChainUnitMachine().by_name | dict.fromkeys(ChamberForces.input_layout.names, 0.0)
    each = [{**start, **point["parameters"], **point["inputs"]} for point in points]
    values = {name: xr.DataArray([p[name] for p in each], dims="point") for name in start}
    out = batch.evaluate(ChamberForces, values)
    worst = max(
        abs(float(out[name][k]) - y) / max(1.0, abs(y))
        for k, point in enumerate(points)
        for name, y in point["outputs"].items()
    )
    values = sum(len(point["outputs"]) for point in points)
    print(f"{len(points)} reference points, {values} values: worst deviation {worst:.1e} (allowed: 1e-9)")
    return {"points": len(points), "values": values, "worst": worst, "allowed": 1e-9}


def engine_errors(engine: str) -> dict[str, float]:
    """Of an engine of ours along a turn: the error at the joints [m], the residual of the power balance in parts of
    the peak power, and the deviation of all chosen outputs from `Machine.evaluate` in parts of their peaks."""
    phi = np.linspace(0.0, 2.0 * np.pi, 4096, endpoint=False)
    p, machine = other_engines.MACHINE.p, other_engines.MACHINE
    turn = LOADS | {"phi": phi, "w": W, "a": 0.7}
    lengths = {("A", "Bd"): p.l, ("C", "Bd"): p.h, ("C", "A2"): p.e}
    for side in ("left", "right"):
        lengths |= {(f"A1 {side}", f"B {side}"): p.l1, ("A2", f"B {side}"): p.l2}
    pins = sorted({pin for pair in lengths for pin in pair})
    at = machine.batch(turn, [f"{axis}({pin})" for pin in pins for axis in "xy"], engine=engine)
    loop = max(
        float(np.max(np.abs(np.hypot(*(at[f"{axis}({a})"] - at[f"{axis}({b})"] for axis in "xy")) - length)))
        for (a, b), length in lengths.items()
    )
    names = ["tau", "dissipated_power", "kinetic_energy", "potential_energy"]
    out = machine.batch(turn, names, by=["phi", "w"], engine=engine)
    slope = {
        k: sum(out[f"d({name}_energy)/d({k})"] for name in ("kinetic", "potential")) for k in ("phi", "w")
    }
    power = out.tau * W
    residual = power - slope["phi"] * W - slope["w"] * 0.7 - out.dissipated_power
    wanted = machine.evaluate(turn)
    own = machine.batch(turn, list(CHOSEN), engine=engine)
    differences = {
        name: float(np.max(np.abs(own[name].values - wanted[name])) / np.max(np.abs(wanted[name])))
        for name in CHOSEN
    }
    return {
        "loop": loop, "energy": float(np.max(np.abs(residual)) / np.max(np.abs(power))),
        "torque": differences["tau"], "outputs": max(differences.values()),
    }  # fmt: skip


def goals(rows: list[dict[str, Any]], points: dict[str, Any]) -> list[dict[str, Any]]:
    """What is demanded, beside what was measured."""

    def best(*keys: str) -> dict[str, Any]:
        return max((row for row in rows if row["key"] in keys), key=lambda row: row["rate"])

    stored, every, numpy = best("chosen"), best("all"), best("numpy chosen")
    wanted = [
        ("states a second, 23 outputs stored", STORED, stored["rate"]),
        ("states a second, 23 cycle quantities in the loop", STORED, best("cycle chosen")["rate"]),
        ("states a second, every output stored", EVERY, every["rate"]),
        ("native to numpy, 23 outputs stored", FASTER, stored["rate"] / numpy["rate"]),
        ("native to numpy, every output stored", FASTER, every["rate"] / best("numpy all")["rate"]),
    ]
    made = [{"goal": text, "demanded": low, "measured": x, "met": x >= low} for text, low, x in wanted]
    made.append({
        "goal": "largest deviation from the reference points", "demanded": points["allowed"],
        "measured": points["worst"], "met": points["worst"] <= points["allowed"],
    })  # fmt: skip
    for each in made:
        met = "met" if each["met"] else "missed"
        print(f"{each['goal']:52} {each['measured']:10.3g}, demanded {each['demanded']:g}: {met}")
    return made


def main() -> None:
    options = parser().parse_args()
    if compiler() is None:
        raise SystemExit("no C compiler: there is no native engine to measure")
    points = reference_points()
    rates, missing = Rates(), {}
    for n, again in ((BLOCK, True), (MANY, True), (MANY, False)):
        rates.native("chosen", CHOSEN, n, again=again)
        rates.native("all", ALL, n, again=again)
    rates.cycle("cycle tau", ("tau",))
    rates.cycle("cycle chosen", CHOSEN)
    rates.native("derivatives", ("tau",), BLOCK, BY, again=True)
    rates.arrays()
    errors = {engine: engine_errors(engine) for engine in ("native", "numpy")}
    others, absent = other_engines.measure()
    for row in others:
        print({name: x for name, x in row.items() if x is not None})
    missing |= absent
    for name, why in missing.items():
        print(f"{name} {why}: not measured")
    kinds = ("sum", "division", "root", "sin", "cos", "asin")
    save(options.json, {
        "cores": CORES, "processor": processor(), "lanes": vector_limit.width(),
        "divider": vector_limit.divider(), "chosen": len(CHOSEN),
        "all": len(ALL),
        "by": list(BY), "rows": rates.rows, "points": points, "errors": errors, "others": others, "missing": missing,
        "costs": {kind: vector_limit.time_of(kind) for kind in kinds},
        "operations": {
            key: dict(vector_limit.operations(ChamberForces, names, MOTION))
            for key, names in (("chosen", CHOSEN), ("all", ALL))
        },
        "bandwidth": {
            str(n): {str(k): vector_limit.bandwidth(len(ALL), n, k) for k in sorted({1, CORES})}
            for n in (BLOCK, MANY)
        },
        "goals": goals(rates.rows, points),
    })  # fmt: skip


def processor() -> str:
    """The name of the processor."""
    file = Path("/proc/cpuinfo")
    lines = file.read_text().splitlines() if file.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


if __name__ == "__main__":
    main()
