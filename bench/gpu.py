# %% [markdown]
# States per second on a GPU
#
# `ChamberForces` by the engine "cuda", in double precision: the chosen outputs stored, and peak and root mean square
# over the angles of many cranks, with arguments and results on the device. Beside each rate stands the limit: the
# bytes of arguments and results at the rate at which the device copies its own memory. Needs CuPy and a GPU; without
# a GPU `tests/test_cuda.py` compares the same kernels with numpy. The exit status is 1 if a goal is missed.

# %%
from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from figures import parser, save
from other_engines import LOADS, W
from states import ANGLES, CHOSEN

from chainunit import ChainUnitMachine, InputError
from chainunit.batch import Histogram, cuda
from chainunit.batch.equations import equations

STORED, REDUCED, DEVIATION = 10e9, 10e9, 1e-13
"""What is demanded of one H100: states a second with chosen outputs stored and reduced, and the largest deviation
from numpy in parts of the peak."""
SIZES, CRANKS = (2**20, 2**24, 2**26), 2**17
RESIDENT = (4, 5, 6, 8)
"""Numbers of blocks on a processor of the device that are tried."""
ENDS = {"phi": (0.0, 2.0 * np.pi), "w": (-6.0, 6.0), "a": (-9.0, 9.0)}


class Device:
    """The device, and the machine on it."""

    def __init__(self) -> None:
        self.cupy = cuda.cupy_()
        self.machine = ChainUnitMachine()
        self.rows: list[dict[str, Any]] = []

    @property
    def name(self) -> str:
        """The name of the device."""
        return self.cupy.cuda.runtime.getDeviceProperties(0)["name"].decode()

    def seconds(self, call: Any, rounds: int = 7) -> float:
        """The least time of a call by the events of the device, after one round that does not count."""
        call()
        spent = []
        for _ in range(rounds):
            begin, end = (self.cupy.cuda.Event() for _ in range(2))
            begin.record()
            call()
            end.record()
            end.synchronize()
            spent.append(1e-3 * self.cupy.cuda.get_elapsed_time(begin, end))
        return min(spent)

    def copy_rate(self, count: int) -> float:
        """Bytes a second that the device reads and writes while it copies so many numbers."""
        source, target = self.cupy.zeros(count), self.cupy.zeros(count)
        return 2.0 * source.nbytes / self.seconds(lambda: self.cupy.copyto(target, source))

    def add(self, work: str, states: int, spent: float, limit: float | None, **more: Any) -> None:
        """Take down a measurement."""
        row = {"work": work, "states": states, "rate": states / spent, "limit": limit} | more
        self.rows.append(row)
        of = "" if limit is None else f" of {1e-9 * limit:.2f}"
        print(f"{work:64} {states:11,} states: {1e-9 * row['rate']:6.2f}{of} G/s", flush=True)

    def motion(self, count: int) -> dict[str, Any]:
        """So many states in any motion, on the device."""
        draw = self.cupy.random.default_rng(1).uniform
        return LOADS | {
            name: xr.DataArray(draw(low, high, count), dims="state") for name, (low, high) in ENDS.items()
        }

    def stored(self, count: int) -> None:
        """The chosen outputs, whole calls in the memory of an earlier result, and the kernels alone."""
        values, bytes_of_state = self.motion(count), 8 * (len(ENDS) + len(CHOSEN)) + 2
        limit = self.copy_rate(count) / bytes_of_state
        first = self.machine.batch(values, list(CHOSEN), engine="cuda")
        spent = self.seconds(lambda: self.machine.batch(values, list(CHOSEN), engine="cuda", out=first))
        self.add(f"{len(CHOSEN)} outputs stored, whole calls", count, spent, limit)
        for resident in RESIDENT:
            spent, about = self.kernels(values, count, resident)
            self.add(
                f"{len(CHOSEN)} outputs stored, kernels, {resident} blocks a processor",
                count,
                spent,
                limit,
                **about,
            )

    def kernels(self, values: dict[str, Any], count: int, resident: int) -> tuple[float, dict[str, Any]]:
        """The time of the kernels alone, with so many blocks on a processor; registers and local bytes."""
        own = equations(self.machine.model, CHOSEN, ())
        start = {v.name: v.quantity.start for v in own.arguments} | self.machine.by_name | values
        entry = {variable.name: place for place, variable in own.entries.items()}
        before, cuda._RESIDENT = cuda._RESIDENT, resident
        try:
            kernel = cuda.CudaKernel(own, [entry[name] for name in ENDS], (), self.cupy)
        finally:
            cuda._RESIDENT = before
        by_entry = {e: start[name] for name, e in entry.items()}
        uniform = [np.array([by_entry[e]], float) for e in kernel.inputs]
        columns = [by_entry[e].data[None, :] for e in kernel.columns]
        out = self.cupy.empty((len(CHOSEN), 1, count))
        reason = self.cupy.zeros((1, count), np.int16)
        spent = self.seconds(lambda: kernel(uniform, columns, out, reason, (1, count), np.zeros(1), 1))
        function = kernel.functions["stored"]
        return spent, {"registers": function.num_regs, "local": function.local_size_bytes}

    def reduced(self) -> None:
        """Peak and root mean square of the chosen outputs, and of the torque a histogram, too."""
        phi = np.linspace(0.0, 2.0 * np.pi, ANGLES, endpoint=False)
        values = LOADS | {"phi": phi, "r": np.linspace(0.1, 0.2, CRANKS), "w": W, "a": 0.0}
        peaks = {name: ["peak", "rms"] for name in CHOSEN}
        counts = {"tau": [Histogram(-100.0, 100.0, 64), "peak"]}
        for words, reduce in (
            (f"peak and rms of {len(CHOSEN)} outputs", peaks),
            ("histogram and peak of tau", counts),
        ):
            spent = self.seconds(
                lambda reduce=reduce: self.machine.batch(values, over="phi", reduce=reduce, engine="cuda")
            )
            self.add(f"{words} over {ANGLES} angles of {CRANKS:,} cranks", ANGLES * CRANKS, spent, None)

    def to_host(self, count: int) -> None:
        """The chosen outputs, copied to the host."""
        values = self.motion(count)
        spent = self.seconds(
            lambda: self.machine.batch(values, list(CHOSEN), engine="cuda", on_host=True), rounds=2
        )
        self.add(f"{len(CHOSEN)} outputs copied to the host", count, spent, None)

    def deviation(self) -> float:
        """The largest deviation of all outputs and reductions from numpy, in parts of the peak."""
        rng = np.random.default_rng(2)
        states = LOADS | {
            name: xr.DataArray(rng.uniform(*ends, 4096), dims="state") for name, ends in ENDS.items()
        }
        turn = LOADS | {"phi": np.linspace(0.0, 6.0, 720), "r": np.linspace(0.1, 0.2, 50), "w": W}
        requests = {name: ["min", "max", "peak", "mean", "rms"] for name in CHOSEN}
        worst = 0.0
        for values, more in ((states, {}), (turn, {"over": "phi", "reduce": requests})):
            device, wanted = (
                self.machine.batch(values, engine=engine, on_host=True, **more)
                for engine in ("cuda", "numpy")
            )
            for name, y in wanted.data_vars.items():
                off = float(np.max(np.abs(device[name].values - y.values)))
                worst = max(worst, off / (float(np.max(np.abs(y))) or 1.0))
        return worst


