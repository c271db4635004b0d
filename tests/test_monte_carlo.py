"""Random overloads: the same numbers whoever computes them, and nothing lost to a kill."""

from __future__ import annotations

import dataclasses
import json
import math
import os
import signal
import subprocess
import sys
import textwrap
import time

import pytest

from chainunit.config import parse
from chainunit.cosim import CoSimulation
from chainunit.drives.dc_motor import DcMotor
from chainunit.errors import RunError
from chainunit.studies import monte_carlo
from chainunit.studies.drive import Drive

STUDY = """
[run]
step = 0.004
ramp = 0.3
[monte_carlo]
runs = {runs}
duration = 0.5
force_low = 4000
force_high = 9000
[coupling]
trip_torque = 500
scatter = 0.2
[overload]
jam_duration = 0.1
"""
# alone in a process, as workers are started anew
SCRIPT = """
    import sys
    from pathlib import Path
    from chainunit.config import parse
    from chainunit.drives.dc_motor import DcMotor
    from chainunit.studies import monte_carlo
    from chainunit.studies.drive import Drive

    if __name__ == "__main__":
        config = parse(Path("study.toml").read_text())
        drive = Drive(DcMotor, config.motor, config.machine)
        files, _ = drive.export(Path("."))
        task = monte_carlo.Task(config, drive, files, 1.0)
        result = monte_carlo.run(task, Path("."), lambda what, done, todo: print(done, todo, flush=True), workers=2)
        print("resumed", result.resumed, flush=True)
"""


def start(folder, runs):
    (folder / "study.toml").write_text(STUDY.format(runs=runs))
    (folder / "script.py").write_text(textwrap.dedent(SCRIPT))
    return subprocess.Popen(
        [sys.executable, "script.py"],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


@pytest.fixture(scope="module")
def killed(tmp_path_factory):
    """A run that was killed after its first results, a torn line left behind, and then resumed."""
    folder = tmp_path_factory.mktemp("monte carlo")
    first = start(folder, 100_000)
    while not list(folder.glob("*.jsonl")) or not next(folder.glob("*.jsonl")).stat().st_size:
        assert first.poll() is None, first.stderr.read()
        time.sleep(0.05)
    os.killpg(first.pid, signal.SIGKILL)
    first.communicate()
    (file,) = folder.glob("*.jsonl")
    with file.open("a") as out:
        out.write('{"run": 99999, "crank_a')
    before = monte_carlo.read(file)
    second = start(folder, len(before) + 10)
    said, errors = second.communicate()
    assert second.returncode == 0, errors
    return file, before, said


def test_a_killed_study_goes_on_from_what_it_saved(killed):
    file, before, said = killed
    assert len(before) >= 25 and f"resumed {len(before)}" in said
    rows = [json.loads(line) for line in file.read_text().splitlines()]
    assert sorted(row["run"] for row in rows) == list(range(len(before) + 10))
    for row in rows:
        assert before.get(row["run"], row) == row


def test_a_row_is_what_its_number_says(killed):
    """Run again here, in this process, in another order."""
    file, before, _ = killed
    config = parse(STUDY.format(runs=10))
    drive = Drive(DcMotor, config.motor, config.machine)
    files = {name: file.parent / f"{model.name}.fmu" for name, (model, _) in drive.models().items()}
    task = monte_carlo.Task(config, drive, files, 1.0)
    signals = {**drive.loads(config.feed), **drive.reference(config.run.crank_speed, config.run.ramp)}
    with CoSimulation(drive.system(files), signals) as simulation:
        simulation.run(1.0, config.run.step)
        simulation.save()
        for number in (7, 3, 20):
            got = monte_carlo.Layout(monte_carlo.Sample).named(monte_carlo.one(task, number, simulation))
            assert {"run": number, "failed": None, **got} == before[number]


def test_answers_hang_together(killed):
    rows = list(killed[1].values())
    assert 0.0 < sum(row["trips"] for row in rows) < len(rows)
    for row in rows:
        assert (row["crank_torque_peak"] > row["trip_torque"]) == bool(row["trips"])
        assert 4000.0 <= row["force"] <= 9000.0
    result = monte_carlo.MonteCarloResult(rows, killed[0], 0)
    sizes = result.quantiles()["crank_torque_peak"]
    assert sizes["q5"] < sizes["q50"] < sizes["q95"] <= sizes["q99"]
    assert result.as_dict()["quantiles"]["trips"]["share"]["unit"] == "1"


def test_lumps_come_anywhere_in_a_turn(killed):
    angles = sorted(row["crank_angle"] for row in killed[1].values())
    gaps = [b - a for a, b in zip(angles, [*angles[1:], angles[0] + 2.0 * math.pi], strict=True)]
    # of n uniform angles the largest gap is about 2 pi (ln n + 3)/n at most
    n = len(angles)
    assert max(gaps) < 2.0 * math.pi * (math.log(n) + 3.0) / n


def test_what_the_numbers_depend_on_is_in_the_name(killed):
    config = parse(STUDY.format(runs=10))
    drive = Drive(DcMotor, config.motor, config.machine)
    files = {name: killed[0].parent / f"{model.name}.fmu" for name, (model, _) in drive.models().items()}
    digest = monte_carlo.Task(config, drive, files, 1.0).digest()
    assert killed[0].name == f"monte_carlo_{digest}.jsonl"
    other = dataclasses.replace(drive, feed_forward=True)
    assert monte_carlo.Task(config, other, files, 1.0).digest() != digest
    more = parse(STUDY.format(runs=20))
    assert monte_carlo.Task(more, drive, files, 1.0).digest() == digest


def test_a_run_that_fails_is_a_row(killed, monkeypatch):
    config = parse(STUDY.format(runs=10))
    drive = Drive(DcMotor, config.motor, config.machine)
    files = {name: killed[0].parent / f"{model.name}.fmu" for name, (model, _) in drive.models().items()}
    task = monte_carlo.Task(config, drive, files, 1.0)
    good = monte_carlo.one

    def fails(task, number, simulation):
        if number == 2:
            raise RunError("machine: it broke")
        return good(task, number, simulation)

    monkeypatch.setattr(monte_carlo, "one", fails)
    rows = monte_carlo.batch(task, task.digest(), [1, 2, 3])
    monte_carlo._worker.popitem()[1].close()
    assert [row["failed"] for row in rows] == [None, "machine: it broke", None]
    result = monte_carlo.MonteCarloResult(rows, killed[0], 0)
    assert result.failed == 1 and result.quantiles()["crank_torque_peak"]["q50"] > 0.0
