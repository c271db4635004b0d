# %% [markdown]
# Random overloads
#
# 1,000 runs of 2 s each with a step of 1 ms, on two processes, with native FMUs; the limit is 120 s on two cores.
# The floor beside it is the importer's own: as many steps in which fmpy only calls the FMUs (set, step, get).

# %%
from __future__ import annotations

import tempfile
import time
from pathlib import Path

from chainunit.drives.dc_motor import DcMotor
from chainunit.study import monte_carlo
from chainunit.study.config import parse
from chainunit.study.drive import Drive
from chainunit.system.instance import Fmu, Instance

STUDY = "[monte_carlo]\nruns = 1000\nduration = 2\n[coupling]\ntrip_torque = 1000\n"


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


def main() -> None:
    config = parse(STUDY)
    drive = Drive(DcMotor, config.motor, config.machine)
    with tempfile.TemporaryDirectory() as folder:
        files, _ = drive.export(Path(folder))
        task = monte_carlo.Task(config, drive, files, 6.7)
        began = time.perf_counter()
        result = monte_carlo.run(task, Path(folder), lambda *said: None, workers=2)
        duration = time.perf_counter() - began
        floor = 1000 * importer(files) / 2
    print(f"{result.runs} runs of 2 s in {duration:.0f} s on two processes (limit 120 s);")
    print(f"{duration / floor:.1f} times the time of fmpy alone for the same calls ({floor:.0f} s).")


if __name__ == "__main__":
    main()
