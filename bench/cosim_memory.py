# %% [markdown]
# Memory of a long co-simulation
#
# The packaged machine with its motor, native FMUs, for 600 s at 1 ms: the largest memory of the process (its resident
# set), each way of keeping rows in a process of its own. "a second" shows the share of the libraries alone.

# %%
from __future__ import annotations

import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from figures import parser, save

from chainunit.study.choice import choose
from chainunit.study.config import load
from chainunit.study.drive_fmus import export_drive, with_files
from chainunit.system import CoSimulation

CHOSEN = ("motor.w", "motor.tau", "machine.tau")
WAYS = {
    "a second": {},
    "all rows, in memory": {},
    "each 10th row": {"every": 10},
    "three variables": {"names": CHOSEN},
    "all rows, to a file": {"file": Path("run.nc")},
}


def one(way: str, folder: Path, seconds: float) -> dict[str, float | str]:
    config = load()
    drive = choose(config, folder, lambda *_: None).drive
    files = {name: folder / f"{part.model.name}.fmu" for name, part in drive.graph.components.items()}
    options = dict(WAYS[way])
    if "file" in options:
        options["file"] = folder / options["file"]
    signals = {**drive.loads(config.feed), **drive.reference(config.run.crank_speed, config.run.ramp)}
    began = time.perf_counter()
    with CoSimulation(with_files(drive, files), signals) as simulation:
        run = simulation.run(1.0 if way == "a second" else seconds, 1e-3, **options)
    rows, variables = run.sizes["time"], len(run.data_vars)
    run.close()
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    duration = time.perf_counter() - began
    print(f"{way:22} {rows:7} rows of {variables:3} variables, {peak:5.0f} MB, {duration:4.0f} s", flush=True)
    return {"way": way, "rows": rows, "variables": variables, "memory": peak, "duration": duration}


def main() -> None:
    options, figures = parser(), []
    options.add_argument("--seconds", type=float, default=600.0)
    options.add_argument("--way", choices=list(WAYS))
    options.add_argument("--folder", type=Path)
    values = options.parse_args()
    if values.way:
        save(values.json, one(values.way, values.folder, values.seconds))
        return
    with tempfile.TemporaryDirectory() as folder:
        config = load()
        export_drive(choose(config, Path(folder), lambda *_: None).drive, Path(folder))
        for way in WAYS:
            file = Path(folder) / "figures.json"
            command = [sys.executable, __file__, "--way", way, "--folder", folder, "--json", str(file)]
            subprocess.run([*command, "--seconds", str(values.seconds)], check=True)
            figures.append(json.loads(file.read_text("utf-8")))
    save(values.json, {"seconds": values.seconds, "ways": figures})


if __name__ == "__main__":
    main()
