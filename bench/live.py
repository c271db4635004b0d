# %% [markdown]
# The live page
#
# Times of a frame after the move of a slider (equations over a turn, tables, plots, picture) and of a transient after
# its release, measured by the page itself in Chromium, beside the same equations in native code: a turn of all
# outputs by the batch, and the same event by the compiled loop of the sweeps. And the time to write such a page.
#
# A frame has 16 ms at 60 pictures a second; a hand does not notice 100 ms after a release.

# %%
from __future__ import annotations

import json
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from chainunit.batch import evaluate
from chainunit.report.html import render
from chainunit.report.live.page import live_page
from chainunit.study import config as study_files
from chainunit.study.block_runs import BlockRuns, RunPoint
from chainunit.study.choice import choose
from chainunit.study.parts import example
from chainunit.study.rig import Rig

ROOT = Path(__file__).parents[1]
sys.path.append(str(ROOT / "tests"))
from browser import Page  # noqa: E402

MOVES, RELEASES = 60, 12
SCRIPT = """(async () => {
  const root = document.getElementById("live-root"), range = document.querySelector("input[type=range][data-q]");
  const rest = () => new Promise((go) => requestAnimationFrame(() => setTimeout(go)));
  const frames = [], transients = [];
  for (let k = 1; k <= MOVES; k++) {
    range.value = 20 + k;
    range.dispatchEvent(new Event("input"));
    await rest();
    frames.push(Number(root.dataset.frame));
  }
  for (let k = 0; k < RELEASES; k++) {
    const before = root.dataset.runs;
    range.value = 60 + k;
    range.dispatchEvent(new Event("input"));
    range.dispatchEvent(new Event("change"));
    while (root.dataset.runs === before) await rest();
    transients.push(Number(root.dataset.transient));
  }
  return JSON.stringify([frames, transients]);
})()"""


def best(function, times: int = 5) -> float:
    """The least time of a call [ms]."""
    spent = []
    for _ in range(times):
        began = time.perf_counter()
        function()
        spent.append(1e3 * (time.perf_counter() - began))
    return min(spent)


def in_browser(file: Path, folder: Path) -> tuple[list[float], list[float]]:
    with Page(file, folder / "browser") as page:
        page.wait("document.getElementById('live-root').dataset.runs")
        script = SCRIPT.replace("MOVES", str(MOVES)).replace("RELEASES", str(RELEASES))
        frames, transients = json.loads(page.evaluate(script))
    return frames, transients


def row(name: str, folder: Path) -> list[str]:
    config = study_files.parse(example(name))
    file = folder / f"{name}.html"
    file.write_text(render(live_page_of(name, folder)), "utf-8")
    frames, transients = in_browser(file, folder)
    choice = choose(config, folder)
    machine, speed = choice.drive.machine, float(config.run.crank_speed)
    angles = np.linspace(0.0, 2.0 * np.pi, 720, endpoint=False) * machine.ratio
    given = {"phi": angles, "w": speed * machine.ratio}
    turn = best(lambda: evaluate(machine.model, given, parameters=machine.p))
    rig = Rig(config.operation, choice.drive, None).plain
    event = next(each for each in config.events.values() if rig.takes(each) and not each.from_rest)
    block = BlockRuns(rig, [event])
    point = RunPoint(rig, event, event.time_followed(config.operation.turn))
    run = best(lambda: list(block.runs([point])))
    frame, transient = statistics.median(frames), statistics.median(transients)
    size = f"{len(file.read_bytes()) / 1e3:.0f}"
    return [
        name, size, f"{frame:.1f}", f"{max(frames):.1f}", f"{frame / turn:.1f}", f"{transient:.0f}",
        f"{max(transients):.0f}", f"{transient / run:.1f}",
    ]  # fmt: skip


def live_page_of(name: str, folder: Path):
    study = folder / f"{name}.toml"
    study.write_text(example(name), "utf-8")
    return live_page(study, None, folder)


def main() -> None:
    table = Table(
        "page", "kB", "frame, ms", "longest", "over native", "start and event, ms", "longest", "over native"
    )
    with tempfile.TemporaryDirectory() as folder:
        for name in ("chain-unit", "knife"):
            table.add_row(*row(name, Path(folder)))
        command = [sys.executable, "-m", "chainunit", "live", "-o", str(Path(folder) / "live.html")]
        subprocess.run(command, check=True, capture_output=True)
        written = best(lambda: subprocess.run(command, check=True, capture_output=True), 3)
    Console().print(table)
    print(f"chainunit live, warm: {written / 1e3:.1f} s, of which Python and its libraries take most.")


if __name__ == "__main__":
    main()
