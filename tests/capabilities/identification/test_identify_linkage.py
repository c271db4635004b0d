"""``chainunit identify`` on machines of linkage files, whose torque is recorded; ``watch`` knows chain units."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from command import chainunit

from chainunit.core.native.compilers import compiler
from chainunit.machines.linkages.file import read_linkage
from chainunit.machines.machine import Machine
from chainunit.reading.result_entries import ResultEntries

pytestmark = pytest.mark.skipif(compiler() is None, reason="no C compiler")
GALLERY = Path(__file__).parents[3] / "examples" / "linkages"
TURNS, ROWS = 6.0, 250.0
CASES = {
    "pump_jack": (
        1.05,
        {"machine.counterweight": (1450.0, "800 kg", "2.4 t"), "feed.fluid_load": (24e3, "10 kN", "50 kN")},
    ),
    "crank_shaper": (
        4.0,
        {"feed.cutting_force": (1900.0, "500 N", "5 kN"), "machine.guides.friction": (0.11, "0.02", "0.3")},
    ),
}
"""By file, the speed of the crank [rad/s], and the sought numbers: the true one, and its bounds."""


def record(folder, name, speed, truth):
    """Write the torque of the inverse machine along a motion with a ripple, with noise of 1 %."""
    time = np.arange(TURNS * ROWS) * (2.0 * np.pi / speed / ROWS)
    even = speed * time
    phi = even - 0.7 + 0.02 * np.cos(even + 0.4) + 0.005 * np.sin(2.0 * even)
    w = speed * (1.0 - 0.02 * np.sin(even + 0.4) + 0.01 * np.cos(2.0 * even))
    a = speed**2 * (-0.02 * np.cos(even + 0.4) - 0.02 * np.sin(2.0 * even))
    own = {key.removeprefix("machine."): x for key, x in truth.items() if key.startswith("machine.")}
    loads = {key.removeprefix("feed."): x for key, x in truth.items() if key.startswith("feed.")}
    machine = Machine(read_linkage(GALLERY / f"{name}.toml")).replace(own)
    torque = machine.evaluate({"phi": phi, "w": w, "a": a, **loads})["tau"]
    rng = np.random.default_rng(3)
    noisy = [x + 0.01 * np.sqrt(np.mean(x**2)) * rng.standard_normal(len(x)) for x in (torque, w)]
    mark = np.append(0.0, np.diff(np.floor(phi / (2.0 * np.pi))))
    head = "time [s],crank.tau [N m],crank.w [rad/s],mark [1]"
    table = np.stack([time, *noisy, mark], axis=1)
    np.savetxt(folder / "run.csv", table, "%.8g", ",", header=head, comments="")


def study(name, speed, numbers):
    file = (GALLERY / f"{name}.toml").as_posix()
    text = f'[machine]\nlinkage = "{file}"\n[run]\ncrank_speed = {speed}\n[identify]\ngain = 0\n'
    text += '[[identify.run]]\nfile = "run.csv"\n'
    for key, (_, low, high) in numbers.items():
        text += f'[[identify.parameter]]\nname = "{key}"\nfrom = "{low}"\nto = "{high}"\n'
    return text


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_a_linkage_is_identified(name, tmp_path):
    """Parameters and inputs that the file itself declares, within four deviations of the truth."""
    speed, numbers = CASES[name]
    truth = {key: true for key, (true, *_) in numbers.items()}
    record(tmp_path, name, speed, truth)
    (tmp_path / "mine.toml").write_text(study(name, speed, numbers), "utf-8")
    done = chainunit("identify", "mine.toml", "-o", "out", cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    result = ResultEntries(json.loads((tmp_path / "out" / "result.json").read_text("utf-8")))
    for key, true in truth.items():
        own = result["numbers"][key]
        assert own["told"] and abs(own["value"]["value"] - true) < 4.0 * own["deviation"]["value"], key
        assert own["deviation"]["value"] < 0.01 * true, key
    if name == "pump_jack":  # as the page has it
        deviations = [result["numbers"][key]["deviation"]["value"] for key in truth]
        assert deviations == [pytest.approx(0.9, rel=0.1), pytest.approx(21.0, rel=0.1)]
    assert all(each["is_noise"] for each in result["residuals"])
    assert "None of these runs" not in done.stdout


def test_a_linkage_is_not_watched(tmp_path):
    """The sentence says why, and names the command that knows linkages."""
    speed, numbers = CASES["pump_jack"]
    record(tmp_path, "pump_jack", speed, {key: true for key, (true, *_) in numbers.items()})
    text = study("pump_jack", speed, numbers) + '[watch]\nfile = "run.csv"\n'
    (tmp_path / "mine.toml").write_text(text, "utf-8")
    done = chainunit("watch", "mine.toml", "-o", "out", cwd=tmp_path)
    assert done.returncode == 2 and not (tmp_path / "out").exists()
    words = " ".join(done.stderr.split())
    assert (
        "mine.toml:17: watch: is of the chain unit, and the machine is pump_jack: the observer compares"
        in words
    )
    assert "of two sides, which this machine does not have" in words and "chainunit identify finds" in words
