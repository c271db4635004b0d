# %% [markdown]
# Models in JavaScript
#
# The size of a model's text, packed by zlib too, the time to write it, and that of all outputs at one state in node;
# and the time of a jam of the packaged drive over 4 s with a row every millisecond: in node, and each way of Python.

# %%
from __future__ import annotations

import sys
import tempfile
import time
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from figures import least
from rich.console import Console
from rich.table import Table

from chainunit.batch import transients
from chainunit.core.model import Model
from chainunit.core.printing.javascript import model_text, program
from chainunit.core.symbolic_trace import trace
from chainunit.drives.dc_motor import DcMotor
from chainunit.models import MODELS, model_named
from chainunit.study.config import parse
from chainunit.study.drive import Drive
from chainunit.system import CompiledSimulation, CoSimulation, Profile, Simulation, System, compiled, export

ROOT = Path(__file__).parents[1]
sys.path.append(str(ROOT / "tests"))
from javascript_hosts import in_node, profile_numbers  # noqa: E402

GALLERY = ("chain_unit", "knife_drive", "slider_crank_press", "stephenson_six_bar")
LEAST = """
const least = (call, calls, rounds = 8) => {
  let time = Infinity;
  for (let k = 0; k < rounds; ++k) {
    const begin = performance.now();
    for (let n = 0; n < calls; ++n) call();
    time = Math.min(time, (performance.now() - begin) / calls);
  }
  return time;
};
const m = models.m;
"""
"""The least time of a call [ms]."""
JAM = """
m.p.set(given.p);
m.u.set(given.u);
m.derive?.();
const signals = Object.entries(given.signals).map(([name, numbers]) => [m.about.u.indexOf(name), numbers]);
return [false, true].map((between) => least(() => {
  m.start();
  m.run({ begin: 0, step: 1e-3, rows: 4001, signals, between, row() {} });
}, 1));
"""


def row(name: str, model: Model) -> list[str]:
    trace(model)
    began = time.perf_counter()
    text = model_text(model)
    written = time.perf_counter() - began
    script = LEAST + "m.derive?.(); m.start?.(); return [m.y.length, 1e3 * least(m.values, 20000)];"
    outputs, state = in_node({"m": text}, script)
    size, packed = len(text), len(zlib.compress(program({"m": text}).encode(), 9))
    return [name, str(outputs), f"{size / 1e3:.1f}", f"{packed / 1e3:.1f}", f"{written:.2f}", f"{state:.2f}"]


def jam() -> None:
    config = parse("")
    drive = Drive(DcMotor, config.motor.parameters, config.machine)
    whole = compiled(drive.graph)
    model = whole.model
    signals = {
        "motor.w_ref": Profile(0.0, ((0.0, 0.6, 3.0 * drive.ratio),)),
        "machine.left.processing_force": Profile(10.0, ((2.0, 0.02, 1500.0), (2.4, 0.02, 10.0))),
    }
    given = {
        "p": np.array(model.parameter_layout.values(whole.parameters), float),
        "u": np.array(
            model.input_layout.values(model.input_layout.from_names(drive.loads(config.feed))), float
        ),
        "signals": {name: profile_numbers(signal) for name, signal in signals.items()},
    }
    to_rows, between = in_node({"m": model}, LEAST + JAM, given)
    print(
        f"DC motor on the chain unit: 4 s of a jam with 4001 rows in {to_rows:.0f} ms in node with steps that end at "
        f"rows, in {between:.0f} ms with rows between them."
    )
    ways = from_python(drive, drive.loads(config.feed) | signals)
    print("From Python: " + ", ".join(f"{way} {1e3 * spent:.0f} ms" for way, spent in ways.items()))


def from_python(drive: Drive, signals: dict[str, Any]) -> dict[str, float]:
    """The least time of the jam by each way [s]."""

    def timed(kind: type[Simulation], system: System, rounds: int) -> float:
        with kind(system, signals) as simulation:
            simulation.save()

            def whole() -> None:
                simulation.restore()
                simulation.run(4.0, 1e-3, names=["motor.w", "machine.tau"])

            return least(whole, rounds).wall

    ways = {}
    with tempfile.TemporaryDirectory() as folder:
        for backend, rounds in (("python", 2), ("native", 5)):
            system, _ = export(drive.graph, Path(folder) / backend, backend)
            ways[f"FMUs, {backend}"] = timed(CoSimulation, system, rounds)
    ways["one system, native"] = timed(CompiledSimulation, drive.graph, 5)
    transients.compiler = lambda: None
    ways["one system, Python"] = timed(CompiledSimulation, drive.graph, 2)
    return ways


def main() -> None:
    table = Table("model", "outputs", "kB", "packed with steps, kB", "written in, s", "all outputs, us")
    for name, model in MODELS.items():
        table.add_row(*row(name, model))
    for name in GALLERY:
        table.add_row(*row(f"{name}.toml", model_named(str(ROOT / "examples" / "linkages" / f"{name}.toml"))))
    Console().print(table)
    jam()


if __name__ == "__main__":
    main()