def goals(rows: list[dict[str, Any]], worst: float) -> list[dict[str, Any]]:
    """What is demanded, beside what was measured."""
    wanted = (
        ("states a second, outputs stored", STORED, max(r["rate"] for r in rows if "stored" in r["work"])),
        ("states a second, peak and rms", REDUCED, max(r["rate"] for r in rows if "rms" in r["work"])),
    )
    made = [{"goal": text, "demanded": low, "measured": x, "met": x >= low} for text, low, x in wanted]
    made.append(
        {
            "goal": "largest deviation from numpy",
            "demanded": DEVIATION,
            "measured": worst,
            "met": worst <= DEVIATION,
        }
    )
    for goal in made:
        met = "met" if goal["met"] else "missed"
        print(f"{goal['goal']:40} {goal['measured']:10.3g}, demanded {goal['demanded']:g}: {met}")
    return made


def main() -> None:
    options = parser().parse_args()
    try:
        device = Device()
    except InputError as error:
        raise SystemExit(f"{error}: nothing to measure") from None
    worst, copy = device.deviation(), device.copy_rate(2**28)
    print(f"{device.name}: copies {1e-12 * copy:.2f} TB/s, worst deviation {worst:.1e}")
    for count in SIZES:
        device.stored(count)
    device.reduced()
    device.to_host(SIZES[1])
    made = goals(device.rows, worst)
    save(
        options.json,
        {"device": device.name, "copy": copy, "worst": worst, "rows": device.rows, "goals": made},
    )
    if not all(goal["met"] for goal in made):
        raise SystemExit(1)


if __name__ == "__main__":
    main()
