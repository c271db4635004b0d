# %% [markdown]
# Models as WebAssembly
#
# The size of a model's module without slopes, packed by zlib too, the time to write it, and for all outputs at one
# state in node; and the time of a jam of the packaged drive over 4 s with a row every millisecond: in node, and from
# Python where there is no C compiler, by wasmtime and by FMUs in Python.

# %%
from __future__ import annotations

import sys
import tempfile
import time
import zlib
from pathlib import Path
from typing import Any

from figures import least
from rich.console import Console
from rich.table import Table

from chainunit.batch import transients
from chainunit.core.model import Model
from chainunit.core.native.compilers import compiler
from chainunit.core.symbolic_trace import trace
from chainunit.core.wasm.module import WasmModule, wasm_module
from chainunit.drives.dc_motor import DcMotor
from chainunit.models import MODELS, model_named
from chainunit.study.config import parse
from chainunit.study.drive import Drive
from chainunit.system import CompiledSimulation, CoSimulation, Profile, Simulation, System, compiled, export

ROOT = Path(__file__).parents[1]
sys.path.append(str(ROOT / "tests"))
from wasm_hosts import in_node, numbers, run_steps  # noqa: E402

GALLERY = ("chain_unit", "knife_drive", "slider_crank_press", "stephenson_six_bar")
CALLS, ROUNDS = 20_000, 8


def prepared(module: WasmModule, values: list[float], inputs: list[float]) -> list[tuple]:
    """The steps to a state: parameters, inputs, and all that follows from them."""
    d = module.description
    return [
        ("write", d["parameters"]["address"], numbers(values)),
        ("write", d["inputs"]["address"], numbers(inputs)),
        *(("call", name, []) for name in ("derive", "start") if name in d["functions"]),
    ]


def row(name: str, model: type[Model]) -> list[str]:
    trace(model)
    began = time.perf_counter()
    module = wasm_module(model, slopes=False)
    written = time.perf_counter() - began
    starts = [
        [v.quantity.start or 0.0 for v in of.variables] for of in (model.parameter_layout, model.input_layout)
    ]
    every = (1 << len(module.description["groups"])) - 1
    timed = ("time", "values", [every], ROUNDS, CALLS)
    state = in_node(module.content, [*prepared(module, *starts), timed])[-1]
    size, packed = len(module.content), len(zlib.compress(module.content, 9))
    outputs = str(len(module.description["outputs"]["names"]))
    return [name, outputs, f"{size / 1e3:.1f}", f"{packed / 1e3:.1f}", f"{written:.2f}", f"{state:.2f}"]


def jam() -> None:
    config = parse("")
    drive = Drive(DcMotor, config.motor.parameters, config.machine)
    whole = compiled(drive.graph)
    model = whole.model
    module = wasm_module(model, slopes=False)
    inputs = model.input_layout.values(model.input_layout.from_names(drive.loads(config.feed)))
    signals = {
        "motor.w_ref": Profile(0.0, ((0.0, 0.6, 3.0 * drive.ratio),)),
        "machine.left.processing_force": Profile(10.0, ((2.0, 0.02, 1500.0), (2.4, 0.02, 10.0))),
    }
    names = ["motor.tau", "machine.rocker.tau", "motor.w", "motor.armature.i"]
    steps = run_steps(module.description, signals, names, begin=0.0, step=1e-3, rows=4001)
    run = next(step for step in steps if step[:2] == ("call", "run"))
    start = prepared(module, model.parameter_layout.values(whole.parameters), inputs)
    before = [*start, *steps[: steps.index(run)], run]
    to_rows, dense = (
        in_node(module.content, [*before, ("time", function, run[2], ROUNDS, 1)])[-1] / 1e3
        for function in ("run", "dense")
    )
    print(
        f"DC motor on the chain unit, one module of {len(module.content) / 1e3:.1f} kB: 4 s of a jam with 4001 rows "
        f"in {to_rows:.0f} ms in node with steps that end at rows, in {dense:.0f} ms with rows between them."
    )
    ways = from_python(drive, drive.loads(config.feed) | signals, names)
    print("From Python: " + ", ".join(f"{name} {1e3 * took:.0f} ms" for name, took in ways.items()))
    print(f"wasmtime is {ways['FMUs in Python'] / ways['wasmtime']:.0f} times as fast as FMUs in Python")


def from_python(drive: Drive, signals: dict[str, Any], names: list[str]) -> dict[str, float]:
    """The least time of the jam by each way [s]."""
    times = {}

    def timed(way: str, kind: type[Simulation], system: System, rounds: int) -> None:
        with kind(system, signals) as simulation:
            simulation.save()

            def whole() -> None:
                simulation.restore()
                simulation.run(4.0, 1e-3, names=names)

            times[way] = least(whole, rounds).wall

    with tempfile.TemporaryDirectory() as folder:
        for way, backend, rounds in (("native FMUs", "native", ROUNDS), ("FMUs in Python", "python", 2)):
            if backend == "python" or compiler():
                system, _ = export(drive.graph, Path(folder) / backend, backend)
                timed(way, CoSimulation, system, rounds)
    if compiler():
        timed("native code as one system", CompiledSimulation, drive.graph, ROUNDS)
    transients.compiler = lambda: None
    timed("wasmtime", CompiledSimulation, drive.graph, ROUNDS)
    return times


def main() -> None:
    table = Table("model", "outputs", "kB", "packed, kB", "written in, s", "all outputs, us")
    for name, model in MODELS.items():
        table.add_row(*row(name, model))
    for name in GALLERY:
        table.add_row(*row(f"{name}.toml", model_named(str(ROOT / "examples" / "linkages" / f"{name}.toml"))))
    Console().print(table)
    jam()


if __name__ == "__main__":
    main()
